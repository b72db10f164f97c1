//! Opponent model of Smart-Help (Cao et al. 2024; here as in the paper's appendix on learning).
//! From a helper's last five observations it predicts the partner's goal and physical limits.
//!
//! [`window`] encodes the input, [`network`] has the model, [`tracker`] runs it during an episode,
//! [`collect`] collects labeled windows from generated episodes, and [`train`] and [`report`] train
//! and evaluate the model.

mod walk;
mod walk_features;
pub mod window;

pub mod network;
pub mod tracker;

pub mod collect;
mod episode_agents;
pub mod report;
pub mod train;

use chaic_agents::decision::Plan;
use chaic_core::capability::{Capability, Gait};
use chaic_core::{ClassId, Role};

/// Goal of the partner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum OpponentGoal {
    /// The partner is in none of the five observations.
    Unknown,
    /// Exploring, or moving to another agent.
    Explore,
    /// Standing still.
    Wait,
    /// Picking up a target, a container or an obstacle.
    Pick,
    /// Putting a held object into a held container.
    PutIn,
    /// Bringing held objects to the goal place.
    PutOn,
}

impl OpponentGoal {
    /// All goals, by [`OpponentGoal::index`].
    pub const ALL: [OpponentGoal; 6] = [
        OpponentGoal::Unknown,
        OpponentGoal::Explore,
        OpponentGoal::Wait,
        OpponentGoal::Pick,
        OpponentGoal::PutIn,
        OpponentGoal::PutOn,
    ];

    /// Returns the index in [`OpponentGoal::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// Returns the name in reports.
    pub fn name(self) -> &'static str {
        ["unknown", "explore", "wait", "pick", "put_in", "put_on"][self.index()]
    }

    /// Returns the goal of an agent that follows this plan.
    pub fn from_plan(plan: &Plan) -> OpponentGoal {
        match plan {
            Plan::Explore | Plan::TurnAround | Plan::FollowPartner | Plan::FollowChild => {
                OpponentGoal::Explore
            }
            Plan::Wait => OpponentGoal::Wait,
            Plan::PickUp(_)
            | Plan::PickContainer(_)
            | Plan::RemoveObstacle(_)
            | Plan::LiftWith(_) => OpponentGoal::Pick,
            Plan::PutIn => OpponentGoal::PutIn,
            Plan::Deliver => OpponentGoal::PutOn,
        }
    }
}

/// Number of values that describe the limits of a body.
pub const N_BODY_LIMITS: usize = 5;
/// Names of the limits, in order.
pub const LIMITS: [&str; N_BODY_LIMITS] =
    ["reaches_high", "reaches_low", "strength", "no_bicycle", "no_wheelchair"];

/// Returns physical limits of a body, each from 0 (constrained) to 1 (unconstrained). They are the
/// maximum height (1.5 to 3 m), the minimum height (0.25 to 0 m), the strength (100 to 600 kg), and
/// the absence of a bicycle and of a wheelchair. The ranges are those of the original's data.
pub fn limits(body: &Capability) -> [f32; N_BODY_LIMITS] {
    let [low_m, high_m] = body.pick_range_m;
    let flag = |condition: bool| f32::from(u8::from(condition));
    let values = [(high_m - 1.5) / 1.5, (0.25 - low_m) / 0.25, (body.strength_kg - 100.0) / 500.0];
    let [high, low, strength] = values.map(|x: f32| x.clamp(0.0, 1.0));
    [high, low, strength, flag(body.gait != Gait::WalkBike), flag(body.gait != Gait::Roll)]
}

/// Returns whether a partner can pick up objects of this class. The catalogue's targets, containers
/// and obstacles are 53 classes, as in the paper.
pub fn is_pickable(class: ClassId) -> bool {
    class.info().is_movable() && class.info().role != Role::Vehicle
}
