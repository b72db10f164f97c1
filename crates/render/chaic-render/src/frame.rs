//! One moment of a world, ready to be looked at by any number of cameras.

use std::sync::{Arc, OnceLock};

use chaic_core::{ClassId, EntityId, Vec3};
use chaic_world::Thing;
use glam::Mat3;

use crate::mesh::{Mesh, length};
use crate::models::{N_STYLES, thing_mesh};
use crate::portals::{PortalGraph, RegionSet};
use crate::solids::{N_LEVELS, place_of};

/// The mesh of a thing's shape, at every level of detail, each made when first needed.
#[derive(Debug)]
pub(crate) struct ClassMesh {
    thing: Thing,
    style: u8,
    pub min: Vec3,
    pub max: Vec3,
    levels: [OnceLock<Mesh>; N_LEVELS],
}

/// Class, style, scale and height of the seat, the latter two as bits.
pub(crate) type ShapeKey = (ClassId, u8, [u32; 3], Option<u32>);

impl ClassMesh {
    /// The mesh of a thing in a style, wherever it is. Those of catalogue size are shared by all
    /// scenes of the process.
    pub fn of(thing: &Thing, style: u8) -> Arc<ClassMesh> {
        const N: usize = 256 * N_STYLES as usize;
        static UNSCALED: [OnceLock<Arc<ClassMesh>>; N] = [const { OnceLock::new() }; N];
        let style = style % N_STYLES;
        let make = || Arc::new(ClassMesh::new(thing, style));
        let is_usual = thing.scale == [1.0; 3] && thing.seat_m.is_none();
        let slot = thing.class.index() * usize::from(N_STYLES) + usize::from(style);
        if is_usual { UNSCALED[slot].get_or_init(make).clone() } else { make() }
    }

    fn new(thing: &Thing, style: u8) -> ClassMesh {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for part in thing.parts() {
            let place = place_of(&part, thing.size_m());
            let half = 0.5
                * (place.axes.x_axis.abs() * place.extent.x
                    + place.axes.y_axis.abs() * place.extent.y
                    + place.axes.z_axis.abs() * place.extent.z);
            min = min.min(place.center - half);
            max = max.max(place.center + half);
        }
        if min.x > max.x {
            (min, max) = (Vec3::ZERO, Vec3::ZERO);
        }
        ClassMesh { thing: *thing, style, min, max, levels: [const { OnceLock::new() }; N_LEVELS] }
    }

    /// The class.
    pub fn class(&self) -> ClassId {
        self.thing.class
    }

    /// What decides the shape: equal for equal shapes only.
    pub fn key(&self) -> ShapeKey {
        let Thing { class, scale, seat_m, .. } = &self.thing;
        (*class, self.style, scale.map(f32::to_bits), seat_m.map(f32::to_bits))
    }

    fn level(&self, level: usize) -> &Mesh {
        self.levels[level].get_or_init(|| thing_mesh(&self.thing, self.style, level))
    }
}

/// Where an instance's triangles come from.
#[derive(Clone, Copy)]
pub(crate) enum Shape<'a> {
    Fixed(&'a Mesh),
    Class(&'a ClassMesh),
    Body(&'a crate::people::Body),
}

impl<'a> Shape<'a> {
    pub fn mesh(&self, level: usize) -> &'a Mesh {
        match self {
            Shape::Fixed(mesh) => mesh,
            Shape::Class(class) => class.level(level),
            Shape::Body(body) => body.level(level),
        }
    }
}

/// A mesh somewhere in the world.
pub(crate) struct Instance<'a> {
    pub entity: EntityId,
    pub shape: Shape<'a>,
    /// Rotates from the object's frame to the world.
    pub rotation: Mat3,
    pub origin: Vec3,
    /// Bounds in the object's frame.
    pub min: Vec3,
    pub max: Vec3,
    /// Color in place of the tinted skins' own, linear.
    pub tint: Option<[f32; 3]>,
    /// By what linear colors are multiplied.
    pub factor: Vec3,
    /// The room whose lamp shines on it; structure is lit point by point.
    pub room: Option<u8>,
    /// The regions it reaches into, where they are known already: those of structure.
    pub regions: Option<RegionSet>,
}

impl Instance<'_> {
    /// Distance from a point in the world to the bounds, metres.
    pub fn distance(&self, p: Vec3) -> f32 {
        let d = p - self.origin;
        let local = Vec3::new(
            self.rotation.x_axis.dot(d),
            self.rotation.y_axis.dot(d),
            self.rotation.z_axis.dot(d),
        );
        length(local - local.max(self.min).min(self.max))
    }

    /// The bounds in the world's frame: least and greatest coordinates.
    pub fn bounds_in_world(&self) -> (Vec3, Vec3) {
        let middle = self.origin + self.rotation * (0.5 * (self.min + self.max));
        let half = 0.5 * (self.max - self.min);
        let [x, y, z] = [self.rotation.x_axis, self.rotation.y_axis, self.rotation.z_axis];
        let reach = x.abs() * half.x + y.abs() * half.y + z.abs() * half.z;
        (middle - reach, middle + reach)
    }

    /// The regions that it reaches into.
    pub fn regions_among(&self, regions: &PortalGraph) -> RegionSet {
        self.regions.unwrap_or_else(|| {
            let (min, max) = self.bounds_in_world();
            regions.of_box(min, max)
        })
    }

    /// The corners of the bounds, in the object's frame.
    pub fn corners(&self) -> [Vec3; 8] {
        corners(self.min, self.max)
    }
}

/// The corners of a box.
pub(crate) fn corners(min: Vec3, max: Vec3) -> [Vec3; 8] {
    std::array::from_fn(|k| {
        let pick = |bit: usize, low: f32, high: f32| if k >> bit & 1 == 1 { high } else { low };
        Vec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
    })
}

/// Everything that can be seen at one moment.
pub(crate) struct Frame<'a> {
    pub instances: Vec<Instance<'a>>,
    pub regions: &'a PortalGraph,
    pub light: crate::light::Light<'a>,
}
