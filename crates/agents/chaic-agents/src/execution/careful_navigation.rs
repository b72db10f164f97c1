//! Navigation with a body of its true radius: follows the cheapest path with steps and turns of 15
//! degrees.

use std::collections::VecDeque;

use chaic_core::Vec2;

use super::careful_approach::CarefulApproach;
use super::destination::{Destination, OWN_BODY_M};
use super::joint_navigation;
use super::navigation::{Approach, NavigationStep, Navigator};
use super::steering::steer;
use crate::memory::Memory;
use crate::planning::cost_map::{CostMap, OCCUPIED};
use crate::planning::path::SearchGoal;
use crate::track::Intent;

/// Maximum path cost: a path that costs more passes an occupied cell.
const LIMIT: u32 = 10 * OCCUPIED - 1;
/// Maximum look-ahead of the waypoint on the path, cells (2.5 m).
const LOOK_AHEAD: usize = 20;
/// Length of the path ahead that is checked for new obstacles, cells.
const CHECK_AHEAD: usize = 24;
/// Maximum number of decisions between replannings.
const REPLAN_EVERY: u32 = 10;
/// Distance from the path that triggers replanning, meters.
const OFF_PATH_M: f32 = 0.6;

/// Goal of the path search: any arrival position.
struct Goal<'a> {
    destination: &'a Destination,
    costs: &'a CostMap,
    center: Vec2,
    radius_m: f32,
}

impl SearchGoal for Goal<'_> {
    fn is_goal(&self, cell: usize) -> bool {
        self.min_distance_m(cell) <= 0.0
            && !self.costs.touches_obstacle(cell)
            && self.destination.accepts(self.costs, self.costs.grid().center(cell), 0.0)
    }

    fn min_distance_m(&self, cell: usize) -> f32 {
        let here = self.costs.grid().center(cell);
        here.distance(self.center) - self.radius_m - self.destination.within_m
    }
}

/// Navigates to destinations; keeps the path between decisions.
#[derive(Clone, Debug, Default)]
pub struct CarefulNavigator {
    path: Vec<usize>,
    /// Index on the path of the cell nearest to the body.
    index: usize,
    /// Center and arrival distance of the destination for which the path was planned.
    planned_for: Option<(Vec2, f32)>,
    /// Number of decisions since the path was planned.
    age: u32,
    /// True if the path passes cells in which the body touches something.
    is_tight_path: bool,
    /// Next actions of joint carriers.
    joint_actions: VecDeque<Intent>,
}

impl Navigator for CarefulNavigator {
    fn step(&mut self, memory: &mut Memory, destination: &Destination) -> NavigationStep {
        if let Some(step) = joint_navigation::step(memory, destination, &mut self.joint_actions) {
            return step;
        }
        let (here, yaw, motion) = (memory.position(), memory.pose.yaw_rad, memory.motion);
        let (costs, _) = memory.costs_and_search();
        if destination.is_reached(costs, here) {
            self.path.clear();
            return NavigationStep::Arrived;
        }
        self.age += 1;
        if !self.advance_on_path(costs, here, destination) && !self.plan(memory, here, destination)
        {
            return NavigationStep::Unreachable;
        }
        // The center of the agent's own cell is an arrival position: no step brings it closer.
        if self.path.len() == 1 {
            self.path.clear();
            return NavigationStep::Arrived;
        }
        let (costs, _) = memory.costs_and_search();
        let waypoint = self.waypoint(costs, here);
        NavigationStep::Act(steer(costs, here, yaw, waypoint, &motion))
    }

    fn path(&self) -> &[usize] {
        self.path.get(self.index..).unwrap_or_default()
    }

    fn reset(&mut self) {
        self.path.clear();
        self.joint_actions.clear();
    }

    fn needs_recovery(&self) -> bool {
        true
    }

    fn new_approach(&self) -> Box<dyn Approach> {
        Box::<CarefulApproach>::default()
    }

    fn fork(&self) -> Box<dyn Navigator> {
        Box::new(self.clone())
    }
}

impl CarefulNavigator {
    /// Advances on the path. Returns false if it leads elsewhere or is blocked.
    fn advance_on_path(&mut self, costs: &CostMap, here: Vec2, destination: &Destination) -> bool {
        let (center, _) = destination.center_and_radius();
        let same = self
            .planned_for
            .is_some_and(|(c, w)| c.distance(center) < 0.3 && w == destination.within_m);
        if !same || self.path.is_empty() || self.age > REPLAN_EVERY {
            return false;
        }
        let grid = costs.grid();
        let ahead = &self.path[self.index..self.path.len().min(self.index + CHECK_AHEAD)];
        let nearest = ahead
            .iter()
            .enumerate()
            .map(|(i, c)| (i, grid.center(*c).distance(here)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((i, off_m)) = nearest else { return false };
        let is_blocked =
            |c: &usize| costs.is_blocked(*c) || (costs.touches_obstacle(*c) && !self.is_tight_path);
        if off_m > OFF_PATH_M || ahead[i..].iter().any(is_blocked) {
            return false;
        }
        self.index += i;
        // At the end of the path without arrival: the map has changed.
        self.index + 1 < self.path.len()
    }

    /// Plans a path; returns whether there is one.
    fn plan(&mut self, memory: &mut Memory, here: Vec2, destination: &Destination) -> bool {
        let (costs, search) = memory.costs_and_search();
        let (center, radius_m) = destination.center_and_radius();
        self.planned_for = Some((center, destination.within_m));
        (self.index, self.age) = (0, 0);
        self.path.clear();
        let goal = Goal { destination, costs, center, radius_m };
        let Some(start) = costs.grid().cell_at(here) else { return false };
        match search.a_star(costs.grid(), costs.costs(), start, &goal, LIMIT) {
            Some(path) => {
                self.is_tight_path = path.cells[1..].iter().any(|c| costs.touches_obstacle(*c));
                self.path = path.cells;
                true
            }
            None => false,
        }
    }

    /// Returns the farthest waypoint on the path, within the look-ahead, that is reachable on a
    /// straight line without higher costs than on the path.
    fn waypoint(&self, costs: &CostMap, here: Vec2) -> Vec2 {
        let grid = costs.grid();
        let end = self.path.len().min(self.index + 1 + LOOK_AHEAD);
        let ahead = &self.path[(self.index + 1).min(end)..end];
        let Some(first) = ahead.first() else { return here };
        let mut best = grid.center(*first);
        let mut worst = costs.cost(self.path[self.index]).max(costs.cost(*first));
        for cell in ahead {
            worst = worst.max(costs.cost(*cell));
            let point = grid.center(*cell);
            let length = point.distance(here);
            let from = here.lerp(point, (OWN_BODY_M / length.max(OWN_BODY_M)).min(1.0));
            if grid.line(from, point).all(|c| costs.cost(c) <= worst) {
                best = point;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{Toy, ToyObject, ToyRun};

    /// Walks to a point in a toy world; returns the remaining distance and the number of decisions.
    fn walk(toy: Toy, to: Vec2, limit: usize) -> (f32, usize) {
        let mut run = ToyRun::new(toy);
        let mut navigator = CarefulNavigator::default();
        for n in 0..limit {
            let mut memory = run.observe();
            match navigator.step(&mut memory, &Destination::near(to, 0.5)) {
                NavigationStep::Act(action) => run.act(action, memory),
                NavigationStep::Arrived => return (memory.position().distance(to), n),
                NavigationStep::Unreachable => panic!("no path after {n} decisions"),
            }
        }
        panic!("not there after {limit} decisions: {:?}", run.toy.here());
    }

    #[test]
    fn walks_straight_through_a_free_room() {
        let mut toy = Toy::room(10.0, 10.0);
        toy.stand([-4.0, 4.0], 0.0);
        let (left_m, n) = walk(toy, Vec2::new(4.0, -4.0), 45);
        // 11.3 m less 0.5 m are 26 steps, after three turns.
        assert!(left_m <= 0.5 && n <= 36, "{left_m} {n}");
    }

    #[test]
    fn walks_around_furniture_and_through_a_door() {
        let mut toy = Toy::room(10.0, 8.0);
        // A wall across the room with a door 0.9 m wide at x = 3, and a cabinet in front of it.
        toy.add_wall([-5.0, -0.05], [2.55, 0.05]);
        toy.add_wall([3.45, -0.05], [5.0, 0.05]);
        toy.add(ToyObject::new("cabinet", [1.5, 0.0, 1.6], [1.6, 1.0, 0.5]));
        toy.stand([-4.0, 3.0], 0.0);
        let (left_m, n) = walk(toy, Vec2::new(-4.0, -3.0), 140);
        assert!(left_m <= 0.5, "{left_m} after {n}");
    }

    #[test]
    fn an_agent_in_an_arrival_cell_has_arrived() {
        let mut toy = Toy::room(8.0, 8.0);
        toy.stand([0.0, 0.0], 0.0);
        let mut memory = ToyRun::new(toy).observe();
        let grid = memory.costs().grid();
        let cell = grid.cell_at(memory.position()).expect("inside the room");
        let center = grid.center(cell);
        let from_center = memory.position() - center;
        assert!(from_center.length() > 0.01, "the agent stands off the center");
        // The center is nearer than 0.5 m to this point, the agent is not.
        let point = center - from_center.normalize() * 0.495;
        assert!(memory.position().distance(point) > 0.5);
        let step = CarefulNavigator::default().step(&mut memory, &Destination::near(point, 0.5));
        assert_eq!(step, NavigationStep::Arrived);
    }
}
