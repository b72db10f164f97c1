//! Color of pixels whose surface is known, one row of the image at a time.
//!
//! A row is an array per quantity, and each step is a plain loop over such arrays, so that the
//! compiler computes several pixels at once: the order of operations for a pixel stays the same.

use chaic_protocol::Vec3;

use crate::frame::Frame;
use crate::lens::Lens;
use crate::mesh::Gloss;
use crate::raster::{NOBODY, Target, owner_parts};
use crate::surface::Surface;
use crate::texture::{SRGB, srgb_from_linear};

const SUN: Vec3 = Vec3::new(0.42, 0.80, 0.43);
const SUN_COLOR: Vec3 = Vec3::new(0.92, 0.86, 0.74);
const LAMP_COLOR: Vec3 = Vec3::new(0.66, 0.62, 0.55);
/// Light from above and from below, out of doors.
const OUTDOORS: [Vec3; 2] = [Vec3::new(0.36, 0.41, 0.48), Vec3::new(0.24, 0.23, 0.20)];
/// The same in a room. Ceilings get more: all that is below them shines up.
const INDOORS: [Vec3; 2] = [Vec3::new(0.40, 0.40, 0.40), Vec3::new(0.34, 0.32, 0.30)];

/// The pixels of one row; every array has one number per pixel.
#[derive(Default)]
pub(crate) struct Row {
    /// Depth, metres.
    pub depth: Vec<f32>,
    /// The point seen, in the world, metres.
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    pub z: Vec<f32>,
    /// Its unit normal.
    pub nx: Vec<f32>,
    pub ny: Vec<f32>,
    pub nz: Vec<f32>,
    /// Side of the patch that the pixel covers, metres.
    pub covers_m: Vec<f32>,
    /// First the surface's color, then the light that comes from it, linear.
    pub r: Vec<f32>,
    pub g: Vec<f32>,
    pub b: Vec<f32>,
    /// Factor for what is hidden from light; 2 on ceilings, which see the whole lit room.
    pub shade: Vec<f32>,
    /// First the lamp, in the world, metres; then the unit vector to the light.
    pub lx: Vec<f32>,
    pub ly: Vec<f32>,
    pub lz: Vec<f32>,
    /// 1 if a lamp shines, 0 if the sun does.
    pub indoors: Vec<f32>,
    /// Strength of the direct light.
    pub direct: Vec<f32>,
    runs: Vec<(usize, usize, u32)>,
}

impl Row {
    #[inline]
    pub fn point(&self, k: usize) -> Vec3 {
        Vec3::new(self.x[k], self.y[k], self.z[k])
    }

    fn resize(&mut self, n: usize) {
        for array in [
            &mut self.depth,
            &mut self.x,
            &mut self.y,
            &mut self.z,
            &mut self.nx,
            &mut self.ny,
            &mut self.nz,
            &mut self.covers_m,
            &mut self.r,
            &mut self.g,
            &mut self.b,
            &mut self.shade,
            &mut self.lx,
            &mut self.ly,
            &mut self.lz,
            &mut self.indoors,
            &mut self.direct,
        ] {
            array.clear();
            array.resize(n, 0.0);
        }
    }
}

/// What the pixels of one row look along: pixel k along `left + k * step`, per metre of depth (in
/// a plan view: offset by it, all straight down).
#[derive(Clone, Copy)]
struct Rays {
    left: Vec3,
    step: Vec3,
}

/// Writes RGB, u8, shape [height, width, 3].
pub(crate) fn shade(
    frame: &Frame,
    lens: &Lens,
    levels: &[u8],
    target: &Target<u32>,
    row: &mut Row,
    rgb: &mut Vec<u8>,
) {
    rgb.clear();
    rgb.resize(lens.width * lens.height * 3, 0);
    if lens.width == 0 {
        return;
    }
    row.resize(lens.width);
    let table: &[u8; 4096] = &SRGB;
    let (mu, mv) = lens.middle();
    let per_px = 1.0 / lens.focal;
    for (j, out) in rgb.chunks_exact_mut(3 * lens.width).enumerate() {
        let line = j * lens.width..(j + 1) * lens.width;
        let y = -(j as f32 + 0.5 - mv) * per_px;
        let mut left = lens.up * y + lens.right * ((0.5 - mu) * per_px);
        if !lens.is_plan {
            left += lens.ahead;
        }
        let rays = Rays { left, step: lens.right * per_px };
        find_points(lens, &rays, &target.nearness[line.clone()], row);
        find_runs(&target.owner[line], &mut row.runs);
        let runs = std::mem::take(&mut row.runs);
        let surface = |owner: u32| {
            let (index, triangle) = owner_parts(owner);
            let instance = &frame.instances[index];
            Surface::of(instance, instance.shape.mesh(usize::from(levels[index])), triangle)
        };
        let mut any_surface = false;
        for (from, to, owner) in runs.iter().copied().filter(|r| r.2 != NOBODY) {
            any_surface = true;
            let surface = surface(owner);
            surface.normals(row, from, to);
            find_covers(lens, &rays, row, from, to);
            surface.paint(frame, row, from, to, lens.is_plan);
        }
        if any_surface {
            light(row);
        }
        for (from, to, owner) in runs.iter().copied() {
            if owner == NOBODY {
                sky(lens, &rays, row, from, to);
            } else {
                gloss(surface_gloss(frame, levels, owner), lens, row, from, to);
            }
        }
        row.runs = runs;
        let colors = row.r.iter().zip(&row.g).zip(&row.b);
        for (pixel, ((r, g), b)) in out.chunks_exact_mut(3).zip(colors) {
            pixel[0] = srgb_from_linear(table, *r);
            pixel[1] = srgb_from_linear(table, *g);
            pixel[2] = srgb_from_linear(table, *b);
        }
    }
}

fn surface_gloss(frame: &Frame, levels: &[u8], owner: u32) -> Gloss {
    let (index, triangle) = owner_parts(owner);
    let mesh = frame.instances[index].shape.mesh(usize::from(levels[index]));
    mesh.skins[usize::from(mesh.triangles[triangle].skin)].gloss
}

/// Neighboring pixels of one owner: first, one past the last, owner.
fn find_runs(owners: &[u32], runs: &mut Vec<(usize, usize, u32)>) {
    runs.clear();
    let mut begin = 0;
    for k in 1..=owners.len() {
        if k == owners.len() || owners[k] != owners[begin] {
            runs.push((begin, k, owners[begin]));
            begin = k;
        }
    }
}

fn find_points(lens: &Lens, rays: &Rays, nearness: &[f32], row: &mut Row) {
    let n = nearness.len();
    let (eye, ahead, Rays { left, step }) = (lens.eye, lens.ahead, *rays);
    let depth = &mut row.depth[..n];
    for (d, q) in depth.iter_mut().zip(nearness) {
        *d = lens.depth(*q);
    }
    let (x, y, z) = (&mut row.x[..n], &mut row.y[..n], &mut row.z[..n]);
    if lens.is_plan {
        for k in 0..n {
            let t = k as f32;
            x[k] = eye.x + left.x + step.x * t + ahead.x * depth[k];
            y[k] = eye.y + left.y + step.y * t + ahead.y * depth[k];
            z[k] = eye.z + left.z + step.z * t + ahead.z * depth[k];
        }
        return;
    }
    for k in 0..n {
        let t = k as f32;
        x[k] = eye.x + (left.x + step.x * t) * depth[k];
        y[k] = eye.y + (left.y + step.y * t) * depth[k];
        z[k] = eye.z + (left.z + step.z * t) * depth[k];
    }
}

/// How much each pixel covers. Seen at a slant it covers more; the root keeps textures from
/// blurring too early.
fn find_covers(lens: &Lens, rays: &Rays, row: &mut Row, from: usize, to: usize) {
    let per_px = 1.0 / lens.focal;
    if lens.is_plan {
        row.covers_m[from..to].fill(per_px);
        return;
    }
    let n = to - from;
    let Rays { left, step } = *rays;
    let covers = &mut row.covers_m[from..to];
    let depth = &row.depth[from..to];
    let (nx, ny, nz) = (&row.nx[from..to], &row.ny[from..to], &row.nz[from..to]);
    for k in 0..n {
        let t = (from + k) as f32;
        let slant = (nx[k] * (left.x + step.x * t)
            + ny[k] * (left.y + step.y * t)
            + nz[k] * (left.z + step.z * t))
            .abs();
        covers[k] = depth[k] * per_px / most(slant, 0.05).sqrt();
    }
}

#[inline]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline]
fn pick(yes: bool, a: f32, b: f32) -> f32 {
    if yes { a } else { b }
}

/// Turns colors of surfaces into light.
fn light(row: &mut Row) {
    let n = row.depth.len();
    let (x, y, z) = (&row.x[..n], &row.y[..n], &row.z[..n]);
    let (nx, ny, nz) = (&row.nx[..n], &row.ny[..n], &row.nz[..n]);
    let (lx, ly, lz) = (&mut row.lx[..n], &mut row.ly[..n], &mut row.lz[..n]);
    let (indoors, direct) = (&row.indoors[..n], &mut row.direct[..n]);
    for k in 0..n {
        let (dx, dy, dz) = (lx[k] - x[k], ly[k] - y[k], lz[k] - z[k]);
        let d2 = dx * dx + dy * dy + dz * dz + 0.3;
        let inverse = 1.0 / d2.sqrt();
        let inside = indoors[k] > 0.5;
        lx[k] = pick(inside, dx * inverse, SUN.x);
        ly[k] = pick(inside, dy * inverse, SUN.y);
        lz[k] = pick(inside, dz * inverse, SUN.z);
        let facing = lx[k] * nx[k] + ly[k] * ny[k] + lz[k] * nz[k];
        let lamp = most(facing + 0.35, 0.0) / (1.0 + 0.085 * d2);
        direct[k] = pick(inside, lamp, most(facing, 0.0));
    }
    let (shade, indoors, direct) = (&row.shade[..n], &row.indoors[..n], &row.direct[..n]);
    for (channel, array) in [&mut row.r, &mut row.g, &mut row.b].into_iter().enumerate() {
        let array = &mut array[..n];
        let (sun, lamp) = (SUN_COLOR[channel], LAMP_COLOR[channel]);
        let [out_high, out_low] = OUTDOORS.map(|c| c[channel]);
        let [in_high, in_low] = INDOORS.map(|c| c[channel]);
        for k in 0..n {
            let inside = indoors[k] > 0.5;
            let up = 0.5 * ny[k] + 0.5;
            let around =
                pick(inside, in_low + (in_high - in_low) * up, out_low + (out_high - out_low) * up);
            // Walls at right angles must differ even where no lamp is near, and what faces down
            // sees little but its own shadow (a ceiling sees the whole room).
            let around = around * (1.0 + 0.07 * nx[k] - 0.05 * nz[k]);
            let around = around * pick(ny[k] < -0.5, pick(shade[k] > 1.5, 1.85, 0.7), 1.0);
            array[k] *= (around + pick(inside, lamp, sun) * direct[k])
                * pick(shade[k] < 1.0, shade[k], 1.0);
        }
    }
}

/// Adds highlights and reflections.
fn gloss(gloss: Gloss, lens: &Lens, row: &mut Row, from: usize, to: usize) {
    match gloss {
        Gloss::Dull => {}
        Gloss::Satin => highlight(lens, row, from, to, |s| Shine {
            keep: 1.0,
            light: 0.07 * s.c8,
            sky: 0.02 * s.edge,
        }),
        Gloss::Shiny => highlight(lens, row, from, to, |s| {
            let c32 = s.c8 * s.c8 * s.c8 * s.c8;
            Shine { keep: 1.0, light: 0.45 * c32, sky: 0.07 * s.edge * s.edge }
        }),
        Gloss::Metal => highlight(lens, row, from, to, |s| {
            let keep = 0.62 + 0.75 * s.mirror * s.mirror;
            Shine { keep, light: 0.4 * s.c8 * s.c8, sky: 0.05 * s.edge }
        }),
        Gloss::Glass => highlight(lens, row, from, to, |s| {
            let reflects = 0.10 + 0.6 * s.edge * s.edge;
            Shine { keep: 0.6, light: 0.6 * s.c8 * s.c8, sky: 0.75 * reflects * s.mirror }
        }),
    }
}

/// How a point is seen and lit.
struct Seen {
    /// Cosine between the normal and the half-way vector, to the eighth.
    c8: f32,
    /// 0 looking straight at it, 1 along it.
    edge: f32,
    /// How far up the mirrored view looks: 0 down, 1 up.
    mirror: f32,
}

/// What becomes of a point's light.
struct Shine {
    keep: f32,
    light: f32,
    sky: f32,
}

#[inline]
fn highlight(lens: &Lens, row: &mut Row, from: usize, to: usize, shine: impl Fn(Seen) -> Shine) {
    let n = to - from;
    let (x, y, z) = (&row.x[from..to], &row.y[from..to], &row.z[from..to]);
    let (nx, ny, nz) = (&row.nx[from..to], &row.ny[from..to], &row.nz[from..to]);
    let (lx, ly, lz) = (&row.lx[from..to], &row.ly[from..to], &row.lz[from..to]);
    let (direct, indoors) = (&row.direct[from..to], &row.indoors[from..to]);
    let (r, g, b) = (&mut row.r[from..to], &mut row.g[from..to], &mut row.b[from..to]);
    let (eye, up) = (lens.eye, -lens.ahead);
    let flat = lens.is_plan;
    for k in 0..n {
        let (vx, vy, vz) = (eye.x - x[k], eye.y - y[k], eye.z - z[k]);
        let (vx, vy, vz) = (pick(flat, up.x, vx), pick(flat, up.y, vy), pick(flat, up.z, vz));
        let inverse = 1.0 / most(vx * vx + vy * vy + vz * vz, 1e-12).sqrt();
        let (vx, vy, vz) = (vx * inverse, vy * inverse, vz * inverse);
        let (hx, hy, hz) = (vx + lx[k], vy + ly[k], vz + lz[k]);
        let inverse = 1.0 / most(hx * hx + hy * hy + hz * hz, 1e-12).sqrt();
        let c = most((nx[k] * hx + ny[k] * hy + nz[k] * hz) * inverse, 0.0);
        let (c2, facing) = (c * c, nx[k] * vx + ny[k] * vy + nz[k] * vz);
        let c4 = c2 * c2;
        let away = 1.0 - most(facing, 0.0);
        let mirror = 0.5 + 0.5 * (2.0 * facing * ny[k] - vy);
        let s = shine(Seen { c8: c4 * c4, edge: away * away, mirror: most(mirror, 0.0) });
        let inside = indoors[k] > 0.5;
        let light = s.light * direct[k];
        r[k] = r[k] * s.keep + light * pick(inside, LAMP_COLOR.x, SUN_COLOR.x) + 0.85 * s.sky;
        g[k] = g[k] * s.keep + light * pick(inside, LAMP_COLOR.y, SUN_COLOR.y) + 0.95 * s.sky;
        b[k] = b[k] * s.keep + light * pick(inside, LAMP_COLOR.z, SUN_COLOR.z) + 1.05 * s.sky;
    }
}

fn sky(lens: &Lens, rays: &Rays, row: &mut Row, from: usize, to: usize) {
    if lens.is_plan {
        for array in [&mut row.r, &mut row.g, &mut row.b] {
            array[from..to].fill(0.86);
        }
        return;
    }
    let (horizon, zenith) = (Vec3::new(0.74, 0.82, 0.88), Vec3::new(0.19, 0.40, 0.74));
    let ground = Vec3::new(0.36, 0.38, 0.34);
    let Rays { left, step } = *rays;
    let (r, g, b) = (&mut row.r[from..to], &mut row.g[from..to], &mut row.b[from..to]);
    for k in 0..to - from {
        let t = (from + k) as f32;
        let ray = [left.x + step.x * t, left.y + step.y * t, left.z + step.z * t];
        let l2 = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2];
        let y = ray[1] / most(l2, 1e-12).sqrt();
        let up = (1.0 - y) * (1.0 - y);
        let up = 1.0 - up * (0.4 + 0.6 * up);
        let down = -most(-1.0, y * 6.0);
        let above = y >= 0.0;
        let t = pick(above, up, down);
        r[k] = horizon.x + pick(above, zenith.x - horizon.x, ground.x - horizon.x) * t;
        g[k] = horizon.y + pick(above, zenith.y - horizon.y, ground.y - horizon.y) * t;
        b[k] = horizon.z + pick(above, zenith.z - horizon.z, ground.z - horizon.z) * t;
    }
}
