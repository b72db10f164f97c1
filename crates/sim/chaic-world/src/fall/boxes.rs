//! Collision queries between boxes and the ground. The dispatcher of parry links the code of all pairs
//! of shapes, which would enlarge the module for browsers. This one calls the same functions for the
//! two pairs that occur in falls, so results are bit-identical.

use rapier3d::geometry::{ContactData, ContactManifold, ContactManifoldData};
use rapier3d::math::{Pose, Real, Vector};
use rapier3d::parry::query::details::{
    NonlinearShapeCastMode, NormalConstraints, ShapeCastOptions,
    cast_shapes_nonlinear_support_map_support_map, closest_points_support_map_support_map,
    contact_manifold_cuboid_cuboid_shapes, contact_manifold_halfspace_pfm_shapes,
};
use rapier3d::parry::query::{
    ClosestPoints, Contact, ContactManifoldsWorkspace, NonlinearRigidMotion,
    PersistentQueryDispatcher, QueryDispatcher, ShapeCastHit, ShapeDistance, ShapeIntersection,
    Unsupported,
};
use rapier3d::parry::shape::{Shape, ShapeType};

/// Dispatcher of the queries of falls. It supports boxes, and boxes with a half-space.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxDispatcher;

impl QueryDispatcher for BoxDispatcher {
    fn intersection_test(
        &self,
        _: &Pose,
        _: &dyn Shape,
        _: &dyn Shape,
    ) -> Result<ShapeIntersection, Unsupported> {
        Err(Unsupported)
    }

    fn distance(
        &self,
        _: &Pose,
        _: &dyn Shape,
        _: &dyn Shape,
    ) -> Result<ShapeDistance, Unsupported> {
        Err(Unsupported)
    }

    fn contact(
        &self,
        _: &Pose,
        _: &dyn Shape,
        _: &dyn Shape,
        _: Real,
    ) -> Result<Option<Contact>, Unsupported> {
        Err(Unsupported)
    }

    fn closest_points(
        &self,
        pos12: &Pose,
        a: &dyn Shape,
        b: &dyn Shape,
        max_dist: Real,
    ) -> Result<ClosestPoints, Unsupported> {
        let maps = a.as_support_map().zip(b.as_support_map());
        let (a, b) = maps.ok_or(Unsupported)?;
        Ok(closest_points_support_map_support_map(pos12, a, b, max_dist))
    }

    fn cast_shapes(
        &self,
        _: &Pose,
        _: Vector,
        _: &dyn Shape,
        _: &dyn Shape,
        _: ShapeCastOptions,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        Err(Unsupported)
    }

    fn cast_shapes_nonlinear(
        &self,
        motion_a: &NonlinearRigidMotion,
        a: &dyn Shape,
        motion_b: &NonlinearRigidMotion,
        b: &dyn Shape,
        start_time: Real,
        end_time: Real,
        stop_at_penetration: bool,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        let maps = a.as_support_map().zip(b.as_support_map());
        let (map_a, map_b) = maps.ok_or(Unsupported)?;
        let mode = if stop_at_penetration {
            NonlinearShapeCastMode::StopAtPenetration
        } else {
            NonlinearShapeCastMode::directional_toi(a, b)
        };
        Ok(cast_shapes_nonlinear_support_map_support_map(
            self, motion_a, map_a, a, motion_b, map_b, b, start_time, end_time, mode,
        ))
    }
}

impl PersistentQueryDispatcher<ContactManifoldData, ContactData> for BoxDispatcher {
    fn contact_manifolds(
        &self,
        pos12: &Pose,
        a: &dyn Shape,
        b: &dyn Shape,
        prediction: Real,
        manifolds: &mut Vec<ContactManifold>,
        _: &mut Option<ContactManifoldsWorkspace>,
    ) -> Result<(), Unsupported> {
        if manifolds.is_empty() {
            manifolds.push(ContactManifold::new());
        }
        self.contact_manifold_convex_convex(pos12, a, b, None, None, prediction, &mut manifolds[0])
    }

    fn contact_manifold_convex_convex(
        &self,
        pos12: &Pose,
        a: &dyn Shape,
        b: &dyn Shape,
        _: Option<&dyn NormalConstraints>,
        _: Option<&dyn NormalConstraints>,
        prediction: Real,
        manifold: &mut ContactManifold,
    ) -> Result<(), Unsupported> {
        match (a.shape_type(), b.shape_type()) {
            (ShapeType::Cuboid, ShapeType::Cuboid) => {
                contact_manifold_cuboid_cuboid_shapes(pos12, a, b, prediction, manifold);
            }
            (ShapeType::HalfSpace, ShapeType::Cuboid)
            | (ShapeType::Cuboid, ShapeType::HalfSpace) => {
                contact_manifold_halfspace_pfm_shapes(pos12, a, b, prediction, manifold);
            }
            _ => return Err(Unsupported),
        }
        Ok(())
    }
}
