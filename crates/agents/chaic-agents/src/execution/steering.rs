//! Steering: turns and steps towards a point.

use std::f32::consts::PI;

use chaic_core::briefing::MotionParams;
use chaic_core::geom::{self, to_xz, wrap_angle};
use chaic_core::{Action, Vec2, Vec3};

use super::destination::OWN_BODY_M;
use crate::memory::Memory;
use crate::planning::cost_map::CostMap;
use crate::track::Intent;

/// Heading error up to which the agent steps forward, radians (9 degrees). Half a turn is 7.5
/// degrees, so this prevents oscillation.
const WALK_RAD: f32 = 0.157;
/// Ratio of a step to the stride. A step ends with a whole frame: an adult's, of 9 frames at 0.047
/// m, covers slightly more than the stride (facts S1.5 and S2.2).
const STEP_PER_STRIDE: f32 = 1.05;

/// Length of a step, meters.
pub fn step_length_m(motion: &MotionParams) -> f32 {
    STEP_PER_STRIDE * motion.stride_m
}

/// Steers towards `target`: of the headings that turns can reach, takes the one nearest to the
/// target's bearing along which the next step is free.
pub(super) fn steer(
    costs: &CostMap,
    here: Vec2,
    yaw: f32,
    target: Vec2,
    motion: &MotionParams,
) -> Intent {
    let half_circle = (PI / motion.turn_rad).round() as i32;
    let bearing = yaw_between(here, target);
    let is_free = |heading: f32| {
        let ahead = to_xz(geom::forward(heading));
        let (from, to) = (here + OWN_BODY_M * ahead, here + (step_length_m(motion) + 0.05) * ahead);
        costs.is_straight_clear(from, to)
    };
    if wrap_angle(bearing - yaw).abs() < WALK_RAD && is_free(yaw) {
        return Action::MoveForward;
    }
    let mut best: Option<(f32, i32)> = None;
    let mut nearest = (f32::INFINITY, 0);
    // Small turns first, so that the nearer of two equally good headings is chosen.
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

fn yaw_between(from: Vec2, to: Vec2) -> f32 {
    geom::yaw_towards(Vec3::new(from.x, 0.0, from.y), Vec3::new(to.x, 0.0, to.y))
}

/// Returns the turn that faces `target` better; `None` if the heading error is at most
/// `tolerance_rad` or half a turn, whichever is larger.
pub fn turn_towards(memory: &Memory, target: Vec2, tolerance_rad: f32) -> Option<Intent> {
    let error = wrap_angle(yaw_between(memory.position(), target) - memory.pose.yaw_rad);
    (error.abs() > tolerance_rad.max(0.5 * memory.motion.turn_rad + 1e-3))
        .then_some(if error > 0.0 { Action::TurnLeft } else { Action::TurnRight })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{Toy, ToyRun};

    #[test]
    fn turns_take_the_shorter_direction() {
        let mut toy = Toy::room(6.0, 6.0);
        toy.stand([0.0, 0.0], 0.0);
        let mut memory = ToyRun::new(toy).observe();
        let turn = |memory: &Memory, x| turn_towards(memory, Vec2::new(x, -1.0), 0.0);
        assert_eq!(turn(&memory, -1.0), Some(Action::TurnLeft));
        assert_eq!(turn(&memory, 1.0), Some(Action::TurnRight));
        assert_eq!(turn(&memory, 0.1), None);
        // An error below half a turn counts as facing, for any turn size.
        assert_eq!(turn(&memory, 0.2), Some(Action::TurnRight));
        memory.motion.turn_rad *= 2.0;
        assert_eq!(turn(&memory, 0.2), None);
    }
}
