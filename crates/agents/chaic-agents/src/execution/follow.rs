//! Following a person.

use chaic_core::geom::to_xz;
use chaic_core::{Action, AgentId};

use super::destination::Destination;
use super::navigation::{NavigationStep, Navigator};
use super::steering::turn_towards;
use crate::memory::Memory;
use crate::track::Intent;

/// Heading tolerance towards the person, radians (facts A1.6: 11.25 degrees).
const FACING_RAD: f32 = 0.2;
/// Time to stand beside the person before the next decision, frames.
const STAND_FRAMES: u32 = 3;
/// A last position this near to the body is useless if the person is no longer in view, meters.
const LOST_M: f32 = 0.9;
/// Turns to search for a lost person: a full circle with a field of view of 90 degrees.
const SEARCH_TURNS: u32 = 18;

/// Result of one following step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FollowStep {
    /// Take this action next.
    Act(Intent),
    /// Near enough: stand or face the person.
    Near(Intent),
    /// The position of the person is unknown.
    Lost,
}

/// Follows one person; counts the turns of its search.
#[derive(Clone, Copy, Debug, Default)]
pub struct Follower {
    n_turns: u32,
}

impl Follower {
    /// Returns the next action to get within `keep_m` of `agent`.
    pub fn step(
        &mut self,
        memory: &mut Memory,
        navigator: &mut dyn Navigator,
        agent: AgentId,
        keep_m: f32,
    ) -> FollowStep {
        let Some(person) = memory.people.get(agent).copied() else { return FollowStep::Lost };
        let (here, at) = (memory.position(), to_xz(person.position_in_world));
        if person.is_in_view {
            self.n_turns = 0;
            if here.distance(at) <= keep_m {
                let turn = turn_towards(memory, at, FACING_RAD);
                return FollowStep::Near(turn.unwrap_or(Action::Wait { frames: STAND_FRAMES }));
            }
        }
        let within_m = if person.is_in_view { keep_m } else { LOST_M };
        if person.is_in_view || here.distance(at) > within_m {
            match navigator.step(memory, &Destination::near(at, within_m)) {
                NavigationStep::Act(action) => return FollowStep::Act(action),
                NavigationStep::Arrived | NavigationStep::Unreachable if person.is_in_view => {
                    let turn = turn_towards(memory, at, FACING_RAD);
                    return FollowStep::Act(turn.unwrap_or(Action::Wait { frames: STAND_FRAMES }));
                }
                NavigationStep::Arrived | NavigationStep::Unreachable => {}
            }
        }
        if self.n_turns < SEARCH_TURNS {
            self.n_turns += 1;
            return FollowStep::Act(Action::TurnLeft);
        }
        FollowStep::Lost
    }
}
