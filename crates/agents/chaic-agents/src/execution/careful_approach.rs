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
/// Steps near an object, on the way to a position, before the requirements are relaxed.
const MAX_STEPS: u32 = 14;

/// Approach to one object.
#[derive(Clone, Debug, Default)]
pub struct CarefulApproach {
    /// Number of times the requirements on the position were relaxed.
    n_relaxed: usize,
    /// Steps taken near the object since then.
    n_steps: u32,
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
        loop {
            destination.arm_m =
                ARM_OFFSETS_M.get(self.n_relaxed).map(|m| memory.motion.arm_reach_m + m);
            if destination.arm_m.is_none() {
                destination.within_m = RELAXED_M;
            }
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
                end => return end,
            }
        }
    }

    fn fork(&self) -> Box<dyn Approach> {
        Box::new(self.clone())
    }
}
