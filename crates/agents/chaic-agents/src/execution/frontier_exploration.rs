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
use crate::planning::cost_map::CostMap;
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
/// Upper bound of the number of cells with their center in that area. The disc has the area of 804 cells;
/// with half a cell diagonal more radius, 877.
const MAX_AREA_CELLS: usize = 900;
/// Path length added to each frontier's when areas are compared, meters: looking takes time too.
const AREA_PATH_M: f32 = 2.0;
/// Step by which the cost limit of the search grows (1 m of free floor), and limit beyond which it
/// covers the whole map (100 m).
const SEARCH_STEP: u32 = 800;
const SEARCH_LIMIT: u32 = 80_000;
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
    n_turns: u32,
}

/// Connected frontier cells; all are reachable, or none.
struct FrontierCluster {
    /// Number of its cells.
    n_cells: usize,
    /// Cells that may be visited.
    allowed: Vec<usize>,
    /// Score and nearest allowed cell, once a search has reached one.
    reached: Option<(f32, usize)>,
}

/// Explores; keeps its target during a plan.
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

    /// Drops the target of the previous plan.
    pub fn reset(&mut self) {
        self.target = None;
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
            && !costs.touches_obstacle(cell)
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
        let frontier = self.best_frontier(memory, path_costs);
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

    /// Returns the frontier with the best score: the lowest path cost, with a small preference for long
    /// frontiers, or the largest unknown area per path length. The search ends when no frontier beyond
    /// it can be better.
    fn best_frontier(&self, memory: &Memory, path_costs: PathCosts<'_>) -> Option<Target> {
        let grid = memory.map.grid();
        let mut clusters = self.clusters(memory, path_costs);
        let allowed = clusters.iter().flat_map(|cluster| cluster.allowed.iter().copied());
        let mut limit = path_costs.min_cost(allowed)?.saturating_add(1);
        let cell = loop {
            for cluster in clusters.iter_mut().filter(|cluster| cluster.reached.is_none()) {
                let cells = cluster.allowed.iter();
                let costs = cells.filter_map(|c| Some((path_costs.cost_below(*c, limit)?, *c)));
                let nearest = costs.min();
                cluster.reached = nearest.map(|(cost, cell)| {
                    let area_m2 = || self.unknown_area_m2(memory, cell);
                    (score(memory.rules.exploration, cost, cluster.n_cells, area_m2), cell)
                });
            }
            // Of equal scores, the first frontier wins.
            let mut best: Option<(f32, usize)> = None;
            for (score, cell) in clusters.iter().filter_map(|cluster| cluster.reached) {
                if best.is_none_or(|(s, _)| score < s) {
                    best = Some((score, cell));
                }
            }
            let (best_score, cell) = best?;
            let can_be_better = |cluster: &FrontierCluster| {
                let area_m2 = || MAX_AREA_CELLS as f32 * CELL_M * CELL_M;
                let exploration = memory.rules.exploration;
                score(exploration, limit, cluster.n_cells, area_m2) <= best_score
            };
            let mut unreached = clusters.iter().filter(|cluster| cluster.reached.is_none());
            if limit == u32::MAX || !unreached.any(can_be_better) {
                break cell;
            }
            limit = if limit < SEARCH_LIMIT { limit + SEARCH_STEP } else { u32::MAX };
        };
        let at = grid.center(cell);
        let side = self.unknown_side(memory, cell).map_or(at, |c| grid.center(c));
        let beyond = at + 4.0 * (side - at);
        Some(Target { at, beyond, is_frontier: true, n_turns: 0 })
    }

    /// Returns the frontiers that are long enough and not ignored, in the order of their first cells.
    fn clusters(&self, memory: &Memory, path_costs: PathCosts<'_>) -> Vec<FrontierCluster> {
        let costs = memory.costs();
        // A cell that fits the body is blocked only on the lattice, as in the margin of an obstacle.
        let is_start = |c: usize| path_costs.cost_below(c, 1).is_some();
        let mut frontier_mask: Vec<bool> = (0..costs.grid().n_cells())
            .map(|c| self.is_frontier(memory, c) && (!costs.is_blocked(c) || is_start(c)))
            .collect();
        if !is_connected_by_steps(costs, &frontier_mask) {
            for (cell, is_member) in frontier_mask.iter_mut().enumerate() {
                *is_member = *is_member && path_costs.cost(cell).is_some();
            }
        }
        let grid = memory.map.grid();
        let mut clusters = Vec::new();
        let mut cells = Vec::new();
        for first in 0..grid.n_cells() {
            if !std::mem::take(&mut frontier_mask[first]) {
                continue;
            }
            cells.clear();
            cells.push(first);
            let mut k = 0;
            while k < cells.len() {
                for (next, _) in grid.neighbors(cells[k]) {
                    if std::mem::take(&mut frontier_mask[next]) {
                        cells.push(next);
                    }
                }
                k += 1;
            }
            if cells.len() < MIN_FRONTIER {
                continue;
            }
            let is_allowed = |c: &usize| !self.is_blacklisted(grid.center(*c));
            let allowed: Vec<usize> = cells.iter().copied().filter(is_allowed).collect();
            if !allowed.is_empty() {
                clusters.push(FrontierCluster { n_cells: cells.len(), allowed, reached: None });
            }
        }
        clusters
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
                && !memory.costs().touches_obstacle(cell)
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
        best.map(|(_, at)| Target { at, beyond: at, is_frontier: false, n_turns: 0 })
    }
}

/// Returns the score of a frontier of `n_cells` cells whose nearest cell has this path cost; lower is
/// better. It rises with the cost, and falls with the unknown area behind that cell.
fn score(exploration: Exploration, cost: u32, n_cells: usize, area_m2: impl Fn() -> f32) -> f32 {
    let path_m = CostField::meters(cost);
    match exploration {
        Exploration::UnknownArea => -area_m2() / (path_m + AREA_PATH_M),
        _ => path_m - (BONUS_PER_CELL_M * n_cells as f32).min(MAX_BONUS_M),
    }
}

/// Returns whether steps lead from each of these cells to all of its neighbors among them, directly or
/// around one corner. Connected cells are then all reachable, or none.
fn is_connected_by_steps(costs: &CostMap, is_member: &[bool]) -> bool {
    let grid = costs.grid();
    let nx = grid.nx();
    let is_passable = |from: usize, to: usize| {
        let ((i0, j0), (i1, j1)) = (grid.column_row(from), grid.column_row(to));
        [j0 * nx + i1, j1 * nx + i0].into_iter().any(|corner| !costs.is_blocked(corner))
    };
    (0..grid.n_cells()).filter(|cell| is_member[*cell]).all(|cell| {
        let mut neighbors = grid.neighbors(cell);
        neighbors.all(|(next, diagonal)| !diagonal || !is_member[next] || is_passable(cell, next))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::execution::careful_navigation::CarefulNavigator;
    use crate::mapping::occupancy::OccupancyMap;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::rules::Walking;
    use crate::test_support::{Toy, ToyRun, seen};
    use crate::track::TrackId;
    use chaic_core::rng::RngStream;
    use chaic_core::{AgentId, Briefing, Vec3};

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
            let briefing = Briefing { layout, ..toy.briefing() };
            let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
            let observation = toy.observe();
            memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
            let mut explorer = FrontierExplorer::new(toy.bounds());
            explorer.choose(&mut memory);
            assert_eq!(explorer.is_exhausted(), is_granted);
        }
    }

    /// Returns the memory of an agent at this position. The room in the west is known, except for a
    /// shadow of 0.75 by 0.75 m in its corner. A door leads to an unknown room in the east.
    fn shadow_and_door(exploration: Exploration, at: [f32; 2]) -> (Toy, Memory) {
        let toy = Toy::room(12.0, 6.0);
        let rules = crate::PlannerRules { exploration, ..crate::PlannerRules::paper() };
        let mut memory = Memory::new(&toy.briefing(), rules);
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
        memory.map = OccupancyMap::from_cells(grid, &cells);
        memory.pose.position = Vec3::new(at[0], 0.0, at[1]);
        (toy, memory)
    }

    #[test]
    fn a_plan_keeps_its_frontier_and_the_next_plan_chooses_again() {
        let (toy, mut at_shadow) = shadow_and_door(Exploration::Frontier, [-4.0, -1.5]);
        let (_, mut at_door) = shadow_and_door(Exploration::Frontier, [-1.5, 0.0]);
        let mut explorer = FrontierExplorer::new(toy.bounds());
        let mut navigator = CarefulNavigator::default();
        let mut target_x = |explorer: &mut FrontierExplorer, memory: &mut Memory| {
            explorer.step(memory, &mut navigator);
            explorer.target.expect("two frontiers").at.x
        };
        let shadow = target_x(&mut explorer, &mut at_shadow);
        // Long after, another plan has led the agent to the door.
        at_door.frame += 10 * at_door.rules.plan_timeouts.explore_frames;
        assert_eq!(target_x(&mut explorer, &mut at_door), shadow);
        explorer.reset();
        let door = target_x(&mut explorer, &mut at_door);
        assert!(shadow < -4.5 && door > -0.5, "{shadow}, {door}");
        // The shadow can be chosen again.
        explorer.reset();
        assert_eq!(target_x(&mut explorer, &mut at_shadow), shadow);
    }

    #[test]
    fn a_large_unknown_room_is_preferred_to_a_small_shadow_that_is_nearer() {
        let chosen = |exploration| {
            let (toy, mut memory) = shadow_and_door(exploration, [-4.0, -1.5]);
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

    /// Returns the best frontier from the path costs of all cells, and the number of frontiers.
    fn reference_best_frontier(
        explorer: &FrontierExplorer,
        memory: &Memory,
    ) -> (Option<Target>, usize) {
        let grid = memory.map.grid();
        let path_costs = memory.path_costs().expect("refreshed");
        let mut frontier_mask: Vec<bool> = (0..grid.n_cells())
            .map(|c| explorer.is_frontier(memory, c) && path_costs.cost(c).is_some())
            .collect();
        let mut best: Option<(f32, usize)> = None;
        let mut n_frontiers = 0;
        for first in 0..grid.n_cells() {
            let mut cluster: Vec<usize> = Vec::new();
            let mut waiting = vec![first];
            while let Some(cell) = waiting.pop() {
                if std::mem::take(&mut frontier_mask[cell]) {
                    cluster.push(cell);
                    waiting.extend(grid.neighbors(cell).map(|(next, _)| next));
                }
            }
            let allowed = cluster.iter().filter(|c| !explorer.is_blacklisted(grid.center(**c)));
            let nearest = allowed.filter_map(|c| Some((path_costs.cost(*c)?, *c))).min();
            let Some((cost, cell)) = nearest.filter(|_| cluster.len() >= MIN_FRONTIER) else {
                continue;
            };
            n_frontiers += 1;
            let path_m = CostField::meters(cost);
            let score = match memory.rules.exploration {
                Exploration::UnknownArea => {
                    -explorer.unknown_area_m2(memory, cell) / (path_m + AREA_PATH_M)
                }
                _ => path_m - (BONUS_PER_CELL_M * cluster.len() as f32).min(MAX_BONUS_M),
            };
            if best.is_none_or(|(s, _)| score < s) {
                best = Some((score, cell));
            }
        }
        let target = best.map(|(_, cell)| {
            let at = grid.center(cell);
            let side = explorer.unknown_side(memory, cell).map_or(at, |c| grid.center(c));
            let beyond = at + 4.0 * (side - at);
            Target { at, beyond, is_frontier: true, n_turns: 0 }
        });
        (target, n_frontiers)
    }

    #[test]
    fn a_search_that_ends_early_finds_the_frontier_of_a_search_over_the_whole_map() {
        let toy = Toy::room(12.0, 7.0);
        let (mut n_found, mut n_choices, mut n_unconnected, mut n_blocked) = (0, 0, 0, 0);
        for seed in 0..260 {
            let mut rng = RngStream::new(seed, "frontiers", 0);
            // The partner on the lattice, whose costs rise around obstacles.
            let is_lattice = seed >= 200;
            let mut briefing = toy.briefing();
            // Only narrow bodies fit between small obstacles.
            let (radius_m, noise) = [(0.05, 8), (0.05, 60), (0.2, 60)][rng.below(3)];
            briefing.capability.radius_m = radius_m;
            let is_area = rng.chance(0.5);
            let exploration =
                if is_area { Exploration::UnknownArea } else { Exploration::Frontier };
            let walking = if is_lattice { Walking::Lattice } else { Walking::Careful };
            briefing.me = if is_lattice { AgentId::PARTNER } else { AgentId::HELPER };
            let rules =
                crate::PlannerRules { walking, exploration, ..crate::PlannerRules::paper() };
            let mut memory = Memory::new(&briefing, rules);
            let grid = *memory.map.grid();
            let blocks: Vec<usize> = (0..grid.n_cells()).map(|_| rng.below(20)).collect();
            let state = |cell: usize| {
                let (i, j) = grid.column_row(cell);
                match (rng.below(noise), blocks[j / 6 * grid.nx() + i / 6]) {
                    (0, _) => CellOccupancy::Wall,
                    (1, _) => CellOccupancy::Unknown,
                    (_, 0..9) => CellOccupancy::Free,
                    (_, 9..14) => CellOccupancy::Unknown,
                    _ => CellOccupancy::Wall,
                }
            };
            let cells: Vec<CellOccupancy> = (0..grid.n_cells()).map(state).collect();
            memory.map = OccupancyMap::from_cells(grid, &cells);
            memory.pose.position = Vec3::new(rng.range(-6.0, 6.0), 0.0, rng.range(-3.5, 3.5));
            let mut explorer = FrontierExplorer::new(toy.bounds());
            if is_lattice {
                let bins = (0..6).map(|n| {
                    let at = [rng.range(-6.0, 6.0), 0.0, rng.range(-3.5, 3.5)];
                    seen(TrackId(20 + n), "trashbin", at, 0.3, 0.3)
                });
                memory.objects.update(&bins.collect::<Vec<_>>(), &[], 0, 0);
                let mut copy = memory.clone();
                copy.refresh();
                let is_blocked = |c: &usize| copy.costs().is_blocked(*c);
                let is_start = |c: &usize| {
                    let is_edge = grid.neighbors(*c).any(|(next, _)| !is_blocked(&next));
                    is_blocked(c) && is_edge && explorer.is_frontier(&copy, *c)
                };
                let starts: Vec<usize> = (0..grid.n_cells()).filter(is_start).collect();
                if let Some(start) = rng.choose(&starts) {
                    let at = grid.center(*start);
                    memory.pose.position = Vec3::new(at.x, 0.0, at.y);
                }
            }
            memory.refresh();
            for _ in 0..rng.below(4) {
                let at = Vec2::new(rng.range(-6.0, 6.0), rng.range(-3.5, 3.5));
                explorer.blacklist.push((at, 1000));
            }
            let (expected, n_frontiers) = reference_best_frontier(&explorer, &memory.clone());
            let found = explorer.best_frontier(&memory, memory.path_costs().expect("refreshed"));
            assert_eq!(found, expected, "seed {seed}");
            n_found += usize::from(found.is_some());
            // The start is the only blocked cell that can be found.
            let cell = found.and_then(|target| grid.cell_at(target.at));
            n_blocked += usize::from(cell.is_some_and(|cell| memory.costs().is_blocked(cell)));
            n_choices += usize::from(n_frontiers > 2);
            let frontier_mask: Vec<bool> =
                (0..grid.n_cells()).map(|c| explorer.is_frontier(&memory, c)).collect();
            n_unconnected += usize::from(!is_connected_by_steps(memory.costs(), &frontier_mask));
        }
        let n = (n_found, n_choices, n_unconnected, n_blocked);
        assert!(n_found > 80 && n_choices > 40 && n_unconnected > 10 && n_blocked > 5, "{n:?}");
    }

    #[test]
    fn the_area_behind_a_frontier_has_at_most_the_assumed_number_of_cells() {
        let mut rng = RngStream::new(1, "area", 0);
        let grid =
            *Memory::new(&Toy::room(6.0, 6.0).briefing(), crate::PlannerRules::paper()).map.grid();
        let counts = (0..1000).map(|_| {
            let center = Vec2::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
            grid.disc(center, AREA_RADIUS_M).count()
        });
        let most = counts.max().expect("not empty");
        assert!((804..MAX_AREA_CELLS).contains(&most), "{most}");
    }
}
