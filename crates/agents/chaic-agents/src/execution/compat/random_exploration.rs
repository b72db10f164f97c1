//! Random exploration ([`Exploration::Sampled`]): visits the cheapest of some random cells in
//! unknown space (facts A1.10).
//!
//! [`Exploration::Sampled`]: crate::rules::Exploration

use chaic_core::rng::RngStream;
use chaic_core::{Action, Briefing, Frame, Vec2};

use crate::execution::destination::Destination;
use crate::execution::exploration::ExplorationStep;
use crate::execution::navigation::{NavigationStep, Navigator, PathState};
use crate::mapping::CellOccupancy;
use crate::memory::Memory;
use crate::planning::compat::lattice_costs::MAX_PATH_COST;
use crate::planning::compat::straight_path::StraightCostField;

/// Arrival distance, and minimum distance of a new target, meters.
const ARRIVAL_M: f32 = 1.5;
/// Time after which a target that has become known counts as reached, frames.
const KNOWN_FRAMES: Frame = 100;
/// Probability to take the first suitable cell.
const FIRST_CHANCE: f32 = 0.1;
/// Maximum number of draws.
const MAX_DRAWS: usize = 10_000;
/// Number of draws after which the next improvement is taken.
const ENOUGH_DRAWS: usize = 100;
/// Minimum distance from the border of the map, cells.
const BORDER: usize = 3;

/// Explores random cells; keeps its target until the plan ends. It ends where the target is near,
/// known for a while, or behind something (facts A1.6).
#[derive(Clone, Debug)]
pub struct RandomExplorer {
    rng: RngStream,
    target: Option<(Vec2, Frame)>,
}

impl RandomExplorer {
    /// Creates the explorer of one episode.
    pub fn new(briefing: &Briefing) -> RandomExplorer {
        RandomExplorer { rng: RngStream::new(briefing.seed, "exploration", 0), target: None }
    }

    /// Starts a new plan.
    pub fn reset(&mut self) {
        self.target = None;
    }

    /// Returns the next action.
    pub fn step(&mut self, memory: &mut Memory, navigator: &mut dyn Navigator) -> ExplorationStep {
        if self.target.is_none() {
            self.target = self.choose(memory).map(|at| (at, memory.frame));
        }
        let Some((at, since)) = self.target else {
            // An obstacle may enclose the agent.
            return ExplorationStep::Act(Action::TurnLeft);
        };
        let step = navigator.step(memory, &Destination::near(at, ARRIVAL_M));
        let is_known = memory.map.grid().cell_at(at).is_some_and(|c| memory.map.is_known(c));
        let has_ended = match navigator.path_state() {
            PathState::Open => is_known && memory.frame > since + KNOWN_FRAMES,
            PathState::TooCostly => true,
            // The wait for an obstacle overrides every end but the plan's time limit.
            PathState::Blocked => false,
        };
        match step {
            NavigationStep::Act(_) if has_ended => ExplorationStep::Resolved,
            NavigationStep::Act(action) => ExplorationStep::Act(action),
            NavigationStep::Arrived | NavigationStep::Unreachable => ExplorationStep::Resolved,
        }
    }

    fn choose(&mut self, memory: &mut Memory) -> Option<Vec2> {
        let here = memory.position();
        let (costs, _) = memory.costs_and_search();
        let grid = *costs.grid();
        let start = grid.cell_at(here)?;
        let field = StraightCostField::new(&grid, costs.costs(), start, MAX_PATH_COST);
        let inner = |cell: &usize| {
            let (i, j) = grid.column_row(*cell);
            (BORDER..grid.nx() - BORDER).contains(&i) && (BORDER..grid.nz() - BORDER).contains(&j)
        };
        let map = &memory.map;
        let is_hidden = |c: usize| !map.is_known(c) && map.state(c) < CellOccupancy::Occupied;
        let unknown: Vec<usize> =
            (0..grid.n_cells()).filter(inner).filter(|c| !map.is_known(*c)).collect();
        let takes_first = self.rng.chance(FIRST_CHANCE);
        let mut best: Option<(u32, Vec2)> = None;
        for draw in 0..if unknown.is_empty() { 0 } else { MAX_DRAWS } {
            let cell = unknown[self.rng.below(unknown.len())];
            let Some(score) =
                field.score(cell).filter(|_| grid.center(cell).distance(here) > ARRIVAL_M)
            else {
                continue;
            };
            let straight = grid.neighbors(cell).filter(|(_, diagonal)| !diagonal);
            if !is_hidden(cell) || straight.map(|(c, _)| c).any(|c| !is_hidden(c)) {
                continue;
            }
            if best.is_none_or(|(lowest, _)| score < lowest) {
                best = Some((score, grid.center(cell)));
                if takes_first || draw > ENOUGH_DRAWS {
                    break;
                }
            }
        }
        best.map(|(_, at)| at).or_else(|| {
            // No unknown cell is reachable, so any other cell is accepted.
            (0..MAX_DRAWS).map(|_| self.rng.below(grid.n_cells())).find_map(|cell| {
                let at = grid.center(cell);
                (field.score(cell).is_some() && at.distance(here) > ARRIVAL_M).then_some(at)
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
    fn targets_are_unknown_cells_on_this_side_of_walls() {
        // The other half of the room, behind a wall without a door, is unreachable.
        let mut toy = Toy::room(12.0, 6.0);
        toy.add_wall([-0.1, -3.0], [0.1, 3.0]);
        toy.stand([-3.0, 0.0], -std::f32::consts::FRAC_PI_2);
        let rules = PlannerRules { walking: Walking::Lattice, ..PlannerRules::paper() };
        let briefing = toy.briefing();
        let mut memory = Memory::new(&briefing, rules);
        let observation = toy.observe();
        memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
        for seed in 0..30 {
            let mut explorer = RandomExplorer::new(&Briefing { seed, ..briefing.clone() });
            let at = explorer.choose(&mut memory).expect("most of it is unknown");
            let cell = memory.map.grid().cell_at(at).expect("inside");
            assert!(!memory.map.is_known(cell), "{at}");
            assert!(at.x < 0.0 && at.distance(memory.position()) > ARRIVAL_M, "{at}");
        }
    }
}
