//! Walking as the original does ([`Walking::Lattice`]): a way over straight neighbors, planned anew
//! at every decision; turns of 15 degrees towards a cell a little ahead on it (facts A1.6).
//!
//! [`Walking::Lattice`]: crate::rules::Walking

use chaic_protocol::geom::{wrap_angle, yaw_towards};
use chaic_protocol::{Action, Vec2, Vec3};

use super::navigate::{Destination, Nav, TURN_RAD};
use super::path::Path;
use crate::memory::lattice_costs::BLOCKED;
use crate::memory::{CELL_M, Memory, Space};

/// One heads for the cell that is so many ahead on the way.
const AHEAD: usize = 5;
/// Heading for it within this, one walks on, radians: 1.2 turns.
const WALK_RAD: f32 = 1.2 * TURN_RAD;
/// Who has turned so often without a step takes one (ours). Nobody needs more than half a circle to
/// face any way; but what one sees on turning may move the way to the other side, and back again.
const MOST_TURNS: u32 = 24;
/// To do something with a thing, the way to it may have so many cells at most.
const INTERACT_CELLS: usize = 25;

/// The next action on the way to `destination`; `n_turns` counts the turns since the last step.
pub fn step(memory: &mut Memory, destination: &Destination, n_turns: &mut u32) -> Nav {
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
    if memory.waits_for_obstacles() && way.cost > BLOCKED && memory.map.space(end) != Space::Wall {
        // It waits for somebody to clear the way.
        return Nav::Act(Action::TurnLeft);
    }
    let to = waypoint(memory, &way);
    let at = |p: Vec2| Vec3::new(p.x, 0.0, p.y);
    let error = wrap_angle(yaw_towards(at(here), at(to)) - yaw);
    *n_turns += 1;
    Nav::Act(if error.abs() < WALK_RAD || to == here || *n_turns > MOST_TURNS {
        *n_turns = 0;
        Action::MoveForward
    } else if error > 0.0 {
        Action::TurnLeft
    } else {
        Action::TurnRight
    })
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
    use crate::rules::Walking;
    use crate::test_support::{Toy, ToyObject};
    use chaic_protocol::AgentId;
    use chaic_protocol::capability::Persona;

    /// The first step of somebody towards an obstacle straight ahead.
    fn first_step(persona: Persona, me: AgentId) -> Nav {
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
        let percepts = crate::perception::Perception::perceive(
            &mut crate::perception::GroundTruthIds,
            &observation,
        );
        memory.update(&briefing, &observation, &percepts);
        step(&mut memory, &Destination::near(Vec2::new(2.0, 0.0), 0.3), &mut 0)
    }

    #[test]
    fn an_obstacle_keeps_the_partner_in_the_wheelchair_turning_and_nobody_else() {
        let (rolls, walks) = (Persona::Wheelchair, Persona::Adult);
        assert_eq!(first_step(rolls, AgentId::PARTNER), Nav::Act(Action::TurnLeft));
        assert_eq!(first_step(walks, AgentId::PARTNER), Nav::Act(Action::MoveForward));
        assert_eq!(first_step(rolls, AgentId::HELPER), Nav::Act(Action::MoveForward));
    }
}
