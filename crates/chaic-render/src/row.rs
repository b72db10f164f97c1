//! The pixels of one row of the image, a list for each quantity.
//!
//! Runs are filled in whole [`LANES`], from left to right: the last ones may lie beyond a run's end,
//! where the next run writes them again.

use glam::Vec4;

use crate::lens::seen_depth_m;
use crate::light::{MAX_CELLS, N_GROUND};
use crate::paint::RowPlane;
use crate::patches::{Patch, Patches};
use crate::points::Points;
use crate::raster::{Blocks, LANES, Wide};
use crate::texture::{Atlas, N_ATLAS, PLAIN};

/// Most pixels between two knots of light.
pub(crate) const STEP: usize = 64;

/// The cell of what isn't ground.
const NO_CELL: u32 = N_GROUND as u32 - 1;

/// The pixels of one row; each array has at least [`LANES`] more than the row.
#[derive(Default)]
pub(crate) struct Row {
    /// Depth, metres; 1 in a plan view (see [`crate::paint::Plane`]).
    depth: Vec<f32>,
    /// What is shown but for textures, 0 to 255.
    r: Vec<f32>,
    g: Vec<f32>,
    b: Vec<f32>,
    /// The sky's, once it has been asked for.
    sky: [Vec<f32>; 3],
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

impl Row {
    pub fn resize(&mut self, width: usize) {
        let n = width.div_ceil(LANES) * LANES + LANES;
        let Row { depth, r, g, b, sky, texel, within, cell, within_cell, packed } = self;
        for array in [depth, r, g, b].into_iter().chain(sky) {
            array.resize(n, 1.0);
        }
        for array in [texel, within, cell, within_cell, packed] {
            array.resize(n, 0);
        }
    }

    /// Depth in a pixel, as [`crate::paint::Plane`] wants it.
    #[inline(always)]
    pub fn depth_at(&self, k: usize) -> f32 {
        self.depth[k]
    }

    /// Depths of nearnesses, as [`crate::paint::Plane`] wants them and as eyes see them.
    #[inline(always)]
    pub fn find_depths(
        &mut self,
        nearness: Blocks<Wide<f32>>,
        is_plan: bool,
        seen: Option<&mut [f32]>,
    ) {
        if is_plan {
            self.depth.fill(1.0);
            return;
        }
        for (depth, nearness) in
            self.depth.as_chunks_mut::<LANES>().0.iter_mut().zip(nearness.iter())
        {
            for k in 0..LANES {
                depth[k] = 1.0 / nearness[k];
            }
        }
        if let Some(seen) = seen {
            for (seen, depth_m) in seen.iter_mut().zip(&self.depth) {
                *seen = seen_depth_m(*depth_m);
            }
        }
    }

    /// Writes three bytes for each pixel.
    #[inline(always)]
    pub fn write(&self, out: &mut [u8]) {
        for (pixel, color) in out.chunks_exact_mut(3).zip(&self.packed) {
            let [r, g, b, _] = color.to_le_bytes();
            pixel.copy_from_slice(&[r, g, b]);
        }
    }

    /// Mixes textures into colors. Plain loops over a whole number of steps, so that no pixel is
    /// left for a slower one.
    #[inline(always)]
    pub fn pack(&mut self, atlas: &Atlas, ground: Option<&[u32; N_GROUND]>) {
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

/// Filling runs `begin..end` of a row.
impl Row {
    #[inline(always)]
    pub fn fill_color(&mut self, begin: usize, end: usize, color: Vec4) {
        self.r[begin..end].fill(color.x);
        self.g[begin..end].fill(color.y);
        self.b[begin..end].fill(color.z);
    }

    /// Colors from knots of light, every [`STEP`] pixels and in the last one.
    #[inline(always)]
    pub fn light(&mut self, begin: usize, end: usize, knot: usize, points: &Points) {
        let mut here = points.shown(knot);
        for (k, from) in (begin..end).step_by(STEP).enumerate() {
            let is_last = end - from <= STEP;
            let next = if is_last { end - 1 } else { from + STEP };
            let there = if next > from { points.shown(knot + k + 1) } else { here };
            let step = (there - here) * (1.0 / (next - from).max(1) as f32);
            let lanes = lanes(from, if is_last { end } else { next });
            let channels = [&mut self.r, &mut self.g, &mut self.b];
            ramp(channels.map(|c| &mut c[lanes.clone()]), here, step);
            here = there;
        }
    }

    /// Works out the sky along the row from its color in some pixels.
    #[inline(always)]
    pub fn find_sky(&mut self, color: impl Fn(usize) -> Vec4) {
        let n = self.sky[0].len();
        let mut here = color(0);
        for from in (0..n).step_by(STEP) {
            let there = color(from + STEP);
            let step = (there - here) * (1.0 / STEP as f32);
            let lanes = from..n.min(from + STEP);
            ramp(self.sky.each_mut().map(|c| &mut c[lanes.clone()]), here, step);
            here = there;
        }
    }

    /// The sky.
    #[inline(always)]
    pub fn fill_sky(&mut self, begin: usize, end: usize) {
        for (channel, sky) in [&mut self.r, &mut self.g, &mut self.b].into_iter().zip(&self.sky) {
            channel[begin..end].copy_from_slice(&sky[begin..end]);
        }
        self.leave_plain(begin, end);
    }

    /// No texture.
    #[inline(always)]
    pub fn leave_plain(&mut self, begin: usize, end: usize) {
        self.texel[begin..end].fill(PLAIN);
    }

    /// Not on the ground.
    #[inline(always)]
    pub fn leave_ground(&mut self, begin: usize, end: usize) {
        self.cell[begin..end].fill(NO_CELL);
    }

    /// Colors from a plane, within bounds.
    #[inline(always)]
    pub fn color(&mut self, begin: usize, end: usize, plane: &RowPlane, low: Vec4, high: Vec4) {
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

    /// Texels, piece by piece.
    #[inline(always)]
    pub fn texture(&mut self, begin: usize, end: usize, patch: usize, patches: &Patches) {
        for (k, first) in (begin..end).step_by(STEP).enumerate() {
            let lanes = lanes(first, end.min(first + STEP));
            let Patch { begin, log2_side, u, v } = patches.get(patch + k);
            let mask = (1u32 << log2_side) - 1;
            let depth = &self.depth[lanes.clone()];
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
    pub fn cells(&mut self, begin: usize, end: usize, plane: &RowPlane) {
        const MOST: i32 = 256 * (MAX_CELLS as i32 - 1);
        let lanes = lanes(begin, end);
        let plane = plane.from(begin);
        let (base, at, du) = (plane.base * 256.0, plane.at * 256.0, plane.du * 256.0);
        let [x, z] = [0, 1].map(|c| Line { base: base[c] - 128.0, at: at[c], du: du[c] });
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

/// Colors that grow by a step from pixel to pixel.
#[inline(always)]
fn ramp(channels: [&mut [f32]; 3], start: Vec4, step: Vec4) {
    let (starts, steps) = (start.to_array(), step.to_array());
    for ((channel, start), step) in channels.into_iter().zip(starts).zip(steps) {
        for (k, x) in channel.iter_mut().enumerate() {
            *x = start + step * k as u32 as f32;
        }
    }
}

/// 1.5 * 2^23: a number below 2^22 added to it is rounded, and the sum's low bits hold it.
pub(crate) const WHOLE: f32 = 12_582_912.0;

/// A coordinate along a row, in whole numbers: `base + depth * (at + k * du)` in its k-th pixel.
#[derive(Clone, Copy)]
pub(crate) struct Line {
    pub base: f32,
    pub at: f32,
    pub du: f32,
}

impl Line {
    /// In the k-th pixel, at a depth.
    #[inline(always)]
    pub fn at(&self, k: usize, depth: f32) -> u32 {
        /// Farther off is no sane picture.
        const FAR: f32 = 2e6;
        let x = self.base + depth * (self.at + self.du * k as u32 as f32);
        let x = if x < FAR { x } else { FAR };
        let x = if x > -FAR { x } else { -FAR };
        (x + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits())
    }
}
