//! Walking as the original does ([`Walking::Lattice`]): a way over straight neighbors, planned anew
//! at every decision; turns of 15 degrees towards a cell a little ahead on it (facts A1.6).
//!
//! [`Walking::Lattice`]: crate::rules::Walking

use chaic_core::geom::{wrap_angle, yaw_towards};
use chaic_core::{Action, Vec2, Vec3};

use super::navigate::{Destination, Nav};
use crate::mapping::{CELL_M, Space};
use crate::memory::Memory;
use crate::planning::lattice_costs::BLOCKED;
use crate::planning::path::Path;

/// One heads for the cell that is so many ahead on the way.
const AHEAD: usize = 5;
/// Heading for it within so many turns, one walks on.
const WALK_TURNS: f32 = 1.2;
/// Who has turned towards its way so often without a step keeps to the way that it then knows, and
/// waits for nobody meanwhile (ours). Nobody needs more than half a circle to face any way; but what
/// one sees on turning may move the way to the other side, or block it, and back again.
const MOST_TURNS: u32 = 24;
/// A way is kept for so many cells (1.5 m), and for so many actions (ours: half a circle of turns
/// to either side, and the steps).
const KEPT_CELLS: usize = 12;
const KEPT_ACTIONS: u32 = 40;
/// Whoever is farther than this from the way that it keeps to has left it, metres.
const OFF_WAY_M: f32 = 0.5;
/// To do something with a thing, the way to it may have so many cells at most.
const INTERACT_CELLS: usize = 25;

/// What lasts between decisions, so that nobody turns to and fro for ever.
#[derive(Clone, Debug, Default)]
pub struct Steadiness {
    /// Turns towards the way since the last step.
    n_turns: u32,
    /// The way that one keeps to, whatever is seen meanwhile, and for how many actions yet.
    kept: Option<(Vec<usize>, u32)>,
}

impl Steadiness {
    /// Notes a turn towards `way`, the one that is known now.
    fn turn(&mut self, way: &Path) {
        self.n_turns += 1;
        if self.n_turns > MOST_TURNS {
            self.n_turns = 0;
            let cells = way.cells.iter().copied().take(KEPT_CELLS).collect();
            self.kept = Some((cells, KEPT_ACTIONS));
        }
    }

    /// What is left of the way that one keeps to. It ends where one has left it, or where a wall
    /// turns out to stand on it; not where an obstacle does, which is seen from one side and not from
    /// the other while one turns.
    fn kept_way(&mut self, memory: &Memory) -> Option<Path> {
        let (cells, n_left) = self.kept.take().filter(|(_, n_left)| *n_left > 0)?;
        let (grid, here) = (memory.map.grid(), memory.here());
        let away_m = |cell: &usize| grid.center(*cell).distance(here);
        let nearest = cells.iter().map(away_m).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        let (first, _) = nearest.filter(|(_, away_m)| *away_m <= OFF_WAY_M)?;
        let ahead = cells.get(first..).filter(|ahead| ahead.len() > 1)?.to_vec();
        if ahead.iter().any(|cell| memory.map.space(*cell) == Space::Wall) {
            return None;
        }
        self.kept = Some((cells, n_left - 1));
        Some(Path { cells: ahead, cost: 0 })
    }
}

/// The next action on the way to `destination`.
pub fn step(memory: &mut Memory, destination: &Destination, steady: &mut Steadiness) -> Nav {
    let (here, yaw) = (memory.here(), memory.pose.yaw_rad);
    let target = destination.nearest(here);
    let (costs, search) = memory.costs_and_search();
    let grid = *costs.grid();
    let (Some(start), Some(end)) = (grid.cell_at(here), grid.cell_at(target)) else {
        return Nav::Unreachable;
    };
    let Some(way) = search.straight_way(costs, start, end) else {
        return Nav::Unreachable;
    };
    let is_short = destination.arm_m.is_none() || way.cells.len() <= INTERACT_CELLS;
    if here.distance(target) < destination.within_m && is_short {
        return Nav::Arrived;
    }
    let way = steady.kept_way(memory).unwrap_or(way);
    if memory.waits_for_obstacles() && way.cost > BLOCKED && memory.map.space(end) != Space::Wall {
        // It waits for somebody to clear the way, though not for ever.
        return if memory.wait_for_obstacle() {
            Nav::Act(Action::TurnLeft)
        } else {
            Nav::Unreachable
        };
    }
    let to = waypoint(memory, &way);
    let at = |p: Vec2| Vec3::new(p.x, 0.0, p.y);
    let error = wrap_angle(yaw_towards(at(here), at(to)) - yaw);
    if error.abs() < WALK_TURNS * memory.motion.turn_rad || to == here {
        steady.n_turns = 0;
        memory.note_step();
        return Nav::Act(Action::MoveForward);
    }
    steady.turn(&way);
    Nav::Act(if error > 0.0 { Action::TurnLeft } else { Action::TurnRight })
}

/// The cell to head for: a little ahead, or the next one if a wall is anywhere between.
fn waypoint(memory: &Memory, way: &Path) -> Vec2 {
    let grid = memory.map.grid();
    let center = |k: usize| grid.center(way.cells[k.min(way.cells.len() - 1)]);
    let (from, to) = (center(0), center(AHEAD));
    let (low, high) = (from.min(to), from.max(to));
    let cells = |length: f32| (length / CELL_M).round() as usize;
    let (nx, nz) = (cells(high.x - low.x), cells(high.y - low.y));
    let mut between = (0..nz)
        .flat_map(|j| (0..nx).map(move |i| low + CELL_M * Vec2::new(i as f32, j as f32)))
        .filter_map(|p| grid.cell_at(p));
    if between.any(|c| memory.map.space(c) == Space::Wall) { center(1) } else { to }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannerRules;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::rules::{FailureRules, Walking};
    use crate::test_support::{Toy, ToyObject};
    use chaic_core::AgentId;
    use chaic_core::capability::Persona;

    /// What somebody remembers who stands before an obstacle, with the obstacle straight ahead.
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

    /// The first step of somebody towards an obstacle straight ahead.
    fn first_step(persona: Persona, me: AgentId) -> Nav {
        step(&mut before_obstacle(persona, me), &beyond_obstacle(), &mut Steadiness::default())
    }

    fn beyond_obstacle() -> Destination {
        Destination::near(Vec2::new(2.0, 0.0), 0.3)
    }

    #[test]
    fn nobody_waits_for_an_obstacle_to_be_cleared_for_ever() {
        let mut memory = before_obstacle(Persona::Wheelchair, AgentId::PARTNER);
        let begin = memory.frame;
        let FailureRules { obstacle_patience_frames, ignore_frames, .. } = memory.rules.failures;
        let again = obstacle_patience_frames + ignore_frames;
        for after in (0..again + 10).step_by(2) {
            memory.frame = begin + after;
            let waits = after <= obstacle_patience_frames || after >= again;
            let expected = if waits { Nav::Act(Action::TurnLeft) } else { Nav::Unreachable };
            let nav = step(&mut memory, &beyond_obstacle(), &mut Steadiness::default());
            assert_eq!(nav, expected, "after {after} frames");
        }
    }

    #[test]
    fn who_has_waited_in_vain_goes_where_there_is_just_enough_room() {
        let mut memory = before_obstacle(Persona::Wheelchair, AgentId::PARTNER);
        // Beside the obstacle's front, from (1.75, -0.25) to (1.75, 0.25): in a corner of the square
        // that the original leaves free, and where the body would touch.
        let [corner, touching] = [[2.2, 0.65], [1.8, 0.35]].map(Vec2::from);
        let is_open = |memory: &mut Memory, at: Vec2| {
            memory.refresh();
            let cell = memory.map.grid().cell_at(at).expect("inside");
            memory.costs().cost(cell) < BLOCKED / 3
        };
        assert!(!is_open(&mut memory, corner) && !is_open(&mut memory, touching));
        memory.wait_for_obstacle();
        memory.frame += memory.rules.failures.obstacle_patience_frames;
        assert!(memory.wait_for_obstacle(), "to the end of its patience");
        assert!(is_open(&mut memory, corner) && !is_open(&mut memory, touching));
    }

    #[test]
    fn who_turns_to_and_fro_keeps_to_one_way_and_leaves_it_in_time() {
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
        let mut steady = Steadiness::default();
        for way in [&left, &right].into_iter().cycle().take(MOST_TURNS as usize) {
            steady.turn(way);
            assert!(steady.kept_way(&memory).is_none());
        }
        steady.turn(&left);
        let kept = steady.kept_way(&memory).expect("it has turned too often");
        assert_eq!(kept.cells, left.cells[..KEPT_CELLS]);
        toy.stand([-0.5, 0.0], 0.0);
        look(&toy, &mut memory);
        let rest = steady.kept_way(&memory).expect("it goes on");
        assert_eq!(rest.cells, left.cells[4..KEPT_CELLS]);
        let n_more = std::iter::from_fn(|| steady.kept_way(&memory)).count();
        assert_eq!(n_more, KEPT_ACTIONS as usize - 2, "not for ever");
    }

    #[test]
    fn an_obstacle_keeps_the_partner_in_the_wheelchair_turning_and_nobody_else() {
        let (rolls, walks) = (Persona::Wheelchair, Persona::Adult);
        assert_eq!(first_step(rolls, AgentId::PARTNER), Nav::Act(Action::TurnLeft));
        assert_eq!(first_step(walks, AgentId::PARTNER), Nav::Act(Action::MoveForward));
        assert_eq!(first_step(rolls, AgentId::HELPER), Nav::Act(Action::MoveForward));
    }
}
