//! Rendering of a batch of views: culling, then rounds of drawing that fit the arena.

use std::ops::Range;

use bytemuck::Zeroable as _;
use chaic_render::{MAX_SIDE_PX, View};

use crate::batch::{Batch, Outputs};
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::gpu::Gpu;
use crate::lights::Lights;
use crate::passes::bind;
use crate::records::{RoundParams, Tally, ViewRecord, ViewVisibility};
use crate::world_id::WorldId;

/// Maximum number of views in a batch: one dimension of a dispatch.
pub const MAX_VIEWS: usize = 65_535;

/// Bytes of a triangle after setup: 16 words to fill it, 2 words for its bounds.
const SETUP_BYTES: u64 = 64;
const BOUNDS_BYTES: u64 = 8;
/// Minimum capacity of the arena if the batch needs it, triangles: 288 MiB.
const MIN_ARENA_TRIANGLES: u64 = 1 << 22;
/// Workgroups that share the triangles of a view.
const SETUP_GROUPS: u32 = 32;
/// Side of the tile of one raster workgroup, and of one shading workgroup, pixels.
const TILE_PX: u32 = 32;
const SHADE_PX: u32 = 8;

const STORAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE;

/// Triangle buffers that each round reuses.
#[derive(Debug)]
pub(crate) struct Arena {
    bounds: wgpu::Buffer,
    setups: wgpu::Buffer,
    triangles: u64,
}

impl Arena {
    pub fn new(context: &GpuContext) -> Result<Arena, GpuError> {
        Arena::with_capacity(context, 0)
    }

    fn with_capacity(context: &GpuContext, triangles: u64) -> Result<Arena, GpuError> {
        let bounds = context.buffer("triangle setups", BOUNDS_BYTES * triangles, STORAGE)?;
        let setups = context.buffer("triangle setups", SETUP_BYTES * triangles, STORAGE)?;
        Ok(Arena { bounds, setups, triangles })
    }
}

/// Views that are drawn in one round.
#[derive(Debug, PartialEq)]
struct ViewGroup {
    views: Range<usize>,
    /// Offset of each view's triangles in the arena.
    first_triangles: Vec<u32>,
}

/// Groups consecutive views into rounds that fit the capacity. `max_triangles` is the upper bound
/// for each view, which fits on its own.
fn groups(max_triangles: &[u32], capacity: u64) -> Vec<ViewGroup> {
    let mut groups: Vec<ViewGroup> = Vec::new();
    let mut end = 0;
    for (k, n) in max_triangles.iter().enumerate() {
        let n = u64::from(*n);
        match groups.last_mut() {
            Some(group) if end + n <= capacity => {
                group.views.end = k + 1;
                group.first_triangles.push(end as u32);
            }
            _ => {
                end = 0;
                groups.push(ViewGroup { views: k..k + 1, first_triangles: vec![0] });
            }
        }
        end += n;
    }
    groups
}

impl Gpu {
    /// Renders a batch of views of one size. An invalid camera (see [`View`]) gets the same
    /// background images as in the CPU renderer. Unlike in the CPU renderer, a side over
    /// [`MAX_SIDE_PX`] is an error, and so is a view with [`View::sight`].
    pub fn render(&mut self, views: &[(WorldId, View)]) -> Result<Batch, GpuError> {
        let (width, height) = self.common_size_px(views)?;
        let channels: Vec<_> = views.iter().map(|(_, view)| view.channels).collect();
        let wants_color = channels.iter().any(|c| c.rgb);
        let mut batch = Batch {
            context: self.context.clone(),
            free_outputs: self.free_outputs.clone(),
            outputs: None,
            channels,
            width,
            height,
        };
        if views.is_empty() || width == 0 || height == 0 {
            return Ok(batch);
        }
        batch.outputs = Some(self.outputs(&batch, wants_color)?);
        if let Some(outputs) = &batch.outputs {
            let culled = self.cull(views)?;
            self.draw(&culled, outputs, width, height, wants_color)?;
        }
        Ok(batch)
    }

    fn common_size_px(&self, views: &[(WorldId, View)]) -> Result<(u32, u32), GpuError> {
        let Some((_, first)) = views.first() else { return Ok((0, 0)) };
        // An unlimited image would show an agent more than it may see.
        if let Some(index) = views.iter().position(|(_, view)| view.sight.is_some()) {
            return Err(GpuError::LimitedEyesight { index });
        }
        let (first_width, first_height) = (first.camera.width, first.camera.height);
        for (index, (world, view)) in views.iter().enumerate() {
            self.placed(*world)?;
            let (width, height) = (view.camera.width, view.camera.height);
            if (width, height) != (first_width, first_height) {
                return Err(GpuError::MixedSizes {
                    index,
                    width,
                    height,
                    first_width,
                    first_height,
                });
            }
        }
        let n_pixels = (u64::from(first_width) * u64::from(first_height)).max(1);
        let fits = first_width <= MAX_SIDE_PX && first_height <= MAX_SIDE_PX;
        let max = if fits { self.context.max_buffer_bytes() / (4 * n_pixels) } else { 0 };
        let max = max.min(MAX_VIEWS as u64);
        if views.len() as u64 > max {
            return Err(GpuError::TooLargeBatch {
                views: views.len(),
                width: first_width,
                height: first_height,
                max,
            });
        }
        Ok((first_width, first_height))
    }

    /// Output buffers of a batch: those of an earlier batch if the sizes match.
    fn outputs(&self, batch: &Batch, wants_color: bool) -> Result<Outputs, GpuError> {
        let (n, height) = (batch.n_views() as u64, u64::from(batch.height));
        let n_pixels = 4 * n * height * u64::from(batch.width);
        let color = if wants_color { n_pixels } else { 0 };
        let ids = 4 * n * height * u64::from(batch.id_words());
        let size = |bytes: u64| bytes.max(16).next_multiple_of(16);
        let fits = |o: &Outputs| {
            let sizes = [o.depth.size(), o.ids.size(), o.color.size()];
            sizes == [n_pixels, ids, color].map(size)
        };
        let mut free_outputs =
            self.free_outputs.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(k) = free_outputs.iter().position(fits) {
            return Ok(free_outputs.swap_remove(k));
        }
        // Buffers of another size may never be needed again.
        free_outputs.clear();
        drop(free_outputs);
        let usage = STORAGE.union(wgpu::BufferUsages::COPY_SRC);
        Ok(Outputs {
            depth: self.context.buffer("depth", n_pixels, usage)?,
            ids: self.context.buffer("ids", ids, usage)?,
            color: self.context.buffer("color", color, usage)?,
        })
    }

    /// Culls the instances of each view.
    fn cull(&mut self, views: &[(WorldId, View)]) -> Result<CullResult, GpuError> {
        let visibility =
            |(world, view): &(WorldId, View)| Ok(ViewVisibility::new(view, self.placed(*world)?));
        let visibilities = views.iter().map(visibility).collect::<Result<Vec<_>, GpuError>>()?;
        self.build_bodies(views, &visibilities)?;
        let context = &self.context;
        let mut records = Vec::with_capacity(views.len());
        let mut n_listed = 0;
        for ((world, view), visibility) in views.iter().zip(&visibilities) {
            let world = self.placed(*world)?;
            records.push(ViewRecord::new(view, visibility.as_ref(), world, n_listed as u32));
            n_listed += world.instances.len() as u64;
        }
        if 4 * n_listed > context.max_buffer_bytes() {
            return Err(GpuError::OutOfMemory { purpose: "instance lists", bytes: 4 * n_listed });
        }
        let bytes = (views.len() * size_of::<Tally>()) as u64;
        let culled = CullResult {
            views: context.buffer_with("views", bytemuck::cast_slice(&records))?,
            visible: context.buffer("instance lists", 4 * n_listed, STORAGE)?,
            levels: context.buffer("instance lists", 4 * n_listed, STORAGE)?,
            tallies: context.buffer("tallies", bytes, STORAGE | wgpu::BufferUsages::COPY_SRC)?,
            max_triangles: Vec::new(),
        };
        let pass = &self.passes.cull;
        let buffers = [
            &culled.views,
            &self.instances.buffer,
            &self.meshes.records.buffer,
            &culled.visible,
            &culled.levels,
            &culled.tallies,
        ];
        let bind_group = bind(context, pass, &buffers);
        let mut encoder = context.encoder();
        dispatch(&mut encoder, pass, &bind_group, [views.len() as u32, 1, 1]);
        context.queue.submit([encoder.finish()]);
        let bytes_read = context.read(&[(&culled.tallies, bytes)])?.pop().unwrap_or_default();
        let tallies = bytes_read.chunks_exact(size_of::<Tally>());
        let max_triangles =
            tallies.map(|bytes| bytemuck::pod_read_unaligned::<Tally>(bytes).max_triangles);
        Ok(CullResult { max_triangles: max_triangles.collect(), ..culled })
    }

    /// Draws all views, in as many rounds as needed, in one submission.
    fn draw(
        &mut self,
        culled: &CullResult,
        outputs: &Outputs,
        width: u32,
        height: u32,
        wants_color: bool,
    ) -> Result<(), GpuError> {
        self.fit_arena(&culled.max_triangles)?;
        let (context, passes) = (&self.context, &self.passes);
        let (records, instances) = (&self.meshes.records.buffer, &self.instances.buffer);
        let (vertices, triangles) = (&self.meshes.vertices.buffer, &self.meshes.triangles.buffer);
        let Arena { bounds, setups, .. } = &self.arena;
        let CullResult { views, visible, levels, tallies, .. } = culled;
        let groups = groups(&culled.max_triangles, self.arena.triangles);
        let first_triangles: Vec<u32> =
            groups.iter().flat_map(|g| g.first_triangles.iter().copied()).collect();
        let first_triangles =
            &context.buffer_with("first triangles", bytemuck::cast_slice(&first_triangles))?;
        let mut encoder = context.encoder();
        for group in groups {
            let round = RoundParams {
                width,
                height,
                first_view: group.views.start as u32,
                id_words: width.div_ceil(2),
                wants_color: u32::from(wants_color),
                ..RoundParams::zeroed()
            };
            let round = &context.buffer_with("round", bytemuck::bytes_of(&round))?;
            let n = group.views.len() as u32;
            let bind_group = bind(
                context,
                &passes.setup,
                &[
                    views,
                    instances,
                    records,
                    visible,
                    levels,
                    tallies,
                    vertices,
                    triangles,
                    first_triangles,
                    bounds,
                    setups,
                    round,
                ],
            );
            dispatch(&mut encoder, &passes.setup, &bind_group, [SETUP_GROUPS, n, 1]);
            let Outputs { depth, ids, color } = outputs;
            let bind_group = bind(
                context,
                &passes.tiles,
                &[
                    views,
                    instances,
                    tallies,
                    first_triangles,
                    bounds,
                    setups,
                    depth,
                    ids,
                    color,
                    round,
                ],
            );
            let tiles = [width.div_ceil(TILE_PX), height.div_ceil(TILE_PX), n];
            dispatch(&mut encoder, &passes.tiles, &bind_group, tiles);
            if wants_color {
                let materials = &self.meshes.materials.buffer;
                let Lights { records: lights, lamps, cells } = &self.lights;
                let bind_group = bind(
                    context,
                    &passes.shade,
                    &[
                        views,
                        instances,
                        records,
                        levels,
                        vertices,
                        triangles,
                        materials,
                        &lights.buffer,
                        &lamps.buffer,
                        &cells.buffer,
                        &self.atlas,
                        depth,
                        color,
                        round,
                    ],
                );
                let shade_groups = [width.div_ceil(SHADE_PX), height.div_ceil(SHADE_PX), n];
                dispatch(&mut encoder, &passes.shade, &bind_group, shade_groups);
            }
        }
        context.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Grows the arena so that each view fits, and several views if possible.
    fn fit_arena(&mut self, max_triangles: &[u32]) -> Result<(), GpuError> {
        let capacity = self.context.max_buffer_bytes() / SETUP_BYTES;
        let (index, largest) =
            max_triangles.iter().copied().enumerate().max_by_key(|(_, n)| *n).unwrap_or_default();
        if u64::from(largest) > capacity {
            return Err(GpuError::TooManyTriangles { index, n: largest, max: capacity as u32 });
        }
        let total: u64 = max_triangles.iter().map(|n| u64::from(*n)).sum();
        let needed = total.min(MIN_ARENA_TRIANGLES.max(u64::from(largest))).min(capacity);
        if needed > self.arena.triangles {
            self.arena = Arena::with_capacity(&self.context, needed)?;
        }
        Ok(())
    }
}

/// Results of culling on the device, and the upper bound on each view's triangles.
struct CullResult {
    views: wgpu::Buffer,
    visible: wgpu::Buffer,
    levels: wgpu::Buffer,
    tallies: wgpu::Buffer,
    max_triangles: Vec<u32>,
}

fn dispatch(
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::ComputePipeline,
    bind_group: &wgpu::BindGroup,
    [x, y, z]: [u32; 3],
) {
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, bind_group, &[]);
    pass.dispatch_workgroups(x, y, z);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_hold_all_views_in_order_and_never_more_than_fits() {
        let group = |views: Range<usize>, first_triangles: &[u32]| ViewGroup {
            views,
            first_triangles: first_triangles.to_vec(),
        };
        assert_eq!(groups(&[], 10), []);
        assert_eq!(groups(&[0, 0, 0], 0), [group(0..3, &[0, 0, 0])]);
        assert_eq!(
            groups(&[3, 4, 4, 10, 0, 1], 10),
            [group(0..2, &[0, 3]), group(2..3, &[0]), group(3..5, &[0, 10]), group(5..6, &[0])]
        );
    }
}
