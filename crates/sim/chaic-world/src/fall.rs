//! Falls of released objects.
//!
//! A small rigid-body simulation computes the whole fall at its start, for all objects that are
//! released together and with the obstacles nearby. The world then plays it back frame by frame.
//! Physics is thus a pure function, the state remains plain data, and a frame without a fall costs
//! nothing.

use chaic_core::{EntityId, Quat, Vec3};
use rapier3d::prelude::*;

use crate::shape::Block;
use boxes::BoxDispatcher;

mod boxes;

/// A falling object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Falling {
    pub entity: EntityId,
    /// Center of the bottom face, meters.
    pub position: Vec3,
    pub rotation: Quat,
    /// Extents, meters.
    pub size: Vec3,
    pub mass_kg: f32,
}

/// A static box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Obstacle {
    pub center: Vec3,
    pub half: Vec3,
    pub rotation: Quat,
    pub entity: EntityId,
}

impl From<&Block> for Obstacle {
    fn from(block: &Block) -> Obstacle {
        Obstacle {
            center: block.center,
            half: block.half,
            rotation: chaic_core::geom::yaw_rotation(block.yaw_rad),
            entity: block.entity,
        }
    }
}

/// Computed fall of an object.
#[derive(Clone, Debug)]
pub(crate) struct Fall {
    /// Position and rotation after each frame, in order; never empty.
    pub path: Vec<(Vec3, Quat)>,
    /// Object on which it comes to rest; `None` for the ground.
    pub on: Option<EntityId>,
}

/// Maximum length of a fall, frames. From 3 m it takes 78; the remainder is for rolling and
/// sliding.
const MAX_FRAMES: usize = 240;
/// An object slower than this for [`STILL_FRAMES`] frames is at rest, m/s (the original: 1 mm a
/// frame).
const STILL_M_PER_S: f32 = 0.03;
const STILL_FRAMES: usize = 4;
/// Sliding friction of household objects on wood or cloth.
const FRICTION: f32 = 0.8;

/// Simulates a joint fall among `obstacles` above the ground at y = 0, until all objects are at
/// rest.
pub(crate) fn fall(objects: &[Falling], obstacles: &[Obstacle], step_s: f32) -> Vec<Fall> {
    let mut world = empty_world(step_s);
    for o in obstacles {
        let collider = ColliderBuilder::cuboid(o.half.x, o.half.y, o.half.z)
            .position(rapier3d::math::Pose::from_parts(o.center, o.rotation))
            .friction(FRICTION)
            .user_data(u128::from(o.entity.0));
        world.colliders.insert(collider);
    }
    world.colliders.insert(
        ColliderBuilder::halfspace(rapier3d::na::Unit::new_unchecked(Vector::Y))
            .friction(FRICTION)
            .user_data(u128::from(EntityId::FLOOR.0)),
    );
    let bodies: Vec<(RigidBodyHandle, ColliderHandle)> =
        objects.iter().map(|object| add(&mut world, object)).collect();
    let mut falls = vec![Fall { path: Vec::new(), on: None }; objects.len()];
    let mut n_still = 0;
    for _ in 0..MAX_FRAMES {
        world.step();
        let mut is_still = true;
        for ((body, collider), (object, fall)) in bodies.iter().zip(objects.iter().zip(&mut falls))
        {
            let b = &world.bodies[*body];
            let rotation = *b.rotation();
            let bottom = b.translation() - rotation * (Vec3::Y * (0.5 * object.size.y));
            fall.path.push((bottom, rotation));
            let has_contact =
                world.contact_pairs_with(*collider).any(|p| p.has_any_active_contact());
            let is_slow =
                b.linvel().length() < STILL_M_PER_S && b.angvel().length() < 10.0 * STILL_M_PER_S;
            is_still &= has_contact && is_slow;
        }
        n_still = if is_still { n_still + 1 } else { 0 };
        if n_still >= STILL_FRAMES {
            break;
        }
    }
    for ((_, collider), fall) in bodies.iter().zip(&mut falls) {
        fall.on = support(&world, *collider);
    }
    falls
}

fn empty_world(step_s: f32) -> PhysicsWorld {
    // `PhysicsWorld::new` would make the code of all pairs of shapes part of the program.
    PhysicsWorld {
        gravity: Vector::new(0.0, -9.81, 0.0),
        integration_parameters: IntegrationParameters {
            dt: step_s,
            ..IntegrationParameters::default()
        },
        physics_pipeline: PhysicsPipeline::new(),
        collision_pipeline: CollisionPipeline::new(),
        islands: IslandManager::new(),
        broad_phase: DefaultBroadPhase::default(),
        narrow_phase: NarrowPhase::with_query_dispatcher(BoxDispatcher),
        bodies: RigidBodySet::new(),
        colliders: ColliderSet::new(),
        impulse_joints: ImpulseJointSet::new(),
        multibody_joints: MultibodyJointSet::new(),
        soft_bodies: SoftBodySet::new(),
        ccd_solver: CCDSolver::new(),
    }
}

fn add(world: &mut PhysicsWorld, object: &Falling) -> (RigidBodyHandle, ColliderHandle) {
    let half = 0.5 * object.size;
    let center = object.position + object.rotation * (Vec3::Y * half.y);
    let body = world.bodies.insert(
        RigidBodyBuilder::dynamic()
            .pose(rapier3d::math::Pose::from_parts(center, object.rotation))
            .angular_damping(2.0)
            .linear_damping(0.1)
            .can_sleep(false)
            .ccd_enabled(true),
    );
    let collider = world.colliders.insert_with_parent(
        ColliderBuilder::cuboid(half.x, half.y, half.z)
            .friction(FRICTION)
            .mass(object.mass_kg.max(0.01))
            .user_data(u128::from(object.entity.0)),
        body,
        &mut world.bodies,
    );
    (body, collider)
}

/// Returns the support of a fallen object: of all contacts, the one with the lowest point.
fn support(world: &PhysicsWorld, collider: ColliderHandle) -> Option<EntityId> {
    let mut lowest: Option<(f32, u16)> = None;
    for pair in world.contact_pairs_with(collider).filter(|p| p.has_any_active_contact()) {
        let (other, own_is_first) = if pair.collider1 == collider {
            (pair.collider2, true)
        } else {
            (pair.collider1, false)
        };
        let entity = world.colliders[other].user_data as u16;
        let own_pose = world.colliders[collider].position();
        for manifold in pair.manifolds() {
            for point in &manifold.points {
                let local = if own_is_first { point.local_p1 } else { point.local_p2 };
                let local = Vec3::from_array([local.x, local.y, local.z]);
                let y = (own_pose.rotation * local + own_pose.translation).y;
                if lowest.is_none_or(|(best, e)| (y, entity) < (best, e)) {
                    lowest = Some((y, entity));
                }
            }
        }
    }
    lowest.map(|(_, e)| EntityId(e)).filter(|e| e.is_object())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apple_at(position: Vec3) -> Falling {
        let (entity, size) = (EntityId(21), Vec3::splat(0.1));
        Falling { entity, position, rotation: Quat::IDENTITY, size, mass_kg: 0.2 }
    }

    fn fall_alone(object: Falling, obstacles: &[Obstacle]) -> Fall {
        super::fall(&[object], obstacles, 0.01).remove(0)
    }

    #[test]
    fn objects_that_fall_together_do_not_overlap() {
        let other = Falling { entity: EntityId(22), ..apple_at(Vec3::new(0.12, 1.1, 0.01)) };
        let falls = super::fall(&[apple_at(Vec3::new(0.1, 0.95, 0.0)), other], &[table()], 0.01);
        let ends = falls.iter().map(|fall| fall.path.last().unwrap().0).collect::<Vec<_>>();
        assert!(ends[0].distance(ends[1]) > 0.09, "{ends:?} overlap");
        assert!(falls.iter().all(|fall| fall.on.is_some()), "both have a support");
        assert_eq!(falls[0].path.len(), falls[1].path.len());
    }

    fn table() -> Obstacle {
        Obstacle {
            center: Vec3::new(0.0, 0.375, 0.0),
            half: Vec3::new(0.6, 0.375, 0.4),
            rotation: Quat::IDENTITY,
            entity: EntityId(20),
        }
    }

    #[test]
    fn a_drop_above_a_table_lands_on_it() {
        let fall = fall_alone(apple_at(Vec3::new(0.1, 0.95, 0.0)), &[table()]);
        let (end, _) = *fall.path.last().unwrap();
        assert!((end.y - 0.75).abs() < 0.01, "{end}");
        assert_eq!(fall.on, Some(EntityId(20)));
        // 0.2 m at 9.81 m/s^2 takes 0.202 s, 20 frames, and a few more to come to rest.
        assert!((20..60).contains(&fall.path.len()), "{} frames", fall.path.len());
    }

    #[test]
    fn the_support_is_the_lowest_contact() {
        // The apple stands on the table and leans against a block of half of its height. Both orders of
        // the two ids are tried.
        for entities in [[20, 23], [23, 20]] {
            let [below, beside] = entities.map(EntityId);
            let leaned = Obstacle {
                center: Vec3::new(0.145, 0.775, 0.0),
                half: Vec3::new(0.05, 0.025, 0.1),
                entity: beside,
                ..table()
            };
            let obstacles = [leaned, Obstacle { entity: below, ..table() }];
            let fall = fall_alone(apple_at(Vec3::new(0.047, 0.8, 0.0)), &obstacles);
            assert_eq!(fall.on, Some(below));
        }
    }

    #[test]
    fn a_drop_beside_a_table_lands_on_the_ground() {
        let fall = fall_alone(apple_at(Vec3::new(1.0, 0.95, 0.0)), &[table()]);
        let (end, _) = *fall.path.last().unwrap();
        assert!(end.y.abs() < 0.01, "{end}");
        assert_eq!(fall.on, None);
    }

    #[test]
    fn equal_falls_are_bit_identical() {
        let run = || fall_alone(apple_at(Vec3::new(0.58, 0.9, 0.02)), &[table()]).path;
        assert_eq!(run(), run());
    }
}
