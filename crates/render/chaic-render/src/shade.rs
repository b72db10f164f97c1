//! Color, depth and ids of pixels whose triangles are known, one row of the image at a time.
//!
//! Neighboring pixels of one face are a run, which is cut into segments of limited length. Along
//! them, colors and texture coordinates follow the face's planes ([`crate::paint`]); only the light
//! on structure, which no plane describes, is worked out at knots and runs linearly between. For each
//! row the segments are found first, then all that has to be lit is lit together, then all places on
//! textures are worked out together, and at last the segments are filled.
//!
//! Lanes are plain arrays and loops, which the compiler makes vectors of, as wide as the machine's
//! (see [`Rows`]); each lane's operations stay the same. Closures and `array::from_fn` must stay
//! out of such loops: they are compiled apart, for any machine.

use chaic_core::EntityId;
use glam::Vec4;

use crate::frame::Frame;
use crate::lens::Lens;
use crate::light::Shadows;
use crate::paint::{Kind, Linear, Paint, Painter, Sight};
use crate::planes::Plane;
use crate::points::Points;
use crate::raster::{BACKGROUND, Blocks, LANES, Target, Wide, unpack_visibility_id};
use crate::row::{Hue, OnGround, Row, SegmentStyle};
use crate::segments::{STEP, Segment, Segments};
use crate::texture::{Atlas, Texture, Tile, atlas};

/// Buffers for shading, used again and again.
#[derive(Default)]
pub(crate) struct Canvas {
    /// Where each triangle's paint is, by [`crate::draw::Work::firsts`]; [`EMPTY`] if not there.
    slots: Vec<u32>,
    paints: Vec<Paint>,
    sights: Vec<Option<Sight>>,
    /// So many of the paints have been lit.
    n_lit: usize,
    /// Where neighboring pixels of one triangle, a run, begin on the row.
    begins: Vec<u32>,
    /// Whose the row's pixels are, after one that is someone else's than the first.
    visibility_ids: Vec<u32>,
    segments: Segments,
    /// What is lit on the row: new triangles' points and knots of structure.
    points: Points,
    /// The sky every [`STEP`] pixels of the row, if it is seen.
    sky: Vec<Vec4>,
    row: Row,
}

const EMPTY: u32 = u32::MAX;

/// The images of a view that are wanted; shape [height, width], colors [height, width, 3].
pub(crate) struct Wanted<'a> {
    pub rgb: &'a mut [u8],
    pub depth_m: Option<&'a mut [f32]>,
    pub ids: Option<&'a mut [u16]>,
}

/// What is drawn: instances with the level and the number of the first triangle of each.
pub(crate) struct Drawn<'a> {
    pub arch: pulp::Arch,
    pub levels: &'a [u8],
    pub firsts: &'a [u32],
    pub n_triangles: usize,
}

impl<'a> Drawn<'a> {
    /// What has just been drawn.
    pub fn of(work: &'a crate::draw::Work) -> Drawn<'a> {
        Drawn {
            arch: work.arch,
            levels: &work.levels,
            firsts: &work.firsts,
            n_triangles: work.n_triangles,
        }
    }
}

/// Shades a view.
pub(crate) fn shade(
    frame: &Frame,
    lens: &Lens,
    drawn: &Drawn,
    target: &Target<u32>,
    canvas: &mut Canvas,
    wanted: Wanted,
) {
    canvas.slots.clear();
    canvas.slots.resize(drawn.n_triangles, EMPTY);
    canvas.paints.clear();
    canvas.n_lit = 0;
    canvas.sights.clear();
    canvas.sights.resize(frame.instances.len(), None);
    canvas.row.resize(lens.width);
    let painter = Painter::new(frame, lens);
    let atlas = atlas();
    drawn.arch.dispatch(Rows { painter, lens, drawn, target, canvas, wanted, atlas });
}

/// All rows of an image, compiled for each kind of vectors and called for the widest that the
/// machine has.
struct Rows<'a> {
    painter: Painter<'a>,
    lens: &'a Lens,
    drawn: &'a Drawn<'a>,
    target: &'a Target<u32>,
    canvas: &'a mut Canvas,
    wanted: Wanted<'a>,
    atlas: &'static Atlas,
}

impl pulp::NullaryFnOnce for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let width = self.lens.width;
        if width == 0 {
            return;
        }
        for j in 0..self.lens.height {
            let line = j * width..(j + 1) * width;
            self.canvas.row.find_depths(self.target.inverse_depth(j), self.lens.is_plan);
            self.find_segments(j);
            self.light();
            self.canvas.segments.place(j as f32 + 0.5, 1.0 / self.lens.focal);
            self.fill(j);
            let Wanted { rgb, depth_m, ids } = &mut self.wanted;
            self.canvas.row.write(
                &mut rgb[3 * line.start..3 * line.end],
                depth_m.as_deref_mut().map(|d| &mut d[line.clone()]),
                ids.as_deref_mut().map(|i| &mut i[line.clone()]),
            );
        }
    }
}

/// Finds the columns in which runs begin; `visibility_ids` gets the row's, after one that isn't.
#[inline(always)]
fn find_begins(
    row: Blocks<Wide<u32>>,
    width: usize,
    visibility_ids: &mut Vec<u32>,
    begins: &mut Vec<u32>,
) {
    visibility_ids.resize(width.div_ceil(LANES) * LANES + 1, 0);
    let Some((before, after)) = visibility_ids.split_first_mut() else { return };
    for (out, block) in after.as_chunks_mut::<LANES>().0.iter_mut().zip(row.iter()) {
        *out = **block;
    }
    *before = !after.first().copied().unwrap_or_default();
    begins.clear();
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
            begins.push((LANES * b) as u32 + begin.trailing_zeros());
            begin &= begin - 1;
        }
    }
    while begins.last().is_some_and(|last| *last as usize >= width) {
        begins.pop();
    }
}

impl Rows<'_> {
    /// Finds the segments of row `j`, and what has to be lit.
    #[inline(always)]
    fn find_segments(&mut self, j: usize) {
        let width = self.lens.width;
        self.canvas.points.clear();
        self.canvas.segments.clear();
        self.canvas.sky.clear();
        let mut begins = std::mem::take(&mut self.canvas.begins);
        find_begins(
            self.target.visibility_ids(j),
            width,
            &mut self.canvas.visibility_ids,
            &mut begins,
        );
        for (k, begin) in begins.iter().enumerate() {
            let begin = *begin as usize;
            let end = begins.get(k + 1).map_or(width, |end| *end as usize);
            let visibility_id = self.canvas.visibility_ids[begin + 1];
            if visibility_id == BACKGROUND {
                self.see_sky(j, begin, end);
            } else {
                let paint = self.find_paint(visibility_id);
                self.see_surface(j, begin, end, paint);
            }
        }
        self.canvas.begins = begins;
    }

    /// Adds the segments of a run of sky, each between two of its knots.
    #[inline(never)]
    fn see_sky(&mut self, j: usize, begin: usize, end: usize) {
        let Canvas { segments, sky, .. } = &mut *self.canvas;
        if sky.is_empty() {
            let knots = (0..=self.lens.width.div_ceil(STEP)).map(|k| (STEP * k) as f32 + 0.5);
            sky.extend(knots.map(|u| self.painter.sky(u, j as f32 + 0.5)));
        }
        let mut from = begin;
        while from < end {
            let to = end.min((from / STEP + 1) * STEP);
            let segment = Segment {
                begin: from as u32,
                end: to as u32,
                paint: EMPTY,
                knots: [0; 2],
                between: 1,
            };
            segments.push(segment, Tile::of(Texture::Plain), &Plane::default(), 1.0);
            from = to;
        }
    }

    /// Adds the segments of a run of a surface.
    #[inline(always)]
    fn see_surface(&mut self, j: usize, begin: usize, end: usize, at: usize) {
        let Canvas { paints, points, segments, row, .. } = &mut *self.canvas;
        let paint = &paints[at];
        let depth_at = |k: usize| {
            if !self.lens.is_plan {
                return row.depth_at(k);
            }
            let inverse_depth =
                self.target.inverse_depth(j).get(k / LANES).map(|block| block[k % LANES]);
            self.lens.depth(inverse_depth.unwrap_or_default())
        };
        let mut knots = [0; 2];
        let mut between = 1;
        let is_long = end - begin > LANES;
        if let Kind::Structure(surface) = &paint.kind {
            // Light hardly changes within a short run.
            let k = if is_long { begin } else { (begin + end) / 2 };
            knots = [self.painter.knot(points, surface, (k, j), depth_at(k)); 2];
        }
        let mut from = begin;
        while from < end {
            let to = end.min(from + STEP);
            if let (Kind::Structure(surface), true) = (&paint.kind, is_long) {
                let k = to.min(end - 1);
                let next = self.painter.knot(points, surface, (k, j), depth_at(k));
                (knots, between) = ([knots[1], next], (k - from).max(1));
            }
            let segment = Segment {
                begin: from as u32,
                end: to as u32,
                paint: at as u32,
                knots,
                between: between as u32,
            };
            segments.push(segment, paint.tile, &paint.texture, row.depth_at(from));
            from = to;
        }
    }

    /// Lights the points of the row, and finishes the triangles that waited for it.
    #[inline(always)]
    fn light(&mut self) {
        let Canvas { paints, points, n_lit, .. } = &mut *self.canvas;
        points.light(self.painter.frame.light.rig);
        for paint in &mut paints[*n_lit..] {
            if let Kind::Unlit(unlit) = &paint.kind {
                paint.kind = Kind::Linear(unlit.lit(points));
            }
        }
        *n_lit = paints.len();
    }

    /// Fills the segments of row `j`.
    #[inline(always)]
    fn fill(&mut self, j: usize) {
        let v = j as f32 + 0.5;
        let Canvas { paints, points, segments, sky, row, .. } = &mut *self.canvas;
        let quads = self.painter.frame.light.shadows.as_ref().and_then(Shadows::quads);
        for k in 0..segments.len() {
            let (segment, place) = segments.get(k);
            let (begin, end) = (segment.begin as usize, segment.end as usize);
            let mut ground = None;
            let (id, hue) = match paints.get(segment.paint as usize) {
                None => {
                    let (here, there) = (sky[begin / STEP], sky[begin / STEP + 1]);
                    let step = (there - here) * (1.0 / STEP as f32);
                    let start = here + step * (begin % STEP) as f32;
                    (EntityId::NOTHING.0, Hue::Ramp { start, step })
                }
                Some(paint) => {
                    let hue = match &paint.kind {
                        Kind::Linear(Linear { shown, low, high }) => {
                            let plane = shown.from(begin, v);
                            Hue::Linear { plane, low: *low, high: *high }
                        }
                        Kind::Structure(surface) => {
                            if let (true, Some(quads)) = (surface.is_floor, quads) {
                                let plane = self.painter.ground.from(begin, v);
                                ground = Some(OnGround::along(quads, &plane));
                            }
                            let [start, there] = segment.knots.map(|k| points.shown(k as usize));
                            let step = (there - start) * (1.0 / segment.between as f32);
                            Hue::Ramp { start, step }
                        }
                        // All are lit by now.
                        Kind::Unlit(_) => Hue::Ramp { start: Vec4::ZERO, step: Vec4::ZERO },
                    };
                    (paint.entity, hue)
                }
            };
            row.fill((begin, end), &SegmentStyle { id, hue, place }, self.atlas, ground);
        }
    }

    /// Where the paint of a triangle is; worked out when first asked for.
    #[inline(always)]
    fn find_paint(&mut self, visibility_id: u32) -> usize {
        let (index, triangle) = unpack_visibility_id(visibility_id);
        let slot = self.drawn.firsts[index] as usize + triangle;
        let known = self.canvas.slots[slot];
        if known != EMPTY {
            return known as usize;
        }
        let paint = self.new_paint(index, triangle);
        self.canvas.slots[slot] = self.canvas.paints.len() as u32;
        self.canvas.paints.push(paint);
        self.canvas.paints.len() - 1
    }

    #[inline(never)]
    fn new_paint(&mut self, index: usize, triangle: usize) -> Paint {
        let instance = &self.painter.frame.instances[index];
        let mesh = instance.shape.mesh(usize::from(self.drawn.levels[index]));
        let Canvas { sights, points, .. } = &mut *self.canvas;
        let sight = sights[index].get_or_insert_with(|| self.painter.sight(instance));
        self.painter.paint(instance, sight, mesh, &mesh.triangles[triangle], points)
    }
}
