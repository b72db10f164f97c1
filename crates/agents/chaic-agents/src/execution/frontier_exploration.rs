//! Frontier exploration: visits the nearest frontier and, when none is left, the place that was
//! unseen for longest.

use chaic_core::geom::{Rect, to_xz};
use chaic_core::{Action, Frame, Vec2};

use super::destination::Destination;
use super::exploration::ExplorationStep;
use super::navigation::{NavigationStep, Navigator};
use super::steering::turn_towards;
use crate::mapping::{CELL_M, CellOccupancy};
use crate::memory::Memory;
use crate::planning::path::{CostField, PathCosts};
use crate::rules::Exploration;

/// Minimum length of a frontier, cells (0.6 m).
const MIN_FRONTIER: usize = 5;
/// Time for which a frontier that could not be resolved is ignored, frames.
const BLACKLIST_FRAMES: Frame = 1000;
/// Radius around such a frontier that is ignored too, meters.
const BLACKLIST_M: f32 = 0.75;
/// Arrival distance of a frontier, from which its other side should be visible, meters.
const ARRIVAL_M: f32 = 0.5;
/// A frontier counts as resolved if no frontier cell is left within this radius, meters.
const RESOLVED_M: f32 = 0.3;
/// Preference for long frontiers: path length that one frontier cell offsets, meters.
const BONUS_PER_CELL_M: f32 = 0.03;
/// Maximum offset of one frontier, meters.
const MAX_BONUS_M: f32 = 2.0;
/// Distance of the center of the area behind a frontier from it, and its radius, meters.
const AREA_AHEAD_M: f32 = 1.5;
const AREA_RADIUS_M: f32 = 2.0;
/// Path length added to each frontier's when areas are compared, meters: looking takes time too.
const AREA_PATH_M: f32 = 2.0;
/// Arrival distance of a place to revisit, meters.
const REVISIT_M: f32 = 1.0;
/// Turns to look around at a revisited place.
const REVISIT_TURNS: u32 = 12;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Target {
    at: Vec2,
    /// A point just beyond the frontier.
    beyond: Vec2,
    is_frontier: bool,
    since: Frame,
    n_turns: u32,
}

/// Explores; keeps its target between decisions.
#[derive(Clone, Debug)]
pub struct FrontierExplorer {
    bounds: Rect,
    target: Option<Target>,
    blacklist: Vec<(Vec2, Frame)>,
    is_exhausted: bool,
}

impl FrontierExplorer {
    /// Creates an explorer of the area inside `bounds`.
    pub fn new(bounds: Rect) -> FrontierExplorer {
        FrontierExplorer { bounds, target: None, blacklist: Vec::new(), is_exhausted: false }
    }

    /// Returns whether no frontier was left at the last search.
    pub fn is_exhausted(&self) -> bool {
        self.is_exhausted
    }

    /// Drops the current target and ignores it for a while.
    pub fn give_up(&mut self, now: Frame) {
        if let Some(target) = self.target.take() {
            self.blacklist.push((target.at, now + BLACKLIST_FRAMES));
        }
    }

    /// Returns the next action.
    pub fn step(&mut self, memory: &mut Memory, navigator: &mut dyn Navigator) -> ExplorationStep {
        let now = memory.frame;
        self.blacklist.retain(|(_, until)| *until > now);
        if self.target.is_some_and(|t| now > t.since + memory.rules.plan_timeouts.explore_frames) {
            self.give_up(now);
        }
        if let Some(target) = self.target
            && target.is_frontier
            && !self.has_frontier_near(memory, target.at)
        {
            self.target = None;
            return ExplorationStep::Resolved;
        }
        let target = match self.target {
            Some(target) => target,
            None => match self.choose(memory) {
                Some(target) => target,
                None => return ExplorationStep::Act(Action::TurnLeft),
            },
        };
        self.target = Some(target);
        let within_m = if target.is_frontier { ARRIVAL_M } else { REVISIT_M };
        match navigator.step(memory, &Destination::near(target.at, within_m)) {
            NavigationStep::Act(action) => ExplorationStep::Act(action),
            NavigationStep::Unreachable => {
                self.give_up(now);
                ExplorationStep::Resolved
            }
            NavigationStep::Arrived => self.observe_target(memory, target),
        }
    }

    /// At the target: looks beyond the frontier, or around.
    fn observe_target(&mut self, memory: &Memory, target: Target) -> ExplorationStep {
        if target.is_frontier {
            if let Some(turn) = turn_towards(memory, target.beyond, 0.3)
                && target.n_turns < REVISIT_TURNS
            {
                self.target = Some(Target { n_turns: target.n_turns + 1, ..target });
                return ExplorationStep::Act(turn);
            }
            // The area is in front of the camera and still unknown, so it cannot be seen from here.
            self.give_up(memory.frame);
            return ExplorationStep::Resolved;
        }
        if target.n_turns < REVISIT_TURNS {
            self.target = Some(Target { n_turns: target.n_turns + 1, ..target });
            return ExplorationStep::Act(Action::TurnLeft);
        }
        self.give_up(memory.frame);
        ExplorationStep::Resolved
    }

    /// Returns whether frontier cells are left around a point.
    fn has_frontier_near(&self, memory: &Memory, at: Vec2) -> bool {
        memory.map.grid().disc(at, RESOLVED_M).any(|c| self.is_frontier(memory, c))
    }

    /// Returns whether a cell is free, fits the body and borders on unknown space.
    fn is_frontier(&self, memory: &Memory, cell: usize) -> bool {
        let (map, costs) = (&memory.map, memory.costs());
        map.state(cell) == CellOccupancy::Free
            && !costs.is_tight(cell)
            && self.unknown_side(memory, cell).is_some()
    }

    fn unknown_side(&self, memory: &Memory, cell: usize) -> Option<usize> {
        let (map, grid) = (&memory.map, memory.map.grid());
        grid.neighbors(cell)
            .filter(|(_, diagonal)| !diagonal)
            .map(|(c, _)| c)
            .find(|c| map.is_unexplored(*c) && self.bounds.contains(grid.center(*c)))
    }

    fn choose(&mut self, memory: &mut Memory) -> Option<Target> {
        memory.refresh();
        let path_costs = memory.path_costs()?;
        let frontier = self.nearest_frontier(memory, path_costs);
        self.is_exhausted = frontier.is_none();
        let target = frontier.or_else(|| self.longest_unseen(memory, path_costs));
        if target.is_none() {
            let here = memory.position();
            self.blacklist.retain(|(at, _)| at.distance(here) < BLACKLIST_M);
            // An agent that can reach nothing is not walled in: one of the barriers does not exist.
            memory.map.clear_barriers();
        }
        target
    }

    fn is_blacklisted(&self, at: Vec2) -> bool {
        self.blacklist.iter().any(|(b, _)| b.distance(at) < BLACKLIST_M)
    }

    /// Returns the frontier with the lowest path cost, with a small preference for long ones.
    fn nearest_frontier(&self, memory: &Memory, path_costs: PathCosts<'_>) -> Option<Target> {
        let grid = memory.map.grid();
        let mut is_frontier: Vec<bool> = (0..grid.n_cells())
            .map(|c| self.is_frontier(memory, c) && path_costs.cost(c).is_some())
            .collect();
        let mut best: Option<(f32, Target)> = None;
        let mut cluster = Vec::new();
        for first in 0..grid.n_cells() {
            if !std::mem::take(&mut is_frontier[first]) {
                continue;
            }
            cluster.clear();
            cluster.push(first);
            let mut k = 0;
            while k < cluster.len() {
                for (next, _) in grid.neighbors(cluster[k]) {
                    if std::mem::take(&mut is_frontier[next]) {
                        cluster.push(next);
                    }
                }
                k += 1;
            }
            if cluster.len() < MIN_FRONTIER {
                continue;
            }
            let nearest = cluster
                .iter()
                .filter(|c| !self.is_blacklisted(grid.center(**c)))
                .filter_map(|c| Some((path_costs.cost(*c)?, *c)))
                .min();
            let Some((cost, cell)) = nearest else { continue };
            let path_m = CostField::meters(cost);
            let score = match memory.rules.exploration {
                Exploration::UnknownArea => {
                    -self.unknown_area_m2(memory, cell) / (path_m + AREA_PATH_M)
                }
                _ => path_m - (BONUS_PER_CELL_M * cluster.len() as f32).min(MAX_BONUS_M),
            };
            if best.is_none_or(|(s, _)| score < s) {
                let at = grid.center(cell);
                let side = self.unknown_side(memory, cell).map_or(at, |c| grid.center(c));
                let beyond = at + 4.0 * (side - at);
                let since = memory.frame;
                best = Some((score, Target { at, beyond, is_frontier: true, since, n_turns: 0 }));
            }
        }
        best.map(|(_, target)| target)
    }

    /// Returns the unknown area behind a frontier cell, square meters.
    fn unknown_area_m2(&self, memory: &Memory, cell: usize) -> f32 {
        let grid = memory.map.grid();
        let at = grid.center(cell);
        let Some(side) = self.unknown_side(memory, cell) else { return 0.0 };
        let center = at + AREA_AHEAD_M * (grid.center(side) - at).normalize_or_zero();
        let is_unknown =
            |c: &usize| memory.map.is_unexplored(*c) && self.bounds.contains(grid.center(*c));
        grid.disc(center, AREA_RADIUS_M).filter(is_unknown).count() as f32 * CELL_M * CELL_M
    }

    /// Returns the place with the highest ratio of time since it was last seen to path length.
    fn longest_unseen(&self, memory: &Memory, path_costs: PathCosts<'_>) -> Option<Target> {
        let grid = memory.map.grid();
        let mut best: Option<(f32, Vec2)> = None;
        for (i, j) in
            (0..grid.nz()).step_by(4).flat_map(|j| (0..grid.nx()).step_by(4).map(move |i| (i, j)))
        {
            let cell = j * grid.nx() + i;
            let at = grid.center(cell);
            let is_usable = memory.map.state(cell) == CellOccupancy::Free
                && !memory.costs().is_tight(cell)
                && self.bounds.contains(at)
                && at.distance(to_xz(memory.pose.position)) > 1.5
                && !self.is_blacklisted(at);
            if !is_usable {
                continue;
            }
            let Some(cost) = path_costs.cost(cell) else { continue };
            let age = (memory.frame + 1).saturating_sub(memory.map.last_seen(cell).unwrap_or(0));
            let score = age as f32 / (5.0 + CostField::meters(cost));
            if best.is_none_or(|(s, _)| score > s) {
                best = Some((score, at));
            }
        }
        best.map(|(_, at)| Target {
            at,
            beyond: at,
            is_frontier: false,
            since: memory.frame,
            n_turns: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::execution::careful_navigation::CarefulNavigator;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::test_support::{Toy, ToyRun};

    #[test]
    fn two_rooms_are_explored_and_then_nothing_is_left() {
        let mut toy = Toy::room(10.0, 6.0);
        toy.add_wall([-0.05, -3.0], [0.05, 0.4]);
        toy.add_wall([-0.05, 1.4], [0.05, 3.0]);
        toy.stand([-4.0, -2.0], 0.0);
        let mut explorer = FrontierExplorer::new(toy.bounds());
        let mut navigator = CarefulNavigator::default();
        let mut run = ToyRun::new(toy);
        let mut has_crossed = false;
        for _ in 0..300 {
            let mut memory = run.observe();
            has_crossed |= memory.position().x > 0.3;
            if has_crossed && explorer.is_exhausted() {
                let grid = *memory.map.grid();
                let known = |x, z| {
                    let cell = grid.cell_at(Vec2::new(x, z)).expect("inside");
                    memory.map.state(cell) == CellOccupancy::Free
                };
                assert!(known(4.5, 2.5) && known(4.5, -2.5) && known(-4.5, 2.5));
                return;
            }
            match explorer.step(&mut memory, &mut navigator) {
                ExplorationStep::Act(action) => run.act(action, memory),
                ExplorationStep::Resolved => run.put_back(memory),
            }
        }
        panic!("not done; crossed: {has_crossed}, at {:?}", run.toy.here());
    }

    #[test]
    fn a_granted_layout_leaves_nothing_to_explore() {
        let mut toy = Toy::room(10.0, 6.0);
        toy.add_wall([-0.05, -3.0], [0.05, 0.4]);
        toy.add_wall([-0.05, 1.4], [0.05, 3.0]);
        toy.stand([-4.0, 0.0], -std::f32::consts::FRAC_PI_2);
        for is_granted in [false, true] {
            let layout = is_granted.then(|| toy.layout());
            let briefing = chaic_core::Briefing { layout, ..toy.briefing() };
            let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
            let observation = toy.observe();
            memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
            let mut explorer = FrontierExplorer::new(toy.bounds());
            explorer.choose(&mut memory);
            assert_eq!(explorer.is_exhausted(), is_granted);
        }
    }

    #[test]
    fn a_large_unknown_room_is_preferred_to_a_small_shadow_that_is_nearer() {
        // Known room in the west with a shadow of 0.75 by 0.75 m in its corner; a door to an unknown
        // room in the east, twice as far away.
        let toy = Toy::room(12.0, 6.0);
        let briefing = toy.briefing();
        let chosen = |exploration| {
            let rules = crate::PlannerRules { exploration, ..crate::PlannerRules::paper() };
            let mut memory = Memory::new(&briefing, rules);
            let grid = *memory.map.grid();
            let state = |cell| {
                let Vec2 { x, y: z } = grid.center(cell);
                match () {
                    () if x.abs() > 6.0 || z.abs() > 3.0 => CellOccupancy::Wall,
                    () if x.abs() < 0.1 && z.abs() > 0.6 => CellOccupancy::Wall,
                    () if x > 0.0 || (x < -5.25 && z < -2.25) => CellOccupancy::Unknown,
                    () => CellOccupancy::Free,
                }
            };
            let cells: Vec<CellOccupancy> = (0..grid.n_cells()).map(state).collect();
            memory.map = crate::mapping::occupancy::OccupancyMap::from_cells(grid, &cells);
            memory.pose.position = chaic_core::Vec3::new(-4.0, 0.0, -1.5);
            let mut explorer = FrontierExplorer::new(toy.bounds());
            let target = explorer.choose(&mut memory).expect("two frontiers");
            assert!(target.is_frontier && !explorer.is_exhausted());
            target.at.x
        };
        let is_shadow = |x: f32| x < -4.5;
        let is_door = |x: f32| x > -0.5;
        let first = chosen(Exploration::UnknownArea);
        assert!(is_door(first), "{first}");
        let first = chosen(Exploration::Frontier);
        assert!(is_shadow(first), "the nearest one: {first}");
    }
}
