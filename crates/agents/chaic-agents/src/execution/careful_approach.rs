//! Approach with a body of its true radius: stops where the arm reaches the object.

use chaic_core::{Action, Role, Vec2};

use super::destination::Destination;
use super::navigation::{Approach, NavigationStep, Navigator};
use crate::mapping::MappedObject;
use crate::memory::Memory;
use crate::track::TrackId;

/// Offsets to the arm's reach over what an object lies on, meters, tried in this order. The first
/// is on the safe side; later ones allow for the coarse map if no position is found.
pub(crate) const ARM_OFFSETS_M: [f32; 3] = [-0.08, 0.05, 0.25];
/// Arrival distance if no such position exists either, meters.
pub(crate) const RELAXED_M: f32 = 2.4;
/// Margin of the distance from which the image shows an object, meters.
const VIEW_MARGIN_M: f32 = 0.2;
/// Distance up to which an agent that points acts on what it sees, meters. The world accepts 3 m.
const SEEN_WITHIN_M: f32 = 2.8;
/// Margin of the distance over which the hand reaches if the body cannot come nearer, meters.
const REACH_MARGIN_M: f32 = 0.4;
/// Assumed distance of a small object from the edge of what it lies on, meters.
const EDGE_M: f32 = 0.25;
/// Maximum distance that an agent keeps to see an object above the eyes, meters.
const MAX_VIEW_M: f32 = 2.4;
/// Side from which an object was seen: directions with a greater cosine (40 degrees either way; 20
/// degrees if it is above the eyes, where the edge hides most of it).
const SEEN_COS: f32 = 0.77;
const SEEN_COS_HIGH: f32 = 0.94;
/// Steps near an object, on the way to a position, before the requirements are relaxed.
const MAX_STEPS: u32 = 14;

/// Approach to one object.
#[derive(Clone, Debug, Default)]
pub struct CarefulApproach {
    /// Number of times the requirements on the position were relaxed.
    n_relaxed: usize,
    /// Steps taken near the object since then.
    n_steps: u32,
    /// True if no position shows the object, so that nearer ones are accepted.
    ignores_view: bool,
    /// True if no position is known on the side from which the object was seen.
    ignores_seen_side: bool,
}

impl Approach for CarefulApproach {
    fn step(
        &mut self,
        memory: &mut Memory,
        navigator: &mut dyn Navigator,
        track: TrackId,
        within_m: f32,
        failed_positions: &[Vec2],
    ) -> NavigationStep {
        let Some(object) = memory.objects.get(track) else { return NavigationStep::Unreachable };
        let min_m = min_distance_m(memory, object);
        let is_high = memory.eyes_above_m(object).is_some_and(|m| m <= 0.0);
        let within_m = if is_high { within_m.max(SEEN_WITHIN_M) } else { within_m };
        let is_near = object.distance_from(memory.position()) < within_m + 0.5;
        let mut destination = Destination::at_object(object, within_m);
        destination.failed_positions = failed_positions.to_vec();
        // The world walks up to the object, as far as the body can, and the hand reaches the rest.
        let arm_m = Some(memory.motion.reach_limit_m - REACH_MARGIN_M);
        let mut seen = Destination { within_m: SEEN_WITHIN_M, arm_m, ..destination.clone() };
        let seen_cos = if is_high { SEEN_COS_HIGH } else { SEEN_COS };
        let must_see = memory.eyes_above_m(object).is_some();
        let seen_from = object.seen_from.filter(|_| must_see).map(|from| (from, seen_cos));
        let here = memory.position();
        // The next position may not show what this one shows.
        if can_point_at(memory, object) && seen.is_reached(memory.costs_and_search().0, here) {
            return NavigationStep::Arrived;
        }
        // Furniture may hide the object on other sides: from all of them if it is above the eyes.
        let prefers_seen_side = is_high || !failed_positions.is_empty();
        if seen_from.is_some() && prefers_seen_side && !self.ignores_seen_side {
            (seen.side_of, seen.min_m) = (seen_from, min_m);
            let step = navigator.step(memory, &seen);
            self.n_steps += u32::from(is_near && step == NavigationStep::Act(Action::MoveForward));
            if step != NavigationStep::Unreachable && self.n_steps <= MAX_STEPS {
                return step;
            }
            (self.n_steps, self.ignores_seen_side) = (0, true);
        }
        loop {
            destination.arm_m =
                ARM_OFFSETS_M.get(self.n_relaxed).map(|m| memory.motion.arm_reach_m + m);
            let is_relaxed = destination.arm_m.is_none() && !is_high;
            destination.within_m = if is_relaxed { RELAXED_M } else { within_m };
            destination.min_m = if self.ignores_view { 0.0 } else { min_m };
            match navigator.step(memory, &destination) {
                NavigationStep::Act(action) => {
                    self.n_steps += u32::from(is_near && action == Action::MoveForward);
                    if self.n_steps <= MAX_STEPS {
                        return NavigationStep::Act(action);
                    }
                    // The exact position is not reached, so accept a similar one.
                    (self.n_steps, self.n_relaxed) = (0, self.n_relaxed + 1);
                    if self.n_relaxed > ARM_OFFSETS_M.len() {
                        return NavigationStep::Arrived;
                    }
                }
                NavigationStep::Unreachable if destination.arm_m.is_some() => self.n_relaxed += 1,
                NavigationStep::Unreachable if destination.min_m > 0.0 => {
                    (self.ignores_view, self.n_relaxed) = (true, 0);
                }
                end => return end,
            }
        }
    }

    fn fork(&self) -> Box<dyn Approach> {
        Box::new(self.clone())
    }
}

/// Returns whether an agent that points at objects sees this one. Furniture is lifted and set down
/// from nearby only.
fn can_point_at(memory: &Memory, object: &MappedObject) -> bool {
    memory.needs_view
        && object.last_seen == memory.frame
        && object.class.info().role != Role::HeavyTarget
        && !memory.hands.is_joint
}

/// Returns the distance from which the image probably shows an object on which the agent acts,
/// meters; 0 if it need not show it.
fn min_distance_m(memory: &Memory, object: &MappedObject) -> f32 {
    match memory.eyes_above_m(object) {
        // The edge of what it lies on hides it from nearby.
        Some(m) if m <= 0.0 => {
            let above_edge_m = (object.position_in_world.y - object.bottom_m).max(0.01);
            (EDGE_M * -m / above_edge_m).min(MAX_VIEW_M)
        }
        // A level camera sees 45 degrees downward. What it shows now is not too near.
        Some(m) if object.last_seen < memory.frame => m + VIEW_MARGIN_M,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;
    use crate::execution::careful_navigation::CarefulNavigator;
    use crate::test_support::{Toy, ToyObject, ToyRun};

    /// Approaches an apple 0.8 m behind the agent, which saw it from `seen_z`. Its bottom and its
    /// height are given in meters. Returns the distance on arrival, meters.
    fn arrival_m(needs_view: bool, bottom_m: f32, height_m: f32, seen_z: f32) -> f32 {
        let at = Vec2::new(0.0, -1.0);
        let mut toy = Toy::room(8.0, 8.0);
        toy.size = 256;
        let size = [0.2, height_m, 0.2];
        let apple = toy.add(ToyObject::new("apple", [at.x, bottom_m, at.y], size));
        toy.stand([0.0, seen_z], 0.0);
        let mut run = ToyRun::new(toy);
        let mut memory = run.observe();
        memory.needs_view = needs_view;
        run.put_back(memory);
        run.toy.stand([0.0, -0.2], PI);
        run.toy.frame += 10;
        let mut approach = CarefulApproach::default();
        let mut navigator = CarefulNavigator::default();
        for _ in 0..40 {
            let mut memory = run.observe();
            match approach.step(&mut memory, &mut navigator, apple, 2.2, &[]) {
                NavigationStep::Act(action) => run.act(action, memory),
                NavigationStep::Arrived => return memory.position().distance(at),
                NavigationStep::Unreachable => panic!("no path"),
            }
        }
        panic!("not there: {:?}", run.toy.here());
    }

    #[test]
    fn an_agent_that_points_at_objects_stays_so_far_away_that_it_sees_them() {
        let near_m = arrival_m(false, 0.0, 0.2, 3.5);
        assert!((near_m - 0.8).abs() < 0.05, "{near_m}");
        let far_m = arrival_m(true, 0.0, 0.2, 3.5);
        assert!((1.55..2.4).contains(&far_m), "{far_m}");
        // Above the eyes, the edge of a cabinet may hide what is flat. What is tall is visible.
        let flat_m = arrival_m(true, 2.0, 0.06, 1.5);
        assert!((2.2..2.85).contains(&flat_m), "{flat_m}");
        let tall_m = arrival_m(true, 1.8, 0.5, 1.5);
        assert!((tall_m - 0.8).abs() < 0.05, "{tall_m}");
    }

    #[test]
    fn an_agent_that_points_acts_as_soon_as_it_sees_what_it_can_reach() {
        for needs_view in [false, true] {
            let mut toy = Toy::room(8.0, 8.0);
            toy.size = 256;
            toy.add(ToyObject::new("dining_table", [0.0, 0.0, -1.0], [3.0, 0.5, 1.8]));
            let apple = toy.add(ToyObject::new("apple", [0.0, 0.5, -1.6], [0.16, 0.12, 0.16]));
            let mut run = ToyRun::new(toy);
            // The apple is nearer to the other side of the table.
            for (z, yaw_rad) in [(3.5, 0.0), (-3.8, PI), (0.25, 0.0)] {
                run.toy.stand([0.0, z], yaw_rad);
                run.toy.frame += 10;
                let memory = run.observe();
                run.put_back(memory);
            }
            let mut memory = run.observe();
            memory.needs_view = needs_view;
            let mut navigator = CarefulNavigator::default();
            let mut approach = CarefulApproach::default();
            let step = approach.step(&mut memory, &mut navigator, apple, 2.2, &[]);
            assert_eq!(step == NavigationStep::Arrived, needs_view, "{step:?}");
            // What is not in the image is approached.
            memory.frame += 10;
            let step = approach.step(&mut memory, &mut navigator, apple, 2.2, &[]);
            assert!(matches!(step, NavigationStep::Act(_)), "{step:?}");
        }
    }

    #[test]
    fn what_one_side_did_not_show_is_viewed_from_where_it_was_seen() {
        let mut toy = Toy::room(7.0, 7.0);
        toy.size = 256;
        toy.add(ToyObject::new("cabinet", [0.0, 0.0, 0.35], [1.4, 1.3, 0.1]));
        let apple = toy.add(ToyObject::new("apple", [0.0, 0.3, 0.0], [0.16, 0.12, 0.16]));
        toy.stand([0.0, -3.0], PI);
        let mut run = ToyRun::new(toy);
        let mut memory = run.observe();
        memory.needs_view = true;
        let behind = Vec2::new(0.0, 1.2);
        run.put_back(memory);
        run.toy.stand(behind.to_array(), PI);
        run.toy.frame += 10;
        let mut approach = CarefulApproach::default();
        let mut navigator = CarefulNavigator::default();
        for _ in 0..60 {
            let mut memory = run.observe();
            match approach.step(&mut memory, &mut navigator, apple, 2.2, &[behind]) {
                NavigationStep::Act(action) => run.act(action, memory),
                NavigationStep::Arrived => break,
                NavigationStep::Unreachable => panic!("no path"),
            }
        }
        let here = run.toy.here();
        assert!(here.y < -0.5, "{here:?} is not where it was seen from");
    }
}
