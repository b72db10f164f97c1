//! Blinn-Phong lighting of surface points, many together.
//!
//! Direct diffuse light comes from the sun or the lamp of the room (Lambert, with a wrap term
//! indoors). Ambient light is a hemisphere model. The specular term is a power of the cosine
//! between the normal and the half vector of eye and light. Mirror reflection has one constant
//! color, and is stronger at grazing angles (Schlick).
//!
//! Each quantity is an array, and all arrays go through one plain loop that the compiler vectorizes
//! (see [`crate::shade`]).

use chaic_core::Vec3;
use glam::Vec4;

use crate::light_rig::LightRig;
use crate::mesh::SpecularPreset;
use crate::setup::{fmax, fmin};

/// A surface point in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint {
    /// Position for lighting by the lamp. All points of an object share its center.
    pub position: Vec3,
    /// Position of the lamp that lights it; `None` for the sun.
    pub lamp: Option<Vec3>,
    /// Unit normal.
    pub normal: Vec3,
    /// Vector to the eye, not normalized.
    pub to_eye: Vec3,
    /// Linear color.
    pub color: Vec3,
    pub gloss: SpecularPreset,
    /// Ambient occlusion: factor on diffuse and mirror light, but not on highlights.
    pub occlusion: f32,
}

/// Surface points and their display colors.
#[derive(Default)]
pub(crate) struct SurfacePoints {
    n: usize,
    blocks: Vec<Block>,
}

/// Number of points that are lit together.
const LANES: usize = 16;

/// One quantity of a block of points.
type Lane = [f32; LANES];

/// A block of neighboring points; inner arrays are coordinates or channels.
#[derive(Clone, Default)]
struct Block {
    position: [Lane; 3],
    lamp: [Lane; 3],
    has_lamp: [u32; LANES],
    normal: [Lane; 3],
    to_eye: [Lane; 3],
    color: [Lane; 3],
    gloss: [u32; LANES],
    occlusion: Lane,
    display: [Lane; 3],
}

impl SurfacePoints {
    /// Removes all points.
    pub fn clear(&mut self) {
        self.n = 0;
    }

    /// Adds a point; returns its index.
    #[inline(always)]
    pub fn push(&mut self, point: &SurfacePoint) -> usize {
        let (block, k) = (self.n / LANES, self.n % LANES);
        if block >= self.blocks.len() {
            self.blocks.push(Block::default());
        }
        let block = &mut self.blocks[block];
        set_lane(&mut block.position, k, point.position);
        set_lane(&mut block.lamp, k, point.lamp.unwrap_or_default());
        set_lane(&mut block.normal, k, point.normal);
        set_lane(&mut block.to_eye, k, point.to_eye);
        set_lane(&mut block.color, k, point.color);
        block.has_lamp[k] = u32::from(point.lamp.is_some());
        block.gloss[k] = point.gloss as u32;
        block.occlusion[k] = point.occlusion;
        self.n += 1;
        self.n - 1
    }

    /// Returns the display color of a point, 0 to 255.
    #[inline(always)]
    pub fn display(&self, point: usize) -> Vec4 {
        let (block, k) = (&self.blocks[point / LANES], point % LANES);
        let [r, g, b] = &block.display;
        Vec4::new(r[k], g[k], b[k], 0.0)
    }

    /// Computes the display colors of all points.
    #[inline(always)]
    pub fn light(&mut self, light_rig: &LightRig) {
        let lights = [0, 1, 2].map(|c| ChannelLight {
            direct: [light_rig.sun[c], light_rig.lamp[c]],
            from_above: [light_rig.outdoors[0][c], light_rig.indoors[0][c]],
            from_below: [light_rig.outdoors[1][c], light_rig.indoors[1][c]],
        });
        for block in self.blocks.iter_mut().take(self.n.div_ceil(LANES)) {
            block.light(light_rig.to_sun, &lights);
        }
    }
}

#[inline(always)]
fn set_lane(lists: &mut [Lane; 3], k: usize, v: Vec3) {
    (lists[0][k], lists[1][k], lists[2][k]) = (v.x, v.y, v.z);
}

impl Block {
    #[inline(always)]
    fn light(&mut self, to_sun: Vec3, lights: &[ChannelLight; 3]) {
        let Block { position, lamp, has_lamp, normal, to_eye, color, gloss, occlusion, display } =
            self;
        let [at_x, at_y, at_z] = position;
        let [lamp_x, lamp_y, lamp_z] = lamp;
        let [nx, ny, nz] = normal;
        let [eye_x, eye_y, eye_z] = to_eye;
        let [red, green, blue] = color;
        let [r, g, b] = display;
        for k in 0..LANES {
            let indoors = has_lamp[k] != 0;
            let (x, y, z) = (lamp_x[k] - at_x[k], lamp_y[k] - at_y[k], lamp_z[k] - at_z[k]);
            let d2 = x * x + y * y + z * z + 0.3;
            let per_d = 1.0 / d2.sqrt();
            let to_x = if indoors { x * per_d } else { to_sun.x };
            let to_y = if indoors { y * per_d } else { to_sun.y };
            let to_z = if indoors { z * per_d } else { to_sun.z };
            let strength = if indoors { 1.0 / (1.0 + 0.085 * d2) } else { 1.0 };
            let wrap = if indoors { 0.35 } else { 0.0 };
            let facing = to_x * nx[k] + to_y * ny[k] + to_z * nz[k] + wrap;
            let direct = fmax(facing, 0.0) * strength;
            // Perpendicular walls must differ in brightness even without a lamp nearby, and a
            // surface that faces down receives little light.
            let ambient_factor = 1.0 + 0.07 * nx[k] - 0.05 * nz[k];
            let ambient_factor = if ny[k] < -0.5 { 0.7 * ambient_factor } else { ambient_factor };
            let up = 0.5 * ny[k] + 0.5;

            let (x, y, z) = (eye_x[k], eye_y[k], eye_z[k]);
            let per_d = 1.0 / fmax(x * x + y * y + z * z, 1e-12).sqrt();
            let (x, y, z) = (x * per_d, y * per_d, z * per_d);
            let (hx, hy, hz) = (to_x + x, to_y + y, to_z + z);
            let per_half = 1.0 / fmax(hx * hx + hy * hy + hz * hz, 1e-12).sqrt();
            let c = fmax(hx * nx[k] + hy * ny[k] + hz * nz[k], 0.0) * per_half;
            let c8 = c * c * (c * c) * (c * c) * (c * c);
            let c16 = c8 * c8;
            let cos_view = x * nx[k] + y * ny[k] + z * nz[k];
            let away = 1.0 - fmax(cos_view, 0.0);
            let fresnel = away * away;
            // Upward direction of the mirrored view: 0 is down, 1 is up.
            let mirror = fmax(0.5 + 0.5 * (2.0 * cos_view * ny[k] - y), 0.0);
            let gloss = gloss[k];
            let diffuse =
                lookup(&DIFFUSE, gloss) + lookup(&DIFFUSE_MIRROR, gloss) * (mirror * mirror);
            let specular = lookup(&SPECULAR_8, gloss) * c8
                + lookup(&SPECULAR_16, gloss) * c16
                + lookup(&SPECULAR_32, gloss) * (c16 * c16);
            let mirror_light = lookup(&FRESNEL_2, gloss) * fresnel
                + lookup(&FRESNEL_4, gloss) * (fresnel * fresnel)
                + mirror
                    * (lookup(&MIRROR, gloss)
                        + lookup(&MIRROR_FRESNEL, gloss) * (fresnel * fresnel));
            let diffuse = diffuse * occlusion[k];
            let emission = lookup(&EMISSION, gloss);
            let reflectance = Reflectance {
                indoors,
                direct,
                ambient_factor,
                up,
                diffuse,
                emission,
                specular,
                mirror_light,
            };
            r[k] = reflectance.display(red[k], &lights[0], MIRROR_COLOR[0]);
            g[k] = reflectance.display(green[k], &lights[1], MIRROR_COLOR[1]);
            b[k] = reflectance.display(blue[k], &lights[2], MIRROR_COLOR[2]);
        }
    }
}

/// One color channel of the light outdoors and indoors.
struct ChannelLight {
    /// Light of the sun, and of the lamp at distance 0.
    direct: [f32; 2],
    /// Ambient light from above.
    from_above: [f32; 2],
    /// Ambient light from below.
    from_below: [f32; 2],
}

/// Reflection of light at a point.
struct Reflectance {
    indoors: bool,
    /// Direct light, 0 to 1.
    direct: f32,
    /// Factor on ambient light.
    ambient_factor: f32,
    /// Upward direction of the normal, 0 to 1.
    up: f32,
    /// Diffuse reflectance.
    diffuse: f32,
    /// Emission, as a factor on the point's color.
    emission: f32,
    specular: f32,
    mirror_light: f32,
}

impl Reflectance {
    /// Returns the display value of a linear color channel, 0 to 255.
    #[inline(always)]
    fn display(&self, color: f32, lights: &ChannelLight, mirror_color: f32) -> f32 {
        let ChannelLight { direct, from_above, from_below } = lights;
        let direct = if self.indoors { direct[1] } else { direct[0] } * self.direct;
        let from_above = if self.indoors { from_above[1] } else { from_above[0] };
        let from_below = if self.indoors { from_below[1] } else { from_below[0] };
        let lit = ((from_below + (from_above - from_below) * self.up) * self.ambient_factor
            + direct)
            * self.diffuse;
        let factor = lit + self.emission;
        let linear = color * factor + direct * self.specular + mirror_color * self.mirror_light;
        255.0 * fmax(fmin(linear, 1.0), 0.0).sqrt()
    }
}

/// Looks up the coefficient of a specular preset.
#[inline(always)]
fn lookup(table: &[f32; 8], gloss: u32) -> f32 {
    table[gloss as usize & 7]
}

/// Color of mirror reflections, mostly of windows and the sky.
const MIRROR_COLOR: [f32; 3] = [0.85, 0.95, 1.05];

// Coefficients of each specular preset: dull, satin, shiny, metal, glass, glow. Panes use glow.

/// Diffuse reflectance.
const DIFFUSE: [f32; 8] = [1.0, 1.0, 1.0, 0.62, 0.6, 0.0, 0.0, 0.0];
/// Diffuse reflectance that grows with the square of the mirrored view's upward direction.
const DIFFUSE_MIRROR: [f32; 8] = [0.0, 0.0, 0.0, 0.75, 0.0, 0.0, 0.0, 0.0];
/// Emission, as a factor on the color.
const EMISSION: [f32; 8] = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
/// Specular highlights with exponents 8, 16 and 32.
const SPECULAR_8: [f32; 8] = [0.0, 0.07, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
const SPECULAR_16: [f32; 8] = [0.0, 0.0, 0.0, 0.4, 0.6, 0.0, 0.0, 0.0];
const SPECULAR_32: [f32; 8] = [0.0, 0.0, 0.45, 0.0, 0.0, 0.0, 0.0, 0.0];
/// Fresnel reflection: grows with the 2nd and 4th power toward grazing angles.
const FRESNEL_2: [f32; 8] = [0.0, 0.02, 0.0, 0.05, 0.0, 0.0, 0.0, 0.0];
const FRESNEL_4: [f32; 8] = [0.0, 0.0, 0.07, 0.0, 0.0, 0.0, 0.0, 0.0];
/// Fresnel reflection that grows with the mirrored view's upward direction.
const MIRROR: [f32; 8] = [0.0, 0.0, 0.0, 0.0, 0.075, 0.0, 0.0, 0.0];
const MIRROR_FRESNEL: [f32; 8] = [0.0, 0.0, 0.0, 0.0, 0.45, 0.0, 0.0, 0.0];
