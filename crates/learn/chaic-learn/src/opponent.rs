//! The opponent model of Smart-Help (Cao et al. 2024; here as in the paper's appendix on learning): from the last five
//! observations of a helper, what its partner is about to do and what it can't do.
//!
//! [`window`] is what it reads, [`network`] the model, [`collect`] makes windows of generated episodes with what was
//! true of the partner, [`train`] and [`report`] learn from them and tell how good the model is.

pub mod window;

pub mod network;

pub mod collect;
pub mod report;
pub mod train;

use chaic_agents::decision::Plan;
use chaic_core::capability::{Capability, Gait};
use chaic_core::{ClassId, Role};

/// What a partner may be about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Goal {
    /// Nobody can tell: it was in none of the five observations.
    Unknown,
    /// Finding out more of the place, or going to somebody.
    Explore,
    /// Standing still.
    Wait,
    /// Taking something: a target, a container, or something that is in the way.
    Pick,
    /// Putting what it holds into the container that it holds.
    PutIn,
    /// Bringing what it holds to the goal place.
    PutOn,
}

impl Goal {
    /// All, by [`Goal::index`].
    pub const ALL: [Goal; 6] =
        [Goal::Unknown, Goal::Explore, Goal::Wait, Goal::Pick, Goal::PutIn, Goal::PutOn];

    /// Its place in [`Goal::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        ["unknown", "explore", "wait", "pick", "put_in", "put_on"][self.index()]
    }

    /// What somebody is about who follows this plan.
    pub fn of(plan: &Plan) -> Goal {
        match plan {
            Plan::Explore | Plan::TurnAround | Plan::FollowPartner | Plan::FollowChild => {
                Goal::Explore
            }
            Plan::Wait => Goal::Wait,
            Plan::PickUp(_)
            | Plan::PickContainer(_)
            | Plan::RemoveObstacle(_)
            | Plan::LiftWith(_) => Goal::Pick,
            Plan::PutIn => Goal::PutIn,
            Plan::Deliver => Goal::PutOn,
        }
    }
}

/// How many numbers tell what a person can't do.
pub const N_LIMITS: usize = 5;
/// What these numbers are of, in order.
pub const LIMITS: [&str; N_LIMITS] =
    ["reaches_high", "reaches_low", "strength", "no_bicycle", "no_wheelchair"];

/// What a body can't do, as numbers between 0 (constrained) and 1 (not): how high it reaches from 1.5 to 3 m, how low
/// from 0.25 m to the ground, how strong it is from 100 to 600 kg, whether it has no bicycle and no wheelchair. The
/// scales are those of the original's own data.
pub fn limits_of(body: &Capability) -> [f32; N_LIMITS] {
    let [low_m, high_m] = body.pick_range_m;
    let flag = |is_so: bool| f32::from(u8::from(is_so));
    let numbers = [(high_m - 1.5) / 1.5, (0.25 - low_m) / 0.25, (body.strength_kg - 100.0) / 500.0];
    let [high, low, strength] = numbers.map(|x: f32| x.clamp(0.0, 1.0));
    [high, low, strength, flag(body.gait != Gait::WalkBike), flag(body.gait != Gait::Roll)]
}

/// Whether things of this class can be what a partner picks up: 53 classes, as in the paper, if the catalogue's
/// obstacles are counted with its targets and containers.
pub fn is_pickable(class: ClassId) -> bool {
    class.info().is_movable() && class.info().role != Role::Vehicle
}
