//! Shading of surface points, many at once: Blinn-Phong.
//!
//! Diffuse light comes from the sun or the room's lamp (Lambert, wrapped a little indoors) and from around
//! (hemisphere ambient); the specular term is a power of the cosine between the normal and the half
//! vector of eye and light; what mirrors shows one even color, more of it at grazing angles (Schlick).
//!
//! Each quantity is a list of its own, and all lists go through one plain loop, which the compiler
//! makes vectors of (see [`crate::shade`]).

use chaic_core::Vec3;
use glam::Vec4;

use crate::light_rig::LightRig;
use crate::mesh::Gloss;
use crate::setup::{least, most};

/// A point of a surface in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// Where it is for the lamp. All points of a thing are in its middle.
    pub at: Vec3,
    /// The lamp that shines on it; else it is the sun.
    pub lamp: Option<Vec3>,
    /// Unit vector.
    pub normal: Vec3,
    /// To the eye, of any length.
    pub to_eye: Vec3,
    /// Linear.
    pub color: Vec3,
    pub gloss: Gloss,
    /// By what its light is multiplied, but for highlights.
    pub tone: f32,
}

/// Points, and what they show.
#[derive(Default)]
pub(crate) struct Points {
    n: usize,
    blocks: Vec<Block>,
}

/// So many points are lit at once.
const LANES: usize = 16;

/// Quantities of points side by side.
type Lane = [f32; LANES];

/// Neighboring points; the lists in a list are coordinates or channels.
#[derive(Clone, Default)]
struct Block {
    at: [Lane; 3],
    lamp: [Lane; 3],
    has_lamp: [u32; LANES],
    normal: [Lane; 3],
    to_eye: [Lane; 3],
    color: [Lane; 3],
    gloss: [u32; LANES],
    tone: Lane,
    shown: [Lane; 3],
}

impl Points {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.n = 0;
    }

    /// Adds a point; gives its number.
    #[inline(always)]
    pub fn push(&mut self, point: &Point) -> usize {
        let (block, k) = (self.n / LANES, self.n % LANES);
        if block >= self.blocks.len() {
            self.blocks.push(Block::default());
        }
        let block = &mut self.blocks[block];
        put(&mut block.at, k, point.at);
        put(&mut block.lamp, k, point.lamp.unwrap_or_default());
        put(&mut block.normal, k, point.normal);
        put(&mut block.to_eye, k, point.to_eye);
        put(&mut block.color, k, point.color);
        block.has_lamp[k] = u32::from(point.lamp.is_some());
        block.gloss[k] = point.gloss as u32;
        block.tone[k] = point.tone;
        self.n += 1;
        self.n - 1
    }

    /// What a point shows, 0 to 255.
    #[inline(always)]
    pub fn shown(&self, point: usize) -> Vec4 {
        let (block, k) = (&self.blocks[point / LANES], point % LANES);
        let [r, g, b] = &block.shown;
        Vec4::new(r[k], g[k], b[k], 0.0)
    }

    /// Works out what all points show.
    #[inline(always)]
    pub fn light(&mut self, rig: &LightRig) {
        let source = [0, 1, 2].map(|c| Source {
            direct: [rig.sun[c], rig.lamp[c]],
            high: [rig.outdoors[0][c], rig.indoors[0][c]],
            low: [rig.outdoors[1][c], rig.indoors[1][c]],
        });
        for block in self.blocks.iter_mut().take(self.n.div_ceil(LANES)) {
            block.light(rig.to_sun, &source);
        }
    }
}

#[inline(always)]
fn put(lists: &mut [Lane; 3], k: usize, v: Vec3) {
    (lists[0][k], lists[1][k], lists[2][k]) = (v.x, v.y, v.z);
}

impl Block {
    #[inline(always)]
    fn light(&mut self, to_sun: Vec3, source: &[Source; 3]) {
        let Block { at, lamp, has_lamp, normal, to_eye, color, gloss, tone, shown } = self;
        let [at_x, at_y, at_z] = at;
        let [lamp_x, lamp_y, lamp_z] = lamp;
        let [nx, ny, nz] = normal;
        let [eye_x, eye_y, eye_z] = to_eye;
        let [red, green, blue] = color;
        let [r, g, b] = shown;
        for k in 0..LANES {
            let indoors = has_lamp[k] != 0;
            let (x, y, z) = (lamp_x[k] - at_x[k], lamp_y[k] - at_y[k], lamp_z[k] - at_z[k]);
            let d2 = x * x + y * y + z * z + 0.3;
            let per_d = 1.0 / d2.sqrt();
            let to_x = if indoors { x * per_d } else { to_sun.x };
            let to_y = if indoors { y * per_d } else { to_sun.y };
            let to_z = if indoors { z * per_d } else { to_sun.z };
            let strength = if indoors { 1.0 / (1.0 + 0.085 * d2) } else { 1.0 };
            let wrapped = if indoors { 0.35 } else { 0.0 };
            let facing = to_x * nx[k] + to_y * ny[k] + to_z * nz[k] + wrapped;
            let direct = most(facing, 0.0) * strength;
            // Walls at right angles must differ even where no lamp is near, and what faces down
            // sees little but its own shadow.
            let corner = 1.0 + 0.07 * nx[k] - 0.05 * nz[k];
            let corner = if ny[k] < -0.5 { 0.7 * corner } else { corner };
            let up = 0.5 * ny[k] + 0.5;

            let (x, y, z) = (eye_x[k], eye_y[k], eye_z[k]);
            let per_d = 1.0 / most(x * x + y * y + z * z, 1e-12).sqrt();
            let (x, y, z) = (x * per_d, y * per_d, z * per_d);
            let (hx, hy, hz) = (to_x + x, to_y + y, to_z + z);
            let per_half = 1.0 / most(hx * hx + hy * hy + hz * hz, 1e-12).sqrt();
            let c = most(hx * nx[k] + hy * ny[k] + hz * nz[k], 0.0) * per_half;
            let c8 = c * c * (c * c) * (c * c) * (c * c);
            let c16 = c8 * c8;
            let seen = x * nx[k] + y * ny[k] + z * nz[k];
            let away = 1.0 - most(seen, 0.0);
            let edge = away * away;
            // How far up the mirrored view looks: 0 down, 1 up.
            let mirror = most(0.5 + 0.5 * (2.0 * seen * ny[k] - y), 0.0);
            let gloss = gloss[k];
            let keep = of(&KEEP, gloss) + of(&KEEP_MIRROR, gloss) * (mirror * mirror);
            let specular = of(&SPECULAR_8, gloss) * c8
                + of(&SPECULAR_16, gloss) * c16
                + of(&SPECULAR_32, gloss) * (c16 * c16);
            let mirrored = of(&EDGE, gloss) * edge
                + of(&EDGE_2, gloss) * (edge * edge)
                + mirror * (of(&MIRROR, gloss) + of(&MIRROR_EDGE, gloss) * (edge * edge));
            let keep = keep * tone[k];
            let glow = of(&GLOW, gloss);
            let reflectance =
                Reflectance { indoors, direct, corner, up, keep, glow, specular, mirrored };
            r[k] = reflectance.shown(red[k], &source[0], REFLECTED[0]);
            g[k] = reflectance.shown(green[k], &source[1], REFLECTED[1]);
            b[k] = reflectance.shown(blue[k], &source[2], REFLECTED[2]);
        }
    }
}

/// One channel of the light indoors and out of doors.
struct Source {
    /// Of the sun and of the lamp at no distance.
    direct: [f32; 2],
    /// From above.
    high: [f32; 2],
    /// From below.
    low: [f32; 2],
}

/// How a point reflects light.
struct Reflectance {
    indoors: bool,
    /// What it gets of direct light, 0 to 1.
    direct: f32,
    /// By what light from around is multiplied.
    corner: f32,
    /// How far it faces up, 0 to 1.
    up: f32,
    /// What it keeps of all this light on its own color.
    keep: f32,
    /// What it gives of its own color, whatever the light.
    glow: f32,
    specular: f32,
    mirrored: f32,
}

impl Reflectance {
    /// What is shown of a linear color in a channel, 0 to 255.
    #[inline(always)]
    fn shown(&self, color: f32, source: &Source, reflected: f32) -> f32 {
        let Source { direct, high, low } = source;
        let direct = if self.indoors { direct[1] } else { direct[0] } * self.direct;
        let high = if self.indoors { high[1] } else { high[0] };
        let low = if self.indoors { low[1] } else { low[0] };
        let lit = ((low + (high - low) * self.up) * self.corner + direct) * self.keep;
        let factor = lit + self.glow;
        let linear = color * factor + direct * self.specular + reflected * self.mirrored;
        255.0 * most(least(linear, 1.0), 0.0).sqrt()
    }
}

/// What stands in a table for a gloss.
#[inline(always)]
fn of(table: &[f32; 8], gloss: u32) -> f32 {
    table[gloss as usize & 7]
}

/// The color of what mirrors, which is mostly windows and the sky.
const REFLECTED: [f32; 3] = [0.85, 0.95, 1.05];

// How each gloss answers to light: dull, satin, shiny, metal, glass, glow. Panes come as glow.

/// What it keeps of the light on its own color.
const KEEP: [f32; 8] = [1.0, 1.0, 1.0, 0.62, 0.6, 0.0, 0.0, 0.0];
/// The same, growing with the square of how far up the mirrored view looks.
const KEEP_MIRROR: [f32; 8] = [0.0, 0.0, 0.0, 0.75, 0.0, 0.0, 0.0, 0.0];
/// What it gives of its own color, whatever the light.
const GLOW: [f32; 8] = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
/// A highlight of the 8th, 16th and 32nd power.
const SPECULAR_8: [f32; 8] = [0.0, 0.07, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
const SPECULAR_16: [f32; 8] = [0.0, 0.0, 0.0, 0.4, 0.6, 0.0, 0.0, 0.0];
const SPECULAR_32: [f32; 8] = [0.0, 0.0, 0.45, 0.0, 0.0, 0.0, 0.0, 0.0];
/// What is mirrored, growing with the 2nd and 4th power towards the edge as the eye sees it.
const EDGE: [f32; 8] = [0.0, 0.02, 0.0, 0.05, 0.0, 0.0, 0.0, 0.0];
const EDGE_2: [f32; 8] = [0.0, 0.0, 0.07, 0.0, 0.0, 0.0, 0.0, 0.0];
/// The same, growing with how far up the mirrored view looks.
const MIRROR: [f32; 8] = [0.0, 0.0, 0.0, 0.0, 0.075, 0.0, 0.0, 0.0];
const MIRROR_EDGE: [f32; 8] = [0.0, 0.0, 0.0, 0.0, 0.45, 0.0, 0.0, 0.0];
