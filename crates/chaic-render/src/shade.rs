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
use chaic_protocol::geom::Camera;
use glam::Vec4;

use crate::frame::Frame;
use crate::lens::Lens;
use crate::light::{MAX_CELLS, N_GROUND};
use crate::paint::{Kind, Paint, Painter, RowPlane, Sight};
use crate::raster::{NOBODY, Target, owner_parts};
use crate::texture::{Atlas, Level, N_ATLAS, PLAIN, Tile, atlas};

/// Pixels that are worked on at once; a run's last lanes may lie beyond its end, where the next
/// run writes them again.
const LANES: usize = 16;
/// Most pixels between two knots of light.
const STEP: usize = 64;

/// Buffers for shading, used again and again.
#[derive(Default)]
pub(crate) struct Canvas {
    /// Where each triangle's paint is, by [`crate::draw::Work::firsts`]; [`EMPTY`] if not there.
    slots: Vec<u32>,
    paints: Vec<Paint>,
    sights: Vec<Option<Sight>>,
    row: Row,
}

/// The pixels of one row; each array has at least [`LANES`] more than the row.
#[derive(Default)]
struct Row {
    /// Depth, metres; 1 in a plan view (see [`crate::paint::Plane`]).
    depth: Vec<f32>,
    /// What is shown but for textures, 0 to 255.
    r: Vec<f32>,
    g: Vec<f32>,
    b: Vec<f32>,
    /// The texel in the atlas, and how far the pixel is from it to the right (low 16 bits) and
    /// down, in parts of 256.
    texel: Vec<u32>,
    within: Vec<u32>,
    /// The same on the ground's grid; only where floor is in the row.
    cell: Vec<u32>,
    within_cell: Vec<u32>,
    /// Red in the lowest byte, then green and blue.
    packed: Vec<u32>,
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
            let nearness = &self.target.nearness[line.clone()];
            let depth_m = self.wanted.depth_m.as_deref_mut().map(|d| &mut d[line.clone()]);
            self.canvas.row.find_depths(nearness, self.lens.is_plan, depth_m);
            let owners = &self.target.owner[line.clone()];
            let mut has_floor = false;
            let mut begin = 0;
            while begin < width {
                let owner = owners[begin];
                let end = begin + run_length(&owners[begin..], owner);
                let (id, is_floor) = self.run(j, begin, end, owner, nearness);
                if is_floor && !has_floor {
                    // What came before isn't floor.
                    self.canvas.row.cell[..begin].fill(NO_CELL);
                }
                has_floor |= is_floor;
                if has_floor && !is_floor {
                    self.canvas.row.cell[begin..end].fill(NO_CELL);
                }
                if let Some(ids) = &mut self.wanted.ids {
                    ids[line.start + begin..line.start + end].fill(id);
                }
                begin = end;
            }
            let ground = self.painter.frame.light.quads.first_chunk().filter(|_| has_floor);
            self.canvas.row.pack(self.atlas, ground);
            let out = &mut self.wanted.rgb[3 * line.start..3 * line.end];
            write(&self.canvas.row.packed, out);
        }
    }
}

/// The cell of what isn't ground.
const NO_CELL: u32 = N_GROUND as u32 - 1;

/// How many pixels at the beginning have this owner.
#[inline(always)]
fn run_length(owners: &[u32], owner: u32) -> usize {
    let mut n = 0;
    for chunk in owners.as_chunks::<LANES>().0 {
        let mut other = 0;
        for o in chunk {
            other |= o ^ owner;
        }
        if other != 0 {
            break;
        }
        n += LANES;
    }
    n + owners[n..].iter().take_while(|o| **o == owner).count()
}

/// Writes three bytes for each color.
#[inline(always)]
fn write(colors: &[u32], out: &mut [u8]) {
    for (pixel, color) in out.chunks_exact_mut(3).zip(colors) {
        let [r, g, b, _] = color.to_le_bytes();
        pixel.copy_from_slice(&[r, g, b]);
    }
}

impl Row {
    fn resize(&mut self, width: usize) {
        let n = width.div_ceil(LANES) * LANES + LANES;
        let Row { depth, r, g, b, texel, within, cell, within_cell, packed } = self;
        for array in [depth, r, g, b] {
            array.resize(n, 1.0);
        }
        for array in [texel, within, cell, within_cell, packed] {
            array.resize(n, 0);
        }
    }

    /// Depths of nearnesses, as [`crate::paint::Plane`] wants them and as eyes see them: what is
    /// farther than can be seen is as far as that.
    #[inline(always)]
    fn find_depths(&mut self, nearness: &[f32], is_plan: bool, seen: Option<&mut [f32]>) {
        let depth = &mut self.depth[..nearness.len()];
        if is_plan {
            depth.fill(1.0);
            return;
        }
        for (d, q) in depth.iter_mut().zip(nearness) {
            *d = 1.0 / *q;
        }
        if let Some(seen) = seen {
            for (seen, d) in seen.iter_mut().zip(&*depth) {
                *seen = if *d < Camera::FAR_M { *d } else { Camera::FAR_M };
            }
        }
    }

    /// Mixes textures into colors. Plain loops over a whole number of steps, so that no pixel is
    /// left for a slower one.
    #[inline(always)]
    fn pack(&mut self, atlas: &Atlas, ground: Option<&[u32; N_GROUND]>) {
        let n = self.packed.len() / LANES * LANES;
        let (r, g, b) = (&mut self.r[..n], &mut self.g[..n], &mut self.b[..n]);
        let (texel, within) = (&self.texel[..n], &self.within[..n]);
        let packed = &mut self.packed[..n];
        if let Some(ground) = ground {
            let (cell, within_cell) = (&self.cell[..n], &self.within_cell[..n]);
            for k in 0..n {
                let quad = ground[(cell[k] as usize).min(N_GROUND - 1)];
                let bright = mixed(quad, within_cell[k]) * (1.0 / (255.0 * 65536.0));
                r[k] *= bright;
                g[k] *= bright;
                b[k] *= bright;
            }
        }
        for k in 0..n {
            let quad = atlas[texel[k] as usize % N_ATLAS];
            let bright = mixed(quad, within[k]) * (1.0 / (128.0 * 65536.0));
            packed[k] =
                whole(r[k] * bright) | whole(g[k] * bright) << 8 | whole(b[k] * bright) << 16;
        }
    }
}

/// A number from 0 to 255 without its fraction; more is 255.
#[inline(always)]
fn whole(x: f32) -> u32 {
    let x = if x < 255.0 { x } else { 255.0 };
    // 2^23 added, a number has its whole part in the lowest bits.
    (x + 8_388_608.0).to_bits() & 0xff
}

/// Mixes the four bytes of a quad by how far right (low 16 bits) and down the point is; 65,536
/// times their mean.
#[inline(always)]
fn mixed(quad: u32, within: u32) -> f32 {
    let (right, down) = (within & 0xffff, within >> 16);
    let (left_bytes, right_bytes) = (quad & 0x00ff_00ff, quad >> 8 & 0x00ff_00ff);
    let rows = left_bytes * (256 - right) + right_bytes * right;
    let (above, below) = (rows & 0xffff, rows >> 16);
    (above * (256 - down) + below * down) as i32 as f32
}

impl Rows<'_> {
    /// Colors the run of pixels `begin..end` of row `j`; tells whose it is, and if it is floor.
    #[inline(always)]
    fn run(
        &mut self,
        j: usize,
        begin: usize,
        end: usize,
        owner: u32,
        nearness: &[f32],
    ) -> (u16, bool) {
        let v = j as f32 + 0.5;
        if owner == NOBODY {
            let (painter, row) = (&self.painter, &mut self.canvas.row);
            row.light(begin, end, |k| painter.sky(k as f32 + 0.5, v));
            row.texel[begin..end].fill(PLAIN);
            return (EntityId::NOTHING.0, false);
        }
        let at = self.find_paint(owner);
        let Canvas { paints, row, .. } = &mut *self.canvas;
        let paint = &paints[at];
        let mut is_floor = false;
        match &paint.kind {
            Kind::Even(shown) => row.fill_color(begin, end, *shown),
            Kind::Smooth { shown, low, high } => row.color(begin, end, &shown.row(v), *low, *high),
            Kind::Structure(surface) => {
                let (painter, lens) = (&self.painter, self.lens);
                row.light(begin, end, |k| {
                    let (p, ray) = painter.rays.point(k as f32 + 0.5, v, lens.depth(nearness[k]));
                    painter.shown_structure(surface, p, ray)
                });
                is_floor = surface.is_floor;
                if is_floor {
                    row.cells(begin, end, &painter.ground.row(v));
                }
            }
        }
        match paint.tile {
            Some(tile) => {
                row.texture(begin, end, &paint.texture.row(v), tile, 1.0 / self.lens.focal)
            }
            None => row.texel[begin..end].fill(PLAIN),
        }
        (paint.entity, is_floor)
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
        let sight = self.canvas.sights[index].get_or_insert_with(|| self.painter.sight(instance));
        self.painter.paint(instance, sight, mesh, &mesh.triangles[triangle])
    }
}

/// Filling runs `begin..end` of a row.
impl Row {
    #[inline(always)]
    fn fill_color(&mut self, begin: usize, end: usize, color: Vec4) {
        self.r[begin..end].fill(color.x);
        self.g[begin..end].fill(color.y);
        self.b[begin..end].fill(color.z);
    }

    /// Colors from knots of light.
    #[inline(always)]
    fn light(&mut self, begin: usize, end: usize, knot: impl Fn(usize) -> Vec4) {
        let mut from = begin;
        let mut here = knot(from);
        while from < end {
            // The last pixel is a knot too.
            let is_last = end - from <= STEP;
            let next = if is_last { end - 1 } else { from + STEP };
            let there = if next > from { knot(next) } else { here };
            let step = (there - here) * (1.0 / (next - from).max(1) as f32);
            let last = if is_last { end } else { next };
            let lanes = lanes(from, last);
            let channels = [&mut self.r, &mut self.g, &mut self.b];
            let (starts, steps) = (here.to_array(), step.to_array());
            for ((channel, start), step) in channels.into_iter().zip(starts).zip(steps) {
                for (k, x) in channel[lanes.clone()].iter_mut().enumerate() {
                    *x = start + step * k as u32 as f32;
                }
            }
            (from, here) = (last, there);
        }
    }

    /// Colors from a plane, within bounds.
    #[inline(always)]
    fn color(&mut self, begin: usize, end: usize, plane: &RowPlane, low: Vec4, high: Vec4) {
        let lanes = lanes(begin, end);
        let plane = plane.from(begin);
        let depth = &self.depth[lanes.clone()];
        let channels = [&mut self.r, &mut self.g, &mut self.b];
        for (c, channel) in channels.into_iter().enumerate() {
            let (base, at, du) = (plane.base[c], plane.at[c], plane.du[c]);
            let (low, high) = (low[c], high[c]);
            let channel = &mut channel[lanes.clone()];
            for k in 0..channel.len() {
                let x = base + depth[k] * (at + du * k as u32 as f32);
                let x = if x > low { x } else { low };
                channel[k] = if x < high { x } else { high };
            }
        }
    }

    /// Texels from a plane of texture coordinates; `per_px` is what a pixel covers one metre away.
    #[inline(always)]
    fn texture(&mut self, begin: usize, end: usize, plane: &RowPlane, tile: Tile, per_px: f32) {
        for first in (begin..end).step_by(STEP) {
            let lanes = lanes(first, end.min(first + STEP));
            let plane = plane.from(first);
            let depth = &self.depth[lanes.clone()];
            // Seen at a slant a pixel covers more; the root keeps textures from blurring too early.
            let covers_m = depth[0] * per_px / plane.at.z.abs().max(0.05).sqrt();
            let Level { begin, log2_side, texels_per_m } = tile.level(covers_m);
            let period = 256.0 * (1u32 << log2_side) as f32;
            let [u, v] = lines(&plane, depth[0], 256.0 * texels_per_m, Some(period));
            let mask = (1u32 << log2_side) - 1;
            let (texel, within) = (&mut self.texel[lanes.clone()], &mut self.within[lanes]);
            for k in 0..depth.len() {
                let (u, v) = (u.at(k, depth[k]), v.at(k, depth[k]));
                texel[k] = begin + ((v >> 8 & mask) << log2_side) + (u >> 8 & mask);
                within[k] = u & 0xff | (v & 0xff) << 16;
            }
        }
    }

    /// Cells from a plane of places on the ground's grid.
    #[inline(always)]
    fn cells(&mut self, begin: usize, end: usize, plane: &RowPlane) {
        const MOST: i32 = 256 * (MAX_CELLS as i32 - 1);
        let lanes = lanes(begin, end);
        let [x, z] = lines(&plane.from(begin), 0.0, 256.0, None);
        let depth = &self.depth[lanes.clone()];
        let (cell, within) = (&mut self.cell[lanes.clone()], &mut self.within_cell[lanes]);
        for k in 0..depth.len() {
            let x = (x.at(k, depth[k]) as i32).clamp(0, MOST) as u32;
            let z = (z.at(k, depth[k]) as i32).clamp(0, MOST) as u32;
            cell[k] = (z >> 8) * MAX_CELLS as u32 + (x >> 8);
            within[k] = x & 0xff | (z & 0xff) << 16;
        }
    }
}

/// The pixels from `begin` in whole [`LANES`].
#[inline(always)]
fn lanes(begin: usize, end: usize) -> std::ops::Range<usize> {
    begin..begin + (end - begin).div_ceil(LANES) * LANES
}

/// A coordinate along a row, in whole numbers.
#[derive(Clone, Copy)]
struct Line {
    base: f32,
    at: f32,
    du: f32,
}

impl Line {
    /// In the k-th pixel, at a depth.
    #[inline(always)]
    fn at(&self, k: usize, depth: f32) -> u32 {
        /// Farther off is no sane picture.
        const FAR: f32 = 2e6;
        /// 1.5 * 2^23: a number below 2^22 added to it has its whole part in the sum's low bits.
        const WHOLE: f32 = 12_582_912.0;
        let x = self.base + depth * (self.at + self.du * k as u32 as f32);
        let x = if x < FAR { x } else { FAR };
        let x = if x > -FAR { x } else { -FAR };
        (x + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits())
    }
}

/// The first two quantities of a plane in units of 1 / `scale`, less half of 256 units; less the
/// whole periods (in the same units) at this depth in the first pixel too, which keeps them small.
#[inline(always)]
fn lines(plane: &RowPlane, depth: f32, scale: f32, period: Option<f32>) -> [Line; 2] {
    let line = |base: f32, at: f32, du: f32| {
        let (base, at, du) = (base * scale, at * scale, du * scale);
        let periods = period.map_or(0.0, |p| p * ((base + depth * at) / p).floor());
        Line { base: base - 128.0 - periods, at, du }
    };
    [line(plane.base.x, plane.at.x, plane.du.x), line(plane.base.y, plane.at.y, plane.du.y)]
}
