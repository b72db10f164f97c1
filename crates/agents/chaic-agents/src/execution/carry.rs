//! Leading with furniture that two carry: the two are one body of two discs. Its way is searched for
//! in the steps and turns that the world makes of actions, so that neither disc meets anything.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::f32::consts::TAU;

use chaic_core::briefing::Motion;
use chaic_core::geom::{Pose, Rect, wrap_angle, xz};
use chaic_core::{Action, Vec2, Vec3};

use super::navigate::{Destination, Nav, step_m};
use crate::memory::Memory;
use crate::planning::costs::{CostMap, FREE};
use crate::track::Intent;

/// Frames of a step and of a turn, about: what a way costs.
const STEP_FRAMES: u32 = 11;
const TURN_FRAMES: u32 = 2;
/// Cost of cells that is worth a frame: what is near to things is gone around if it costs little.
const COST_PER_FRAME: u32 = 20;
/// Most poses that one search looks at (ours: more than there are in the largest yard).
const MAX_POSES: usize = 200_000;
/// Poses in one square of this side are one, metres: two thirds of a step.
const SQUARE_M: f32 = 0.25;
/// One puts down from so much nearer than the world asks of either of the two, metres.
const NEARER_M: f32 = 0.2;
/// A place is another one than where it failed from this far on, metres.
const OTHER_PLACE_M: f32 = 0.4;
/// A way is kept for so many actions: steps are a little longer or shorter than they are planned.
const KEEP_ACTIONS: usize = 16;
/// Parts of the room that two need with which a way is searched for, one after the other: the map is
/// coarse, so that a door may look too narrow. With none, costs alone show the way out (ours).
const ROOMS: [f32; 3] = [1.0, 0.6, 0.0];
/// Spacing of the points of a step that are looked at, as parts of it.
const PARTS: u32 = 3;

/// The two bodies and what they go by.
struct Pair<'a> {
    costs: &'a CostMap,
    bounds: Rect,
    motion: Motion,
    other_in_body: Vec3,
    /// How much room the leader and the other one need: no more than they have at the start.
    room_m: [f32; 2],
}

/// A pose on the way, and how it was come to.
struct Node {
    pose: Pose,
    cost: u32,
    /// The node before it, and the action between.
    from: Option<(usize, Intent)>,
}

/// The next action of the way of two to `destination`; `None` if nobody carries along or there is no
/// way at all. `way` keeps what comes after it: who plans anew after each turn may turn to and fro.
pub fn step(
    memory: &mut Memory,
    destination: &Destination,
    way: &mut VecDeque<Intent>,
) -> Option<Nav> {
    let other_in_body = memory.other_end?.position_in_body;
    let (pose, blocked) = (memory.pose, memory.blocked);
    let (bounds, motion) = (memory.bounds, memory.motion);
    let (costs, _) = memory.costs_and_search();
    let mut pair = Pair { costs, bounds, motion, other_in_body, room_m: [costs.radius_m(); 2] };
    if pair.is_there(pose, destination) {
        return Some(Nav::Arrived);
    }
    let now = pair.bodies(pose).map(|p| pair.clearance_m(p));
    pair.room_m = [0, 1].map(|i| pair.room_m[i].min(now[i]));
    let next = way.front().and_then(|action| pair.after(pose, *action));
    if blocked.is_some() || next.is_none() {
        way.clear();
        let room_m = pair.room_m;
        let found = ROOMS.into_iter().find_map(|part| {
            pair.room_m = room_m.map(|m| part * m);
            pair.search(pose, destination, blocked)
        });
        way.extend(found?.into_iter().take(KEEP_ACTIONS));
    }
    way.pop_front().map(Nav::Act)
}

impl Pair<'_> {
    /// Where leader and other one stand.
    fn bodies(&self, pose: Pose) -> [Vec2; 2] {
        [xz(pose.position), xz(pose.to_world(self.other_in_body))]
    }

    fn clearance_m(&self, p: Vec2) -> f32 {
        let cell = self.costs.grid().cell_at(p).filter(|_| self.bounds.contains(p));
        cell.map_or(0.0, |cell| self.costs.clearance_m(cell))
    }

    fn has_room(&self, body: usize, p: Vec2) -> bool {
        self.bounds.contains(p) && self.clearance_m(p) >= self.room_m[body]
    }

    /// The pose after a step ahead, if there is room for both all along.
    fn ahead(&self, pose: Pose) -> Option<Pose> {
        let at = |part: u32| {
            let way = pose.forward() * (step_m(&self.motion) * part as f32 / PARTS as f32);
            Pose { position: pose.position + way, ..pose }
        };
        let is_free = |pose: Pose| {
            let [leader, other] = self.bodies(pose);
            self.has_room(0, leader) && self.has_room(1, other)
        };
        (1..=PARTS).all(|part| is_free(at(part))).then(|| at(PARTS))
    }

    /// The pose after a turn: about the leader or, where something is in the other one's way, about
    /// the other one.
    fn turned(&self, pose: Pose, sign: f32) -> Option<Pose> {
        let turned =
            Pose { yaw_rad: wrap_angle(pose.yaw_rad + sign * self.motion.turn_rad), ..pose };
        let swung = turned.to_world(self.other_in_body);
        if self.has_room(1, xz(swung)) {
            return Some(turned);
        }
        let position = pose.position + pose.to_world(self.other_in_body) - swung;
        self.has_room(0, xz(position)).then_some(Pose { position, ..turned })
    }

    fn after(&self, pose: Pose, action: Intent) -> Option<Pose> {
        match action {
            Action::MoveForward => self.ahead(pose),
            Action::TurnLeft => self.turned(pose, 1.0),
            Action::TurnRight => self.turned(pose, -1.0),
            _ => None,
        }
    }

    /// Distance of the nearer of the two from the destination, metres.
    fn distance_m(&self, pose: Pose, to: &Destination) -> f32 {
        let away = self.bodies(pose).map(|p| to.nearest(p).distance(p));
        away[0].min(away[1])
    }

    fn is_there(&self, pose: Pose, to: &Destination) -> bool {
        let here = xz(pose.position);
        self.distance_m(pose, to) <= to.within_m.min(self.motion.reach_limit_m - NEARER_M)
            && to.avoid.iter().all(|tried| tried.distance(here) > OTHER_PLACE_M)
            && !to.is_walled_off(self.costs, here)
    }

    fn cost_frames(&self, pose: Pose) -> u32 {
        let cost = |p: Vec2| self.costs.grid().cell_at(p).map_or(0, |c| self.costs.cost(c));
        self.bodies(pose).map(|p| cost(p).saturating_sub(FREE) / COST_PER_FRAME).iter().sum()
    }

    /// A*: poses that share a square and a heading are one. The actions to the destination, of which
    /// the first is not the one that was just blocked.
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
        let still = |pose: Pose| {
            (self.distance_m(pose, to) - to.within_m).max(0.0) / step_m(&self.motion)
                * STEP_FRAMES as f32
        };
        let mut nodes = vec![Node { pose: start, cost: 0, from: None }];
        let mut best = BTreeMap::from([(key(start), 0)]);
        let mut queue = BinaryHeap::from([Reverse((still(start) as u32, 0))]);
        while let Some(Reverse((_, k))) = queue.pop() {
            let Node { pose, cost, .. } = nodes[k];
            if self.is_there(pose, to) {
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
                let next = self.after(pose, action).filter(|_| is_allowed);
                let Some(next) = next else { continue };
                let key = key(next);
                let cost = cost + frames + self.cost_frames(next);
                if best.get(&key).is_none_or(|best| cost < *best) {
                    best.insert(key, cost);
                    queue.push(Reverse((cost + still(next) as u32, nodes.len())));
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
    use chaic_core::observation::OtherEnd;

    /// Walks a pair, the other one so far ahead of the leader, to a point by the same rules as the
    /// search; the number of actions, or `None` if there is no way or it takes too many.
    fn walk(toy: &mut Toy, ahead_m: f32, to: Vec2) -> Option<usize> {
        let mut memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        let end =
            OtherEnd { agent: AgentId::HELPER, position_in_body: Vec3::new(0.0, 0.0, -ahead_m) };
        let mut way = VecDeque::new();
        for n in 0..120 {
            let mut observation = toy.observe();
            observation.own.other_end = Some(end);
            let percepts = crate::perception::Perception::perceive(
                &mut crate::perception::GroundTruthIds,
                &observation,
            );
            memory.update(&toy.briefing(), &observation, &percepts);
            let action = match step(&mut memory, &Destination::near(to, 0.6), &mut way)? {
                Nav::Act(action) => action,
                Nav::Arrived => return Some(n),
                Nav::Unreachable => return None,
            };
            let (costs, _) = memory.costs_and_search();
            let pose = observation.own.pose;
            let mut pair = Pair {
                costs,
                bounds: toy.bounds(),
                motion: MOTION,
                other_in_body: end.position_in_body,
                room_m: [costs.radius_m(); 2],
            };
            let now = pair.bodies(pose).map(|p| pair.clearance_m(p));
            pair.room_m = [0, 1].map(|i| pair.room_m[i].min(now[i]));
            let next = pair.after(pose, action);
            let next = next.expect("it has room");
            for body in pair.bodies(next) {
                assert!(toy.is_clear(body, 0.1), "something is met at {body} after {n} actions");
            }
            toy.stand([next.position.x, next.position.z], next.yaw_rad);
        }
        None
    }

    #[test]
    fn two_get_through_a_door_that_they_have_to_turn_before() {
        let mut toy = Toy::room(10.0, 8.0);
        toy.add_wall([-5.0, -0.05], [0.6, 0.05]);
        toy.add_wall([1.9, -0.05], [5.0, 0.05]);
        toy.stand([-3.0, 2.5], 0.0);
        let n = walk(&mut toy, 1.4, Vec2::new(-2.0, -2.5)).expect("there is a way");
        assert!(n < 70, "{n}");
    }

    #[test]
    fn two_against_a_wall_turn_away_from_it() {
        let mut toy = Toy::room(8.0, 8.0);
        // The other one stands between the leader and the wall, and the way is along it.
        toy.stand([-3.3, -2.3], 0.0);
        let n = walk(&mut toy, 1.4, Vec2::new(3.0, 1.0)).expect("there is a way");
        assert!(n < 40, "{n}");
    }
}
