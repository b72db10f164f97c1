//! What color a triangle has, worked out once for each triangle in view.

use chaic_core::{EntityId, Vec3};
use glam::Vec4;

use crate::frame::{Frame, Instance};
use crate::ground::NO_ROOM;
use crate::lens::Lens;
use crate::light_rig::{CEILING_FARTHER_M, CEILING_TONE};
use crate::mesh::{Gloss, Mesh, Triangle, unit};
use crate::planes::{Plane, Rays};
use crate::points::{Point, Points};
use crate::texture::{Texture, Tile};

/// How dark the tops of walls are on maps, 0 to 255.
const WALL_ON_MAP: f32 = 44.0;

/// The lawn outside of windows, linear.
const LAWN: [f32; 3] = [0.16, 0.28, 0.09];

/// What a map shows where nothing is, 0 to 255.
const PAPER: f32 = 236.0;

/// How a triangle's color comes about. What is shown is 0 to 255, red, green and blue in the lanes.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    /// Linear, within bounds.
    Linear(Linear),
    /// As its vertices show, once they are lit; see [`Unlit::lit`].
    Unlit(Unlit),
    /// Lit point by point, since it is large.
    Structure(Surface),
}

/// Colors that are linear over a triangle, within bounds.
#[derive(Clone, Copy)]
pub(crate) struct Linear {
    pub shown: Plane,
    pub low: Vec4,
    pub high: Vec4,
}

impl Linear {
    /// The same everywhere.
    fn even(shown: Vec4) -> Linear {
        Linear { shown: Plane { base: shown, ..Plane::default() }, low: shown, high: shown }
    }
}

/// A piece of structure before it is lit.
#[derive(Clone, Copy)]
pub(crate) struct Surface {
    pub is_floor: bool,
    /// Linear.
    color: Vec3,
    normal: Vec3,
    gloss: Gloss,
}

/// A triangle of a thing before its points are lit.
#[derive(Clone, Copy)]
pub(crate) struct Unlit {
    /// The number of its first point.
    point: u32,
    /// Second and third barycentric coordinate over the image; `None` if a single point stands for
    /// all of it.
    barycentric: Option<[Vec4; 2]>,
    is_flat: bool,
}

impl Unlit {
    /// What becomes of it when its points are lit.
    #[inline(always)]
    pub fn lit(&self, points: &Points) -> Linear {
        let first = self.point as usize;
        let a = points.shown(first);
        let Some([s, t]) = self.barycentric else { return Linear::even(a) };
        let (b, c) = (points.shown(first + 1), points.shown(first + 2));
        let (mut low, mut high) = (a.min(b).min(c), a.max(b).max(c));
        if self.is_flat {
            // It may be half of a parallelogram.
            let d = a + c - b;
            (low, high) = (low.min(d).max(Vec4::ZERO), high.max(d).min(Vec4::splat(255.0)));
        }
        Linear { shown: Plane::mixed(a, (b - a, s), (c - a, t)), low, high }
    }
}

/// A triangle, ready to be looked at.
#[derive(Clone, Copy)]
pub(crate) struct Paint {
    pub entity: u16,
    pub kind: Kind,
    pub tile: Tile,
    /// Texture coordinates, metres, all 0 if it has none; the third lane's slope is the cosine
    /// between normal and ray (not normalized).
    pub texture: Plane,
}

/// What all triangles of an instance share in a view.
#[derive(Clone, Copy)]
pub(crate) struct Sight {
    rays: Rays,
    /// Where it is for the lamp.
    middle: Vec3,
    lamp: Option<Vec3>,
}

/// Works out triangles of one view.
pub(crate) struct Painter<'a> {
    pub frame: &'a Frame<'a>,
    pub is_plan: bool,
    pub rays: Rays,
    /// Places on the ground's grid.
    pub ground: Plane,
    /// What is seen of a lawn out of doors, linear.
    lawn: Vec3,
}

impl<'a> Painter<'a> {
    /// A painter of what a lens sees.
    pub fn new(frame: &'a Frame<'a>, lens: &Lens) -> Painter<'a> {
        let Rays { eye, ray } = Rays::of(lens);
        let flat = |v: Vec3| Vec4::new(v.x, v.z, 0.0, 0.0);
        let (cells_per_m, first) = frame.light.ground.grid();
        let from = flat(eye[0]) - Vec4::new(first.x, first.y, 0.0, 0.0);
        // A plan view looks straight down, whose rays don't move over the ground.
        let [at, du, dv] = if lens.is_plan { [Vec3::ZERO, eye[1], eye[2]] } else { ray };
        let ground = Plane {
            base: from * cells_per_m,
            at: flat(at) * cells_per_m,
            du: flat(du) * cells_per_m,
            dv: flat(dv) * cells_per_m,
        };
        let lawn = frame.light.rig.in_the_open(LAWN.into());
        Painter { frame, is_plan: lens.is_plan, rays: Rays { eye, ray }, ground, lawn }
    }

    /// What is common to an instance's triangles.
    pub fn sight(&self, instance: &Instance) -> Sight {
        let middle = instance.origin + instance.rotation * (0.5 * (instance.min + instance.max));
        let lamp = self.frame.light.ground.lamp(instance.room.unwrap_or(NO_ROOM));
        Sight { rays: self.rays.within(instance), middle, lamp }
    }

    /// A quantity with this gradient (in the instance's frame) that is 0 at `zero`, as (base, at,
    /// du, dv). In a plan view, whose eyes move with the pixel instead of its rays, the plane of
    /// the triangle turns depth into a linear quantity too, so that w = 1 fits.
    fn plane(&self, sight: &Sight, gradient: Vec3, zero: Vec3, normal: Vec3) -> Vec4 {
        let Rays { eye, ray } = &sight.rays;
        let base = gradient.dot(eye[0] - zero);
        let [at, du, dv] = if self.is_plan {
            let down = normal.dot(ray[0]);
            let fall = if down.abs() > 1e-6 { gradient.dot(ray[0]) / down } else { 0.0 };
            let along = |v: Vec3| gradient.dot(v) - fall * normal.dot(v);
            [-fall * normal.dot(eye[0] - zero), along(eye[1]), along(eye[2])]
        } else {
            ray.map(|r| gradient.dot(r))
        };
        Vec4::new(base, at, du, dv)
    }

    /// Works out a triangle of an instance; what has to be lit is added to the points.
    #[inline(never)]
    pub fn paint(
        &self,
        instance: &Instance,
        sight: &Sight,
        mesh: &Mesh,
        triangle: &Triangle,
        points: &mut Points,
    ) -> Paint {
        let skin = &mesh.skins[usize::from(triangle.skin)];
        let vertices = triangle.vertices.map(usize::from);
        let [a, b, c] = vertices.map(|k| mesh.positions[k]);
        let flat = (b - a).cross(c - a);
        let face = unit(flat);
        let color = match instance.tint {
            Some(tint) if skin.tinted => tint,
            _ => skin.color,
        };
        let color = Vec3::from(color) * instance.factor;
        let tile = Tile::of(skin.texture);
        let mut texture = Plane::default();
        if skin.texture != Texture::Plain {
            let axes = &skin.axes;
            let facing = [axes.x_axis, axes.y_axis, axes.z_axis].map(|x| x.dot(face).abs());
            // Look along the axis that the face is most square to; the longest axis left is u.
            let (u, v) = if facing[0] > facing[1] && facing[0] > facing[2] {
                (axes.y_axis, axes.z_axis)
            } else if facing[1] > facing[2] {
                (axes.x_axis, axes.z_axis)
            } else {
                (axes.x_axis, axes.y_axis)
            };
            texture = self.texture(sight, u, v, a, face);
        }
        let painted = |kind| Paint { entity: instance.entity.0, kind, tile, texture };
        if instance.room.is_none() {
            let is_floor = instance.entity == EntityId::FLOOR;
            let (normal, gloss) = (instance.rotation * face, skin.gloss);
            if self.is_plan && normal.y > 0.5 && !is_floor {
                // A map shows where walls are, not how they are lit.
                let shown = Vec3::splat(WALL_ON_MAP).extend(0.0);
                return painted(Kind::Linear(Linear::even(shown)));
            }
            return painted(Kind::Structure(Surface { is_floor, color, normal, gloss }));
        }
        let mut push = |p: Vec3, n: Vec3| {
            let point = self.thing_point(instance, sight, (skin.gloss, color), p, n);
            points.push(&point) as u32
        };
        if !triangle.smooth && matches!(skin.gloss, Gloss::Dull | Gloss::Glow) {
            let point = push((a + b + c) * (1.0 / 3.0), face);
            return painted(Kind::Unlit(Unlit { point, barycentric: None, is_flat: true }));
        }
        let normals = if triangle.smooth { vertices.map(|k| mesh.normals[k]) } else { [face; 3] };
        let [point, ..] = [(a, 0), (b, 1), (c, 2)].map(|(p, k)| push(p, normals[k]));
        let barycentric = Some(self.barycentric(sight, [a, b, c], flat));
        painted(Kind::Unlit(Unlit { point, barycentric, is_flat: !triangle.smooth }))
    }

    /// Normals of a triangle in the world, not of length 1.
    pub fn normals(
        &self,
        instance: &Instance,
        sight: &Sight,
        mesh: &Mesh,
        triangle: &Triangle,
    ) -> Plane {
        let vertices = triangle.vertices.map(usize::from);
        let [a, b, c] = vertices.map(|k| mesh.positions[k]);
        let flat = (b - a).cross(c - a);
        let face = unit(flat);
        let in_world = |n: Vec3| (instance.rotation * n).extend(0.0);
        if !triangle.smooth {
            return Plane { base: in_world(face), ..Plane::default() };
        }
        let [at_a, at_b, at_c] = vertices.map(|k| in_world(mesh.normals[k]));
        let [s, t] = self.barycentric(sight, [a, b, c], flat);
        Plane::mixed(at_a, (at_b - at_a, s), (at_c - at_a, t))
    }

    /// The second and third barycentric coordinate of a triangle over the image; `flat` is the cross
    /// product of the edges from its first vertex.
    fn barycentric(&self, sight: &Sight, [a, b, c]: [Vec3; 3], flat: Vec3) -> [Vec4; 2] {
        let face = unit(flat);
        let per_area2 = 1.0 / flat.dot(flat).max(1e-30);
        let s = self.plane(sight, (c - a).cross(flat) * per_area2, a, face);
        let t = self.plane(sight, flat.cross(b - a) * per_area2, a, face);
        [s, t]
    }

    /// Texture coordinates along two axes from the instance's origin.
    fn texture(&self, sight: &Sight, u: Vec3, v: Vec3, vertex: Vec3, face: Vec3) -> Plane {
        // From a vertex of the triangle, so that its plane is right in a plan view; then moved.
        let (pu, pv) = (self.plane(sight, u, vertex, face), self.plane(sight, v, vertex, face));
        let slant = sight.rays.ray.map(|r| face.dot(r));
        Plane {
            base: Vec4::new(pu.x + u.dot(vertex), pv.x + v.dot(vertex), 0.0, 0.0),
            at: Vec4::new(pu.y, pv.y, slant[0], 0.0),
            du: Vec4::new(pu.z, pv.z, slant[1], 0.0),
            dv: Vec4::new(pu.w, pv.w, slant[2], 0.0),
        }
    }

    /// A point of a thing, given in its frame.
    #[inline(always)]
    fn thing_point(
        &self,
        instance: &Instance,
        sight: &Sight,
        (gloss, color): (Gloss, Vec3),
        p: Vec3,
        n: Vec3,
    ) -> Point {
        let (point, normal) = (instance.rotation * p, instance.rotation * n);
        let to_eye =
            if self.is_plan { Vec3::Y } else { self.rays.eye[0] - instance.origin - point };
        let glows = gloss == Gloss::Glow;
        let color = if glows { color * self.frame.light.rig.glow() } else { color };
        // The foot of a thing stands in its own shadow.
        let tone = 0.76 + 0.24 * (point.y * 7.0).clamp(0.0, 1.0);
        Point { at: sight.middle, lamp: sight.lamp, normal, to_eye, color, gloss, tone }
    }

    /// Has a point of structure lit that is seen in column `k` of row `j`; gives its number.
    #[inline(always)]
    pub fn knot(
        &self,
        points: &mut Points,
        surface: &Surface,
        (k, j): (usize, usize),
        depth_m: f32,
    ) -> u32 {
        let point = self.structure_point(surface, k as f32 + 0.5, j as f32 + 0.5, depth_m);
        points.push(&point) as u32
    }

    /// A point of structure, seen in the pixel with middle (u, v) at a depth.
    #[inline(always)]
    fn structure_point(&self, surface: &Surface, u: f32, v: f32, depth_m: f32) -> Point {
        let (at, ray) = self.rays.point(u, v, depth_m);
        let Surface { color, normal, gloss, .. } = *surface;
        let (ground, rig) = (self.frame.light.ground, self.frame.light.rig);
        let (color, gloss) = match gloss {
            Gloss::Pane => (rig.sky_along(ray, self.lawn), Gloss::Glow),
            Gloss::Glow => (color * rig.glow(), gloss),
            _ => (color, gloss),
        };
        // A step off the surface leaves the wall.
        let lamp = ground.lamp(ground.room_at(at + normal * 0.1));
        let is_ceiling = normal.y < -0.5;
        let tone = if is_ceiling {
            CEILING_TONE
        } else if normal.y < 0.5 {
            let low = (1.0 - at.y * 2.2).max(0.0);
            let high = ground.ceiling_m.map_or(0.0, |c| (1.0 - (c - at.y) * 2.2).max(0.0));
            1.0 - 0.22 * low * low - 0.16 * high * high
        } else {
            1.0
        };
        let farther = if is_ceiling { CEILING_FARTHER_M } else { 0.0 };
        let at = Vec3::new(at.x, at.y + farther, at.z);
        Point { at, lamp, normal, to_eye: -ray, color, gloss, tone }
    }

    /// What is shown of the sky in the pixel with middle (u, v).
    #[inline(always)]
    pub fn sky(&self, u: f32, v: f32) -> Vec4 {
        if self.is_plan {
            return Vec4::splat(PAPER);
        }
        let rig = self.frame.light.rig;
        let (_, ray) = self.rays.point(u, v, 0.0);
        shown(rig.sky_along(ray, rig.sky[2]).extend(0.0))
    }
}

/// From linear light to what is shown, 0 to 255.
#[inline(always)]
fn shown(linear: Vec4) -> Vec4 {
    let mut lanes = linear.clamp(Vec4::ZERO, Vec4::ONE).to_array();
    for x in &mut lanes {
        *x = x.sqrt();
    }
    Vec4::from_array(lanes) * 255.0
}
