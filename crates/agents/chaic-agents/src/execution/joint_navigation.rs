//! Navigation of the leader of two joint carriers of furniture: the two form one body of two discs.
//! The search runs over the steps and turns of the world's actions and keeps both discs clear of
//! obstacles.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::f32::consts::TAU;

use chaic_core::briefing::MotionParams;
use chaic_core::geom::{Pose, Rect, to_xz, wrap_angle};
use chaic_core::{Action, Vec2, Vec3};

use super::destination::Destination;
use super::navigation::NavigationStep;
use super::steering::step_length_m;
use crate::memory::Memory;
use crate::planning::cost_map::{CostMap, FREE};
use crate::track::Intent;

/// Approximate duration of a step and of a turn, frames; these are the path costs.
const STEP_FRAMES: u32 = 11;
const TURN_FRAMES: u32 = 2;
/// Cell cost that equals one frame: cells near obstacles are avoided if the detour is short.
const COST_PER_FRAME: u32 = 20;
/// Maximum number of poses per search (ours: more than the largest yard has).
const MAX_POSES: usize = 200_000;
/// Side of the squares in which poses are merged, meters: two thirds of a step.
const SQUARE_M: f32 = 0.25;
/// Reduction of the arrival distance below the world's reach limit, meters.
const REACH_MARGIN_M: f32 = 0.2;
/// Minimum distance of a new position from a failed one, meters.
const MIN_FAILED_DISTANCE_M: f32 = 0.4;
/// Number of actions for which a path is kept: real steps are slightly longer or shorter than
/// planned ones.
const KEEP_ACTIONS: usize = 16;
/// Fractions of the required clearance with which the search is tried, in this order. The coarse
/// map may make a door look too narrow. With zero, only cell costs matter (ours).
const CLEARANCE_FRACTIONS: [f32; 3] = [1.0, 0.6, 0.0];
/// Number of points checked along a step.
const STEP_PARTS: u32 = 3;

/// The two carriers and the map they move on.
struct Carriers<'a> {
    costs: &'a CostMap,
    bounds: Rect,
    motion: MotionParams,
    other_in_body: Vec3,
    /// Required clearance of leader and follower, meters: at most what they have at the start.
    required_m: [f32; 2],
}

/// Search node: a pose and how it was reached.
struct Node {
    pose: Pose,
    cost: u32,
    /// Index of the previous node, and the action between.
    from: Option<(usize, Intent)>,
}

/// Returns the next action of the joint path to `destination`; `None` if there is no other carrier
/// or no path. `actions` caches the following actions, because replanning after each turn may
/// oscillate.
pub fn step(
    memory: &mut Memory,
    destination: &Destination,
    actions: &mut VecDeque<Intent>,
) -> Option<NavigationStep> {
    let other_in_body = memory.other_end?.position_in_body;
    let (pose, blocked) = (memory.pose, memory.blocked);
    let (bounds, motion) = (memory.bounds, memory.motion);
    let (costs, _) = memory.costs_and_search();
    let mut pair =
        Carriers { costs, bounds, motion, other_in_body, required_m: [costs.radius_m(); 2] };
    if pair.has_arrived(pose, destination) {
        return Some(NavigationStep::Arrived);
    }
    let now = pair.bodies(pose).map(|p| pair.clearance_m(p));
    pair.required_m = [0, 1].map(|i| pair.required_m[i].min(now[i]));
    let next = actions.front().and_then(|action| pair.pose_after(pose, *action));
    if blocked.is_some() || next.is_none() {
        actions.clear();
        let required_m = pair.required_m;
        let found = CLEARANCE_FRACTIONS.into_iter().find_map(|fraction| {
            pair.required_m = required_m.map(|m| fraction * m);
            pair.search(pose, destination, blocked)
        });
        actions.extend(found?.into_iter().take(KEEP_ACTIONS));
    }
    actions.pop_front().map(NavigationStep::Act)
}

impl Carriers<'_> {
    /// Positions of leader and follower.
    fn bodies(&self, pose: Pose) -> [Vec2; 2] {
        [to_xz(pose.position), to_xz(pose.to_world(self.other_in_body))]
    }

    fn clearance_m(&self, p: Vec2) -> f32 {
        let cell = self.costs.grid().cell_at(p).filter(|_| self.bounds.contains(p));
        cell.map_or(0.0, |cell| self.costs.clearance_m(cell))
    }

    fn has_clearance(&self, body: usize, p: Vec2) -> bool {
        self.bounds.contains(p) && self.clearance_m(p) >= self.required_m[body]
    }

    /// Returns the pose after a step ahead, if both have clearance all along.
    fn pose_after_step(&self, pose: Pose) -> Option<Pose> {
        let at = |part: u32| {
            let offset =
                pose.forward() * (step_length_m(&self.motion) * part as f32 / STEP_PARTS as f32);
            Pose { position: pose.position + offset, ..pose }
        };
        let is_free = |pose: Pose| {
            let [leader, other] = self.bodies(pose);
            self.has_clearance(0, leader) && self.has_clearance(1, other)
        };
        (1..=STEP_PARTS).all(|part| is_free(at(part))).then(|| at(STEP_PARTS))
    }

    /// Returns the pose after a turn about the leader or, if the follower is blocked, about the
    /// follower.
    fn pose_after_turn(&self, pose: Pose, sign: f32) -> Option<Pose> {
        let turned =
            Pose { yaw_rad: wrap_angle(pose.yaw_rad + sign * self.motion.turn_rad), ..pose };
        let other_after_turn = turned.to_world(self.other_in_body);
        if self.has_clearance(1, to_xz(other_after_turn)) {
            return Some(turned);
        }
        let position = pose.position + pose.to_world(self.other_in_body) - other_after_turn;
        self.has_clearance(0, to_xz(position)).then_some(Pose { position, ..turned })
    }

    fn pose_after(&self, pose: Pose, action: Intent) -> Option<Pose> {
        match action {
            Action::MoveForward => self.pose_after_step(pose),
            Action::TurnLeft => self.pose_after_turn(pose, 1.0),
            Action::TurnRight => self.pose_after_turn(pose, -1.0),
            _ => None,
        }
    }

    /// Distance of the nearer carrier from the destination, meters.
    fn distance_m(&self, pose: Pose, to: &Destination) -> f32 {
        let distances = self.bodies(pose).map(|p| to.nearest_point(p).distance(p));
        distances[0].min(distances[1])
    }

    fn has_arrived(&self, pose: Pose, to: &Destination) -> bool {
        let here = to_xz(pose.position);
        self.distance_m(pose, to) <= to.within_m.min(self.motion.reach_limit_m - REACH_MARGIN_M)
            && to
                .failed_positions
                .iter()
                .all(|failed| failed.distance(here) > MIN_FAILED_DISTANCE_M)
            && !to.is_walled_off(self.costs, here)
    }

    fn cost_frames(&self, pose: Pose) -> u32 {
        let cost = |p: Vec2| self.costs.grid().cell_at(p).map_or(0, |c| self.costs.cost(c));
        self.bodies(pose).map(|p| cost(p).saturating_sub(FREE) / COST_PER_FRAME).iter().sum()
    }

    /// Searches with A*, merging poses that share a square and a heading. Returns the actions to
    /// the destination; the first one differs from the action just blocked.
    fn search(
        &self,
        start: Pose,
        to: &Destination,
        blocked: Option<Intent>,
    ) -> Option<Vec<Intent>> {
        let key = |pose: Pose| {
            let turn_rad = self.motion.turn_rad;
            let turns = (wrap_angle(pose.yaw_rad - start.yaw_rad) / turn_rad).round() as i32;
            let heading = turns.rem_euclid((TAU / turn_rad).round() as i32);
            let square = |m: f32| (m / SQUARE_M).floor() as i32;
            (square(pose.position.x), square(pose.position.z), heading)
        };
        let heuristic = |pose: Pose| {
            (self.distance_m(pose, to) - to.within_m).max(0.0) / step_length_m(&self.motion)
                * STEP_FRAMES as f32
        };
        let mut nodes = vec![Node { pose: start, cost: 0, from: None }];
        let mut best = BTreeMap::from([(key(start), 0)]);
        let mut queue = BinaryHeap::from([Reverse((heuristic(start) as u32, 0))]);
        while let Some(Reverse((_, k))) = queue.pop() {
            let Node { pose, cost, .. } = nodes[k];
            if self.has_arrived(pose, to) {
                return Some(actions_to(&nodes, k));
            }
            if best.get(&key(pose)).is_some_and(|best| *best < cost) || nodes.len() > MAX_POSES {
                continue;
            }
            for (action, frames) in [
                (Action::MoveForward, STEP_FRAMES),
                (Action::TurnLeft, TURN_FRAMES),
                (Action::TurnRight, TURN_FRAMES),
            ] {
                let is_allowed = k > 0 || blocked != Some(action);
                let next = self.pose_after(pose, action).filter(|_| is_allowed);
                let Some(next) = next else { continue };
                let key = key(next);
                let cost = cost + frames + self.cost_frames(next);
                if best.get(&key).is_none_or(|best| cost < *best) {
                    best.insert(key, cost);
                    queue.push(Reverse((cost + heuristic(next) as u32, nodes.len())));
                    nodes.push(Node { pose: next, cost, from: Some((k, action)) });
                }
            }
        }
        None
    }
}

fn actions_to(nodes: &[Node], mut k: usize) -> Vec<Intent> {
    let mut actions = Vec::new();
    while let Some((before, action)) = nodes[k].from {
        actions.push(action);
        k = before;
    }
    actions.reverse();
    actions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{MOTION, Toy};
    use chaic_core::AgentId;
    use chaic_core::observation::JointCarrier;

    /// Moves a pair, with the follower `ahead_m` in front of the leader, to a point by the rules of
    /// the search. Returns the number of actions, or `None` if there is no path or the limit is
    /// exceeded.
    fn walk(toy: &mut Toy, ahead_m: f32, to: Vec2) -> Option<usize> {
        let mut memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        let end = JointCarrier {
            agent: AgentId::HELPER,
            position_in_body: Vec3::new(0.0, 0.0, -ahead_m),
        };
        let mut actions = VecDeque::new();
        for n in 0..120 {
            let mut observation = toy.observe();
            observation.proprioception.other_end = Some(end);
            let percepts = crate::perception::Perception::perceive(
                &mut crate::perception::GroundTruthIds,
                &observation,
            );
            memory.update(&toy.briefing(), &observation, &percepts);
            let action = match step(&mut memory, &Destination::near(to, 0.6), &mut actions)? {
                NavigationStep::Act(action) => action,
                NavigationStep::Arrived => return Some(n),
                NavigationStep::Unreachable => return None,
            };
            let (costs, _) = memory.costs_and_search();
            let pose = observation.proprioception.pose;
            let mut pair = Carriers {
                costs,
                bounds: toy.bounds(),
                motion: MOTION,
                other_in_body: end.position_in_body,
                required_m: [costs.radius_m(); 2],
            };
            let now = pair.bodies(pose).map(|p| pair.clearance_m(p));
            pair.required_m = [0, 1].map(|i| pair.required_m[i].min(now[i]));
            let next = pair.pose_after(pose, action);
            let next = next.expect("the pose is clear");
            for body in pair.bodies(next) {
                assert!(toy.is_clear(body, 0.1), "collision at {body} after {n} actions");
            }
            toy.stand([next.position.x, next.position.z], next.yaw_rad);
        }
        None
    }

    #[test]
    fn carriers_pass_a_door_that_requires_a_turn() {
        let mut toy = Toy::room(10.0, 8.0);
        toy.add_wall([-5.0, -0.05], [0.6, 0.05]);
        toy.add_wall([1.9, -0.05], [5.0, 0.05]);
        toy.stand([-3.0, 2.5], 0.0);
        let n = walk(&mut toy, 1.4, Vec2::new(-2.0, -2.5)).expect("there is a path");
        assert!(n < 70, "{n}");
    }

    #[test]
    fn carriers_next_to_a_wall_turn_away_from_it() {
        let mut toy = Toy::room(8.0, 8.0);
        // The follower is between the leader and the wall, and the path leads along the wall.
        toy.stand([-3.3, -2.3], 0.0);
        let n = walk(&mut toy, 1.4, Vec2::new(3.0, 1.0)).expect("there is a path");
        assert!(n < 40, "{n}");
    }
}
