//! Segments of runs, each with one mip level of its texture. Texture coordinates of many segments
//! are computed together, by one plain loop over arrays, as in [`crate::points`].

use glam::Vec4;

use crate::planes::Plane;
use crate::setup::{fmax, fmin};
use crate::texture::{MIP_LEVELS, TILE_SIDE, Tile};

/// Maximum number of pixels of a segment.
pub(crate) const STEP: usize = 64;

/// 1.5 * 2^23: adding it to a number below 2^22 rounds that number into the low bits of the sum.
pub(crate) const ROUNDING_BIAS: f32 = 12_582_912.0;

/// Neighboring pixels of one triangle.
#[derive(Clone, Copy)]
pub(crate) struct Segment {
    pub begin: u32,
    pub end: u32,
    /// Index of the triangle's shading.
    pub shading: u32,
    /// Light samples of structure: at the first pixel, and `sample_spacing` pixels to the right.
    pub samples: [u32; 2],
    pub sample_spacing: u32,
}

/// Segments of a row.
#[derive(Default)]
pub(crate) struct Segments {
    list: Vec<Segment>,
    blocks: Vec<Block>,
}

/// Number of segments that are processed together.
const LANES: usize = 16;

/// One quantity of a block of segments.
type Lane = [f32; LANES];

/// A block of neighboring segments; inner arrays are the lanes of a [`Plane`] of texture
/// coordinates.
#[derive(Clone, Default)]
struct Block {
    base: [Lane; 3],
    at: [Lane; 3],
    du: [Lane; 3],
    dv: [Lane; 3],
    /// Offset of the texture tile in the atlas.
    tile: [u32; LANES],
    texels_per_m: Lane,
    /// First pixel and its depth.
    first: [u32; LANES],
    depth: Lane,
    // Results:
    begin: [u32; LANES],
    mip_levels: [u32; LANES],
    lines: [[Lane; 3]; 2],
}

/// Texture coordinates of a segment on one mip level, in 1/256 of a texel, minus half a texel.
#[derive(Clone, Copy)]
pub(crate) struct TexturePlacement {
    /// Offset of the mip level in the atlas; its side is `1 << log2_side` texels.
    pub begin: u32,
    pub log2_side: u32,
    pub u: TexelLine,
    pub v: TexelLine,
}

/// A texture coordinate along a row, rounded to an integer: `base + depth * (at + k * du)` at pixel
/// k.
#[derive(Clone, Copy)]
pub(crate) struct TexelLine {
    pub base: f32,
    pub at: f32,
    pub du: f32,
}

impl TexelLine {
    /// Returns the coordinate at pixel k and a depth. The result is not defined for values from
    /// 2^22.
    #[inline(always)]
    pub fn at(&self, k: f32, depth: f32) -> u32 {
        let x = self.base + depth * (self.at + self.du * k);
        (x + ROUNDING_BIAS).to_bits().wrapping_sub(ROUNDING_BIAS.to_bits())
    }
}

impl Segments {
    /// Removes all segments.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// Number of segments.
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
        set_lane(&mut block.base, k, plane.base);
        set_lane(&mut block.at, k, plane.at);
        set_lane(&mut block.du, k, plane.du);
        set_lane(&mut block.dv, k, plane.dv);
        block.tile[k] = tile.begin;
        block.texels_per_m[k] = tile.texels_per_m;
        block.first[k] = segment.begin;
        block.depth[k] = depth;
        self.list.push(segment);
    }

    /// Returns a segment and its texture coordinates once they are computed.
    #[inline(always)]
    pub fn get(&self, k: usize) -> (Segment, TexturePlacement) {
        let (block, lane) = (&self.blocks[k / LANES], k % LANES);
        let [u, v] = &block.lines;
        let u = TexelLine { base: u[0][lane], at: u[1][lane], du: u[2][lane] };
        let v = TexelLine { base: v[0][lane], at: v[1][lane], du: v[2][lane] };
        let log2_side = TILE_SIDE.ilog2() - block.mip_levels[lane];
        (self.list[k], TexturePlacement { begin: block.begin[lane], log2_side, u, v })
    }

    /// Computes the texture coordinates of all segments, for a row with pixel centers at `v`.
    /// `per_px` is the size of a pixel at a depth of one meter.
    #[inline(always)]
    pub fn compute_placements(&mut self, v: f32, per_px: f32) {
        for block in self.blocks.iter_mut().take(self.list.len().div_ceil(LANES)) {
            block.compute_placements(v, per_px);
        }
    }
}

#[inline(always)]
fn set_lane(lists: &mut [Lane; 3], k: usize, v: Vec4) {
    (lists[0][k], lists[1][k], lists[2][k]) = (v.x, v.y, v.z);
}

impl Block {
    #[inline(always)]
    fn compute_placements(&mut self, v: f32, per_px: f32) {
        let Block { base, at, du, dv, tile, texels_per_m, first, depth, begin, mip_levels, lines } =
            self;
        let [[u_base, u_at, u_du], [v_base, v_at, v_du]] = lines;
        for k in 0..LANES {
            let center = first[k] as f32 + 0.5;
            let at_u = at[0][k] + dv[0][k] * v + du[0][k] * center;
            let at_v = at[1][k] + dv[1][k] * v + du[1][k] * center;
            let slant = at[2][k] + dv[2][k] * v + du[2][k] * center;
            // A pixel covers more at a slant; the square root keeps textures from blurring too
            // early.
            let covers_m = depth[k] * per_px / fmax(slant.abs(), 0.05).sqrt();
            let covers = fmin(fmax(covers_m * texels_per_m[k], 1.0), TILE_SIDE as f32);
            let mip_level = (covers.to_bits() >> 23).wrapping_sub(127);
            let mip_level =
                if mip_level < MIP_LEVELS as u32 { mip_level } else { MIP_LEVELS as u32 - 1 };
            mip_levels[k] = mip_level;
            begin[k] = tile[k] + Tile::texels_before(mip_level);
            let scale = 256.0 * texels_per_m[k] * power_of_2(-(mip_level as i32));
            let log2_period = (8 + TILE_SIDE.ilog2()) as i32 - mip_level as i32;
            let (period, per_period) = (power_of_2(log2_period), power_of_2(-log2_period));
            let (base_u, base_v) = (base[0][k] * scale, base[1][k] * scale);
            let (at_u, at_v) = (at_u * scale, at_v * scale);
            // Subtracting whole periods keeps the values small.
            let periods_u =
                ((base_u + at_u * depth[k]) * per_period + ROUNDING_BIAS) - ROUNDING_BIAS;
            let periods_v =
                ((base_v + at_v * depth[k]) * per_period + ROUNDING_BIAS) - ROUNDING_BIAS;
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
