//! Parts of runs, each on one level of its texture; where they lie on it is worked out for many of
//! them at once, by one plain loop over lists, as in [`crate::points`].

use glam::Vec4;

use crate::planes::Plane;
use crate::setup::{least, most};
use crate::texture::{LEVELS, SIDE, Tile};

/// Most pixels of a segment.
pub(crate) const STEP: usize = 64;

/// 1.5 * 2^23: a number below 2^22 added to it is rounded, and the sum's low bits hold it.
pub(crate) const WHOLE: f32 = 12_582_912.0;

/// Neighboring pixels of one triangle.
#[derive(Clone, Copy)]
pub(crate) struct Segment {
    pub begin: u32,
    pub end: u32,
    /// Where its paint is.
    pub paint: u32,
    /// The points where structure is lit: in the first pixel and so many pixels to the right.
    pub knots: [u32; 2],
    pub between: u32,
}

/// The segments of a row.
#[derive(Default)]
pub(crate) struct Segments {
    list: Vec<Segment>,
    blocks: Vec<Block>,
}

/// So many segments are worked out at once.
const LANES: usize = 16;

/// Quantities of segments side by side.
type Lane = [f32; LANES];

/// Neighboring segments; the lists in a list are the lanes of a [`Plane`] of texture coordinates.
#[derive(Clone, Default)]
struct Block {
    base: [Lane; 3],
    at: [Lane; 3],
    du: [Lane; 3],
    dv: [Lane; 3],
    /// Where the tile begins in the atlas.
    tile: [u32; LANES],
    texels_per_m: Lane,
    /// The first pixel, and its depth.
    first: [u32; LANES],
    depth: Lane,
    // What is worked out:
    begin: [u32; LANES],
    level: [u32; LANES],
    lines: [[Lane; 3]; 2],
}

/// Where a segment lies on a level of its texture. Coordinates are in parts of 256 of a texel, half
/// a texel up and left.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    /// Where the level begins in the atlas; its side is 1 << log2_side texels.
    pub begin: u32,
    pub log2_side: u32,
    pub u: Line,
    pub v: Line,
}

/// A coordinate along a row, in whole numbers: `base + depth * (at + k * du)` in its k-th pixel.
#[derive(Clone, Copy)]
pub(crate) struct Line {
    pub base: f32,
    pub at: f32,
    pub du: f32,
}

impl Line {
    /// In the k-th pixel, at a depth; any number from 2^22 on.
    #[inline(always)]
    pub fn at(&self, k: f32, depth: f32) -> u32 {
        let x = self.base + depth * (self.at + self.du * k);
        (x + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits())
    }
}

impl Segments {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Adds a segment whose first pixel has this depth.
    #[inline(always)]
    pub fn push(&mut self, segment: Segment, tile: Tile, plane: &Plane, depth: f32) {
        let (block, k) = (self.list.len() / LANES, self.list.len() % LANES);
        if block >= self.blocks.len() {
            self.blocks.push(Block::default());
        }
        let block = &mut self.blocks[block];
        put(&mut block.base, k, plane.base);
        put(&mut block.at, k, plane.at);
        put(&mut block.du, k, plane.du);
        put(&mut block.dv, k, plane.dv);
        block.tile[k] = tile.begin;
        block.texels_per_m[k] = tile.texels_per_m;
        block.first[k] = segment.begin;
        block.depth[k] = depth;
        self.list.push(segment);
    }

    /// A segment, and its place once it has been worked out.
    #[inline(always)]
    pub fn get(&self, k: usize) -> (Segment, Place) {
        let (block, lane) = (&self.blocks[k / LANES], k % LANES);
        let [u, v] = &block.lines;
        let u = Line { base: u[0][lane], at: u[1][lane], du: u[2][lane] };
        let v = Line { base: v[0][lane], at: v[1][lane], du: v[2][lane] };
        let log2_side = SIDE.ilog2() - block.level[lane];
        (self.list[k], Place { begin: block.begin[lane], log2_side, u, v })
    }

    /// Works out all places, for the row of pixels with middles at `v`; `per_px` is what a pixel
    /// covers one metre away.
    #[inline(always)]
    pub fn place(&mut self, v: f32, per_px: f32) {
        for block in self.blocks.iter_mut().take(self.list.len().div_ceil(LANES)) {
            block.place(v, per_px);
        }
    }
}

#[inline(always)]
fn put(lists: &mut [Lane; 3], k: usize, v: Vec4) {
    (lists[0][k], lists[1][k], lists[2][k]) = (v.x, v.y, v.z);
}

impl Block {
    #[inline(always)]
    fn place(&mut self, v: f32, per_px: f32) {
        let Block { base, at, du, dv, tile, texels_per_m, first, depth, begin, level, lines } =
            self;
        let [[u_base, u_at, u_du], [v_base, v_at, v_du]] = lines;
        for k in 0..LANES {
            let middle = first[k] as f32 + 0.5;
            let at_u = at[0][k] + dv[0][k] * v + du[0][k] * middle;
            let at_v = at[1][k] + dv[1][k] * v + du[1][k] * middle;
            let slant = at[2][k] + dv[2][k] * v + du[2][k] * middle;
            // Seen at a slant a pixel covers more; the root keeps textures from blurring too early.
            let covers_m = depth[k] * per_px / most(slant.abs(), 0.05).sqrt();
            let covers = least(most(covers_m * texels_per_m[k], 1.0), SIDE as f32);
            let up = (covers.to_bits() >> 23).wrapping_sub(127);
            let up = if up < LEVELS as u32 { up } else { LEVELS as u32 - 1 };
            level[k] = up;
            begin[k] = tile[k] + Tile::before(up);
            let scale = 256.0 * texels_per_m[k] * power_of_2(-(up as i32));
            let log2_period = (8 + SIDE.ilog2()) as i32 - up as i32;
            let (period, per_period) = (power_of_2(log2_period), power_of_2(-log2_period));
            let (base_u, base_v) = (base[0][k] * scale, base[1][k] * scale);
            let (at_u, at_v) = (at_u * scale, at_v * scale);
            // Less whole periods, which keeps the numbers small.
            let periods_u = ((base_u + at_u * depth[k]) * per_period + WHOLE) - WHOLE;
            let periods_v = ((base_v + at_v * depth[k]) * per_period + WHOLE) - WHOLE;
            u_base[k] = base_u - 128.0 - periods_u * period;
            v_base[k] = base_v - 128.0 - periods_v * period;
            (u_at[k], v_at[k]) = (at_u, at_v);
            (u_du[k], v_du[k]) = (du[0][k] * scale, du[1][k] * scale);
        }
    }
}

#[inline(always)]
fn power_of_2(exponent: i32) -> f32 {
    f32::from_bits(((127 + exponent) as u32) << 23)
}
