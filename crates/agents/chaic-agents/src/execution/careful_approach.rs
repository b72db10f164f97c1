//! Approach with a body of its true radius: stops where the arm reaches the object.

use chaic_core::{Action, Vec2};

use super::destination::Destination;
use super::navigation::{Approach, NavigationStep, Navigator};
use crate::memory::Memory;
use crate::track::TrackId;

/// Offsets to the arm's reach over what an object lies on, meters, tried in this order. The first
/// is on the safe side; later ones allow for the coarse map if no position is found.
pub(crate) const ARM_OFFSETS_M: [f32; 3] = [-0.08, 0.05, 0.25];
/// Arrival distance if no such position exists either, meters.
pub(crate) const RELAXED_M: f32 = 2.4;
/// Margin of the distance from which the image shows an object, meters.
const VIEW_MARGIN_M: f32 = 0.2;
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
        let is_near = object.distance_from(memory.position()) < within_m + 0.5;
        let mut destination = Destination::at_object(object, within_m);
        destination.failed_positions = failed_positions.to_vec();
        // A level camera sees 45 degrees downward. What it shows now is not too near.
        let is_in_view = object.last_seen == memory.frame;
        let eyes_above_m = memory.eyes_above_m(object).filter(|_| !is_in_view);
        let min_m = eyes_above_m.map_or(0.0, |m| (m + VIEW_MARGIN_M).max(0.0));
        loop {
            destination.arm_m =
                ARM_OFFSETS_M.get(self.n_relaxed).map(|m| memory.motion.arm_reach_m + m);
            destination.within_m = if destination.arm_m.is_none() { RELAXED_M } else { within_m };
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

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;
    use crate::execution::careful_navigation::CarefulNavigator;
    use crate::test_support::{Toy, ToyObject, ToyRun};

    /// Approaches an apple on the floor 0.8 m behind the agent, which saw it from afar. Returns the
    /// distance on arrival, meters.
    fn arrival_m(needs_view: bool) -> f32 {
        let at = Vec2::new(0.0, -1.0);
        let mut toy = Toy::room(8.0, 8.0);
        toy.size = 256;
        let apple = toy.add(ToyObject::new("apple", [at.x, 0.0, at.y], [0.2, 0.2, 0.2]));
        toy.stand([0.0, 3.5], 0.0);
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
        let near_m = arrival_m(false);
        assert!((near_m - 0.8).abs() < 0.05, "{near_m}");
        let far_m = arrival_m(true);
        assert!((1.55..2.4).contains(&far_m), "{far_m}");
    }
}
