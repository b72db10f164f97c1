//! The pixels of one row of the image, a list for each quantity.
//!
//! Segments are filled in whole [`LANES`], from left to right: the last ones may lie beyond a
//! segment's end, where the next one writes them again.

use crate::lens::{reciprocal, seen_depth_m};
use crate::light::{MAX_CELLS, N_GROUND};
use crate::raster::{Blocks, LANES, Wide};
use crate::segments::{Line, Place};
use crate::setup::{least, most};
use crate::texture::{Atlas, N_ATLAS};

/// The row; each list has at least [`LANES`] more than it has pixels.
#[derive(Default)]
pub(crate) struct Row {
    /// Depth, metres; 1 in a plan view (see [`crate::paint::Plane`]).
    depth: Vec<f32>,
    ids: Vec<u16>,
    /// Red in the lowest byte, then green and blue.
    colors: Vec<u32>,
}

/// How a channel goes along a segment but for textures, 0 to 255:
/// `base + k * step + depth * (at + k * du)` in its k-th pixel, within bounds.
#[derive(Clone, Copy, Default)]
pub(crate) struct Channel {
    pub base: f32,
    pub step: f32,
    pub at: f32,
    pub du: f32,
    pub low: f32,
    pub high: f32,
}

impl Channel {
    #[inline(always)]
    fn at(&self, k: f32, depth: f32) -> f32 {
        let x = (self.base + self.step * k) + depth * (self.at + self.du * k);
        least(most(x, self.low), self.high)
    }
}

/// What a segment looks like.
#[derive(Clone, Copy)]
pub(crate) struct Look {
    pub id: u16,
    pub channels: [Channel; 3],
    pub place: Place,
}

/// The ground's brightness, and how a segment goes over its grid.
#[derive(Clone, Copy)]
pub(crate) struct OnGround<'a> {
    pub quads: &'a [u32; N_GROUND],
    pub x: Line,
    pub z: Line,
}

impl Row {
    pub fn resize(&mut self, width: usize) {
        let n = width.div_ceil(LANES) * LANES + LANES;
        self.depth.resize(n, 1.0);
        self.ids.resize(n, 0);
        self.colors.resize(n, 0);
    }

    /// Depth in a pixel, as [`crate::paint::Plane`] wants it.
    #[inline(always)]
    pub fn depth_at(&self, k: usize) -> f32 {
        self.depth[k]
    }

    /// Depths of nearnesses, as [`crate::paint::Plane`] wants them.
    #[inline(always)]
    pub fn find_depths(&mut self, nearness: Blocks<Wide<f32>>, is_plan: bool) {
        if is_plan {
            self.depth.fill(1.0);
            return;
        }
        for (depth, nearness) in
            self.depth.as_chunks_mut::<LANES>().0.iter_mut().zip(nearness.iter())
        {
            for k in 0..LANES {
                depth[k] = reciprocal(nearness[k]);
            }
        }
    }

    /// Fills the pixels `begin..end`.
    #[inline(always)]
    pub fn fill(
        &mut self,
        (begin, end): (usize, usize),
        look: &Look,
        atlas: &Atlas,
        ground: Option<OnGround>,
    ) {
        let lanes = begin..begin + (end - begin).div_ceil(LANES) * LANES;
        self.ids[lanes.clone()].fill(look.id);
        let (colors, depth) = (&mut self.colors[lanes.clone()], &self.depth[lanes]);
        match ground {
            None => color(colors, depth, look, atlas),
            Some(OnGround { quads, x, z }) => {
                color_ground(colors, depth, look, atlas, quads, [x, z])
            }
        }
    }

    /// Writes what was found: three bytes of color for each pixel, and what else is wanted.
    #[inline(always)]
    pub fn write(&self, rgb: &mut [u8], depth_m: Option<&mut [f32]>, ids: Option<&mut [u16]>) {
        let (fours, rest) = rgb.as_chunks_mut::<12>();
        let colors = self.colors.as_chunks::<4>().0;
        for (out, [a, b, c, d]) in fours.iter_mut().zip(colors) {
            let words = [a | b << 24, b >> 8 | c << 16, c >> 16 | d << 8].map(u32::to_le_bytes);
            out.copy_from_slice(words.as_flattened());
        }
        let rest_of_colors = &self.colors[4 * fours.len()..];
        for (pixel, color) in rest.chunks_exact_mut(3).zip(rest_of_colors) {
            pixel.copy_from_slice(&color.to_le_bytes()[..3]);
        }
        if let Some(out) = depth_m {
            for (out, depth_m) in out.iter_mut().zip(&self.depth) {
                *out = seen_depth_m(*depth_m);
            }
        }
        if let Some(out) = ids {
            out.copy_from_slice(&self.ids[..out.len()]);
        }
    }
}

// The next two differ in what the ground adds. Lists are arguments of their own, by which the
// compiler knows that they don't overlap.

#[inline(always)]
fn color(colors: &mut [u32], depth: &[f32], look: &Look, atlas: &Atlas) {
    let Look { channels: [r, g, b], place: Place { begin, log2_side, u, v }, .. } = *look;
    let mask = (1u32 << log2_side) - 1;
    for k in 0..depth.len() {
        let (d, x) = (depth[k], k as u32 as f32);
        let (texel, within) = texel(u.at(x, d), v.at(x, d), begin, mask, log2_side);
        let bright = mixed(atlas[texel as usize % N_ATLAS], within) * PER_TEXEL;
        colors[k] = packed([r.at(x, d), g.at(x, d), b.at(x, d)], bright);
    }
}

#[inline(always)]
fn color_ground(
    colors: &mut [u32],
    depth: &[f32],
    look: &Look,
    atlas: &Atlas,
    quads: &[u32; N_GROUND],
    [ground_x, ground_z]: [Line; 2],
) {
    let Look { channels: [r, g, b], place: Place { begin, log2_side, u, v }, .. } = *look;
    let mask = (1u32 << log2_side) - 1;
    for k in 0..depth.len() {
        let (d, x) = (depth[k], k as u32 as f32);
        let (texel, within) = texel(u.at(x, d), v.at(x, d), begin, mask, log2_side);
        let bright = mixed(atlas[texel as usize % N_ATLAS], within) * PER_TEXEL;
        let (cell, within) = cell(ground_x.at(x, d), ground_z.at(x, d));
        let shade = mixed(quads[(cell as usize).min(N_GROUND - 1)], within) * PER_CELL;
        colors[k] = packed([r.at(x, d), g.at(x, d), b.at(x, d)], bright * shade);
    }
}

/// From what [`mixed`] gives of the ground's cells to a factor.
const PER_CELL: f32 = 1.0 / (255.0 * 65536.0);

/// From what [`mixed`] gives of texels to a factor.
const PER_TEXEL: f32 = 1.0 / (128.0 * 65536.0);

/// The texel of a place on a texture, and how far right (low 16 bits) and down of it that is.
#[inline(always)]
fn texel(u: u32, v: u32, begin: u32, mask: u32, log2_side: u32) -> (u32, u32) {
    let texel = begin + ((v >> 8 & mask) << log2_side) + (u >> 8 & mask);
    (texel, u & 0xff | (v & 0xff) << 16)
}

/// The cell of a place on the ground's grid, and how far within.
#[inline(always)]
fn cell(x: u32, z: u32) -> (u32, u32) {
    const MOST: i32 = 256 * (MAX_CELLS as i32 - 1);
    let (x, z) = ((x as i32).clamp(0, MOST) as u32, (z as i32).clamp(0, MOST) as u32);
    ((z >> 8) * MAX_CELLS as u32 + (x >> 8), x & 0xff | (z & 0xff) << 16)
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

/// Three channels, each times `bright`, without their fractions; more than 255 is 255.
#[inline(always)]
fn packed([r, g, b]: [f32; 3], bright: f32) -> u32 {
    whole(r * bright) | whole(g * bright) << 8 | whole(b * bright) << 16
}

#[inline(always)]
fn whole(x: f32) -> u32 {
    // 2^23 added, a number has its whole part in the lowest bits.
    (least(x, 255.0) + 8_388_608.0).to_bits() & 0xff
}
