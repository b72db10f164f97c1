//! Collision probe of [`CollisionResponse::Creeps`]: a flat box ahead of the walker is tested in
//! every frame (facts S1.5 and S3.3).
//!
//! [`CollisionResponse::Creeps`]: crate::CollisionResponse::Creeps

use chaic_core::capability::Persona;
use chaic_core::catalogue::Role;
use chaic_core::geom::{forward, right, to_xz};
use chaic_core::task::SceneKind;
use chaic_core::{AgentId, EntityId};

use crate::collide::Body;
use crate::shape::Block;
use crate::world::World;

/// Box ahead of a walker.
struct Probe {
    /// Distance from the center of the walker to the center of the box, meters.
    ahead_m: f32,
    /// Half of the width, meters.
    half_width_m: f32,
    /// Half of the depth, meters.
    half_depth_m: f32,
    /// Lowest and highest y coordinate, meters.
    height_m: [f32; 2],
}

/// Probe of an adult (facts S1.5).
const ADULT: Probe =
    Probe { ahead_m: 0.5, half_width_m: 0.319, half_depth_m: 0.0875, height_m: [0.119, 1.881] };
/// Probe of a child (facts S1.5).
const CHILD: Probe =
    Probe { ahead_m: 0.4, half_width_m: 0.139, half_depth_m: 0.0475, height_m: [0.0, 1.081] };
/// Number of upright cylinders that approximate the box; their diameter is its depth.
const CYLINDERS: i8 = 5;
/// Classes that the original does not test in the street, in addition to goal places and furniture.
const STREET_STALLS: [&str; 3] = ["tent", "wood_shelving", "bike"];

impl World {
    /// Returns whether the probe ahead of an agent touches something.
    pub(crate) fn touches_something(&self, agent: AgentId) -> bool {
        let is_child = self.setup.people[agent.index()].persona == Persona::Child;
        let probe = if is_child { CHILD } else { ADULT };
        let pose = self.person(agent).pose;
        let middle = pose.position + probe.ahead_m * forward(pose.yaw_rad);
        let side = right(pose.yaw_rad);
        let body = Body {
            radius_m: probe.half_depth_m,
            low_m: probe.height_m[0],
            high_m: probe.height_m[1],
        };
        let partner_in_lift = self.state.joint.filter(|j| j.leader == agent).map(|j| j.follower);
        let others = self.other_discs(agent, partner_in_lift);
        let movable: Vec<Block> =
            self.movable_blocks().into_iter().filter(|b| self.is_tested(b.entity)).collect();
        let outermost_m = probe.half_width_m - probe.half_depth_m;
        (-CYLINDERS / 2..=CYLINDERS / 2).any(|k| {
            let at = to_xz(middle + side * (outermost_m * f32::from(k) / f32::from(CYLINDERS / 2)));
            let near = self.block_index.near(at, body.radius_m);
            let near = near.filter(|b| self.is_tested(b.entity));
            let touches_disc =
                |d: &&crate::collide::Disc| at.distance(d.center) < d.radius_m + body.radius_m;
            near.chain(&movable).any(|b| body.touches(b, at))
                || others.iter().any(|d| touches_disc(&d))
        })
    }

    /// Returns whether an object is tested. Furniture is not, and in the street neither are stalls
    /// and goal places.
    fn is_tested(&self, entity: EntityId) -> bool {
        let Some(index) = self.setup.object_index(entity) else { return true };
        let info = self.setup.things[index].class.info();
        let is_outdoors = self.setup.task.info().scene != SceneKind::House;
        let is_exempt =
            STREET_STALLS.contains(&info.name) || self.setup.goal_places.contains(&entity);
        info.role != Role::HeavyTarget && !(is_outdoors && is_exempt)
    }
}
