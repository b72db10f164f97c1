//! What a walker meets that nothing stops for good ([`Blocking::Creeps`]): a flat box ahead of it
//! is tested in every frame (facts S1.5 and S3.3).
//!
//! [`Blocking::Creeps`]: crate::Blocking::Creeps

use chaic_core::capability::Persona;
use chaic_core::catalogue::Role;
use chaic_core::geom::{forward, right, xz};
use chaic_core::task::SceneKind;
use chaic_core::{AgentId, EntityId};

use crate::collide::Body;
use crate::shape::Block;
use crate::world::World;

/// The box ahead of a walker.
struct Probe {
    /// From the walker's middle to the box's, metres.
    ahead_m: f32,
    /// Half of its width, metres.
    half_width_m: f32,
    /// Half of its depth, metres.
    half_depth_m: f32,
    /// Its lowest and highest point, metres.
    height_m: [f32; 2],
}

/// A grown-up's (facts S1.5).
const GROWN_UP: Probe =
    Probe { ahead_m: 0.5, half_width_m: 0.319, half_depth_m: 0.0875, height_m: [0.119, 1.881] };
/// A child's (facts S1.5).
const CHILD: Probe =
    Probe { ahead_m: 0.4, half_width_m: 0.139, half_depth_m: 0.0475, height_m: [0.0, 1.081] };
/// The box is tested as a row of so many upright cylinders as thick as it is deep.
const CYLINDERS: i8 = 5;
/// What the original leaves out of the test in the street, besides goal places and furniture to be
/// moved.
const STALLS: [&str; 3] = ["tent", "wood_shelving", "bike"];

impl World {
    /// Whether somebody who walks ahead meets something right now.
    pub(crate) fn meets_something(&self, agent: AgentId) -> bool {
        let is_child = self.setup.people[agent.index()].persona == Persona::Child;
        let probe = if is_child { CHILD } else { GROWN_UP };
        let pose = self.person(agent).pose;
        let middle = pose.position + probe.ahead_m * forward(pose.yaw_rad);
        let aside = right(pose.yaw_rad);
        let body = Body {
            radius_m: probe.half_depth_m,
            low_m: probe.height_m[0],
            high_m: probe.height_m[1],
        };
        let partner_in_lift = self.state.joint.filter(|j| j.leader == agent).map(|j| j.follower);
        let others = self.others(agent, partner_in_lift);
        let movable: Vec<Block> =
            self.movable_blocks().into_iter().filter(|b| self.is_met(b.entity)).collect();
        let outermost_m = probe.half_width_m - probe.half_depth_m;
        (-CYLINDERS / 2..=CYLINDERS / 2).any(|k| {
            let at = xz(middle + aside * (outermost_m * f32::from(k) / f32::from(CYLINDERS / 2)));
            let near = self.block_index.near(at).filter(|b| self.is_met(b.entity));
            let disc_met =
                |d: &&crate::collide::Disc| at.distance(d.center) < d.radius_m + body.radius_m;
            near.chain(&movable).any(|b| body.touches(b, at)) || others.iter().any(|d| disc_met(&d))
        })
    }

    /// Whether a thing is met at all: what is wanted is not, nor is what belongs to the street.
    fn is_met(&self, entity: EntityId) -> bool {
        let Some(index) = self.setup.thing_index(entity) else { return true };
        let info = self.setup.things[index].class.info();
        let outdoors = self.setup.task.info().scene != SceneKind::House;
        let in_street = STALLS.contains(&info.name) || self.setup.goal_places.contains(&entity);
        info.role != Role::HeavyTarget && !(outdoors && in_street)
    }
}
