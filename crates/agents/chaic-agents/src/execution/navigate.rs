//! Walking somewhere: follows the cheapest way in steps and turns of 15 degrees.

use std::collections::VecDeque;
use std::f32::consts::PI;

use chaic_core::briefing::Motion;
use chaic_core::geom::{self, wrap_angle, xz};
use chaic_core::{Action, Vec2, Vec3};

use super::walking::style;
use crate::memory::Memory;
use crate::planning::costs::{CostMap, OCCUPIED};
use crate::planning::path::Goal;
use crate::track::Intent;

/// Whoever heads for the target this well walks on, radians (9 degrees). Half a turn is 7.5, so
/// that one does not turn to and fro.
const WALK_RAD: f32 = 0.157;
/// A step ends with a whole frame: an adult's, of 9 frames at 0.047 m, covers a little more than the
/// stride (facts S1.5 and S2.2).
const STEP_PER_STRIDE: f32 = 1.05;
/// A way that costs more than this passes something occupied.
const LIMIT: u32 = 10 * OCCUPIED - 1;
/// How far ahead on the way to look for a point to walk to, cells (2.5 m).
const LOOK_AHEAD: usize = 20;
/// How far ahead the way must still be as good as when it was planned, cells.
const CHECK_AHEAD: usize = 24;
/// The way is planned anew at least every so many decisions.
const REPLAN_EVERY: u32 = 10;
/// A body farther from its way than this needs a new one, metres.
const OFF_WAY_M: f32 = 0.6;
/// The body is where it is, so the beginning of a straight line is not tested, metres.
const OWN_M: f32 = 0.22;
/// The side of a thing from which an attempt failed is avoided: directions with a greater cosine
/// (40 degrees either way) at points of the thing nearer to each other than this, metres.
const AVOID_COS: f32 = 0.77;
const AVOID_POINTS_M: f32 = 0.4;
/// The same for large things, seen from their middle: 70 degrees either way.
const AVOID_COS_LARGE: f32 = 0.34;

/// One step is longer than a place to stand beside furniture is wide, metres.
const ARRIVAL_M: f32 = 0.12;

/// The length of a step, metres.
pub fn step_m(motion: &Motion) -> f32 {
    STEP_PER_STRIDE * motion.stride_m
}

/// Where to go.
#[derive(Clone, Debug, PartialEq)]
pub struct Destination {
    /// Any of these points (x, z); not empty.
    pub points: Vec<Vec2>,
    /// How near to one of them, metres.
    pub within_m: f32,
    /// If the straight line from there to the point must be clear: except for its last part of
    /// this length, metres, where the arm reaches over what the object lies on.
    pub arm_m: Option<f32>,
    /// It is to be on the same side of every wall as the thing with this middle, which may stand
    /// against the wall that one is behind.
    pub same_room_as: Option<Vec2>,
    /// Places from which it did not work; it is to be another side.
    pub avoid: Vec<Vec2>,
}

impl Destination {
    /// Near one point.
    pub fn near(point: Vec2, within_m: f32) -> Destination {
        Destination {
            points: vec![point],
            within_m,
            arm_m: None,
            same_room_as: None,
            avoid: Vec::new(),
        }
    }

    pub(super) fn nearest(&self, from: Vec2) -> Vec2 {
        let mut best = (f32::INFINITY, from);
        for p in &self.points {
            let d = p.distance_squared(from);
            if d < best.0 {
                best = (d, *p);
            }
        }
        best.1
    }

    fn center_and_radius(&self) -> (Vec2, f32) {
        let center = self.points.iter().copied().sum::<Vec2>() / self.points.len() as f32;
        let radius = self.points.iter().map(|p| p.distance(center)).fold(0.0, f32::max);
        (center, radius)
    }

    /// Whether somebody at `here` has arrived. A little less is asked for than when the way is
    /// planned, or one would step to and fro over the place to stand.
    pub fn is_reached(&self, costs: &CostMap, here: Vec2) -> bool {
        self.will_do(costs, here, ARRIVAL_M)
    }

    fn will_do(&self, costs: &CostMap, here: Vec2, tolerance_m: f32) -> bool {
        let point = self.nearest(here);
        point.distance(here) <= self.within_m
            && self.avoid.iter().all(|tried| self.is_other_side(*tried, here, point))
            && self.arm_m.is_none_or(|arm_m| is_line_clear(costs, here, point, arm_m + tolerance_m))
            && !self.is_walled_off(costs, here)
    }
}

impl Destination {
    /// Whether a wall is between somebody at `here` and the large thing that this is about. What is
    /// as high as a wall is one on the map: the thing's own outline does not count.
    pub(super) fn is_walled_off(&self, costs: &CostMap, here: Vec2) -> bool {
        let Some(middle) = self.same_room_as else { return false };
        /// So far inside the thing the line ends, metres: the wall may be all that it touches.
        const INSIDE_M: f32 = 0.35;
        let nearest = self.nearest(here);
        let end = nearest + (middle - nearest).clamp_length_max(INSIDE_M);
        let grid = costs.grid();
        let mut walls = grid.line(here, end).filter(|cell| costs.is_wall(*cell));
        walls.any(|cell| !self.points.iter().any(|p| grid.cell_at(*p) == Some(cell)))
    }

    fn is_other_side(&self, tried: Vec2, here: Vec2, point: Vec2) -> bool {
        if let Some(middle) = self.same_room_as {
            // What failed before a large thing that is near failed for a wall: not on that side.
            let (a, b) = (tried - middle, here - middle);
            return a.normalize_or_zero().dot(b.normalize_or_zero()) < AVOID_COS_LARGE;
        }
        let tried_point = self.nearest(tried);
        let (a, b) = (tried - tried_point, here - point);
        tried_point.distance(point) > AVOID_POINTS_M
            || a.normalize_or_zero().dot(b.normalize_or_zero()) < AVOID_COS
    }
}

/// Whether the body can walk from `from` to within an arm's length of `to`.
fn is_line_clear(costs: &CostMap, from: Vec2, to: Vec2, arm_m: f32) -> bool {
    let length = from.distance(to);
    if length <= OWN_M + arm_m {
        return true;
    }
    let at = |m: f32| from.lerp(to, m / length);
    costs.is_straight_clear(at(OWN_M), at(length - arm_m))
}

struct Search<'a> {
    destination: &'a Destination,
    costs: &'a CostMap,
    center: Vec2,
    radius_m: f32,
}

impl Goal for Search<'_> {
    fn is_goal(&self, cell: usize) -> bool {
        self.at_least_m(cell) <= 0.0
            && !self.costs.is_tight(cell)
            && self.destination.will_do(self.costs, self.costs.grid().center(cell), 0.0)
    }

    fn at_least_m(&self, cell: usize) -> f32 {
        let here = self.costs.grid().center(cell);
        here.distance(self.center) - self.radius_m - self.destination.within_m
    }
}

/// What navigation says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Nav {
    /// Do this next.
    Act(Intent),
    /// One is there.
    Arrived,
    /// No way is known.
    Unreachable,
}

/// Walks to destinations; keeps the way between decisions.
#[derive(Clone, Debug, Default)]
pub struct Navigator {
    way: Vec<usize>,
    at: usize,
    to: Option<(Vec2, f32)>,
    age: u32,
    is_tight_way: bool,
    /// What lasts between decisions where ways are those of the original.
    pub(super) steady: super::lattice::Steadiness,
    /// What comes next where two carry furniture.
    joint_way: VecDeque<Intent>,
}

impl Navigator {
    /// Forgets the present way.
    pub fn reset(&mut self) {
        self.way.clear();
        self.joint_way.clear();
    }

    /// The next action on the way to `destination`.
    pub fn step(&mut self, memory: &mut Memory, destination: &Destination) -> Nav {
        style(memory.rules.walking).walk(self, memory, destination)
    }

    /// The same for a body of its true width.
    pub(super) fn walk_with_care(&mut self, memory: &mut Memory, destination: &Destination) -> Nav {
        if let Some(nav) = super::carry::step(memory, destination, &mut self.joint_way) {
            return nav;
        }
        let (here, yaw, motion) = (memory.here(), memory.pose.yaw_rad, memory.motion);
        let (costs, _) = memory.costs_and_search();
        if destination.is_reached(costs, here) {
            self.way.clear();
            return Nav::Arrived;
        }
        self.age += 1;
        if !self.is_still_good(costs, here, destination) && !self.plan(memory, here, destination) {
            return Nav::Unreachable;
        }
        let (costs, _) = memory.costs_and_search();
        let target = self.look_ahead(costs, here);
        Nav::Act(steer(costs, here, yaw, target, &motion))
    }

    fn is_still_good(&mut self, costs: &CostMap, here: Vec2, to: &Destination) -> bool {
        let (center, _) = to.center_and_radius();
        let same = self.to.is_some_and(|(c, w)| c.distance(center) < 0.3 && w == to.within_m);
        if !same || self.way.is_empty() || self.age > REPLAN_EVERY {
            return false;
        }
        let grid = costs.grid();
        let ahead = &self.way[self.at..self.way.len().min(self.at + CHECK_AHEAD)];
        let nearest = ahead
            .iter()
            .enumerate()
            .map(|(i, c)| (i, grid.center(*c).distance(here)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((i, off_m)) = nearest else { return false };
        let bad = |c: &usize| costs.is_blocked(*c) || (costs.is_tight(*c) && !self.is_tight_way);
        if off_m > OFF_WAY_M || ahead[i..].iter().any(bad) {
            return false;
        }
        self.at += i;
        // At the end of the way but not arrived: the map has changed.
        self.at + 1 < self.way.len()
    }

    fn plan(&mut self, memory: &mut Memory, here: Vec2, destination: &Destination) -> bool {
        let (costs, search) = memory.costs_and_search();
        let (center, radius_m) = destination.center_and_radius();
        self.to = Some((center, destination.within_m));
        (self.at, self.age) = (0, 0);
        self.way.clear();
        let goal = Search { destination, costs, center, radius_m };
        let Some(start) = costs.grid().cell_at(here) else { return false };
        match search.a_star(costs.grid(), costs.costs(), start, &goal, LIMIT) {
            Some(path) => {
                self.is_tight_way = path.cells[1..].iter().any(|c| costs.is_tight(*c));
                self.way = path.cells;
                true
            }
            None => false,
        }
    }

    /// The farthest point of the way, within the look-ahead, to which one can go straight without
    /// coming nearer to anything than the way does.
    fn look_ahead(&self, costs: &CostMap, here: Vec2) -> Vec2 {
        let grid = costs.grid();
        let end = self.way.len().min(self.at + 1 + LOOK_AHEAD);
        let ahead = &self.way[(self.at + 1).min(end)..end];
        let Some(first) = ahead.first().or(self.way.last()) else { return here };
        let mut best = grid.center(*first);
        let mut worst = costs.cost(self.way[self.at]).max(costs.cost(*first));
        for cell in ahead {
            worst = worst.max(costs.cost(*cell));
            let point = grid.center(*cell);
            let length = point.distance(here);
            let from = here.lerp(point, (OWN_M / length.max(OWN_M)).min(1.0));
            if grid.line(from, point).all(|c| costs.cost(c) <= worst) {
                best = point;
            }
        }
        best
    }
}

/// Turns or walks so as to get to `target`: of the headings that turns can lead to, takes the
/// one nearest to the target's direction along which the next step is free.
fn steer(costs: &CostMap, here: Vec2, yaw: f32, target: Vec2, motion: &Motion) -> Intent {
    let half_circle = (PI / motion.turn_rad).round() as i32;
    let bearing = yaw_to(here, target);
    let is_free = |heading: f32| {
        let ahead = xz(geom::forward(heading));
        let (from, to) = (here + OWN_M * ahead, here + (step_m(motion) + 0.05) * ahead);
        costs.is_straight_clear(from, to)
    };
    if wrap_angle(bearing - yaw).abs() < WALK_RAD && is_free(yaw) {
        return Action::MoveForward;
    }
    let mut best: Option<(f32, i32)> = None;
    let mut nearest = (f32::INFINITY, 0);
    // Small turns first, so that of two equally good headings the nearer one is taken.
    for k in (0..=half_circle).flat_map(|k: i32| [k, -k]) {
        let heading = yaw + k as f32 * motion.turn_rad;
        let error = wrap_angle(bearing - heading).abs();
        if error + 1e-4 < nearest.0 {
            nearest = (error, k);
        }
        let better = best.is_none_or(|(e, _)| error + 1e-4 < e);
        if better && error < PI / 3.0 && is_free(heading) {
            best = Some((error, k));
        }
    }
    turn_or(best.map_or(nearest.1, |(_, k)| k), Action::MoveForward)
}

fn turn_or(turns: i32, ahead: Intent) -> Intent {
    match turns {
        0 => ahead,
        1.. => Action::TurnLeft,
        _ => Action::TurnRight,
    }
}

fn yaw_to(from: Vec2, to: Vec2) -> f32 {
    geom::yaw_towards(Vec3::new(from.x, 0.0, from.y), Vec3::new(to.x, 0.0, to.y))
}

/// The turn that faces `target` better, or `None` if one faces it within `tolerance_rad`, or
/// within half a turn if that is more.
pub fn face(memory: &Memory, target: Vec2, tolerance_rad: f32) -> Option<Intent> {
    let error = wrap_angle(yaw_to(memory.here(), target) - memory.pose.yaw_rad);
    (error.abs() > tolerance_rad.max(0.5 * memory.motion.turn_rad + 1e-3))
        .then_some(if error > 0.0 { Action::TurnLeft } else { Action::TurnRight })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{Toy, ToyObject, ToyRun};

    /// Walks to a point in a toy world; the distance left and the decisions used.
    fn walk(toy: Toy, to: Vec2, limit: usize) -> (f32, usize) {
        let mut run = ToyRun::new(toy);
        let mut navigator = Navigator::default();
        for n in 0..limit {
            let mut memory = run.look();
            match navigator.step(&mut memory, &Destination::near(to, 0.5)) {
                Nav::Act(action) => run.act(action, memory),
                Nav::Arrived => return (memory.here().distance(to), n),
                Nav::Unreachable => panic!("no way after {n} decisions"),
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
        // A wall across the room with a door 0.9 m wide at x = 3, and a cabinet in the way to it.
        toy.add_wall([-5.0, -0.05], [2.55, 0.05]);
        toy.add_wall([3.45, -0.05], [5.0, 0.05]);
        toy.add(ToyObject::new("cabinet", [1.5, 0.0, 1.6], [1.6, 1.0, 0.5]));
        toy.stand([-4.0, 3.0], 0.0);
        let (left_m, n) = walk(toy, Vec2::new(-4.0, -3.0), 140);
        assert!(left_m <= 0.5, "{left_m} after {n}");
    }

    #[test]
    fn turns_the_short_way() {
        let mut toy = Toy::room(6.0, 6.0);
        toy.stand([0.0, 0.0], 0.0);
        let mut memory = ToyRun::new(toy).look();
        let turn = |memory: &Memory, x| face(memory, Vec2::new(x, -1.0), 0.0);
        assert_eq!(turn(&memory, -1.0), Some(Action::TurnLeft));
        assert_eq!(turn(&memory, 1.0), Some(Action::TurnRight));
        assert_eq!(turn(&memory, 0.1), None);
        // What is less than half a turn off is faced, however large a turn is.
        assert_eq!(turn(&memory, 0.2), Some(Action::TurnRight));
        memory.motion.turn_rad *= 2.0;
        assert_eq!(turn(&memory, 0.2), None);
    }
}
