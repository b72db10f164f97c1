//! Staying near somebody.

use chaic_core::geom::xz;
use chaic_core::{Action, AgentId};

use super::navigate::{Destination, Nav, Navigator, face};
use crate::memory::Memory;
use crate::track::Intent;

/// Facing somebody to within this is enough, radians (facts A1.6: 11.25 degrees).
const FACING_RAD: f32 = 0.2;
/// How long to stand beside somebody before looking again, frames.
const STAND_FRAMES: u32 = 3;
/// A sighting this near to where one stands, of somebody no longer in view, is worthless, metres.
const LOST_M: f32 = 0.9;
/// Turns to look around for somebody lost: with a view of 90 degrees, all around.
const SEARCH_TURNS: u32 = 18;

/// What following says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Follow {
    /// Do this next.
    Act(Intent),
    /// One is near enough: nothing to do but stand.
    Near(Intent),
    /// Nobody knows where that person is.
    Lost,
}

/// Follows one person; keeps how long it has searched.
#[derive(Clone, Copy, Debug, Default)]
pub struct Follower {
    n_turns: u32,
}

impl Follower {
    /// The next action to be within `keep_m` of `agent`.
    pub fn step(
        &mut self,
        memory: &mut Memory,
        navigator: &mut Navigator,
        agent: AgentId,
        keep_m: f32,
    ) -> Follow {
        let Some(person) = memory.people.get(agent).copied() else { return Follow::Lost };
        let (here, at) = (memory.here(), xz(person.position_in_world));
        if person.is_in_view {
            self.n_turns = 0;
            if here.distance(at) <= keep_m {
                let turn = face(memory, at, FACING_RAD);
                return Follow::Near(turn.unwrap_or(Action::Wait { frames: STAND_FRAMES }));
            }
        }
        let within_m = if person.is_in_view { keep_m } else { LOST_M };
        if person.is_in_view || here.distance(at) > within_m {
            match navigator.step(memory, &Destination::near(at, within_m)) {
                Nav::Act(action) => return Follow::Act(action),
                Nav::Arrived | Nav::Unreachable if person.is_in_view => {
                    let turn = face(memory, at, FACING_RAD);
                    return Follow::Act(turn.unwrap_or(Action::Wait { frames: STAND_FRAMES }));
                }
                Nav::Arrived | Nav::Unreachable => {}
            }
        }
        if self.n_turns < SEARCH_TURNS {
            self.n_turns += 1;
            return Follow::Act(Action::TurnLeft);
        }
        Follow::Lost
    }
}
