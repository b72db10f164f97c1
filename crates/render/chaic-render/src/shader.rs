//! Shading setup: the color source of a triangle, computed once for each visible triangle.

use chaic_core::{EntityId, Vec3};
use glam::Vec4;

use crate::ground::NO_ROOM;
use crate::light_rig::{CEILING_EXTRA_M, CEILING_FACTOR};
use crate::mesh::{Mesh, SpecularPreset, Triangle, unit};
use crate::planes::{Plane, Rays};
use crate::points::{SurfacePoint, SurfacePoints};
use crate::projection::Projection;
use crate::scene_frame::{Instance, SceneFrame};
use crate::texture::{Texture, Tile};

/// Gray value of the tops of walls on maps, 0 to 255.
const MAP_WALL: f32 = 44.0;

/// Lawn outside of windows, linear color.
const LAWN: [f32; 3] = [0.16, 0.28, 0.09];

/// Gray value of the background of maps, 0 to 255.
const MAP_BACKGROUND: f32 = 236.0;

/// Source of a triangle's color. Display colors are 0 to 255, with red, green and blue in the
/// lanes.
#[derive(Clone, Copy)]
pub(crate) enum ColorSource {
    /// Linear over the triangle, clamped.
    Linear(LinearColor),
    /// Interpolated from its vertices once they are lit; see [`Unlit::resolve`].
    Unlit(Unlit),
    /// Lit at samples, because structure is large.
    Structure(StructureMaterial),
}

/// Display color that is linear over a triangle, clamped to bounds.
#[derive(Clone, Copy)]
pub(crate) struct LinearColor {
    pub display: Plane,
    pub low: Vec4,
    pub high: Vec4,
}

impl LinearColor {
    /// Constant color.
    fn constant(display: Vec4) -> LinearColor {
        LinearColor {
            display: Plane { base: display, ..Plane::default() },
            low: display,
            high: display,
        }
    }
}

/// Material of a piece of structure before lighting.
#[derive(Clone, Copy)]
pub(crate) struct StructureMaterial {
    pub is_floor: bool,
    /// Linear color.
    color: Vec3,
    normal: Vec3,
    gloss: SpecularPreset,
}

/// A triangle of an object before its vertices are lit.
#[derive(Clone, Copy)]
pub(crate) struct Unlit {
    /// Index of its first surface point.
    point: u32,
    /// Planes of the second and third barycentric coordinate over the image; `None` if one point
    /// stands for the whole triangle.
    barycentric: Option<[Vec4; 2]>,
    is_flat: bool,
}

impl Unlit {
    /// Returns the color after the points are lit.
    #[inline(always)]
    pub fn resolve(&self, points: &SurfacePoints) -> LinearColor {
        let first = self.point as usize;
        let a = points.display(first);
        let Some([s, t]) = self.barycentric else { return LinearColor::constant(a) };
        let (b, c) = (points.display(first + 1), points.display(first + 2));
        let (mut low, mut high) = (a.min(b).min(c), a.max(b).max(c));
        if self.is_flat {
            // The triangle may be half of a parallelogram.
            let d = a + c - b;
            (low, high) = (low.min(d).max(Vec4::ZERO), high.max(d).min(Vec4::splat(255.0)));
        }
        LinearColor { display: Plane::combine(a, b - a, s, c - a, t), low, high }
    }
}

/// A triangle ready for shading.
#[derive(Clone, Copy)]
pub(crate) struct TriangleShading {
    pub entity: u16,
    pub source: ColorSource,
    pub tile: Tile,
    /// Texture coordinates, meters; all 0 without a texture. The slope of the third lane is the
    /// cosine between normal and ray (not normalized).
    pub texture: Plane,
}

/// Data that all triangles of an instance share in a view.
#[derive(Clone, Copy)]
pub(crate) struct InstanceShading {
    rays: Rays,
    /// Position of the instance for lighting by the lamp.
    center: Vec3,
    lamp: Option<Vec3>,
}

/// Sets up the shading of the triangles of one view.
pub(crate) struct Shader<'a> {
    pub frame: &'a SceneFrame<'a>,
    pub is_plan: bool,
    pub rays: Rays,
    /// Grid coordinates on the ground.
    pub ground: Plane,
    /// Color of an outdoor lawn, linear.
    lawn: Vec3,
}

impl<'a> Shader<'a> {
    /// Shader of a camera's view.
    pub fn new(frame: &'a SceneFrame<'a>, projection: &Projection) -> Shader<'a> {
        let Rays { eye, ray } = Rays::from_projection(projection);
        let flat = |v: Vec3| Vec4::new(v.x, v.z, 0.0, 0.0);
        let (cells_per_m, first) = frame.light.ground.grid();
        let from = flat(eye[0]) - Vec4::new(first.x, first.y, 0.0, 0.0);
        // In a plan view, all rays point straight down and do not move over the ground.
        let [at, du, dv] = if projection.is_plan { [Vec3::ZERO, eye[1], eye[2]] } else { ray };
        let ground = Plane {
            base: from * cells_per_m,
            at: flat(at) * cells_per_m,
            du: flat(du) * cells_per_m,
            dv: flat(dv) * cells_per_m,
        };
        let lawn = frame.light.light_rig.outdoor_color(LAWN.into());
        Shader { frame, is_plan: projection.is_plan, rays: Rays { eye, ray }, ground, lawn }
    }

    /// Returns the data that an instance's triangles share.
    pub fn instance_shading(&self, instance: &Instance) -> InstanceShading {
        let center = instance.origin + instance.rotation * (0.5 * (instance.min + instance.max));
        let lamp = self.frame.light.ground.lamp(instance.room.unwrap_or(NO_ROOM));
        InstanceShading { rays: self.rays.in_object_frame(instance), center, lamp }
    }

    /// Plane of a quantity with this gradient (in the instance frame) that is 0 at `zero`, as
    /// (base, at, du, dv). In a plan view, the eye moves with the pixel instead of the ray. There,
    /// the plane of the triangle makes depth a linear quantity too, so that w = 1 applies.
    fn plane(&self, shared: &InstanceShading, gradient: Vec3, zero: Vec3, normal: Vec3) -> Vec4 {
        let Rays { eye, ray } = &shared.rays;
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

    /// Sets up the shading of a triangle. Points that must be lit are added to `points`.
    #[inline(never)]
    pub fn shade_triangle(
        &self,
        instance: &Instance,
        shared: &InstanceShading,
        mesh: &Mesh,
        triangle: &Triangle,
        points: &mut SurfacePoints,
    ) -> TriangleShading {
        let material = &mesh.materials[usize::from(triangle.material)];
        let vertices = triangle.vertices.map(usize::from);
        let [a, b, c] = vertices.map(|k| mesh.positions[k]);
        let flat = (b - a).cross(c - a);
        let face = unit(flat);
        let color = match instance.tint {
            Some(tint) if material.tinted => tint,
            _ => material.color,
        };
        let color = Vec3::from(color) * instance.factor;
        let tile = Tile::new(material.texture);
        let mut texture = Plane::default();
        if material.texture != Texture::Plain {
            let axes = &material.axes;
            let facing = [axes.x_axis, axes.y_axis, axes.z_axis].map(|x| x.dot(face).abs());
            // Project along the axis most perpendicular to the face; the longer remaining axis is
            // u.
            let (u, v) = if facing[0] > facing[1] && facing[0] > facing[2] {
                (axes.y_axis, axes.z_axis)
            } else if facing[1] > facing[2] {
                (axes.x_axis, axes.z_axis)
            } else {
                (axes.x_axis, axes.y_axis)
            };
            texture = self.texture(shared, u, v, a, face);
        }
        let with_source =
            |source| TriangleShading { entity: instance.entity.0, source, tile, texture };
        if instance.room.is_none() {
            let is_floor = instance.entity == EntityId::FLOOR;
            let (normal, gloss) = (instance.rotation * face, material.gloss);
            if self.is_plan && normal.y > 0.5 && !is_floor {
                // A map shows the position of walls without lighting.
                let display = Vec3::splat(MAP_WALL).extend(0.0);
                return with_source(ColorSource::Linear(LinearColor::constant(display)));
            }
            return with_source(ColorSource::Structure(StructureMaterial {
                is_floor,
                color,
                normal,
                gloss,
            }));
        }
        let mut push = |p: Vec3, n: Vec3| {
            let point = self.object_point(instance, shared, material.gloss, color, p, n);
            points.push(&point) as u32
        };
        if !triangle.smooth && matches!(material.gloss, SpecularPreset::Dull | SpecularPreset::Glow)
        {
            let point = push((a + b + c) * (1.0 / 3.0), face);
            return with_source(ColorSource::Unlit(Unlit {
                point,
                barycentric: None,
                is_flat: true,
            }));
        }
        let normals = if triangle.smooth { vertices.map(|k| mesh.normals[k]) } else { [face; 3] };
        let [point, ..] = [(a, 0), (b, 1), (c, 2)].map(|(p, k)| push(p, normals[k]));
        let barycentric = Some(self.barycentric(shared, [a, b, c], flat));
        with_source(ColorSource::Unlit(Unlit { point, barycentric, is_flat: !triangle.smooth }))
    }

    /// World normals of a triangle, not normalized.
    pub fn normals(
        &self,
        instance: &Instance,
        shared: &InstanceShading,
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
        let [s, t] = self.barycentric(shared, [a, b, c], flat);
        Plane::combine(at_a, at_b - at_a, s, at_c - at_a, t)
    }

    /// Planes of the second and third barycentric coordinate of a triangle. `flat` is the cross
    /// product of the edges from its first vertex.
    fn barycentric(&self, shared: &InstanceShading, [a, b, c]: [Vec3; 3], flat: Vec3) -> [Vec4; 2] {
        let face = unit(flat);
        let per_area2 = 1.0 / flat.dot(flat).max(1e-30);
        let s = self.plane(shared, (c - a).cross(flat) * per_area2, a, face);
        let t = self.plane(shared, flat.cross(b - a) * per_area2, a, face);
        [s, t]
    }

    /// Planes of the texture coordinates along two axes from the instance's origin.
    fn texture(
        &self,
        shared: &InstanceShading,
        u: Vec3,
        v: Vec3,
        vertex: Vec3,
        face: Vec3,
    ) -> Plane {
        // Relative to a vertex of the triangle, so that its plane is correct in a plan view; then
        // shifted.
        let (pu, pv) = (self.plane(shared, u, vertex, face), self.plane(shared, v, vertex, face));
        let slant = shared.rays.ray.map(|r| face.dot(r));
        Plane {
            base: Vec4::new(pu.x + u.dot(vertex), pv.x + v.dot(vertex), 0.0, 0.0),
            at: Vec4::new(pu.y, pv.y, slant[0], 0.0),
            du: Vec4::new(pu.z, pv.z, slant[1], 0.0),
            dv: Vec4::new(pu.w, pv.w, slant[2], 0.0),
        }
    }

    /// Surface point of an object, given in the object frame.
    #[inline(always)]
    fn object_point(
        &self,
        instance: &Instance,
        shared: &InstanceShading,
        gloss: SpecularPreset,
        color: Vec3,
        p: Vec3,
        n: Vec3,
    ) -> SurfacePoint {
        let (point, normal) = (instance.rotation * p, instance.rotation * n);
        let to_eye =
            if self.is_plan { Vec3::Y } else { self.rays.eye[0] - instance.origin - point };
        let is_emissive = gloss == SpecularPreset::Glow;
        let color = if is_emissive { color * self.frame.light.light_rig.glow() } else { color };
        // Approximates ambient occlusion at the foot of an object.
        let occlusion = 0.76 + 0.24 * (point.y * 7.0).clamp(0.0, 1.0);
        SurfacePoint {
            position: shared.center,
            lamp: shared.lamp,
            normal,
            to_eye,
            color,
            gloss,
            occlusion,
        }
    }

    /// Queues a shading sample for the structure point at pixel (k, j); returns its index.
    #[inline(always)]
    pub fn add_shading_sample(
        &self,
        points: &mut SurfacePoints,
        surface: &StructureMaterial,
        k: usize,
        j: usize,
        depth_m: f32,
    ) -> u32 {
        let point = self.structure_point(surface, k as f32 + 0.5, j as f32 + 0.5, depth_m);
        points.push(&point) as u32
    }

    /// Surface point of structure, seen at pixel center (u, v) at a depth.
    #[inline(always)]
    fn structure_point(
        &self,
        surface: &StructureMaterial,
        u: f32,
        v: f32,
        depth_m: f32,
    ) -> SurfacePoint {
        let (position, ray) = self.rays.point(u, v, depth_m);
        let StructureMaterial { color, normal, gloss, .. } = *surface;
        let (ground, light_rig) = (self.frame.light.ground, self.frame.light.light_rig);
        let (color, gloss) = match gloss {
            SpecularPreset::Pane => (light_rig.sky_color(ray, self.lawn), SpecularPreset::Glow),
            SpecularPreset::Glow => (color * light_rig.glow(), gloss),
            _ => (color, gloss),
        };
        // A step along the normal leaves the wall.
        let lamp = ground.lamp(ground.room_at(position + normal * 0.1));
        let is_ceiling = normal.y < -0.5;
        let occlusion = if is_ceiling {
            CEILING_FACTOR
        } else if normal.y < 0.5 {
            let low = (1.0 - position.y * 2.2).max(0.0);
            let high = ground.ceiling_m.map_or(0.0, |c| (1.0 - (c - position.y) * 2.2).max(0.0));
            1.0 - 0.22 * low * low - 0.16 * high * high
        } else {
            1.0
        };
        let extra_m = if is_ceiling { CEILING_EXTRA_M } else { 0.0 };
        let position = Vec3::new(position.x, position.y + extra_m, position.z);
        SurfacePoint { position, lamp, normal, to_eye: -ray, color, gloss, occlusion }
    }

    /// Returns the display color of the sky at pixel center (u, v).
    #[inline(always)]
    pub fn sky(&self, u: f32, v: f32) -> Vec4 {
        if self.is_plan {
            return Vec4::splat(MAP_BACKGROUND);
        }
        let light_rig = self.frame.light.light_rig;
        let (_, ray) = self.rays.point(u, v, 0.0);
        to_display(light_rig.sky_color(ray, light_rig.sky[2]).extend(0.0))
    }
}

/// Converts linear light to a display color, 0 to 255.
#[inline(always)]
fn to_display(linear: Vec4) -> Vec4 {
    let mut lanes = linear.clamp(Vec4::ZERO, Vec4::ONE).to_array();
    for x in &mut lanes {
        *x = x.sqrt();
    }
    Vec4::from_array(lanes) * 255.0
}
