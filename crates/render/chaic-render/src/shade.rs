//! Deferred shading: color, depth and ids of the visibility buffer, one row of the image at a time.
//!
//! Neighboring pixels of one triangle form a run, which is split into segments of limited length.
//! Along a segment, colors and texture coordinates follow the planes of the triangle
//! ([`crate::shader`]). The light on structure is not planar: it is computed at samples and
//! interpolated linearly between them. Each row takes four steps: find the segments, light all
//! samples, compute all texture coordinates, fill the segments.
//!
//! Lanes are plain arrays and loops that the compiler vectorizes to the width of the machine (see
//! [`ShadeRows`]). The operations of each lane stay the same. Closures and `array::from_fn` must
//! stay out of such loops: they are compiled separately, for the baseline target.

use chaic_core::EntityId;
use glam::Vec4;

use crate::light::Shadows;
use crate::planes::Plane;
use crate::points::SurfacePoints;
use crate::projection::Projection;
use crate::raster::{BACKGROUND, Blocks, LANES, RenderTarget, VisibilityId, unpack_visibility_id};
use crate::row::{GroundShadow, Row, SegmentColor, SegmentStyle};
use crate::scene_frame::SceneFrame;
use crate::segments::{STEP, Segment, Segments};
use crate::shader::{ColorSource, InstanceShading, LinearColor, Shader, TriangleShading};
use crate::texture::{Atlas, Texture, Tile, atlas};

/// Buffers of shading, reused for every view.
#[derive(Default)]
pub(crate) struct ShadingBuffers {
    /// Index into `shadings` of each triangle, by [`crate::draw::DrawBuffers::first_triangles`];
    /// [`EMPTY`] if not shaded yet.
    slots: Vec<u32>,
    shadings: Vec<TriangleShading>,
    instance_shadings: Vec<Option<InstanceShading>>,
    /// Number of elements of `shadings` that are lit.
    n_lit: usize,
    /// Columns of the row where runs begin.
    run_starts: Vec<u32>,
    /// Visibility ids of the row, after one element that differs from the first id.
    visibility_ids: Vec<u32>,
    segments: Segments,
    /// Samples to light on the row: vertices of new triangles and samples of structure.
    points: SurfacePoints,
    /// Sky color every [`STEP`] pixels of the row; empty if no sky is visible.
    sky: Vec<Vec4>,
    row: Row,
}

const EMPTY: u32 = u32::MAX;

/// Output images of a view; shape [height, width], colors [height, width, 3].
pub(crate) struct OutputImages<'a> {
    pub rgb: &'a mut [u8],
    pub depth_m: Option<&'a mut [f32]>,
    pub ids: Option<&'a mut [u16]>,
}

/// Drawn instances: level of detail and offset of the first triangle of each.
pub(crate) struct DrawnInstances<'a> {
    pub arch: pulp::Arch,
    pub levels: &'a [u8],
    pub first_triangles: &'a [u32],
    pub n_triangles: usize,
}

/// Shades a view.
pub(crate) fn shade(
    frame: &SceneFrame,
    projection: &Projection,
    drawn: &DrawnInstances,
    target: &RenderTarget<u32>,
    buffers: &mut ShadingBuffers,
    output: OutputImages,
) {
    buffers.slots.clear();
    buffers.slots.resize(drawn.n_triangles, EMPTY);
    buffers.shadings.clear();
    buffers.n_lit = 0;
    buffers.instance_shadings.clear();
    buffers.instance_shadings.resize(frame.instances.len(), None);
    buffers.row.resize(projection.width);
    let shader = Shader::new(frame, projection);
    let atlas = atlas();
    drawn.arch.dispatch(ShadeRows { shader, projection, drawn, target, buffers, output, atlas });
}

/// Shades all rows of an image. Compiled for each vector width and dispatched to the widest one of
/// the machine.
struct ShadeRows<'a> {
    shader: Shader<'a>,
    projection: &'a Projection,
    drawn: &'a DrawnInstances<'a>,
    target: &'a RenderTarget<u32>,
    buffers: &'a mut ShadingBuffers,
    output: OutputImages<'a>,
    atlas: &'static Atlas,
}

impl pulp::NullaryFnOnce for ShadeRows<'_> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let width = self.projection.width;
        if width == 0 {
            return;
        }
        for j in 0..self.projection.height {
            let line = j * width..(j + 1) * width;
            self.buffers.row.find_depths(self.target.inverse_depth(j), self.projection.is_plan);
            self.find_segments(j);
            self.light();
            self.buffers.segments.compute_placements(j as f32 + 0.5, 1.0 / self.projection.focal);
            self.fill(j);
            let OutputImages { rgb, depth_m, ids } = &mut self.output;
            self.buffers.row.write(
                &mut rgb[3 * line.start..3 * line.end],
                depth_m.as_deref_mut().map(|d| &mut d[line.clone()]),
                ids.as_deref_mut().map(|i| &mut i[line.clone()]),
            );
        }
    }
}

/// Finds the columns where runs begin. `visibility_ids` receives the ids of the row, after one
/// element that differs from the first id.
#[inline(always)]
fn find_run_starts(
    row: Blocks<<u32 as VisibilityId>::Block>,
    width: usize,
    visibility_ids: &mut Vec<u32>,
    run_starts: &mut Vec<u32>,
) {
    visibility_ids.resize(width.div_ceil(LANES) * LANES + 1, 0);
    let Some((before, after)) = visibility_ids.split_first_mut() else { return };
    for (out, block) in after.as_chunks_mut::<LANES>().0.iter_mut().zip(row.iter()) {
        *out = u32::unpack(block);
    }
    *before = !after.first().copied().unwrap_or_default();
    run_starts.clear();
    let pairs = visibility_ids
        .as_chunks::<LANES>()
        .0
        .iter()
        .zip(visibility_ids[1..].as_chunks::<LANES>().0);
    for (b, (before, block)) in pairs.enumerate() {
        let mut begin = 0u32;
        for k in 0..LANES {
            begin |= u32::from(block[k] != before[k]) << k;
        }
        while begin != 0 {
            run_starts.push((LANES * b) as u32 + begin.trailing_zeros());
            begin &= begin - 1;
        }
    }
    while run_starts.last().is_some_and(|last| *last as usize >= width) {
        run_starts.pop();
    }
}

impl ShadeRows<'_> {
    /// Finds the segments of row `j` and collects the samples to light.
    #[inline(always)]
    fn find_segments(&mut self, j: usize) {
        let width = self.projection.width;
        self.buffers.points.clear();
        self.buffers.segments.clear();
        self.buffers.sky.clear();
        let mut run_starts = std::mem::take(&mut self.buffers.run_starts);
        find_run_starts(
            self.target.visibility_ids(j),
            width,
            &mut self.buffers.visibility_ids,
            &mut run_starts,
        );
        for (k, begin) in run_starts.iter().enumerate() {
            let begin = *begin as usize;
            let end = run_starts.get(k + 1).map_or(width, |end| *end as usize);
            let visibility_id = self.buffers.visibility_ids[begin + 1];
            if visibility_id == BACKGROUND {
                self.add_sky_run(j, begin, end);
            } else {
                let shading = self.find_shading(visibility_id);
                self.add_surface_run(j, begin, end, shading);
            }
        }
        self.buffers.run_starts = run_starts;
    }

    /// Adds the segments of a run of sky, each between two sky samples.
    #[inline(never)]
    fn add_sky_run(&mut self, j: usize, begin: usize, end: usize) {
        let ShadingBuffers { segments, sky, .. } = &mut *self.buffers;
        if sky.is_empty() {
            let samples =
                (0..=self.projection.width.div_ceil(STEP)).map(|k| (STEP * k) as f32 + 0.5);
            sky.extend(samples.map(|u| self.shader.sky(u, j as f32 + 0.5)));
        }
        let mut from = begin;
        while from < end {
            let to = end.min((from / STEP + 1) * STEP);
            let segment = Segment {
                begin: from as u32,
                end: to as u32,
                shading: EMPTY,
                samples: [0; 2],
                sample_spacing: 1,
            };
            segments.push(segment, Tile::new(Texture::Plain), &Plane::default(), 1.0);
            from = to;
        }
    }

    /// Adds the segments of a run of one surface.
    #[inline(always)]
    fn add_surface_run(&mut self, j: usize, begin: usize, end: usize, shading_index: usize) {
        let ShadingBuffers { shadings, points, segments, row, .. } = &mut *self.buffers;
        let shading = &shadings[shading_index];
        let depth_at = |k: usize| {
            if !self.projection.is_plan {
                return row.depth_at(k);
            }
            let inverse_depth =
                self.target.inverse_depth(j).get(k / LANES).map(|block| block[k % LANES]);
            self.projection.depth(inverse_depth.unwrap_or_default())
        };
        let mut samples = [0; 2];
        let mut sample_spacing = 1;
        let is_long = end - begin > LANES;
        if let ColorSource::Structure(surface) = &shading.source {
            // Light hardly changes within a short run.
            let k = if is_long { begin } else { (begin + end) / 2 };
            samples = [self.shader.add_shading_sample(points, surface, k, j, depth_at(k)); 2];
        }
        let mut from = begin;
        while from < end {
            let to = end.min(from + STEP);
            if let (ColorSource::Structure(surface), true) = (&shading.source, is_long) {
                let k = to.min(end - 1);
                let next = self.shader.add_shading_sample(points, surface, k, j, depth_at(k));
                (samples, sample_spacing) = ([samples[1], next], (k - from).max(1));
            }
            let segment = Segment {
                begin: from as u32,
                end: to as u32,
                shading: shading_index as u32,
                samples,
                sample_spacing: sample_spacing as u32,
            };
            segments.push(segment, shading.tile, &shading.texture, row.depth_at(from));
            from = to;
        }
    }

    /// Lights the samples of the row and finishes the color of new triangles.
    #[inline(always)]
    fn light(&mut self) {
        let ShadingBuffers { shadings, points, n_lit, .. } = &mut *self.buffers;
        points.light(self.shader.frame.light.light_rig);
        for shading in &mut shadings[*n_lit..] {
            if let ColorSource::Unlit(unlit) = &shading.source {
                shading.source = ColorSource::Linear(unlit.resolve(points));
            }
        }
        *n_lit = shadings.len();
    }

    /// Fills the segments of row `j`.
    #[inline(always)]
    fn fill(&mut self, j: usize) {
        let v = j as f32 + 0.5;
        let ShadingBuffers { shadings, points, segments, sky, row, .. } = &mut *self.buffers;
        let quads = self.shader.frame.light.shadows.as_ref().and_then(Shadows::quads);
        for k in 0..segments.len() {
            let (segment, placement) = segments.get(k);
            let (begin, end) = (segment.begin as usize, segment.end as usize);
            let mut ground = None;
            let (id, color) = match shadings.get(segment.shading as usize) {
                None => {
                    let (left, right) = (sky[begin / STEP], sky[begin / STEP + 1]);
                    let step = (right - left) * (1.0 / STEP as f32);
                    let start = left + step * (begin % STEP) as f32;
                    (EntityId::NOTHING.0, SegmentColor::Ramp { start, step })
                }
                Some(shading) => {
                    let color = match &shading.source {
                        ColorSource::Linear(LinearColor { display, low, high }) => {
                            let plane = display.at_row(begin, v);
                            SegmentColor::Linear { plane, low: *low, high: *high }
                        }
                        ColorSource::Structure(surface) => {
                            if let (true, Some(quads)) = (surface.is_floor, quads) {
                                let plane = self.shader.ground.at_row(begin, v);
                                ground = Some(GroundShadow::from_plane(quads, &plane));
                            }
                            let [start, right] =
                                segment.samples.map(|k| points.display(k as usize));
                            let step = (right - start) * (1.0 / segment.sample_spacing as f32);
                            SegmentColor::Ramp { start, step }
                        }
                        // Every triangle is lit at this point.
                        ColorSource::Unlit(_) => {
                            SegmentColor::Ramp { start: Vec4::ZERO, step: Vec4::ZERO }
                        }
                    };
                    (shading.entity, color)
                }
            };
            row.fill(begin, end, &SegmentStyle { id, color, placement }, self.atlas, ground);
        }
    }

    /// Returns the index of a triangle's shading, which is set up on first use.
    #[inline(always)]
    fn find_shading(&mut self, visibility_id: u32) -> usize {
        let (index, triangle) = unpack_visibility_id(visibility_id);
        let slot = self.drawn.first_triangles[index] as usize + triangle;
        let existing = self.buffers.slots[slot];
        if existing != EMPTY {
            return existing as usize;
        }
        let shading = self.new_shading(index, triangle);
        self.buffers.slots[slot] = self.buffers.shadings.len() as u32;
        self.buffers.shadings.push(shading);
        self.buffers.shadings.len() - 1
    }

    #[inline(never)]
    fn new_shading(&mut self, index: usize, triangle: usize) -> TriangleShading {
        let instance = &self.shader.frame.instances[index];
        let mesh = instance.shape.mesh(usize::from(self.drawn.levels[index]));
        let ShadingBuffers { instance_shadings, points, .. } = &mut *self.buffers;
        let shared =
            instance_shadings[index].get_or_insert_with(|| self.shader.instance_shading(instance));
        self.shader.shade_triangle(instance, shared, mesh, &mesh.triangles[triangle], points)
    }
}
