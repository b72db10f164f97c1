//! The pixels of one row of the image, a list for each quantity.
//!
//! Segments are filled in whole [`LANES`], from left to right: the last ones may lie beyond a
//! segment's end, where the next one writes them again.

use glam::Vec4;

use crate::ground::{MAX_CELLS, N_GROUND};
use crate::lens::{reciprocal, seen_depth_m};
use crate::planes::RowPlane;
use crate::raster::{Blocks, LANES, Wide};
use crate::segments::{Line, Place};
use crate::setup::{WHOLES, least, most};
use crate::texture::{Atlas, N_ATLAS};

/// The row; each list has at least [`LANES`] more than it has pixels.
#[derive(Default)]
pub(crate) struct Row {
    /// Depth, metres; 1 in a plan view (see [`crate::planes::Plane`]).
    depth: Vec<f32>,
    ids: Vec<u16>,
    /// By what textures and shadows multiply the color.
    bright: Vec<f32>,
    /// Red in the lowest byte, then green and blue.
    colors: Vec<u32>,
}

/// How a channel goes along a segment but for textures, 0 to 255.
#[derive(Clone, Copy)]
pub(crate) enum Hue {
    /// Within bounds, `base + depth * (at + k * du)` in the k-th pixel.
    Linear { plane: RowPlane, low: Vec4, high: Vec4 },
    /// By so much more from pixel to pixel.
    Ramp { start: Vec4, step: Vec4 },
}

/// What a segment looks like.
#[derive(Clone, Copy)]
pub(crate) struct SegmentStyle {
    pub id: u16,
    pub hue: Hue,
    pub place: Place,
}

/// The ground's brightness, and how a segment goes over its grid.
#[derive(Clone, Copy)]
pub(crate) struct OnGround<'a> {
    pub quads: &'a [u32; N_GROUND],
    pub x: Line,
    pub z: Line,
}

impl<'a> OnGround<'a> {
    /// Over the ground along a plane of places on its grid.
    #[inline(always)]
    pub fn along(quads: &'a [u32; N_GROUND], plane: &RowPlane) -> OnGround<'a> {
        let RowPlane { base, at, du } = *plane;
        // In parts of 256 of a cell, half a cell less.
        let line = |base: f32, at: f32, du: f32| Line {
            base: 256.0 * base - 128.0,
            at: 256.0 * at,
            du: 256.0 * du,
        };
        OnGround { quads, x: line(base.x, at.x, du.x), z: line(base.y, at.y, du.y) }
    }
}

impl Row {
    pub fn resize(&mut self, width: usize) {
        let n = width.div_ceil(LANES) * LANES + LANES;
        self.depth.resize(n, 1.0);
        self.bright.resize(n, 1.0);
        self.ids.resize(n, 0);
        self.colors.resize(n, 0);
    }

    /// Depth in a pixel, as [`crate::planes::Plane`] wants it.
    #[inline(always)]
    pub fn depth_at(&self, k: usize) -> f32 {
        self.depth[k]
    }

    /// Depths of inverse depths, as [`crate::planes::Plane`] wants them.
    #[inline(always)]
    pub fn find_depths(&mut self, inverse_depth: Blocks<Wide<f32>>, is_plan: bool) {
        if is_plan {
            self.depth.fill(1.0);
            return;
        }
        for (depth, inverse_depth) in
            self.depth.as_chunks_mut::<LANES>().0.iter_mut().zip(inverse_depth.iter())
        {
            for k in 0..LANES {
                depth[k] = reciprocal(inverse_depth[k]);
            }
        }
    }

    /// Fills the pixels `begin..end`.
    #[inline(always)]
    pub fn fill(
        &mut self,
        (begin, end): (usize, usize),
        style: &SegmentStyle,
        atlas: &Atlas,
        ground: Option<OnGround>,
    ) {
        let lanes = begin..begin + (end - begin).div_ceil(LANES) * LANES;
        let Row { depth, ids, bright, colors, .. } = self;
        let depth = &depth[lanes.clone()];
        let (bright, colors) = (&mut bright[lanes.clone()], &mut colors[lanes.clone()]);
        ids[lanes].fill(style.id);
        texture(bright, depth, &style.place, atlas);
        if let Some(OnGround { quads, x, z }) = ground {
            darken(bright, depth, quads, [x, z]);
        }
        match &style.hue {
            Hue::Linear { plane, low, high } => linear(colors, bright, depth, plane, *low, *high),
            Hue::Ramp { start, step } => ramp(colors, bright, *start, *step),
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

// Loops over the pixels of a segment. Each has few numbers that stay the same, so that they stay in
// registers. Lists are arguments of their own, by which the compiler knows that they don't overlap.

/// The brightness of a texture.
#[inline(always)]
fn texture(bright: &mut [f32], depth: &[f32], place: &Place, atlas: &Atlas) {
    let Place { begin, log2_side, u, v } = *place;
    let mask = (1u32 << log2_side) - 1;
    for k in 0..depth.len() {
        let (d, x) = (depth[k], k as u32 as f32);
        let (u, v) = (u.at(x, d), v.at(x, d));
        let texel = begin + ((v >> 8 & mask) << log2_side) + (u >> 8 & mask);
        let within = u & 0xff | (v & 0xff) << 16;
        bright[k] = mixed(atlas[texel as usize % N_ATLAS], within) * PER_TEXEL;
    }
}

/// Makes what stands on the ground's dark cells darker.
#[inline(always)]
fn darken(bright: &mut [f32], depth: &[f32], quads: &[u32; N_GROUND], [x, z]: [Line; 2]) {
    const MOST: i32 = 256 * (MAX_CELLS as i32 - 1);
    for k in 0..depth.len() {
        let (d, at) = (depth[k], k as u32 as f32);
        let x = (x.at(at, d) as i32).clamp(0, MOST) as u32;
        let z = (z.at(at, d) as i32).clamp(0, MOST) as u32;
        let cell = (z >> 8) * MAX_CELLS as u32 + (x >> 8);
        let within = x & 0xff | (z & 0xff) << 16;
        bright[k] *= mixed(quads[(cell as usize).min(N_GROUND - 1)], within) * PER_CELL;
    }
}

/// [`Hue::Linear`].
#[inline(always)]
fn linear(
    colors: &mut [u32],
    bright: &[f32],
    depth: &[f32],
    plane: &RowPlane,
    low: Vec4,
    high: Vec4,
) {
    let RowPlane { base, at, du } = *plane;
    for k in 0..depth.len().min(bright.len()) {
        let (d, x) = (depth[k], k as u32 as f32);
        let r = least(most(base.x + d * (at.x + du.x * x), low.x), high.x);
        let g = least(most(base.y + d * (at.y + du.y * x), low.y), high.y);
        let b = least(most(base.z + d * (at.z + du.z * x), low.z), high.z);
        colors[k] = packed([r, g, b], bright[k]);
    }
}

/// [`Hue::Ramp`].
#[inline(always)]
fn ramp(colors: &mut [u32], bright: &[f32], start: Vec4, step: Vec4) {
    for k in 0..bright.len() {
        let x = k as u32 as f32;
        let channels = [start.x + step.x * x, start.y + step.y * x, start.z + step.z * x];
        colors[k] = packed(channels, bright[k]);
    }
}

/// From what [`mixed`] gives of the ground's cells to a factor.
const PER_CELL: f32 = 1.0 / (255.0 * 65536.0);

/// From what [`mixed`] gives of texels to a factor.
const PER_TEXEL: f32 = 1.0 / (128.0 * 65536.0);

/// Mixes the four bytes of a quad by how far right (low 16 bits) and down the point is; 65,536
/// times their mean.
#[inline(always)]
fn mixed(quad: u32, within: u32) -> f32 {
    let (right, down) = (within & 0xffff, within >> 16);
    // Two bytes at once: what one half borrows from the other for a moment, it gives back.
    let (left_bytes, right_bytes) = (quad & 0x00ff_00ff, quad >> 8 & 0x00ff_00ff);
    let step = right_bytes.wrapping_sub(left_bytes).wrapping_mul(right);
    let rows = (left_bytes << 8).wrapping_add(step);
    let (above, below) = (rows & 0xffff, rows >> 16);
    let step = below.wrapping_sub(above).wrapping_mul(down);
    (above << 8).wrapping_add(step) as i32 as f32
}

/// Three channels, each times `bright` and rounded; more than 255 is 255.
#[inline(always)]
fn packed([r, g, b]: [f32; 3], bright: f32) -> u32 {
    whole(r * bright) | whole(g * bright) << 8 | whole(b * bright) << 16
}

#[inline(always)]
fn whole(x: f32) -> u32 {
    (least(x, 255.0) + WHOLES).to_bits() & 0xff
}
