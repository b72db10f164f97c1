//! Color, depth and ids of pixels whose triangles are known, one row of the image at a time.
//!
//! Neighboring pixels of one triangle are a run. Along it, colors and texture coordinates follow
//! the triangle's planes ([`crate::paint`]); only the light on structure, which no plane describes,
//! is worked out at knots and runs linearly between. Then the whole row takes its texels.
//!
//! Lanes are plain arrays and loops, which the compiler makes vectors of, as wide as the machine's
//! (see [`Rows`]); each lane's operations stay the same. Closures and `array::from_fn` must stay
//! out of such loops: they are compiled apart, for any machine.

use chaic_protocol::EntityId;

use crate::frame::Frame;
use crate::lens::Lens;
use crate::paint::{Kind, Paint, Painter, Sight};
use crate::patches::Patches;
use crate::points::Points;
use crate::raster::{Blocks, LANES, NOBODY, Target, Wide, owner_parts};
use crate::row::{Row, STEP};
use crate::texture::{Atlas, atlas};

/// Buffers for shading, used again and again.
#[derive(Default)]
pub(crate) struct Canvas {
    /// Where each triangle's paint is, by [`crate::draw::Work::firsts`]; [`EMPTY`] if not there.
    slots: Vec<u32>,
    paints: Vec<Paint>,
    sights: Vec<Option<Sight>>,
    /// So many of the paints have been lit.
    n_lit: usize,
    /// Where the runs of the row begin.
    begins: Vec<u32>,
    runs: Vec<Run>,
    /// What is lit on the row: new triangles' points and knots of structure.
    points: Points,
    patches: Patches,
    row: Row,
}

/// Neighboring pixels of one triangle.
#[derive(Clone, Copy)]
struct Run {
    begin: u32,
    end: u32,
    /// Where its paint is; [`EMPTY`] if it is the sky.
    paint: u32,
    /// The number of its first knot, if it is structure.
    knot: u32,
    /// The number of its first patch, if it has a texture.
    patch: u32,
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
            let depth_m = self.wanted.depth_m.as_deref_mut().map(|d| &mut d[line.clone()]);
            self.canvas.row.find_depths(self.target.nearness(j), self.lens.is_plan, depth_m);
            self.find_runs(j);
            self.light();
            self.canvas.patches.place(j as f32 + 0.5, 1.0 / self.lens.focal);
            let has_floor = self.fill(j);
            let ground = self.painter.frame.light.quads.first_chunk().filter(|_| has_floor);
            self.canvas.row.pack(self.atlas, ground);
            let out = &mut self.wanted.rgb[3 * line.start..3 * line.end];
            self.canvas.row.write(out);
        }
    }
}

/// Finds the columns in which runs begin.
#[inline(always)]
fn find_begins(owners: Blocks<Wide<u32>>, width: usize, begins: &mut Vec<u32>) {
    begins.clear();
    let mut last = owners.get(0).map_or(NOBODY, |block| !block[0]);
    for (b, block) in owners.iter().enumerate() {
        let mut begin = 0u32;
        let mut before = [last; LANES];
        before[1..].copy_from_slice(&block[..LANES - 1]);
        for k in 0..LANES {
            begin |= u32::from(block[k] != before[k]) << k;
        }
        last = block[LANES - 1];
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
    /// Finds the runs of row `j`, and what has to be lit.
    #[inline(always)]
    fn find_runs(&mut self, j: usize) {
        let width = self.lens.width;
        let (owners, nearness) = (self.target.owner(j), self.target.nearness(j));
        self.canvas.runs.clear();
        self.canvas.points.clear();
        self.canvas.patches.clear();
        let mut begins = std::mem::take(&mut self.canvas.begins);
        find_begins(owners, width, &mut begins);
        for (k, begin) in begins.iter().enumerate() {
            let begin = *begin as usize;
            let end = begins.get(k + 1).map_or(width, |end| *end as usize);
            let owner = owners.get(begin / LANES).map_or(NOBODY, |block| block[begin % LANES]);
            let mut run =
                Run { begin: begin as u32, end: end as u32, paint: EMPTY, knot: 0, patch: 0 };
            let mut id = EntityId::NOTHING.0;
            if owner != NOBODY {
                let at = self.find_paint(owner);
                run.paint = at as u32;
                let Canvas { paints, points, patches, row, .. } = &mut *self.canvas;
                let paint = &paints[at];
                id = paint.entity;
                if let Some(tile) = paint.tile {
                    let mut patch = |k| patches.push(tile, &paint.texture, k, row.depth_at(k));
                    run.patch = patch(begin) as u32;
                    (begin + STEP..end).step_by(STEP).for_each(|k| _ = patch(k));
                }
                if let Kind::Structure(surface) = &paint.kind {
                    let mut knot = |k: usize| {
                        let (u, v) = (k as f32 + 0.5, j as f32 + 0.5);
                        let q = nearness.get(k / LANES).map_or(0.0, |block| block[k % LANES]);
                        let depth_m = self.lens.depth(q);
                        points.push(&self.painter.structure_point(surface, u, v, depth_m))
                    };
                    run.knot = knot(begin) as u32;
                    // The last pixel is a knot too.
                    (begin + STEP..end - 1).step_by(STEP).for_each(|k| _ = knot(k));
                    if end - begin > 1 {
                        knot(end - 1);
                    }
                }
            }
            if let Some(ids) = &mut self.wanted.ids {
                ids[j * width + begin..j * width + end].fill(id);
            }
            self.canvas.runs.push(run);
        }
        self.canvas.begins = begins;
    }

    /// Lights the points of the row, and finishes the triangles that waited for it.
    #[inline(always)]
    fn light(&mut self) {
        let Canvas { paints, points, n_lit, .. } = &mut *self.canvas;
        points.light(self.painter.frame.light.lamps);
        for paint in &mut paints[*n_lit..] {
            if let Kind::Unlit(unlit) = &paint.kind {
                paint.kind = unlit.lit(points);
            }
        }
        *n_lit = paints.len();
    }

    /// Colors the runs of row `j`; tells whether there is floor among them.
    #[inline(always)]
    fn fill(&mut self, j: usize) -> bool {
        let v = j as f32 + 0.5;
        let Canvas { paints, runs, points, patches, row, .. } = &mut *self.canvas;
        let is_floor = |paint: &Paint| matches!(&paint.kind, Kind::Structure(s) if s.is_floor);
        let paint_of = |run: &Run| (run.paint != EMPTY).then(|| &paints[run.paint as usize]);
        let has_floor = runs.iter().any(|run| paint_of(run).is_some_and(is_floor));
        let mut has_sky = false;
        for run in &*runs {
            let (begin, end) = (run.begin as usize, run.end as usize);
            let Some(paint) = paint_of(run) else {
                if !has_sky {
                    row.find_sky(|k| self.painter.sky(k as f32 + 0.5, v));
                }
                has_sky = true;
                row.fill_sky(begin, end);
                if has_floor {
                    row.leave_ground(begin, end);
                }
                continue;
            };
            let mut on_ground = false;
            match &paint.kind {
                Kind::Even(shown) => row.fill_color(begin, end, *shown),
                Kind::Smooth { shown, low, high } => {
                    row.color(begin, end, &shown.row(v), *low, *high);
                }
                Kind::Structure(surface) => {
                    row.light(begin, end, run.knot as usize, points);
                    on_ground = surface.is_floor;
                }
                // All are lit by now.
                Kind::Unlit(_) => {}
            }
            if on_ground {
                row.cells(begin, end, &self.painter.ground.row(v));
            } else if has_floor {
                row.leave_ground(begin, end);
            }
            match paint.tile {
                Some(_) => row.texture(begin, end, run.patch as usize, patches),
                None => row.leave_plain(begin, end),
            }
        }
        has_floor
    }

    /// Where the paint of a triangle is; worked out when first asked for.
    #[inline(always)]
    fn find_paint(&mut self, owner: u32) -> usize {
        let (index, triangle) = owner_parts(owner);
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
