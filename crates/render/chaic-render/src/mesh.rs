//! Triangle meshes, and the ways of building them.
//!
//! Corners are shared between flat and smooth triangles: a flat triangle takes its own plane's
//! normal, a smooth one interpolates the vertices' normals. Triangles are counter-clockwise seen
//! from outside, and every solid is closed, so that back faces never need to be drawn.

use chaic_core::Vec3;
use chaic_core::catalogue::Finish;
use chaic_core::geom::math;
use glam::Mat3;

use crate::texture::{Texture, linear_from_shown};

/// How a group of triangles looks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Skin {
    /// Linear light, 0 to 1.
    pub color: [f32; 3],
    pub texture: Texture,
    /// Strength and sharpness of the highlight.
    pub gloss: Gloss,
    /// Columns are the skin's axes in the object, longest extent first: the grain runs along it.
    pub axes: Mat3,
    /// Whether an object's variant recolors it.
    pub tinted: bool,
}

/// How a surface answers to light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Gloss {
    /// No highlight to speak of: cloth, plaster, carpet.
    Dull,
    /// A broad, faint highlight: wood, skin, tiles.
    Satin,
    /// A small, bright highlight: varnish, plastic.
    Shiny,
    /// A highlight in the metal's own color.
    Metal,
    /// The sharpest highlight; drawn opaque.
    Glass,
    /// Gives light of its own color, as warm as the scene's lamps: a lamp.
    Glow,
    /// A window's pane, through which the sky is seen, and a lawn below the horizon. Of structure only.
    Pane,
}

impl Skin {
    pub fn new(srgb: [u8; 3], finish: Finish) -> Skin {
        let (texture, gloss) = match finish {
            Finish::Matte => (Texture::Plain, Gloss::Dull),
            Finish::Glossy => (Texture::Plain, Gloss::Shiny),
            Finish::Metal => (Texture::Brushed, Gloss::Metal),
            Finish::Wood => (Texture::Grain, Gloss::Satin),
            Finish::Fabric => (Texture::Weave, Gloss::Dull),
            Finish::Wicker => (Texture::Wicker, Gloss::Dull),
            Finish::Skin => (Texture::Mottle, Gloss::Satin),
            Finish::Crust => (Texture::Crust, Gloss::Dull),
            Finish::Glass => (Texture::Plain, Gloss::Glass),
        };
        let color = linear_from_shown(srgb);
        Skin { color, texture, gloss, axes: Mat3::IDENTITY, tinted: false }
    }

    pub fn with_axes(mut self, axes: Mat3) -> Skin {
        self.axes = axes;
        self
    }
}

/// One triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub vertices: [u16; 3],
    pub skin: u8,
    pub smooth: bool,
}

/// A mesh in its object's frame, metres.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub positions: Vec<Vec3>,
    /// Unit normals, per vertex; meaningless for vertices of flat triangles only.
    pub normals: Vec<Vec3>,
    pub triangles: Vec<Triangle>,
    /// First, second and third vertices of all triangles once more, side by side.
    pub indices: [Vec<u16>; 3],
    /// The first triangle of the face that each triangle is part of: the halves of a flat
    /// quadrilateral look as one.
    pub faces: Vec<u16>,
    pub skins: Vec<Skin>,
    pub min: Vec3,
    pub max: Vec3,
}

/// A box in the object's frame that a solid fills.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub center: Vec3,
    /// Columns are the box's axes; a rotation.
    pub axes: Mat3,
    /// Full extents along the axes, metres.
    pub extent: Vec3,
}

impl Place {
    pub fn upright(center: Vec3, extent: Vec3) -> Place {
        Place { center, axes: Mat3::IDENTITY, extent }
    }

    /// A point given in [-0.5, 0.5]^3.
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.center + self.axes * (p * self.extent)
    }

    /// The unit normal that a normal of the unit form becomes.
    pub fn normal(&self, n: Vec3) -> Vec3 {
        unit(self.axes * (n / self.extent))
    }

    /// The box's axes, that of the longest extent first.
    pub fn grain(&self) -> Mat3 {
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

/// The vector of length 1, by correctly rounded operations only; up for the zero vector.
pub fn unit(v: Vec3) -> Vec3 {
    let l2 = v.x * v.x + v.y * v.y + v.z * v.z;
    if l2 > 1e-30 && l2 < 1e30 { v * (1.0 / l2.sqrt()) } else { Vec3::Y }
}

/// The length, by correctly rounded operations only.
pub(crate) fn length(v: Vec3) -> f32 {
    (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}

/// A point of the unit circle after `k` of `n` steps.
pub(crate) fn circle(k: usize, n: usize) -> (f32, f32) {
    let a = std::f32::consts::TAU * k as f32 / n as f32;
    (math::cos(a), math::sin(a))
}

/// A cross-section of a tube: an ellipse around `center` spanned by `a` and `b`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Section {
    pub center: Vec3,
    pub a: Vec3,
    pub b: Vec3,
}

/// The least cosine between the normals of the halves of a quadrilateral that counts as flat: their
/// angle is below half a degree.
const FLAT: f32 = 0.999_97;

impl Mesh {
    /// Most vertices: indices have 16 bits.
    const MAX_VERTICES: usize = 65_000;

    /// Begins a new skin for what is added next.
    pub fn skin(&mut self, skin: Skin) {
        if self.skins.len() < 255 {
            self.skins.push(skin);
        }
    }

    /// Works out the bounds; to be called when all is added.
    pub fn finish(mut self) -> Mesh {
        let first = self.positions.first().copied().unwrap_or(Vec3::ZERO);
        (self.min, self.max) = (first, first);
        for p in &self.positions {
            self.min = self.min.min(*p);
            self.max = self.max.max(*p);
        }
        self
    }

    /// The vertices of each triangle.
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
        let skin = self.skins.len().saturating_sub(1) as u8;
        let vertices = vertices.map(|c| c as u16);
        self.faces.push(self.triangles.len() as u16);
        self.triangles.push(Triangle { vertices, skin, smooth });
        for (list, vertex) in self.indices.iter_mut().zip(vertices) {
            list.push(vertex);
        }
    }

    /// A quadrilateral, counter-clockwise from outside.
    pub fn quad(&mut self, [a, b, c, d]: [usize; 4], smooth: bool) {
        let n = self.triangles.len();
        self.triangle([a, b, c], smooth);
        self.triangle([a, c, d], smooth);
        if !smooth && self.triangles.len() == n + 2 {
            let [a, b, c, d] = [a, b, c, d].map(|k| self.positions[k]);
            let [one, other] = [(b - a).cross(c - a), (c - a).cross(d - a)].map(unit);
            if one.dot(other) > FLAT {
                self.faces[n + 1] = n as u16;
            }
        }
    }

    /// Joins two rings of `n` vertices that begin at `low` and `high`. Outside is to the right of
    /// the direction from low to high for rings that turn from +x to +z.
    pub fn band(&mut self, low: usize, high: usize, n: usize, smooth: bool) {
        for k in 0..n {
            let l = (k + 1) % n;
            self.quad([low + k, high + k, high + l, low + l], smooth);
        }
    }

    /// Closes a ring with a flat fan around its own first vertex.
    pub fn lid(&mut self, ring: usize, n: usize, reversed: bool) {
        for k in 1..n.saturating_sub(1) {
            let (a, b) = if reversed { (k, k + 1) } else { (k + 1, k) };
            self.triangle([ring, ring + a, ring + b], false);
        }
    }

    /// A smooth tube through elliptic sections, closed at both ends. `a` x `b` of each section
    /// points against the direction of travel.
    pub fn tube(&mut self, sections: &[Section], n: usize) {
        let base = self.positions.len();
        for s in sections {
            for k in 0..n {
                let (c, sn) = circle(k, n);
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
            self.band(base + (j - 1) * n, base + j * n, n, true);
        }
        self.lid(base, n, true);
        self.lid(base + (m - 1) * n, n, false);
    }

    /// A round limb from `from` to `to` with rounded ends.
    pub fn limb(&mut self, from: Vec3, to: Vec3, radius_from: f32, radius_to: f32, n: usize) {
        let along = unit(to - from);
        let side =
            unit(if along.x.abs() < 0.7 { along.cross(Vec3::X) } else { along.cross(Vec3::Z) });
        let other = side.cross(along);
        let section = |center: Vec3, r: f32| Section { center, a: side * r, b: other * r };
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
