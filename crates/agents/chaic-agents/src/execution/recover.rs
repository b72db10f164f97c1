//! Getting free: what to do when one can't get on although the map says so.

use std::collections::VecDeque;

use chaic_core::geom::{wrap_angle, xz, yaw_towards};
use chaic_core::rng::Stream;
use chaic_core::{Action, FailureReason, Frame, Outcome, Vec2};

use crate::memory::Memory;
use crate::track::Intent;

/// Decisions over which one should get somewhere.
const WINDOW: usize = 48;
/// Getting nowhere is to stay within this, metres.
const NOWHERE_M: f32 = 0.6;
/// Bumps within this time add up, frames.
const BUMP_MEMORY_FRAMES: Frame = 150;
/// So many bumps in a row, and the plan is given up.
const HOPELESS_BUMPS: u32 = 8;
/// A person this near and ahead is what one bumped into, metres.
const PERSON_AHEAD_M: f32 = 1.4;
/// How long to give way to a person, frames, at least and beyond.
const GIVE_WAY_FRAMES: (u32, usize) = (4, 10);
/// How often in a row to give way before going around.
const GIVE_WAYS: u32 = 2;
/// Radius of the body in front of which a bump is noted, beyond which, metres.
const BUMP_AHEAD_M: f32 = 0.12;

/// Notices being stuck, and gets free.
#[derive(Clone, Debug, Default)]
pub struct Recovery {
    queue: VecDeque<Intent>,
    n_bumps: u32,
    last_bump: Frame,
    n_waits: u32,
    places: VecDeque<Vec2>,
}

impl Recovery {
    /// Forgets earlier trouble, as a new plan begins.
    pub fn reset(&mut self) {
        self.places.clear();
        self.n_bumps = self.n_bumps.min(2);
    }

    /// Notes that standing still is intended just now.
    pub fn stand(&mut self) {
        self.places.clear();
    }

    /// Whether the present plan should be given up.
    pub fn is_hopeless(&self) -> bool {
        self.n_bumps >= HOPELESS_BUMPS
    }

    /// An action that has to come before anything else, if any.
    pub fn step<T: Copy + PartialEq>(
        &mut self,
        memory: &mut Memory,
        last: Option<(Action<T>, Outcome)>,
        rng: &mut Stream,
    ) -> Option<Intent> {
        let here = memory.here();
        let blocked = Outcome::Failure(FailureReason::Blocked);
        if last == Some((Action::MoveForward, blocked)) {
            self.note_bump(memory, rng);
        } else if memory.frame > self.last_bump + BUMP_MEMORY_FRAMES {
            (self.n_bumps, self.n_waits) = (0, 0);
        }
        if self.queue.is_empty() {
            self.places.push_back(here);
            if self.places.len() > WINDOW {
                self.places.pop_front();
                if self.places.iter().all(|p| p.distance(here) < NOWHERE_M) {
                    self.places.clear();
                    self.back_off(memory, 5 + rng.below(8), rng);
                }
            }
        }
        self.queue.pop_front()
    }

    fn note_bump(&mut self, memory: &mut Memory, rng: &mut Stream) {
        self.queue.clear();
        if memory.frame > self.last_bump + BUMP_MEMORY_FRAMES {
            (self.n_bumps, self.n_waits) = (0, 0);
        }
        self.last_bump = memory.frame;
        let is_person = person_ahead(memory);
        if is_person && self.n_waits < GIVE_WAYS {
            self.n_waits += 1;
            let (least, beyond) = GIVE_WAY_FRAMES;
            let frames = least + rng.below(beyond) as u32;
            self.queue.push_back(Action::Wait { frames });
            return;
        }
        self.n_bumps += 1;
        let ahead = xz(memory.pose.forward());
        let reach_m = memory.costs().radius_m() + BUMP_AHEAD_M;
        let at = memory.here() + reach_m * ahead;
        // People go away.
        let barred_frames = if is_person { 0 } else { memory.rules.failures.barred_frames };
        memory.map.bump(at, memory.frame, barred_frames);
        // A small turn first, then larger ones.
        let n_turns = [2, 3, 5, 8].get(self.n_bumps as usize - 1).copied();
        self.back_off(memory, n_turns.unwrap_or(4 + rng.below(8)), rng);
    }

    /// Turns to the side with more room and takes a step.
    fn back_off(&mut self, memory: &mut Memory, n_turns: usize, rng: &mut Stream) {
        let room = |memory: &Memory, sign: f32| {
            let heading = memory.pose.yaw_rad + sign * n_turns as f32 * memory.motion.turn_rad;
            let ahead = xz(chaic_core::geom::forward(heading));
            let costs = memory.costs();
            (1..=8)
                .map(|k| memory.here() + 0.1 * k as f32 * ahead)
                .take_while(|p| costs.grid().cell_at(*p).is_some_and(|c| !costs.is_blocked(c)))
                .filter_map(|p| costs.grid().cell_at(p))
                .map(|c| costs.clearance_m(c))
                .sum::<f32>()
        };
        let (left, right) = (room(memory, 1.0), room(memory, -1.0));
        let is_left = if (left - right).abs() < 0.05 { rng.chance(0.5) } else { left > right };
        let turn = if is_left { Action::TurnLeft } else { Action::TurnRight };
        self.queue.extend(std::iter::repeat_n(turn, n_turns));
        self.queue.push_back(Action::MoveForward);
    }
}

/// Whether somebody stands before one.
fn person_ahead(memory: &Memory) -> bool {
    let (here, yaw) = (memory.pose.position, memory.pose.yaw_rad);
    memory.people.iter().filter(|p| p.frame + 20 > memory.frame).any(|p| {
        let away = xz(p.position_in_world).distance(xz(here));
        let angle = wrap_angle(yaw_towards(here, p.position_in_world) - yaw);
        away < PERSON_AHEAD_M && angle.abs() < 0.8
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Toy;

    const BLOCKED: Option<(Intent, Outcome)> =
        Some((Action::MoveForward, Outcome::Failure(FailureReason::Blocked)));

    #[test]
    fn a_bump_leads_to_a_turn_and_a_step_and_many_to_giving_up() {
        let toy = Toy::room(6.0, 6.0);
        let mut memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        memory.refresh();
        let (mut recovery, mut rng) = (Recovery::default(), Stream::new(1, "test", 0));
        let first = recovery.step(&mut memory, BLOCKED, &mut rng).expect("it reacts");
        assert!(matches!(first, Action::TurnLeft | Action::TurnRight));
        let second = recovery.step::<()>(&mut memory, None, &mut rng);
        let third = recovery.step::<()>(&mut memory, None, &mut rng);
        assert_eq!((second, third), (Some(first), Some(Action::MoveForward)));
        assert_eq!(recovery.step::<()>(&mut memory, None, &mut rng), None);
        assert!(memory.map.bumps().cells(memory.map.grid()).count() > 0);
        for _ in 1..HOPELESS_BUMPS {
            assert!(!recovery.is_hopeless());
            recovery.step(&mut memory, BLOCKED, &mut rng);
        }
        assert!(recovery.is_hopeless());
    }

    #[test]
    fn getting_nowhere_for_long_is_noticed() {
        let toy = Toy::room(6.0, 6.0);
        let mut memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        memory.refresh();
        let (mut recovery, mut rng) = (Recovery::default(), Stream::new(1, "test", 0));
        let n = (0..200)
            .position(|_| recovery.step::<()>(&mut memory, None, &mut rng).is_some())
            .expect("it reacts");
        assert_eq!(n, WINDOW);
    }
}
