//! One batch of views: culled, then drawn in rounds that fit the arena.

use std::ops::Range;

use bytemuck::Zeroable as _;
use chaic_render::{MAX_SIDE_PX, View};

use crate::batch::{Batch, Outputs};
use crate::device::Link;
use crate::error::GpuError;
use crate::gpu::{Gpu, WorldId};
use crate::lights::Lights;
use crate::passes::bind;
use crate::records::{Round, Sight, Tally, ViewRecord};

/// Most views of a batch: one dimension of a dispatch.
pub const MAX_VIEWS: usize = 65_535;

/// Bytes of a triangle on the image: 16 words to fill it, 2 that say which tiles it touches.
const FILLED_BYTES: u64 = 64;
const BOUNDS_BYTES: u64 = 8;
/// Triangles that the arena has room for unless one view needs more: 288 MiB.
const USUAL_TRIANGLES: u64 = 1 << 22;
/// Workgroups that share the triangles of a view.
const SETUP_GROUPS: u32 = 32;
/// Pixels along the side of what one workgroup draws, and of what one shades.
const TILE_PX: u32 = 32;
const SHADE_PX: u32 = 8;

const STORAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE;

/// Room for triangles on the image, used anew by each round.
#[derive(Debug)]
pub(crate) struct Arena {
    bounds: wgpu::Buffer,
    filled: wgpu::Buffer,
    triangles: u64,
}

impl Arena {
    pub fn new(link: &Link) -> Result<Arena, GpuError> {
        Arena::of(link, 0)
    }

    fn of(link: &Link, triangles: u64) -> Result<Arena, GpuError> {
        let bounds = link.buffer("triangles on the image", BOUNDS_BYTES * triangles, STORAGE)?;
        let filled = link.buffer("triangles on the image", FILLED_BYTES * triangles, STORAGE)?;
        Ok(Arena { bounds, filled, triangles })
    }
}

/// Views that are drawn together.
#[derive(Debug, PartialEq)]
struct Group {
    views: Range<usize>,
    /// Where each view's triangles begin in the arena.
    firsts: Vec<u32>,
}

/// Lays views with at most so many triangles each into as few groups as fit, in order; all of them
/// fit one by one.
fn groups(most: &[u32], capacity: u64) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut end = 0;
    for (k, n) in most.iter().enumerate() {
        let n = u64::from(*n);
        match groups.last_mut() {
            Some(group) if end + n <= capacity => {
                group.views.end = k + 1;
                group.firsts.push(end as u32);
            }
            _ => {
                end = 0;
                groups.push(Group { views: k..k + 1, firsts: vec![0] });
            }
        }
        end += n;
    }
    groups
}

impl Gpu {
    /// Draws what views of worlds see, all of one size, in one batch; a view without a picture (see
    /// [`View`]) gets the blank images of the CPU renderer. Other than there, a side over
    /// [`MAX_SIDE_PX`] is an error, and all is seen as by a camera: [`View::sight`] is left out.
    pub fn render(&mut self, views: &[(WorldId, View)]) -> Result<Batch, GpuError> {
        let (width, height) = self.size_of(views)?;
        let channels: Vec<_> = views.iter().map(|(_, view)| view.channels).collect();
        let wants_color = channels.iter().any(|c| c.rgb);
        let mut batch = Batch {
            link: self.link.clone(),
            spare: self.spare.clone(),
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
            let lists = self.cull(views)?;
            self.draw(&lists, outputs, (width, height), wants_color)?;
        }
        Ok(batch)
    }

    fn size_of(&self, views: &[(WorldId, View)]) -> Result<(u32, u32), GpuError> {
        let Some((_, first)) = views.first() else { return Ok((0, 0)) };
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
        let pixels = (u64::from(first_width) * u64::from(first_height)).max(1);
        let fits = first_width <= MAX_SIDE_PX && first_height <= MAX_SIDE_PX;
        let most = if fits { self.link.most_bytes() / (4 * pixels) } else { 0 };
        let most = most.min(MAX_VIEWS as u64);
        if views.len() as u64 > most {
            return Err(GpuError::TooLargeBatch {
                views: views.len(),
                width: first_width,
                height: first_height,
                most,
            });
        }
        Ok((first_width, first_height))
    }

    /// Buffers for the images of a batch: those of an earlier batch if they fit.
    fn outputs(&self, batch: &Batch, wants_color: bool) -> Result<Outputs, GpuError> {
        let (n, height) = (batch.n_views() as u64, u64::from(batch.height));
        let pixels = 4 * n * height * u64::from(batch.width);
        let color = if wants_color { pixels } else { 0 };
        let ids = 4 * n * height * u64::from(batch.id_words());
        let size = |bytes: u64| bytes.max(16).next_multiple_of(16);
        let fits = |o: &Outputs| {
            let sizes = [o.depth.size(), o.ids.size(), o.color.size()];
            sizes == [pixels, ids, color].map(size)
        };
        let mut spare = self.spare.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(k) = spare.iter().position(fits) {
            return Ok(spare.swap_remove(k));
        }
        // What doesn't fit now may never again.
        spare.clear();
        drop(spare);
        let usage = STORAGE.union(wgpu::BufferUsages::COPY_SRC);
        Ok(Outputs {
            depth: self.link.buffer("depth", pixels, usage)?,
            ids: self.link.buffer("ids", ids, usage)?,
            color: self.link.buffer("color", color, usage)?,
        })
    }

    /// Finds out what each view may see.
    fn cull(&mut self, views: &[(WorldId, View)]) -> Result<Lists, GpuError> {
        let sight = |(world, view): &(WorldId, View)| Ok(Sight::of(view, self.placed(*world)?));
        let sights = views.iter().map(sight).collect::<Result<Vec<_>, GpuError>>()?;
        self.shape_bodies(views, &sights)?;
        let link = &self.link;
        let mut records = Vec::with_capacity(views.len());
        let mut n_listed = 0;
        for ((world, view), sight) in views.iter().zip(&sights) {
            let world = self.placed(*world)?;
            records.push(ViewRecord::of(view, sight.as_ref(), world, n_listed as u32));
            n_listed += world.instances.len() as u64;
        }
        if 4 * n_listed > link.most_bytes() {
            return Err(GpuError::OutOfMemory { what: "lists of instances", bytes: 4 * n_listed });
        }
        let bytes = (views.len() * size_of::<Tally>()) as u64;
        let lists = Lists {
            views: link.filled("views", bytemuck::cast_slice(&records))?,
            visible: link.buffer("lists of instances", 4 * n_listed, STORAGE)?,
            levels: link.buffer("lists of instances", 4 * n_listed, STORAGE)?,
            tallies: link.buffer("tallies", bytes, STORAGE | wgpu::BufferUsages::COPY_SRC)?,
            most: Vec::new(),
        };
        let pass = &self.passes.cull;
        let buffers = [
            &lists.views,
            &self.instances.buffer,
            &self.meshes.records.buffer,
            &lists.visible,
            &lists.levels,
            &lists.tallies,
        ];
        let bound = bind(link, pass, &buffers);
        let mut encoder = link.encoder();
        dispatch(&mut encoder, pass, &bound, [views.len() as u32, 1, 1]);
        link.queue.submit([encoder.finish()]);
        let told = link.read(&[(&lists.tallies, bytes)])?.pop().unwrap_or_default();
        let tallies = told.chunks_exact(size_of::<Tally>());
        let most = tallies.map(|bytes| bytemuck::pod_read_unaligned::<Tally>(bytes).most_triangles);
        Ok(Lists { most: most.collect(), ..lists })
    }

    /// Draws all views, in as many rounds as needed, in one submission.
    fn draw(
        &mut self,
        lists: &Lists,
        outputs: &Outputs,
        (width, height): (u32, u32),
        wants_color: bool,
    ) -> Result<(), GpuError> {
        self.fit_arena(&lists.most)?;
        let (link, passes) = (&self.link, &self.passes);
        let (records, instances) = (&self.meshes.records.buffer, &self.instances.buffer);
        let (vertices, triangles) = (&self.meshes.vertices.buffer, &self.meshes.triangles.buffer);
        let Arena { bounds, filled, .. } = &self.arena;
        let Lists { views, visible, levels, tallies, .. } = lists;
        let groups = groups(&lists.most, self.arena.triangles);
        let firsts: Vec<u32> = groups.iter().flat_map(|g| g.firsts.iter().copied()).collect();
        let firsts = &link.filled("firsts", bytemuck::cast_slice(&firsts))?;
        let mut encoder = link.encoder();
        for group in groups {
            let round = Round {
                width,
                height,
                first_view: group.views.start as u32,
                id_words: width.div_ceil(2),
                wants_color: u32::from(wants_color),
                ..Round::zeroed()
            };
            let round = &link.filled("round", bytemuck::bytes_of(&round))?;
            let n = group.views.len() as u32;
            let bound = bind(
                link,
                &passes.setup,
                &[
                    views, instances, records, visible, levels, tallies, vertices, triangles,
                    firsts, bounds, filled, round,
                ],
            );
            dispatch(&mut encoder, &passes.setup, &bound, [SETUP_GROUPS, n, 1]);
            let Outputs { depth, ids, color } = outputs;
            let bound = bind(
                link,
                &passes.tiles,
                &[views, instances, tallies, firsts, bounds, filled, depth, ids, color, round],
            );
            let tiles = [width.div_ceil(TILE_PX), height.div_ceil(TILE_PX), n];
            dispatch(&mut encoder, &passes.tiles, &bound, tiles);
            if wants_color {
                let skins = &self.meshes.skins.buffer;
                let Lights { records: lights, lamps, cells } = &self.lights;
                let bound = bind(
                    link,
                    &passes.shade,
                    &[
                        views,
                        instances,
                        records,
                        levels,
                        vertices,
                        triangles,
                        skins,
                        &lights.buffer,
                        &lamps.buffer,
                        &cells.buffer,
                        &self.atlas,
                        depth,
                        color,
                        round,
                    ],
                );
                let squares = [width.div_ceil(SHADE_PX), height.div_ceil(SHADE_PX), n];
                dispatch(&mut encoder, &passes.shade, &bound, squares);
            }
        }
        link.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Makes sure that each view fits the arena, and many do.
    fn fit_arena(&mut self, most: &[u32]) -> Result<(), GpuError> {
        let capacity = self.link.most_bytes() / FILLED_BYTES;
        let (index, greatest) =
            most.iter().copied().enumerate().max_by_key(|(_, n)| *n).unwrap_or_default();
        if u64::from(greatest) > capacity {
            return Err(GpuError::TooManyTriangles { index, n: greatest, most: capacity as u32 });
        }
        let all: u64 = most.iter().map(|n| u64::from(*n)).sum();
        let wanted = all.min(USUAL_TRIANGLES.max(u64::from(greatest))).min(capacity);
        if wanted > self.arena.triangles {
            self.arena = Arena::of(&self.link, wanted)?;
        }
        Ok(())
    }
}

/// What culling found, on the device, and the bound on each view's triangles.
struct Lists {
    views: wgpu::Buffer,
    visible: wgpu::Buffer,
    levels: wgpu::Buffer,
    tallies: wgpu::Buffer,
    most: Vec<u32>,
}

fn dispatch(
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::ComputePipeline,
    bound: &wgpu::BindGroup,
    [x, y, z]: [u32; 3],
) {
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, bound, &[]);
    pass.dispatch_workgroups(x, y, z);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_hold_all_views_in_order_and_never_more_than_fits() {
        let group = |views: Range<usize>, firsts: &[u32]| Group { views, firsts: firsts.to_vec() };
        assert_eq!(groups(&[], 10), []);
        assert_eq!(groups(&[0, 0, 0], 0), [group(0..3, &[0, 0, 0])]);
        assert_eq!(
            groups(&[3, 4, 4, 10, 0, 1], 10),
            [group(0..2, &[0, 3]), group(2..3, &[0]), group(3..5, &[0, 10]), group(5..6, &[0])]
        );
    }
}
