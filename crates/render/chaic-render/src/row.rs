//! Pixels of one row of the image, as a structure of arrays.
//!
//! Segments are filled in whole blocks of [`LANES`] pixels, from left to right. The last pixels may
//! lie past the end of a segment, where the next segment overwrites them.

use glam::Vec4;

use crate::ground::{MAX_CELLS, N_GROUND};
use crate::planes::RowPlane;
use crate::projection::{clamp_depth_m, reciprocal};
use crate::raster::{Block32, Blocks, LANES};
use crate::segments::{TexelLine, TexturePlacement};
use crate::setup::{TWO_POW_23, fmax, fmin};
use crate::texture::{Atlas, N_ATLAS, Tile};

/// A row of pixels; each array has at least [`LANES`] elements more than the row has pixels.
#[derive(Default)]
pub(crate) struct Row {
    /// Depth, meters; 1 in a plan view (see [`crate::planes::Plane`]).
    depth: Vec<f32>,
    ids: Vec<u16>,
    /// Factor on the color from textures and shadows.
    brightness: Vec<f32>,
    /// Packed color: red in the lowest byte, then green and blue.
    colors: Vec<u32>,
}

/// Display color along a segment before textures, 0 to 255.
#[derive(Clone, Copy)]
pub(crate) enum SegmentColor {
    /// Clamped to bounds; `base + depth * (at + k * du)` at pixel k.
    Linear { plane: RowPlane, low: Vec4, high: Vec4 },
    /// Linear ramp: `start + k * step` at pixel k.
    Ramp { start: Vec4, step: Vec4 },
}

/// Appearance of a segment.
#[derive(Clone, Copy)]
pub(crate) struct SegmentStyle {
    pub id: u16,
    pub color: SegmentColor,
    pub placement: TexturePlacement,
}

/// Brightness of the ground, and the grid coordinates of a segment on it.
#[derive(Clone, Copy)]
pub(crate) struct GroundShadow<'a> {
    pub quads: &'a [u32; N_GROUND],
    pub x: TexelLine,
    pub z: TexelLine,
}

impl<'a> GroundShadow<'a> {
    /// Ground shadow along a plane of grid coordinates.
    #[inline(always)]
    pub fn from_plane(quads: &'a [u32; N_GROUND], plane: &RowPlane) -> GroundShadow<'a> {
        let RowPlane { base, at, du } = *plane;
        // In 1/256 of a cell, minus half a cell.
        let line = |base: f32, at: f32, du: f32| TexelLine {
            base: 256.0 * base - 128.0,
            at: 256.0 * at,
            du: 256.0 * du,
        };
        GroundShadow { quads, x: line(base.x, at.x, du.x), z: line(base.y, at.y, du.y) }
    }
}

impl Row {
    pub fn resize(&mut self, width: usize) {
        let n = width.div_ceil(LANES) * LANES + LANES;
        self.depth.resize(n, 1.0);
        self.brightness.resize(n, 1.0);
        self.ids.resize(n, 0);
        self.colors.resize(n, 0);
    }

    /// Returns the depth of a pixel, in the convention of [`crate::planes::Plane`].
    #[inline(always)]
    pub fn depth_at(&self, k: usize) -> f32 {
        self.depth[k]
    }

    /// Computes depths from inverse depths, in the convention of [`crate::planes::Plane`].
    #[inline(always)]
    pub fn find_depths(&mut self, inverse_depth: Blocks<Block32<f32>>, is_plan: bool) {
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
        begin: usize,
        end: usize,
        style: &SegmentStyle,
        atlas: &Atlas,
        ground: Option<GroundShadow>,
    ) {
        let lanes = begin..begin + (end - begin).div_ceil(LANES) * LANES;
        let Row { depth, ids, brightness, colors, .. } = self;
        let depth = &depth[lanes.clone()];
        let (brightness, colors) = (&mut brightness[lanes.clone()], &mut colors[lanes.clone()]);
        ids[lanes].fill(style.id);
        if Tile::is_plain(style.placement.begin) {
            brightness.fill(1.0);
        } else {
            sample_texture(brightness, depth, &style.placement, atlas);
        }
        if let Some(GroundShadow { quads, x, z }) = ground {
            apply_ground_shadow(brightness, depth, quads, [x, z]);
        }
        match &style.color {
            SegmentColor::Linear { plane, low, high } => {
                fill_linear(colors, brightness, depth, plane, *low, *high)
            }
            SegmentColor::Ramp { start, step } => fill_ramp(colors, brightness, *start, *step),
        }
    }

    /// Writes three bytes of color per pixel, and depth and ids if requested.
    #[inline(always)]
    pub fn write(&self, rgb: &mut [u8], depth_m: Option<&mut [f32]>, ids: Option<&mut [u16]>) {
        let (blocks, remainder) = rgb.as_chunks_mut::<12>();
        let colors = self.colors.as_chunks::<4>().0;
        for (out, [a, b, c, d]) in blocks.iter_mut().zip(colors) {
            let words = [a | b << 24, b >> 8 | c << 16, c >> 16 | d << 8].map(u32::to_le_bytes);
            out.copy_from_slice(words.as_flattened());
        }
        let remaining_colors = &self.colors[4 * blocks.len()..];
        for (pixel, color) in remainder.chunks_exact_mut(3).zip(remaining_colors) {
            pixel.copy_from_slice(&color.to_le_bytes()[..3]);
        }
        if let Some(out) = depth_m {
            for (out, depth_m) in out.iter_mut().zip(&self.depth) {
                *out = clamp_depth_m(*depth_m);
            }
        }
        if let Some(out) = ids {
            out.copy_from_slice(&self.ids[..out.len()]);
        }
    }
}

// Loops over the pixels of a segment. Each has few constants, so that they stay in registers.
// Arrays are separate arguments, so that the compiler knows that they do not overlap.

/// Samples the brightness of a texture.
#[inline(always)]
fn sample_texture(
    brightness: &mut [f32],
    depth: &[f32],
    placement: &TexturePlacement,
    atlas: &Atlas,
) {
    let TexturePlacement { begin, log2_side, u, v } = *placement;
    let mask = (1u32 << log2_side) - 1;
    for k in 0..depth.len() {
        let (d, x) = (depth[k], k as u32 as f32);
        let (u, v) = (u.at(x, d), v.at(x, d));
        let texel = begin + ((v >> 8 & mask) << log2_side) + (u >> 8 & mask);
        let within = u & 0xff | (v & 0xff) << 16;
        brightness[k] = bilinear(atlas[texel as usize % N_ATLAS], within) * PER_TEXEL;
    }
}

/// Multiplies by the brightness of the ground.
#[inline(always)]
fn apply_ground_shadow(
    brightness: &mut [f32],
    depth: &[f32],
    quads: &[u32; N_GROUND],
    [x, z]: [TexelLine; 2],
) {
    const MAX: i32 = 256 * (MAX_CELLS as i32 - 1);
    for k in 0..depth.len() {
        let (d, at) = (depth[k], k as u32 as f32);
        let x = (x.at(at, d) as i32).clamp(0, MAX) as u32;
        let z = (z.at(at, d) as i32).clamp(0, MAX) as u32;
        let cell = (z >> 8) * MAX_CELLS as u32 + (x >> 8);
        let within = x & 0xff | (z & 0xff) << 16;
        brightness[k] *= bilinear(quads[(cell as usize).min(N_GROUND - 1)], within) * PER_CELL;
    }
}

/// Fills colors from [`SegmentColor::Linear`].
#[inline(always)]
fn fill_linear(
    colors: &mut [u32],
    brightness: &[f32],
    depth: &[f32],
    plane: &RowPlane,
    low: Vec4,
    high: Vec4,
) {
    let RowPlane { base, at, du } = *plane;
    for k in 0..depth.len().min(brightness.len()) {
        let (d, x) = (depth[k], k as u32 as f32);
        let r = fmin(fmax(base.x + d * (at.x + du.x * x), low.x), high.x);
        let g = fmin(fmax(base.y + d * (at.y + du.y * x), low.y), high.y);
        let b = fmin(fmax(base.z + d * (at.z + du.z * x), low.z), high.z);
        colors[k] = pack_rgb([r, g, b], brightness[k]);
    }
}

/// Fills colors from [`SegmentColor::Ramp`].
#[inline(always)]
fn fill_ramp(colors: &mut [u32], brightness: &[f32], start: Vec4, step: Vec4) {
    for k in 0..brightness.len() {
        let x = k as u32 as f32;
        let channels = [start.x + step.x * x, start.y + step.y * x, start.z + step.z * x];
        colors[k] = pack_rgb(channels, brightness[k]);
    }
}

/// Scale from [`bilinear`] of ground cells to a factor.
const PER_CELL: f32 = 1.0 / (255.0 * 65536.0);

/// Scale from [`bilinear`] of texels to a factor.
const PER_TEXEL: f32 = 1.0 / (128.0 * 65536.0);

/// Interpolates the four bytes of a quad bilinearly at the offset to the right (low 16 bits) and
/// down; the result is multiplied by 65,536.
#[inline(always)]
fn bilinear(quad: u32, within: u32) -> f32 {
    let (right, down) = (within & 0xffff, within >> 16);
    // Two bytes at once: a borrow of the lower half from the upper half cancels out.
    let (left_bytes, right_bytes) = (quad & 0x00ff_00ff, quad >> 8 & 0x00ff_00ff);
    let step = right_bytes.wrapping_sub(left_bytes).wrapping_mul(right);
    let rows = (left_bytes << 8).wrapping_add(step);
    let (above, below) = (rows & 0xffff, rows >> 16);
    let step = below.wrapping_sub(above).wrapping_mul(down);
    (above << 8).wrapping_add(step) as i32 as f32
}

/// Packs three channels, each multiplied by `brightness`, rounded and clamped to 255.
#[inline(always)]
fn pack_rgb([r, g, b]: [f32; 3], brightness: f32) -> u32 {
    round_to_u8(r * brightness)
        | round_to_u8(g * brightness) << 8
        | round_to_u8(b * brightness) << 16
}

#[inline(always)]
fn round_to_u8(x: f32) -> u32 {
    (fmin(x, 255.0) + TWO_POW_23).to_bits() & 0xff
}
