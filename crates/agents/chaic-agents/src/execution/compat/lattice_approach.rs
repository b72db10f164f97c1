//! Approach of the original: stops where the straight-line distance is small enough.

use chaic_core::Vec2;
use chaic_core::geom::to_xz;

use crate::execution::destination::Destination;
use crate::execution::navigation::{Approach, NavigationStep, Navigator};
use crate::memory::Memory;
use crate::track::TrackId;

/// Objects longer than this are approached at their nearest part, meters.
const LONG_M: f32 = 4.0;

/// Approach to one object.
#[derive(Clone, Copy, Debug, Default)]
pub struct LatticeApproach {
    /// Position of the object when the plan began, if the approach is to this position.
    initial_position: Option<Vec2>,
}

impl Approach for LatticeApproach {
    fn step(
        &mut self,
        memory: &mut Memory,
        navigator: &mut dyn Navigator,
        track: TrackId,
        within_m: f32,
        _failed_positions: &[Vec2],
    ) -> NavigationStep {
        let Some(object) = memory.objects.get(track) else { return NavigationStep::Unreachable };
        let info = object.class.info();
        // The original walks to a fixed point in front of the truck: its nearest part.
        let is_long = info.size_m[0].max(info.size_m[2]) > LONG_M;
        let mean = to_xz(object.position_in_world);
        let at = if is_long {
            object.nearest_point(memory.position())
        } else if info.is_movable() || memory.keeps_goal_position() {
            *self.initial_position.get_or_insert(mean)
        } else {
            mean
        };
        let destination = Destination { arm_m: Some(0.0), ..Destination::near(at, within_m) };
        navigator.step(memory, &destination)
    }

    fn fork(&self) -> Box<dyn Approach> {
        Box::new(*self)
    }
}
