//! Triangle meshes and their basic construction.
//!
//! Flat and smooth triangles share vertices: a flat triangle uses its geometric normal, a smooth
//! one interpolates the vertex normals. Triangles are counter-clockwise seen from outside. Every
//! solid is closed, so that back faces never need to be drawn.

use chaic_core::Vec3;
use chaic_core::catalogue::Finish;
use chaic_core::geom::math;
use glam::Mat3;

use crate::texture::{Texture, linear_from_display};

/// Material of a group of triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Material {
    /// Linear color, 0 to 1.
    pub color: [f32; 3],
    pub texture: Texture,
    /// Strength and sharpness of the highlight.
    pub gloss: SpecularPreset,
    /// Columns are the texture axes in the object frame, longest extent first: wood grain runs
    /// along it.
    pub axes: Mat3,
    /// True if the tint of an object replaces the color.
    pub tinted: bool,
}

/// Reflection model of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SpecularPreset {
    /// No visible highlight: cloth, plaster, carpet.
    Dull,
    /// Broad, faint highlight: wood, skin, tiles.
    Satin,
    /// Small, bright highlight: varnish, plastic.
    Shiny,
    /// Highlight in the color of the metal.
    Metal,
    /// Sharpest highlight; rendered opaque.
    Glass,
    /// Emission in the color of the surface and of the scene's lamps: a lamp.
    Glow,
    /// Window pane: shows the sky, and a lawn below the horizon. Only for structure.
    Pane,
}

impl Material {
    pub fn new(srgb: [u8; 3], finish: Finish) -> Material {
        let (texture, gloss) = match finish {
            Finish::Matte => (Texture::Plain, SpecularPreset::Dull),
            Finish::Glossy => (Texture::Plain, SpecularPreset::Shiny),
            Finish::Metal => (Texture::Brushed, SpecularPreset::Metal),
            Finish::Wood => (Texture::Grain, SpecularPreset::Satin),
            Finish::Fabric => (Texture::Weave, SpecularPreset::Dull),
            Finish::Wicker => (Texture::Wicker, SpecularPreset::Dull),
            Finish::Skin => (Texture::Mottle, SpecularPreset::Satin),
            Finish::Crust => (Texture::Crust, SpecularPreset::Dull),
            Finish::Glass => (Texture::Plain, SpecularPreset::Glass),
        };
        let color = linear_from_display(srgb);
        Material { color, texture, gloss, axes: Mat3::IDENTITY, tinted: false }
    }

    pub fn with_axes(mut self, axes: Mat3) -> Material {
        self.axes = axes;
        self
    }
}

/// One triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub vertices: [u16; 3],
    pub material: u8,
    pub smooth: bool,
}

/// A mesh in its object frame, meters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub positions: Vec<Vec3>,
    /// Unit normal of each vertex; undefined for vertices that only flat triangles use.
    pub normals: Vec<Vec3>,
    pub triangles: Vec<Triangle>,
    /// Vertex indices of all triangles again, one array per corner.
    pub indices: [Vec<u16>; 3],
    /// First triangle of the face of each triangle: the two halves of a planar quad are one face.
    pub faces: Vec<u16>,
    pub materials: Vec<Material>,
    /// Index of the material of the next triangle.
    material: u8,
    pub min: Vec3,
    pub max: Vec3,
}

/// Oriented box in the object frame that a solid fills.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OrientedBox {
    pub center: Vec3,
    /// Columns are the axes of the box; a rotation.
    pub axes: Mat3,
    /// Full extents along the axes, meters.
    pub extent: Vec3,
}

impl OrientedBox {
    pub fn upright(center: Vec3, extent: Vec3) -> OrientedBox {
        OrientedBox { center, axes: Mat3::IDENTITY, extent }
    }

    /// Maps a point from [-0.5, 0.5]^3 into the box.
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.center + self.axes * (p * self.extent)
    }

    /// Transforms a normal of the unit solid; returns a unit vector.
    pub fn normal(&self, n: Vec3) -> Vec3 {
        unit(self.axes * (n / self.extent))
    }

    /// Returns the axes of the box, that of the longest extent first.
    pub fn grain_axes(&self) -> Mat3 {
        let e = self.extent.to_array();
        let longest = if e[0] >= e[1] && e[0] >= e[2] {
            0
        } else if e[1] >= e[2] {
            1
        } else {
            2
        };
        let axis = |k: usize| self.axes.col((longest + k) % 3);
        Mat3::from_cols(axis(0), axis(1), axis(2))
    }
}

/// Normalizes a vector with correctly rounded operations only; returns +y for the zero vector.
pub fn unit(v: Vec3) -> Vec3 {
    let l2 = v.x * v.x + v.y * v.y + v.z * v.z;
    if l2 > 1e-30 && l2 < 1e30 { v * (1.0 / l2.sqrt()) } else { Vec3::Y }
}

/// Length of a vector, with correctly rounded operations only.
pub(crate) fn length(v: Vec3) -> f32 {
    (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}

/// Point on the unit circle after `k` of `n` steps.
pub(crate) fn unit_circle(k: usize, n: usize) -> (f32, f32) {
    let a = std::f32::consts::TAU * k as f32 / n as f32;
    (math::cos(a), math::sin(a))
}

/// Cross-section of a tube: an ellipse around `center` spanned by `a` and `b`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Section {
    pub center: Vec3,
    pub a: Vec3,
    pub b: Vec3,
}

/// Minimum cosine between the normals of the two halves of a planar quad: the angle is below half a
/// degree.
const PLANAR_COSINE: f32 = 0.999_97;

impl Mesh {
    /// Maximum number of vertices: indices have 16 bits.
    const MAX_VERTICES: usize = 65_000;
    /// Maximum number of materials: indices have 8 bits.
    pub const MAX_MATERIALS: usize = 255;

    /// Begins a new material for the triangles that follow. In a full list, an equal material is
    /// used again, as in long walls with many windows; without one, the current material stays.
    pub fn set_material(&mut self, material: Material) {
        let n = self.materials.len();
        if n < Mesh::MAX_MATERIALS {
            self.materials.push(material);
            self.material = n as u8;
        } else if let Some(k) = self.materials.iter().position(|m| *m == material) {
            self.material = k as u8;
        }
    }

    /// Appends another mesh and returns true, or changes nothing and returns false if the result
    /// would exceed the maximum number of vertices, triangles or materials.
    pub fn append(&mut self, other: &Mesh) -> bool {
        let (n_vertices, n_triangles) = (self.positions.len(), self.triangles.len());
        let n_free = Mesh::MAX_MATERIALS.saturating_sub(self.materials.len());
        let (new, others) = other.materials.split_at(n_free.min(other.materials.len()));
        let is_known = |m: &Material| self.materials.contains(m) || new.contains(m);
        if n_vertices + other.positions.len() > Mesh::MAX_VERTICES
            || n_triangles + other.triangles.len() > Mesh::MAX_VERTICES
            || !others.iter().all(is_known)
        {
            return false;
        }
        let mut materials = Vec::with_capacity(other.materials.len());
        for material in &other.materials {
            self.set_material(*material);
            materials.push(self.material);
        }
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        for (triangle, face) in other.triangles.iter().zip(&other.faces) {
            self.material = materials[usize::from(triangle.material)];
            let vertices = triangle.vertices.map(|k| n_vertices + usize::from(k));
            self.triangle(vertices, triangle.smooth);
            if let Some(last) = self.faces.last_mut() {
                *last = n_triangles as u16 + face;
            }
        }
        true
    }

    /// Computes the bounding box; call it after the last triangle.
    pub fn finish(mut self) -> Mesh {
        let first = self.positions.first().copied().unwrap_or(Vec3::ZERO);
        (self.min, self.max) = (first, first);
        for p in &self.positions {
            self.min = self.min.min(*p);
            self.max = self.max.max(*p);
        }
        self
    }

    /// Iterates over the vertex indices of each triangle.
    pub fn triangle_indices(&self) -> impl Iterator<Item = (u16, u16, u16)> {
        let [a, b, c] = &self.indices;
        a.iter().zip(b).zip(c).map(|((a, b), c)| (*a, *b, *c))
    }

    pub fn vertex(&mut self, position: Vec3, normal: Vec3) -> usize {
        self.positions.push(position);
        self.normals.push(normal);
        self.positions.len() - 1
    }

    pub fn triangle(&mut self, vertices: [usize; 3], smooth: bool) {
        let fits = vertices.iter().all(|c| *c < Mesh::MAX_VERTICES);
        if !fits || self.triangles.len() >= Mesh::MAX_VERTICES {
            return;
        }
        let material = self.material;
        let vertices = vertices.map(|c| c as u16);
        self.faces.push(self.triangles.len() as u16);
        self.triangles.push(Triangle { vertices, material, smooth });
        for (list, vertex) in self.indices.iter_mut().zip(vertices) {
            list.push(vertex);
        }
    }

    /// Adds a quad, counter-clockwise from outside.
    pub fn quad(&mut self, [a, b, c, d]: [usize; 4], smooth: bool) {
        let n = self.triangles.len();
        self.triangle([a, b, c], smooth);
        self.triangle([a, c, d], smooth);
        if !smooth && self.triangles.len() == n + 2 {
            let [a, b, c, d] = [a, b, c, d].map(|k| self.positions[k]);
            let [first, second] = [(b - a).cross(c - a), (c - a).cross(d - a)].map(unit);
            if first.dot(second) > PLANAR_COSINE {
                self.faces[n + 1] = n as u16;
            }
        }
    }

    /// Joins two rings of `n` vertices that begin at `low` and `high`. For rings that turn from +x
    /// to +z, the outside is to the right of the direction from low to high.
    pub fn join_rings(&mut self, low: usize, high: usize, n: usize, smooth: bool) {
        for k in 0..n {
            let l = (k + 1) % n;
            self.quad([low + k, high + k, high + l, low + l], smooth);
        }
    }

    /// Closes a ring with a flat fan around its first vertex.
    pub fn cap(&mut self, ring: usize, n: usize, reversed: bool) {
        for k in 1..n.saturating_sub(1) {
            let (a, b) = if reversed { (k, k + 1) } else { (k + 1, k) };
            self.triangle([ring, ring + a, ring + b], false);
        }
    }

    /// Adds a smooth tube through elliptic sections, with caps at both ends. `a` x `b` of each
    /// section points against the direction of travel.
    pub fn tube(&mut self, sections: &[Section], n: usize) {
        let base = self.positions.len();
        for s in sections {
            for k in 0..n {
                let (c, sn) = unit_circle(k, n);
                self.vertex(s.center + s.a * c + s.b * sn, Vec3::Y);
            }
        }
        let m = sections.len();
        for j in 0..m {
            for k in 0..n {
                let at = |j: usize, k: usize| self.positions[base + j * n + k % n];
                let along = at((j + 1).min(m - 1), k) - at(j.saturating_sub(1), k);
                let around = at(j, k + 1) - at(j, k + n - 1);
                self.normals[base + j * n + k] = unit(along.cross(around));
            }
        }
        for j in 1..m {
            self.join_rings(base + (j - 1) * n, base + j * n, n, true);
        }
        self.cap(base, n, true);
        self.cap(base + (m - 1) * n, n, false);
    }

    /// Adds a round limb from `from` to `to` with rounded ends.
    pub fn limb(&mut self, from: Vec3, to: Vec3, radius_from: f32, radius_to: f32, n: usize) {
        let along = unit(to - from);
        let side =
            unit(if along.x.abs() < 0.7 { along.cross(Vec3::X) } else { along.cross(Vec3::Z) });
        let second = side.cross(along);
        let section = |center: Vec3, r: f32| Section { center, a: side * r, b: second * r };
        self.tube(
            &[
                section(from - along * (0.85 * radius_from), 0.5 * radius_from),
                section(from - along * (0.3 * radius_from), 0.95 * radius_from),
                section(0.6 * from + 0.4 * to, 0.6 * radius_from + 0.4 * radius_to),
                section(to + along * (0.3 * radius_to), 0.95 * radius_to),
                section(to + along * (0.85 * radius_to), 0.5 * radius_to),
            ],
            n,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_list_of_materials_is_used_again() {
        let color = |k: usize| Material::new([(k % 100) as u8, 0, 0], Finish::Matte);
        let mut mesh = Mesh::default();
        for x in [0.0, 1.0, 2.0] {
            mesh.vertex(Vec3::new(x, x * x, 0.0), Vec3::Y);
        }
        for k in 0..10 * Mesh::MAX_MATERIALS {
            mesh.set_material(color(k));
            mesh.triangle([0, 1, 2], false);
        }
        assert_eq!(mesh.materials.len(), Mesh::MAX_MATERIALS);
        for (k, triangle) in mesh.triangles.iter().enumerate() {
            assert_eq!(mesh.materials[usize::from(triangle.material)], color(k), "{k}");
        }
    }

    #[test]
    fn a_mesh_is_appended_completely_or_not_at_all() {
        let quad = |colors: &[u8]| {
            let mut mesh = Mesh::default();
            for [x, y] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                mesh.vertex(Vec3::new(x, y, 0.0), Vec3::Y);
            }
            for color in colors {
                mesh.set_material(Material::new([*color, 0, 0], Finish::Matte));
                mesh.quad([0, 1, 2, 3], false);
            }
            mesh
        };
        let mut mesh = quad(&[1]);
        assert!(mesh.append(&quad(&[2, 3])));
        let vertices: Vec<u16> = mesh.triangles.iter().map(|t| t.vertices[0]).collect();
        assert_eq!(vertices, [0, 0, 4, 4, 4, 4]);
        assert_eq!(mesh.faces, [0, 0, 2, 2, 4, 4]);
        let materials: Vec<u8> = mesh.triangles.iter().map(|t| t.material).collect();
        assert_eq!(materials, [0, 0, 1, 1, 2, 2]);
        assert_eq!((mesh.positions.len(), mesh.normals.len(), mesh.indices[2].len()), (8, 8, 6));
        while mesh.materials.len() < Mesh::MAX_MATERIALS {
            assert!(mesh.append(&quad(&[3])));
        }
        let n = mesh.triangles.len();
        assert!(!mesh.append(&quad(&[3, 4])), "a material does not fit");
        assert_eq!((mesh.triangles.len(), mesh.materials.len()), (n, Mesh::MAX_MATERIALS));
        assert!(mesh.append(&quad(&[1, 3])), "equal materials are used again");
        while mesh.positions.len() + 4 <= Mesh::MAX_VERTICES {
            assert!(mesh.append(&quad(&[3])));
        }
        assert!(!mesh.append(&quad(&[3])), "vertices do not fit");
    }

    #[test]
    fn triangles_beyond_the_limits_are_left_out() {
        let mut mesh = Mesh::default();
        for k in 0..=1 << 16 {
            mesh.vertex(Vec3::splat(k as f32), Vec3::Y);
        }
        let last = Mesh::MAX_VERTICES - 1;
        for vertex in [last, last + 1, 1 << 16] {
            mesh.triangle([0, 1, vertex], false);
        }
        let vertices: Vec<[u16; 3]> = mesh.triangles.iter().map(|t| t.vertices).collect();
        assert_eq!(vertices, [[0, 1, last as u16]]);
        for _ in 0..Mesh::MAX_VERTICES + 10 {
            mesh.quad([0, 1, 2, 3], false);
        }
        assert_eq!(mesh.triangles.len(), Mesh::MAX_VERTICES);
        assert!(mesh.faces.iter().enumerate().all(|(k, face)| usize::from(*face) <= k));
        assert!(mesh.indices.iter().all(|list| list.len() == Mesh::MAX_VERTICES));
    }
}
