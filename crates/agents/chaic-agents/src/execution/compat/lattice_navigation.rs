//! Navigation of the original ([`Walking::Lattice`]): a path over straight neighbors, replanned at
//! every decision, and turns of 15 degrees towards a waypoint on it (facts A1.6).
//!
//! [`Walking::Lattice`]: crate::rules::Walking

use chaic_core::geom::{wrap_angle, yaw_towards};
use chaic_core::{Action, Vec2, Vec3};

use super::lattice_approach::LatticeApproach;
use crate::execution::destination::Destination;
use crate::execution::navigation::{Approach, NavigationStep, Navigator, PathState};
use crate::mapping::{CELL_M, CellOccupancy};
use crate::memory::Memory;
use crate::planning::compat::lattice_costs::{BLOCKED, MAX_PATH_COST};
use crate::planning::compat::straight_path::StraightSearch;
use crate::planning::path::Path;

/// Index of the waypoint on the path.
const WAYPOINT_INDEX: usize = 5;
/// Heading error up to which the agent steps forward, in turns.
const WALK_TURNS: f32 = 1.2;
/// Number of turns without a step after which the current path is kept (ours). Half a circle is
/// enough to face any path. However, observations made while turning may move the path to the other
/// side, repeatedly. Turns in front of an obstacle do not count, and a kept path does not pass one.
const MAX_TURNS: u32 = 24;
/// Length for which a path is kept, cells (1.5 m), and the maximum number of actions (ours: half a
/// circle of turns to either side, and the steps).
const KEPT_CELLS: usize = 12;
const KEPT_ACTIONS: u32 = 40;
/// Distance from the kept path at which it is abandoned, meters.
const OFF_PATH_M: f32 = 0.5;
/// Maximum number of cells of the path to an object for an interaction.
const INTERACT_CELLS: usize = 25;

/// State between decisions that prevents endless turning to and fro.
#[derive(Clone, Debug, Default)]
struct Hysteresis {
    /// Turns towards the path since the last step.
    n_turns: u32,
    /// The kept path, and the number of actions for which it stays valid.
    kept: Option<(Vec<usize>, u32)>,
}

impl Hysteresis {
    /// Records a turn towards `path`, the current one.
    fn record_turn(&mut self, path: &Path) {
        self.n_turns += 1;
        if self.n_turns > MAX_TURNS {
            self.n_turns = 0;
            let cells = path.cells.iter().copied().take(KEPT_CELLS).collect();
            self.kept = Some((cells, KEPT_ACTIONS));
        }
    }

    /// Returns the remaining part of the kept path. It is dropped when the agent has left it, or
    /// when a wall is found on it.
    fn kept_path(&mut self, memory: &Memory) -> Option<Path> {
        let (cells, n_left) = self.kept.take().filter(|(_, n_left)| *n_left > 0)?;
        let (grid, here) = (memory.map.grid(), memory.position());
        let away_m = |cell: &usize| grid.center(*cell).distance(here);
        let nearest = cells.iter().map(away_m).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        let (first, _) = nearest.filter(|(_, away_m)| *away_m <= OFF_PATH_M)?;
        let ahead = cells.get(first..).filter(|ahead| ahead.len() > 1)?.to_vec();
        if ahead.iter().any(|cell| memory.map.state(*cell) == CellOccupancy::Wall) {
            return None;
        }
        self.kept = Some((cells, n_left - 1));
        Some(Path { cells: ahead, cost: 0 })
    }
}

/// Navigator of the original.
#[derive(Clone, Debug, Default)]
pub struct LatticeNavigator {
    hysteresis: Hysteresis,
    path_state: PathState,
    /// Path of the last step, for drawings; empty if the step followed none.
    path: Vec<usize>,
    /// Working memory of the path search, created on first use.
    search: Option<StraightSearch>,
}

impl Navigator for LatticeNavigator {
    fn step(&mut self, memory: &mut Memory, destination: &Destination) -> NavigationStep {
        self.path.clear();
        let (here, yaw) = (memory.position(), memory.pose.yaw_rad);
        let target = destination.nearest_point(here);
        let (costs, _) = memory.costs_and_search();
        let grid = *costs.grid();
        let (Some(start), Some(end)) = (grid.cell_at(here), grid.cell_at(target)) else {
            return NavigationStep::Unreachable;
        };
        let search = self.search.get_or_insert_with(|| StraightSearch::new(grid.n_cells()));
        let Some(path) = search.path(costs, start, end) else {
            return NavigationStep::Unreachable;
        };
        let is_blocked = memory.waits_for_obstacles()
            && path.cost > BLOCKED
            && memory.map.state(end) != CellOccupancy::Wall;
        self.path_state = match path.cost {
            _ if is_blocked => PathState::Blocked,
            cost if cost > MAX_PATH_COST => PathState::TooCostly,
            _ => PathState::Open,
        };
        // A blocked path prevents the arrival of exploration, but not an interaction.
        let is_interaction = destination.arm_m.is_some();
        let is_short = !is_interaction || path.cells.len() <= INTERACT_CELLS;
        let is_near = here.distance(target) < destination.within_m;
        if is_near && is_short && (is_interaction || !is_blocked) {
            return NavigationStep::Arrived;
        }
        if is_blocked {
            // Turn in place until another agent clears the path, or the plan times out.
            return NavigationStep::Act(Action::TurnLeft);
        }
        let path = self.hysteresis.kept_path(memory).unwrap_or(path);
        let to = waypoint(memory, &path);
        self.path.clone_from(&path.cells);
        let at = |p: Vec2| Vec3::new(p.x, 0.0, p.y);
        let error = wrap_angle(yaw_towards(at(here), at(to)) - yaw);
        if error.abs() < WALK_TURNS * memory.motion.turn_rad || to == here {
            self.hysteresis.n_turns = 0;
            return NavigationStep::Act(Action::MoveForward);
        }
        self.hysteresis.record_turn(&path);
        NavigationStep::Act(if error > 0.0 { Action::TurnLeft } else { Action::TurnRight })
    }

    fn path_state(&self) -> PathState {
        self.path_state
    }

    fn path(&self) -> &[usize] {
        &self.path
    }

    /// Drops only the drawn path: the path is replanned at every decision, and the hysteresis spans
    /// plans.
    fn reset(&mut self) {
        self.path.clear();
    }

    fn needs_recovery(&self) -> bool {
        false
    }

    fn new_approach(&self) -> Box<dyn Approach> {
        Box::<LatticeApproach>::default()
    }

    fn fork(&self) -> Box<dyn Navigator> {
        Box::new(self.clone())
    }
}

/// Returns the waypoint: a few cells ahead, or the next cell if a wall is in between.
fn waypoint(memory: &Memory, path: &Path) -> Vec2 {
    let grid = memory.map.grid();
    let center = |k: usize| grid.center(path.cells[k.min(path.cells.len() - 1)]);
    let (from, to) = (center(0), center(WAYPOINT_INDEX));
    let (low, high) = (from.min(to), from.max(to));
    let cells = |length: f32| (length / CELL_M).round() as usize;
    let (nx, nz) = (cells(high.x - low.x), cells(high.y - low.y));
    let mut between = (0..nz)
        .flat_map(|j| (0..nx).map(move |i| low + CELL_M * Vec2::new(i as f32, j as f32)))
        .filter_map(|p| grid.cell_at(p));
    if between.any(|c| memory.map.state(c) == CellOccupancy::Wall) { center(1) } else { to }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannerRules;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::rules::Walking;
    use crate::test_support::{Toy, ToyObject};
    use chaic_core::AgentId;
    use chaic_core::capability::Persona;

    /// Creates a memory of an agent with an obstacle straight ahead.
    fn before_obstacle(persona: Persona, me: AgentId) -> Memory {
        let mut toy = Toy::room(10.0, 10.0);
        toy.add(ToyObject::new("trashbin", [2.0, 0.0, 0.0], [0.5, 0.6, 0.5]));
        toy.stand([-1.0, 0.0], -std::f32::consts::FRAC_PI_2);
        let mut briefing = toy.briefing();
        briefing.capability.removes_obstacles = persona.capability().removes_obstacles;
        briefing.me = me;
        let rules = PlannerRules { walking: Walking::Lattice, ..PlannerRules::paper() };
        let mut memory = Memory::new(&briefing, rules);
        let mut observation = toy.observe();
        observation.frame = 300;
        let percepts = GroundTruthIds.perceive(&observation);
        memory.update(&briefing, &observation, &percepts);
        memory
    }

    /// Returns the first step of an agent towards an obstacle straight ahead.
    fn first_step(persona: Persona, me: AgentId) -> NavigationStep {
        LatticeNavigator::default().step(&mut before_obstacle(persona, me), &beyond_obstacle())
    }

    fn beyond_obstacle() -> Destination {
        Destination::near(Vec2::new(2.0, 0.0), 0.3)
    }

    #[test]
    fn an_obstacle_is_waited_for_without_a_time_limit() {
        let mut memory = before_obstacle(Persona::Wheelchair, AgentId::PARTNER);
        let (start, mut navigator) = (memory.frame, LatticeNavigator::default());
        // The time limit is that of the plan.
        for after in (0..memory.rules.plan_timeouts.interact_frames).step_by(2) {
            memory.frame = start + after;
            let step = navigator.step(&mut memory, &beyond_obstacle());
            assert_eq!(step, NavigationStep::Act(Action::TurnLeft), "after {after} frames");
            assert_eq!(navigator.path_state(), PathState::Blocked);
        }
    }

    #[test]
    fn a_blocked_path_prevents_the_arrival_of_exploration_but_not_an_interaction() {
        let mut memory = before_obstacle(Persona::Wheelchair, AgentId::PARTNER);
        let explore = Destination::near(Vec2::new(1.7, 0.0), 3.5);
        let interact = Destination { arm_m: Some(0.0), ..explore.clone() };
        let mut step = |d: &Destination| LatticeNavigator::default().step(&mut memory, d);
        assert_eq!(step(&explore), NavigationStep::Act(Action::TurnLeft));
        assert_eq!(step(&interact), NavigationStep::Arrived);
    }

    #[test]
    fn no_path_is_drawn_after_arrival_or_a_reset() {
        let mut memory = before_obstacle(Persona::Adult, AgentId::HELPER);
        let mut navigator = LatticeNavigator::default();
        let here = Destination::near(memory.position(), 1.0);
        for is_reset in [false, true] {
            let step = navigator.step(&mut memory, &beyond_obstacle());
            assert!(matches!(step, NavigationStep::Act(_)) && !navigator.path().is_empty());
            if is_reset {
                navigator.reset();
            } else {
                assert_eq!(navigator.step(&mut memory, &here), NavigationStep::Arrived);
            }
            assert!(navigator.path().is_empty());
        }
    }

    #[test]
    fn oscillating_turns_make_the_agent_keep_one_path_for_a_while() {
        let mut toy = Toy::room(10.0, 10.0);
        let briefing = toy.briefing();
        let rules = PlannerRules { walking: Walking::Lattice, ..PlannerRules::paper() };
        let mut memory = Memory::new(&briefing, rules);
        let look = |toy: &Toy, memory: &mut Memory| {
            let observation = toy.observe();
            let percepts = GroundTruthIds.perceive(&observation);
            memory.update(&briefing, &observation, &percepts);
            memory.refresh();
        };
        look(&toy, &mut memory);
        let grid = *memory.map.grid();
        let cells = |x: f32| {
            let at = |k: u32| grid.cell_at(Vec2::new(x * k as f32 * CELL_M, 0.0));
            (0..20).map(|k| at(k).expect("inside")).collect()
        };
        let [left, right] = [-1.0, 1.0].map(|x| Path { cells: cells(x), cost: 0 });
        let mut hysteresis = Hysteresis::default();
        for path in [&left, &right].into_iter().cycle().take(MAX_TURNS as usize) {
            hysteresis.record_turn(path);
            assert!(hysteresis.kept_path(&memory).is_none());
        }
        hysteresis.record_turn(&left);
        let kept = hysteresis.kept_path(&memory).expect("it has turned too often");
        assert_eq!(kept.cells, left.cells[..KEPT_CELLS]);
        toy.stand([-0.5, 0.0], 0.0);
        look(&toy, &mut memory);
        let remaining = hysteresis.kept_path(&memory).expect("the path is still kept");
        assert_eq!(remaining.cells, left.cells[4..KEPT_CELLS]);
        let n_more = std::iter::from_fn(|| hysteresis.kept_path(&memory)).count();
        assert_eq!(n_more, KEPT_ACTIONS as usize - 2, "only for a limited number of actions");
    }

    #[test]
    fn an_obstacle_keeps_only_the_partner_in_the_wheelchair_turning() {
        let (rolls, walks) = (Persona::Wheelchair, Persona::Adult);
        assert_eq!(first_step(rolls, AgentId::PARTNER), NavigationStep::Act(Action::TurnLeft));
        assert_eq!(first_step(walks, AgentId::PARTNER), NavigationStep::Act(Action::MoveForward));
        assert_eq!(first_step(rolls, AgentId::HELPER), NavigationStep::Act(Action::MoveForward));
    }
}
