//! Finding out by chance ([`Exploration::Sampled`]): goes to the cheapest of some random places
//! within the unknown (facts A1.10).
//!
//! [`Exploration::Sampled`]: crate::rules::Exploration

use chaic_core::rng::Stream;
use chaic_core::{Action, Briefing, Frame, Vec2};

use super::explore::Found;
use super::navigate::{Destination, Nav, Navigator};
use crate::mapping::Space;
use crate::memory::Memory;
use crate::planning::lattice_costs::FARTHEST;
use crate::planning::path::StraightCostField;

/// So near to the place one is there, and nearer places are not chosen, metres.
const THERE_M: f32 = 1.5;
/// After so long a place that is known by now counts as reached, frames.
const KNOWN_FRAMES: Frame = 100;
/// Chance of taking the first place that will do.
const FIRST_CHANCE: f32 = 0.1;
/// Draws at most, and draws after which the next better place is taken.
const DRAWS: (usize, usize) = (10_000, 100);
/// Distance from the border of the map, cells.
const BORDER: usize = 3;

/// Explores; keeps where it goes until the plan ends.
#[derive(Clone, Debug)]
pub struct Sampler {
    rng: Stream,
    target: Option<(Vec2, Frame)>,
}

impl Sampler {
    /// For one episode.
    pub fn new(briefing: &Briefing) -> Sampler {
        Sampler { rng: Stream::new(briefing.seed, "exploration", 0), target: None }
    }

    /// Begins a new plan.
    pub fn begin(&mut self) {
        self.target = None;
    }

    /// The next action.
    pub fn step(&mut self, memory: &mut Memory, navigator: &mut Navigator) -> Found {
        if self.target.is_none() {
            self.target = self.choose(memory).map(|at| (at, memory.frame));
        }
        let Some((at, since)) = self.target else {
            // An obstacle may be what closes one in.
            if memory.waits_for_obstacles() {
                memory.wait_for_obstacle();
            }
            return Found::Act(Action::TurnLeft);
        };
        let is_known = memory.map.grid().cell_at(at).is_some_and(|c| memory.map.is_known(c));
        if is_known && memory.frame > since + KNOWN_FRAMES {
            return Found::Resolved;
        }
        match navigator.step(memory, &Destination::near(at, THERE_M)) {
            Nav::Act(action) => Found::Act(action),
            Nav::Arrived | Nav::Unreachable => Found::Resolved,
        }
    }

    fn choose(&mut self, memory: &mut Memory) -> Option<Vec2> {
        let here = memory.here();
        let (costs, search) = memory.costs_and_search();
        let grid = *costs.grid();
        let start = grid.cell_at(here)?;
        let field = StraightCostField::from(&grid, costs.costs(), start, FARTHEST, search);
        let inner = |cell: &usize| {
            let (i, j) = grid.column_row(*cell);
            (BORDER..grid.nx() - BORDER).contains(&i) && (BORDER..grid.nz() - BORDER).contains(&j)
        };
        let map = &memory.map;
        let is_hidden = |c: usize| !map.is_known(c) && map.space(c) < Space::Occupied;
        let unknown: Vec<usize> =
            (0..grid.n_cells()).filter(inner).filter(|c| !map.is_known(*c)).collect();
        let takes_first = self.rng.chance(FIRST_CHANCE);
        let mut best: Option<(u32, Vec2)> = None;
        for draw in 0..if unknown.is_empty() { 0 } else { DRAWS.0 } {
            let cell = unknown[self.rng.below(unknown.len())];
            let Some(score) =
                field.score(cell).filter(|_| grid.center(cell).distance(here) > THERE_M)
            else {
                continue;
            };
            let straight = grid.neighbors(cell).filter(|(_, diagonal)| !diagonal);
            if !is_hidden(cell) || straight.map(|(c, _)| c).any(|c| !is_hidden(c)) {
                continue;
            }
            if best.is_none_or(|(least, _)| score < least) {
                best = Some((score, grid.center(cell)));
                if takes_first || draw > DRAWS.1 {
                    break;
                }
            }
        }
        best.map(|(_, at)| at).or_else(|| {
            // Nothing unknown can be got to: anywhere else will do.
            (0..DRAWS.0).map(|_| self.rng.below(grid.n_cells())).find_map(|cell| {
                let at = grid.center(cell);
                (field.score(cell).is_some() && at.distance(here) > THERE_M).then_some(at)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannerRules;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::rules::Walking;
    use crate::test_support::Toy;

    #[test]
    fn places_lie_within_the_unknown_and_on_this_side_of_walls() {
        // A room whose other half, behind a wall without a door, nobody can get to.
        let mut toy = Toy::room(12.0, 6.0);
        toy.add_wall([-0.1, -3.0], [0.1, 3.0]);
        toy.stand([-3.0, 0.0], -std::f32::consts::FRAC_PI_2);
        let rules = PlannerRules { walking: Walking::Lattice, ..PlannerRules::paper() };
        let briefing = toy.briefing();
        let mut memory = Memory::new(&briefing, rules);
        let observation = toy.observe();
        memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
        for seed in 0..30 {
            let mut sampler = Sampler::new(&Briefing { seed, ..briefing.clone() });
            let at = sampler.choose(&mut memory).expect("most of it is unknown");
            let cell = memory.map.grid().cell_at(at).expect("inside");
            assert!(!memory.map.is_known(cell), "{at}");
            assert!(at.x < 0.0 && at.distance(memory.here()) > THERE_M, "{at}");
        }
    }
}
