//! Following a person.

use chaic_core::geom::to_xz;
use chaic_core::{Action, AgentId, Frame, Vec2};

use super::destination::Destination;
use super::navigation::{NavigationStep, Navigator};
use super::steering::turn_towards;
use crate::mapping::CellOccupancy;
use crate::memory::Memory;
use crate::track::Intent;

/// Heading tolerance towards the person, radians (facts A1.6: 11.25 degrees).
const FACING_RAD: f32 = 0.2;
/// Time to stand beside the person before the next decision, frames.
const STAND_FRAMES: u32 = 3;
/// A last position this near to the body is useless if the person is no longer in view, meters.
const LOST_M: f32 = 0.9;
/// Turns to search for a lost person: a full circle with a field of view of 90 degrees.
pub const SEARCH_TURNS: u32 = 18;
/// A person nearer than this may want to pass, meters. Ours, as all constants of giving way.
const CLOSE_M: f32 = 1.5;
/// Time for which it must be so near, frames.
const CLOSE_FRAMES: Frame = 24;
/// Maximum time to step aside, frames.
const ASIDE_FRAMES: Frame = 80;
/// Minimum distance of the spot aside from the person, meters.
const ASIDE_M: f32 = 2.0;
/// Range in which such a spot is searched, meters.
const ASIDE_RANGE_M: f32 = 4.0;
/// Free space around the body at the spot aside, meters: the width of another body.
const ROOM_M: f32 = 0.55;
/// Arrival distance of the spot aside, meters.
const ASIDE_ARRIVAL_M: f32 = 0.3;

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
    /// Frame since which the person has been in the way.
    close_since: Option<Frame>,
    /// Spot aside to which the agent walks, and the frame in which it was chosen.
    aside: Option<(Vec2, Frame)>,
}

impl Follower {
    /// Returns a step aside if `agent` has been near for some time: this agent may block its way.
    pub fn give_way(
        &mut self,
        memory: &mut Memory,
        navigator: &mut dyn Navigator,
        agent: AgentId,
    ) -> Option<Intent> {
        let now = memory.frame;
        let seen = memory.people.get(agent)?;
        let (person, is_fresh) = (to_xz(seen.position_in_world), seen.frame + CLOSE_FRAMES > now);
        if self.aside.is_none() {
            if !is_fresh || memory.position().distance(person) > CLOSE_M {
                self.close_since = None;
                return None;
            }
            if now < *self.close_since.get_or_insert(now) + CLOSE_FRAMES {
                return None;
            }
            self.aside = Some((spot_aside(memory, person)?, now));
        }
        let (spot, since) = self.aside?;
        if now < since + ASIDE_FRAMES
            && let NavigationStep::Act(action) =
                navigator.step(memory, &Destination::near(spot, ASIDE_ARRIVAL_M))
        {
            return Some(action);
        }
        (self.aside, self.close_since) = (None, None);
        None
    }

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

/// Returns the nearest reachable spot that leaves the person room to pass.
fn spot_aside(memory: &mut Memory, person: Vec2) -> Option<Vec2> {
    memory.refresh();
    let (costs, path_costs) = (memory.costs(), memory.path_costs()?);
    let grid = memory.map.grid();
    let here = memory.position();
    let is_free = |cell: &usize| {
        memory.map.state(*cell) == CellOccupancy::Free
            && grid.center(*cell).distance(person) >= ASIDE_M
            && costs.clearance_m(*cell) >= costs.radius_m() + ROOM_M
    };
    let cells = grid.disc(here, ASIDE_RANGE_M).filter(is_free);
    let nearest = cells.filter_map(|cell| Some((path_costs.cost(cell)?, cell))).min()?;
    Some(grid.center(nearest.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::execution::careful_navigation::CarefulNavigator;
    use crate::test_support::{Toy, ToyRun};

    /// Returns the distance from the partner after 60 actions, for an agent that stood in a doorway
    /// 1.1 m from it.
    fn distance_after(may_give_way: bool) -> f32 {
        let mut toy = Toy::room(10.0, 6.0);
        toy.add_wall([-0.05, -3.0], [0.05, -0.5]);
        toy.add_wall([-0.05, 0.5], [0.05, 3.0]);
        toy.stand([0.0, 0.0], std::f32::consts::FRAC_PI_2);
        let partner = Vec2::new(-1.1, 0.0);
        toy.add_person(AgentId::PARTNER, partner.into());
        let mut follower = Follower::default();
        let mut navigator = CarefulNavigator::default();
        let mut run = ToyRun::new(toy);
        let mut farthest_m = 0.0_f32;
        for _ in 0..60 {
            let mut memory = run.observe();
            farthest_m = farthest_m.max(memory.position().distance(partner));
            let aside = match may_give_way {
                true => follower.give_way(&mut memory, &mut navigator, AgentId::PARTNER),
                false => None,
            };
            let step = || follower.step(&mut memory, &mut navigator, AgentId::PARTNER, 2.2);
            match aside.map_or_else(step, FollowStep::Act) {
                FollowStep::Act(action) | FollowStep::Near(action) => run.act(action, memory),
                FollowStep::Lost => panic!("the partner is in view or was just seen"),
            }
        }
        farthest_m
    }

    #[test]
    fn a_follower_leaves_the_doorway_for_a_partner_that_stays_near() {
        assert!(distance_after(false) < 1.2, "without the rule it stands still");
        let distance_m = distance_after(true);
        assert!(distance_m > ASIDE_M - 0.3, "{distance_m} m");
    }
}
