//! Color of pixels whose surface is known.

use chaic_protocol::{EntityId, Vec3};

use crate::frame::{Frame, Instance};
use crate::lens::Lens;
use crate::light::NO_ROOM;
use crate::mesh::{Gloss, Mesh, Skin, length, unit};
use crate::raster::{NOBODY, Target, owner_parts};
use crate::texture::{SRGB, Tile, srgb_from_linear};

const SUN: Vec3 = Vec3::new(0.42, 0.80, 0.43);
const SUN_COLOR: Vec3 = Vec3::new(0.92, 0.86, 0.74);
const LAMP_COLOR: Vec3 = Vec3::new(0.66, 0.62, 0.55);
/// Light from above and from below, out of doors.
const OUTDOORS: [Vec3; 2] = [Vec3::new(0.36, 0.41, 0.48), Vec3::new(0.24, 0.23, 0.20)];
/// The same in a room.
const INDOORS: [Vec3; 2] = [Vec3::new(0.40, 0.40, 0.40), Vec3::new(0.34, 0.32, 0.30)];
/// Height of the skirting board, metres.
const SKIRTING_M: f32 = 0.075;

/// Writes RGB, u8, shape [height, width, 3].
pub(crate) fn shade(frame: &Frame, lens: &Lens, levels: &[u8], target: &Target, rgb: &mut Vec<u8>) {
    rgb.clear();
    rgb.resize(lens.width * lens.height * 3, 0);
    if lens.width == 0 {
        return;
    }
    let shader = Shader { frame, lens, table: &SRGB };
    let (mu, mv) = lens.middle();
    let per_px = 1.0 / lens.focal;
    for row in 0..lens.height {
        let line = row * lens.width..(row + 1) * lens.width;
        let owners = &target.owner[line.clone()];
        let nearness = &target.nearness[line.clone()];
        let out = &mut rgb[3 * line.start..3 * line.end];
        let y = -(row as f32 + 0.5 - mv) * per_px;
        // A pixel sees along `left + column * step`, per metre of depth (per image in a plan).
        let left = lens.up * y + lens.right * ((0.5 - mu) * per_px);
        let step = lens.right * per_px;
        let mut begin = 0;
        while begin < owners.len() {
            let owner = owners[begin];
            let n = owners[begin..].iter().take_while(|o| **o == owner).count();
            let run = Run { begin, left, step };
            let pixels = &mut out[3 * begin..3 * (begin + n)];
            if owner == NOBODY {
                shader.sky(&run, pixels);
            } else {
                let (index, triangle) = owner_parts(owner);
                let instance = &frame.instances[index];
                let mesh = instance.shape.mesh(usize::from(levels[index]));
                let surface = Surface::of(instance, mesh, triangle);
                shader.surface(&surface, &run, &nearness[begin..begin + n], pixels);
            }
            begin += n;
        }
    }
}

/// Neighboring pixels of one row.
struct Run {
    begin: usize,
    left: Vec3,
    step: Vec3,
}

/// A triangle, ready to be shaded: its quantities are affine functions of the point in the world.
struct Surface<'a> {
    entity: EntityId,
    skin: &'a Skin,
    color: Vec3,
    /// Normal at `at`, and its changes along the triangle's two edges if it is smooth.
    at: Vec3,
    normal: Vec3,
    change: [Vec3; 2],
    weights: [Vec3; 2],
    smooth: bool,
    tile: Option<&'static Tile>,
    origin: Vec3,
    /// Directions of the texture, in the world.
    u: Vec3,
    v: Vec3,
    room: Option<u8>,
}

impl<'a> Surface<'a> {
    fn of(instance: &'a Instance, mesh: &'a Mesh, triangle: usize) -> Surface<'a> {
        let t = &mesh.triangles[triangle];
        let skin = &mesh.skins[usize::from(t.skin)];
        let corner = t.corners.map(usize::from);
        let [a, b, c] = corner.map(|k| mesh.positions[k]);
        let flat = (b - a).cross(c - a);
        let area2 = flat.dot(flat).max(1e-30);
        let face = unit(flat);
        let turn = |v: Vec3| instance.rotation * v;
        let (mut normal, mut change, mut weights) = (turn(face), [Vec3::ZERO; 2], [Vec3::ZERO; 2]);
        if t.smooth {
            let [na, nb, nc] = corner.map(|k| mesh.normals[k]);
            normal = turn(na);
            change = [turn(nb - na), turn(nc - na)];
            weights = [turn((c - a).cross(flat)) / area2, turn(flat.cross(b - a)) / area2];
        }
        let tile = skin.texture.tile();
        let (mut u, mut v) = (Vec3::ZERO, Vec3::ZERO);
        if tile.is_some() {
            let axes = &skin.axes;
            let facing = [axes.x_axis, axes.y_axis, axes.z_axis].map(|x| x.dot(face).abs());
            // Look along the axis that the face is most square to; the longest axis left is u.
            (u, v) = if facing[0] > facing[1] && facing[0] > facing[2] {
                (turn(axes.y_axis), turn(axes.z_axis))
            } else if facing[1] > facing[2] {
                (turn(axes.x_axis), turn(axes.z_axis))
            } else {
                (turn(axes.x_axis), turn(axes.y_axis))
            };
        }
        let color = match instance.tint {
            Some(tint) if skin.tinted => tint,
            _ => skin.color,
        };
        Surface {
            entity: instance.entity,
            skin,
            color: Vec3::from(color),
            at: turn(a) + instance.origin,
            normal,
            change,
            weights,
            smooth: t.smooth,
            tile,
            origin: instance.origin,
            u,
            v,
            room: instance.room,
        }
    }

    #[inline]
    fn normal_at(&self, p: Vec3) -> Vec3 {
        if !self.smooth {
            return self.normal;
        }
        let d = p - self.at;
        let (s, t) = (self.weights[0].dot(d).clamp(0.0, 1.0), self.weights[1].dot(d).clamp(0.0, 1.0));
        unit(self.normal + self.change[0] * s + self.change[1] * t)
    }
}

struct Shader<'a> {
    frame: &'a Frame<'a>,
    lens: &'a Lens,
    table: &'a [u8; 4096],
}

impl Shader<'_> {
    fn put(&self, out: &mut [u8], color: Vec3) {
        out[0] = srgb_from_linear(self.table, color.x);
        out[1] = srgb_from_linear(self.table, color.y);
        out[2] = srgb_from_linear(self.table, color.z);
    }

    fn sky(&self, run: &Run, pixels: &mut [u8]) {
        for (k, out) in pixels.chunks_exact_mut(3).enumerate() {
            let ray = self.lens.ahead + run.left + run.step * (run.begin + k) as f32;
            let color = if self.lens.is_plan { Vec3::splat(0.86) } else { sky_color(ray) };
            self.put(out, color);
        }
    }

    fn surface(&self, surface: &Surface, run: &Run, nearness: &[f32], pixels: &mut [u8]) {
        let lens = self.lens;
        let mut last_room = (NO_ROOM, None);
        for (k, (out, q)) in pixels.chunks_exact_mut(3).zip(nearness).enumerate() {
            let depth = lens.depth(*q);
            let across = run.left + run.step * (run.begin + k) as f32;
            let (p, to_eye) = if lens.is_plan {
                (lens.eye + across + lens.ahead * depth, -lens.ahead)
            } else {
                let ray = lens.ahead + across;
                (lens.eye + ray * depth, -ray)
            };
            let n = surface.normal_at(p);
            let room = surface.room.unwrap_or_else(|| self.frame.light.ground.room_at(p + n * 0.1));
            if room != last_room.0 {
                last_room = (room, self.frame.light.ground.lamp(room));
            }
            let color = self.pixel(surface, p, n, to_eye, depth, last_room.1);
            self.put(out, color);
        }
    }

    #[inline]
    fn pixel(&self, s: &Surface, p: Vec3, n: Vec3, to_eye: Vec3, depth: f32, lamp: Option<Vec3>) -> Vec3 {
        let mut albedo = s.color;
        if let Some(tile) = s.tile {
            let scale = if self.lens.is_plan { 1.0 } else { depth } / self.lens.focal;
            // Seen at a slant a pixel covers more; the root keeps it from blurring too early.
            let slant = (n.dot(to_eye).abs()).max(0.05);
            let at = p - s.origin;
            albedo *= tile.sample(s.u.dot(at), s.v.dot(at), scale / slant.sqrt());
        }
        let mut shade = 1.0;
        match s.entity {
            EntityId::FLOOR => shade = self.frame.light.ground_brightness(p.x, p.z),
            EntityId::WALL => {
                if self.lens.is_plan && n.y > 0.5 {
                    return Vec3::splat(0.035);
                }
                let low = (1.0 - p.y * 2.2).max(0.0);
                shade = 1.0 - 0.22 * low * low;
                if let Some(ceiling) = self.frame.light.ground.ceiling_m {
                    let high = (1.0 - (ceiling - p.y) * 2.2).max(0.0);
                    shade -= 0.16 * high * high;
                    if p.y < SKIRTING_M && n.y < 0.5 {
                        albedo = Vec3::splat(0.62);
                        shade *= if p.y > SKIRTING_M - 0.012 { 0.72 } else { 1.0 };
                    }
                }
            }
            EntityId::CEILING => {}
            _ => shade = 0.76 + 0.24 * ((p.y - s.origin.y) * 7.0).clamp(0.0, 1.0),
        }
        let (to_light, light, ambient) = match lamp {
            Some(lamp) => {
                let d = lamp - p;
                let d2 = d.dot(d) + 0.3;
                let l = d * (1.0 / d2.sqrt());
                let wrapped = (l.dot(n) + 0.35).max(0.0) * (1.0 / 1.35);
                let fade = 1.35 / (1.0 + 0.085 * d2);
                (l, LAMP_COLOR * (wrapped * fade), INDOORS)
            }
            None => (SUN, SUN_COLOR * SUN.dot(n).max(0.0), OUTDOORS),
        };
        let up = 0.5 * n.y + 0.5;
        let mut hemisphere = ambient[1] + (ambient[0] - ambient[1]) * up;
        // Walls at right angles must differ even where no lamp is near.
        hemisphere *= 1.0 + 0.07 * n.x - 0.05 * n.z;
        if s.entity == EntityId::CEILING {
            hemisphere = Vec3::splat(0.62);
        } else if n.y < -0.5 {
            hemisphere *= 0.7;
        }
        let color = albedo * (hemisphere + light) * shade;
        self.gloss(s.skin.gloss, color, albedo, n, to_eye, to_light, light)
    }

    #[allow(clippy::too_many_arguments, reason = "a piece of one inner loop")]
    #[inline]
    fn gloss(&self, gloss: Gloss, color: Vec3, albedo: Vec3, n: Vec3, to_eye: Vec3, to_light: Vec3, light: Vec3) -> Vec3 {
        if gloss == Gloss::Dull {
            return color;
        }
        let v = to_eye * (1.0 / length(to_eye).max(1e-6));
        let h = unit(v + to_light);
        let c = n.dot(h).max(0.0);
        let (c2, c4) = (c * c, c * c * c * c);
        let (c8, c16) = (c4 * c4, c4 * c4 * c4 * c4);
        let facing = n.dot(v).clamp(0.0, 1.0);
        let edge = (1.0 - facing) * (1.0 - facing);
        match gloss {
            Gloss::Dull => color,
            Gloss::Satin => color + light * (0.07 * c8) + Vec3::splat(0.02 * edge),
            Gloss::Shiny => color + light * (0.45 * c16 * c16) + Vec3::splat(0.07 * edge * edge),
            Gloss::Metal => {
                let mirror = 0.5 + 0.5 * (n * (2.0 * n.dot(v)) - v).y;
                color * 0.55 + albedo * (0.12 + 0.5 * mirror * mirror) + light * (0.5 * c8 * c2)
            }
            Gloss::Glass => {
                let mirror = 0.5 + 0.5 * (n * (2.0 * n.dot(v)) - v).y;
                let reflects = 0.10 + 0.6 * edge * edge;
                color * 0.6 + Vec3::new(0.62, 0.72, 0.80) * (reflects * mirror) + light * (0.6 * c16)
            }
        }
    }
}

fn sky_color(ray: Vec3) -> Vec3 {
    let y = ray.y / length(ray).max(1e-6);
    let (horizon, zenith) = (Vec3::new(0.74, 0.82, 0.88), Vec3::new(0.19, 0.40, 0.74));
    let ground = Vec3::new(0.36, 0.38, 0.34);
    if y >= 0.0 {
        let t = (1.0 - y) * (1.0 - y);
        zenith + (horizon - zenith) * (t * (0.4 + 0.6 * t))
    } else {
        let t = (-y * 6.0).min(1.0);
        horizon + (ground - horizon) * t
    }
}
