//! The geometry of one state of a world, shared by any number of cameras.

use std::sync::{Arc, OnceLock};

use chaic_core::{ClassId, EntityId, Vec3};
use chaic_world::ObjectSpec;
use glam::Mat3;

use crate::mesh::{Mesh, length};
use crate::models::{N_STYLES, object_mesh};
use crate::portals::{PortalGraph, RegionSet};
use crate::solids::{N_LEVELS, part_obb};

/// Mesh of an object's shape at every level of detail. Each level is built on first use.
#[derive(Debug)]
pub(crate) struct ClassMesh {
    object: ObjectSpec,
    style: u8,
    pub min: Vec3,
    pub max: Vec3,
    levels: [OnceLock<Mesh>; N_LEVELS],
}

/// Key of a shape: class, style, bits of the scale, bits of the seat height.
pub(crate) type ShapeKey = (ClassId, u8, [u32; 3], Option<u32>);

impl ClassMesh {
    /// Returns the mesh of an object in a style, independent of its pose. All scenes of the process
    /// share the meshes of unscaled objects.
    pub fn shared(object: &ObjectSpec, style: u8) -> Arc<ClassMesh> {
        const N: usize = 256 * N_STYLES as usize;
        static UNSCALED: [OnceLock<Arc<ClassMesh>>; N] = [const { OnceLock::new() }; N];
        let style = style % N_STYLES;
        let build = || Arc::new(ClassMesh::new(object, style));
        let is_unscaled = object.scale == [1.0; 3] && object.seat_m.is_none();
        let slot = object.class.index() * usize::from(N_STYLES) + usize::from(style);
        if is_unscaled { UNSCALED[slot].get_or_init(build).clone() } else { build() }
    }

    fn new(object: &ObjectSpec, style: u8) -> ClassMesh {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for part in object.parts() {
            let obb = part_obb(&part, object.size_m());
            let half = 0.5
                * (obb.axes.x_axis.abs() * obb.extent.x
                    + obb.axes.y_axis.abs() * obb.extent.y
                    + obb.axes.z_axis.abs() * obb.extent.z);
            min = min.min(obb.center - half);
            max = max.max(obb.center + half);
        }
        if min.x > max.x {
            (min, max) = (Vec3::ZERO, Vec3::ZERO);
        }
        ClassMesh {
            object: *object,
            style,
            min,
            max,
            levels: [const { OnceLock::new() }; N_LEVELS],
        }
    }

    /// Object class.
    pub fn class(&self) -> ClassId {
        self.object.class
    }

    /// Key of the shape: equal only for equal shapes.
    pub fn key(&self) -> ShapeKey {
        let ObjectSpec { class, scale, seat_m, .. } = &self.object;
        (*class, self.style, scale.map(f32::to_bits), seat_m.map(f32::to_bits))
    }

    fn level(&self, level: usize) -> &Mesh {
        self.levels[level].get_or_init(|| object_mesh(&self.object, self.style, level))
    }
}

/// Source of an instance's triangles.
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

/// A mesh with a pose in the world.
pub(crate) struct Instance<'a> {
    pub entity: EntityId,
    pub shape: Shape<'a>,
    /// Rotation from the object frame to the world frame.
    pub rotation: Mat3,
    pub origin: Vec3,
    /// Bounding box in the object frame.
    pub min: Vec3,
    pub max: Vec3,
    /// Linear color that replaces the color of tinted materials.
    pub tint: Option<[f32; 3]>,
    /// Factor on linear colors.
    pub factor: Vec3,
    /// Room whose lamp lights the instance. `None` for structure, which is lit per point.
    pub room: Option<u8>,
    /// Regions that the instance overlaps, if they are known: those of structure.
    pub regions: Option<RegionSet>,
}

impl Instance<'_> {
    /// Returns the distance from a point in the world to the bounding box, meters.
    pub fn distance(&self, p: Vec3) -> f32 {
        let d = p - self.origin;
        let local = Vec3::new(
            self.rotation.x_axis.dot(d),
            self.rotation.y_axis.dot(d),
            self.rotation.z_axis.dot(d),
        );
        length(local - local.max(self.min).min(self.max))
    }

    /// Returns the bounding box in the world frame: minimum and maximum corner.
    pub fn bounds_in_world(&self) -> (Vec3, Vec3) {
        let center = self.origin + self.rotation * (0.5 * (self.min + self.max));
        let half = 0.5 * (self.max - self.min);
        let [x, y, z] = [self.rotation.x_axis, self.rotation.y_axis, self.rotation.z_axis];
        let half_in_world = x.abs() * half.x + y.abs() * half.y + z.abs() * half.z;
        (center - half_in_world, center + half_in_world)
    }

    /// Returns the regions that the instance overlaps.
    pub fn regions_in(&self, portals: &PortalGraph) -> RegionSet {
        self.regions.unwrap_or_else(|| {
            let (min, max) = self.bounds_in_world();
            portals.regions_in_box(min, max)
        })
    }

    /// Returns the corners of the bounding box in the object frame.
    pub fn corners(&self) -> [Vec3; 8] {
        corners(self.min, self.max)
    }
}

/// Corners of a box.
pub(crate) fn corners(min: Vec3, max: Vec3) -> [Vec3; 8] {
    std::array::from_fn(|k| {
        let select = |bit: usize, low: f32, high: f32| if k >> bit & 1 == 1 { high } else { low };
        Vec3::new(select(0, min.x, max.x), select(1, min.y, max.y), select(2, min.z, max.z))
    })
}

/// All instances, portals and lighting of one state of a world.
pub(crate) struct SceneFrame<'a> {
    pub instances: Vec<Instance<'a>>,
    pub portals: &'a PortalGraph,
    pub light: crate::light::Light<'a>,
}
