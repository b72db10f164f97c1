//! Stuck recovery: actions of an agent that cannot move although its map says so.

use std::collections::VecDeque;

use chaic_core::geom::{to_xz, wrap_angle, yaw_towards};
use chaic_core::rng::RngStream;
use chaic_core::{Action, FailureReason, Frame, Outcome, Vec2};

use crate::memory::Memory;
use crate::track::Intent;

/// Number of decisions over which progress is expected.
const WINDOW: usize = 48;
/// Radius within which the agent counts as stuck, meters.
const STUCK_RADIUS_M: f32 = 0.6;
/// Time within which bumps add up, frames.
const BUMP_MEMORY_FRAMES: Frame = 150;
/// Number of successive bumps after which the plan is given up.
const GIVE_UP_BUMPS: u32 = 8;
/// Maximum distance of a person that counts as the cause of a bump, meters.
const PERSON_AHEAD_M: f32 = 1.4;
/// Minimum time to give way to a person, frames.
const MIN_GIVE_WAY_FRAMES: u32 = 4;
/// Upper bound (exclusive) of the random time added to it, frames.
const EXTRA_GIVE_WAY_FRAMES: usize = 10;
/// Number of successive times to give way before going around.
const MAX_GIVE_WAYS: u32 = 2;
/// Distance of a recorded bump beyond the body's radius, meters.
const BUMP_AHEAD_M: f32 = 0.12;

/// Detects that the agent is stuck, and gets it free.
#[derive(Clone, Debug, Default)]
pub struct Recovery {
    queue: VecDeque<Intent>,
    n_bumps: u32,
    last_bump: Frame,
    n_waits: u32,
    recent_positions: VecDeque<Vec2>,
}

impl Recovery {
    /// Resets the state for a new plan.
    pub fn reset(&mut self) {
        self.queue.clear();
        self.recent_positions.clear();
        self.n_bumps = self.n_bumps.min(2);
    }

    /// Records that the agent stands still on purpose.
    pub fn record_stop(&mut self) {
        self.recent_positions.clear();
    }

    /// Returns whether the current plan should be given up.
    pub fn should_give_up(&self) -> bool {
        self.n_bumps >= GIVE_UP_BUMPS
    }

    /// Returns an action that has priority over the plan, if any.
    pub fn step<T: Copy + PartialEq>(
        &mut self,
        memory: &mut Memory,
        last: Option<(Action<T>, Outcome)>,
        rng: &mut RngStream,
    ) -> Option<Intent> {
        let here = memory.position();
        let blocked = Outcome::Failure(FailureReason::Blocked);
        if last == Some((Action::MoveForward, blocked)) {
            self.handle_bump(memory, rng);
        } else if memory.frame > self.last_bump + BUMP_MEMORY_FRAMES {
            (self.n_bumps, self.n_waits) = (0, 0);
        }
        if self.queue.is_empty() {
            self.recent_positions.push_back(here);
            if self.recent_positions.len() > WINDOW {
                self.recent_positions.pop_front();
                if self.recent_positions.iter().all(|p| p.distance(here) < STUCK_RADIUS_M) {
                    self.recent_positions.clear();
                    self.back_off(memory, 5 + rng.below(8), rng);
                }
            }
        }
        self.queue.pop_front()
    }

    fn handle_bump(&mut self, memory: &mut Memory, rng: &mut RngStream) {
        self.queue.clear();
        if memory.frame > self.last_bump + BUMP_MEMORY_FRAMES {
            (self.n_bumps, self.n_waits) = (0, 0);
        }
        self.last_bump = memory.frame;
        let is_person = is_person_ahead(memory);
        if is_person && self.n_waits < MAX_GIVE_WAYS {
            self.n_waits += 1;
            let frames = MIN_GIVE_WAY_FRAMES + rng.below(EXTRA_GIVE_WAY_FRAMES) as u32;
            self.queue.push_back(Action::Wait { frames });
            return;
        }
        self.n_bumps += 1;
        let ahead = to_xz(memory.pose.forward());
        let reach_m = memory.costs().radius_m() + BUMP_AHEAD_M;
        let at = memory.position() + reach_m * ahead;
        // People move away.
        let repeated_collision_frames =
            if is_person { 0 } else { memory.rules.failures.repeated_collision_frames };
        memory.map.record_bump(at, memory.frame, repeated_collision_frames);
        // A small turn first, then larger ones.
        let n_turns = [2, 3, 5, 8].get(self.n_bumps as usize - 1).copied();
        self.back_off(memory, n_turns.unwrap_or(4 + rng.below(8)), rng);
    }

    /// Turns to the side with more clearance and takes a step.
    fn back_off(&mut self, memory: &mut Memory, n_turns: usize, rng: &mut RngStream) {
        let free_length = |memory: &Memory, sign: f32| {
            let heading = memory.pose.yaw_rad + sign * n_turns as f32 * memory.motion.turn_rad;
            let ahead = to_xz(chaic_core::geom::forward(heading));
            let costs = memory.costs();
            (1..=8)
                .map(|k| memory.position() + 0.1 * k as f32 * ahead)
                .take_while(|p| costs.grid().cell_at(*p).is_some_and(|c| !costs.is_blocked(c)))
                .filter_map(|p| costs.grid().cell_at(p))
                .map(|c| costs.clearance_m(c))
                .sum::<f32>()
        };
        let (left, right) = (free_length(memory, 1.0), free_length(memory, -1.0));
        let is_left = if (left - right).abs() < 0.05 { rng.chance(0.5) } else { left > right };
        let turn = if is_left { Action::TurnLeft } else { Action::TurnRight };
        self.queue.extend(std::iter::repeat_n(turn, n_turns));
        self.queue.push_back(Action::MoveForward);
    }
}

/// Returns whether a person is in front of the agent.
fn is_person_ahead(memory: &Memory) -> bool {
    let (here, yaw) = (memory.pose.position, memory.pose.yaw_rad);
    memory.people.iter().filter(|p| p.frame + 20 > memory.frame).any(|p| {
        let distance_m = to_xz(p.position_in_world).distance(to_xz(here));
        let angle = wrap_angle(yaw_towards(here, p.position_in_world) - yaw);
        distance_m < PERSON_AHEAD_M && angle.abs() < 0.8
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Toy;

    const BLOCKED: Option<(Intent, Outcome)> =
        Some((Action::MoveForward, Outcome::Failure(FailureReason::Blocked)));

    #[test]
    fn a_bump_leads_to_a_turn_and_a_step_and_repeated_bumps_to_giving_up() {
        let toy = Toy::room(6.0, 6.0);
        let mut memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        memory.refresh();
        let (mut recovery, mut rng) = (Recovery::default(), RngStream::new(1, "test", 0));
        let first = recovery.step(&mut memory, BLOCKED, &mut rng).expect("it reacts");
        assert!(matches!(first, Action::TurnLeft | Action::TurnRight));
        let second = recovery.step::<()>(&mut memory, None, &mut rng);
        let third = recovery.step::<()>(&mut memory, None, &mut rng);
        assert_eq!((second, third), (Some(first), Some(Action::MoveForward)));
        assert_eq!(recovery.step::<()>(&mut memory, None, &mut rng), None);
        assert!(memory.map.bumps().recent_cells(memory.map.grid()).count() > 0);
        for _ in 1..GIVE_UP_BUMPS {
            assert!(!recovery.should_give_up());
            recovery.step(&mut memory, BLOCKED, &mut rng);
        }
        assert!(recovery.should_give_up());
    }

    #[test]
    fn a_new_plan_does_not_continue_to_back_off() {
        let toy = Toy::room(6.0, 6.0);
        let mut memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        memory.refresh();
        let (mut recovery, mut rng) = (Recovery::default(), RngStream::new(1, "test", 0));
        assert!(recovery.step(&mut memory, BLOCKED, &mut rng).is_some());
        recovery.reset();
        assert_eq!(recovery.step::<()>(&mut memory, None, &mut rng), None);
    }

    #[test]
    fn a_stuck_agent_is_detected() {
        let toy = Toy::room(6.0, 6.0);
        let mut memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        memory.refresh();
        let (mut recovery, mut rng) = (Recovery::default(), RngStream::new(1, "test", 0));
        let n = (0..200)
            .position(|_| recovery.step::<()>(&mut memory, None, &mut rng).is_some())
            .expect("it reacts");
        assert_eq!(n, WINDOW);
    }
}
