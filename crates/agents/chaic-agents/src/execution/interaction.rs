//! Approach to an object for an interaction, and updates of the memory from its outcome.

use chaic_core::{Action, Briefing, FailureReason, Outcome, Role, Vec2};

use super::navigation::{Approach, NavigationStep, Navigator};
use crate::memory::{Memory, SETTLE_FRAMES};
use crate::track::{Intent, TrackId};

/// Result of one approach step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ApproachStep {
    /// Take this action on the way.
    Walk(Intent),
    /// In position: perform the interaction.
    Arrived,
    /// The interaction is not possible now.
    GiveUp,
}

/// Interaction with one object: the approach, and its failed attempts.
#[derive(Clone, Debug)]
pub struct Interaction {
    approach: Box<dyn Approach>,
    /// Positions of failed attempts, including those of earlier plans.
    failed_positions: Vec<Vec2>,
    /// Failed attempts in this plan.
    n_failed: u32,
}

impl Interaction {
    /// Creates an interaction that avoids these positions of earlier failures.
    pub fn new(approach: Box<dyn Approach>, failed_positions: Vec<Vec2>) -> Interaction {
        Interaction { approach, failed_positions, n_failed: 0 }
    }

    /// Number of failed attempts.
    pub fn n_failed(&self) -> u32 {
        self.n_failed
    }

    /// Records that the interaction failed because of the body's position.
    pub fn record_failed_position(&mut self, here: Vec2) {
        self.failed_positions.push(here);
        self.n_failed += 1;
    }

    /// Returns the next step towards `track`.
    pub fn step(
        &mut self,
        memory: &mut Memory,
        navigator: &mut dyn Navigator,
        track: TrackId,
        within_m: f32,
    ) -> ApproachStep {
        if memory.objects.get(track).is_none() {
            return ApproachStep::GiveUp;
        }
        if self.n_failed >= memory.rules.failures.max_positions_tried {
            return self.give_up(memory, track);
        }
        match self.approach.step(memory, navigator, track, within_m, &self.failed_positions) {
            NavigationStep::Act(action) => ApproachStep::Walk(action),
            NavigationStep::Arrived => ApproachStep::Arrived,
            NavigationStep::Unreachable => self.give_up(memory, track),
        }
    }

    fn give_up(&self, memory: &mut Memory, track: TrackId) -> ApproachStep {
        let rules = memory.rules.failures;
        let frames =
            if self.n_failed == 0 { rules.unreachable_frames } else { rules.ignore_frames };
        memory.objects.ignore(track, memory.frame + frames);
        ApproachStep::GiveUp
    }
}

/// Updates the memory with the outcome of an action, for any plan. The lists are the objects in
/// hand before and after the action, including contents.
pub fn apply_outcome(
    memory: &mut Memory,
    briefing: &Briefing,
    last: (Intent, Outcome),
    held_before: &[TrackId],
    held_now: &[TrackId],
) {
    let now = memory.frame;
    let (action, outcome) = last;
    let released: Vec<TrackId> =
        held_before.iter().copied().filter(|e| !held_now.contains(e)).collect();
    match (action, outcome) {
        (Action::PickUp { object, .. }, Outcome::Success) => {
            memory.objects.reset_failures(object);
            memory.objects.mark_absent(object);
        }
        (Action::RemoveObstacle { obstacle, .. }, Outcome::Success) => {
            // It was moved elsewhere and is no longer relevant.
            memory.objects.mark_out_of_play(obstacle);
            memory.objects.mark_absent(obstacle);
        }
        (Action::PickUp { object, .. }, Outcome::Failure(reason))
        | (Action::RemoveObstacle { obstacle: object, .. }, Outcome::Failure(reason)) => {
            apply_failure(memory, object, reason);
        }
        (Action::PutOn { place, .. }, Outcome::Success) => {
            let is_goal =
                memory.objects.get(place).is_some_and(|t| briefing.goal_places.contains(&t.class));
            for track in released.iter().copied().filter(|_| is_goal) {
                memory.objects.ignore(track, now + SETTLE_FRAMES);
                memory.assume_delivered(track, place);
            }
        }
        (Action::PutOn { place, .. }, Outcome::Failure(FailureReason::BeyondLimits)) => {
            // It fell: an object that was not managed once is ignored for a while. With the paper's
            // rules, the place is not.
            memory.objects.ignore(place, now + memory.rules.failed_goal_place_frames);
            for track in released {
                memory.objects.ignore(track, now + memory.rules.failures.ignore_frames);
            }
        }
        _ => {}
    }
}

fn apply_failure(memory: &mut Memory, object: TrackId, reason: FailureReason) {
    let now = memory.frame;
    let rules = memory.rules.failures;
    let reason = match reason {
        FailureReason::Broke | FailureReason::OutOfPlay => reason,
        _ if memory.rules.any_failure_counts => FailureReason::BeyondLimits,
        _ => reason,
    };
    match reason {
        FailureReason::BeyondLimits => {
            let is_heavy = memory
                .objects
                .get(object)
                .is_some_and(|t| t.class.info().role == Role::HeavyTarget);
            // Furniture is tried again at once, up to a limit (facts A2.5).
            if !is_heavy || memory.objects.count_failure(object) >= rules.max_failed_lifts {
                memory.objects.ignore(object, now + rules.ignore_frames);
            }
        }
        FailureReason::Broke | FailureReason::OutOfPlay => memory.objects.mark_out_of_play(object),
        FailureReason::HeldByOther => {
            memory.objects.mark_held(object, now + memory.rules.seen_held_ignore_frames);
            // Regardless of its appearance: the failed attempt is certain evidence.
            memory.objects.ignore(object, now + rules.held_refusal_ignore_frames);
        }
        FailureReason::Impossible => memory.objects.ignore(object, now + rules.impossible_frames),
        FailureReason::OutOfReach => {
            // It was remembered within reach, so it is no longer there.
            let (here, reach_m) = (memory.position(), memory.motion.reach_limit_m);
            if memory.objects.get(object).is_some_and(|t| t.distance_from(here) < reach_m) {
                memory.objects.mark_absent(object);
            }
        }
        FailureReason::Blocked
        | FailureReason::HandFull
        | FailureReason::HandEmpty
        | FailureReason::Full
        | FailureReason::NotContainerAndTarget => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Memory;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::test_support::{Toy, ToyObject};
    use chaic_core::{ClassId, Hand};

    /// Creates a memory of a room with one object straight ahead.
    fn memory_of(class: &str) -> (Memory, Briefing, TrackId) {
        let mut toy = Toy::room(8.0, 8.0);
        let track = toy.add(ToyObject::new(class, [0.0, 0.0, -2.5], [0.5, 0.5, 0.5]));
        toy.stand([0.0, 0.0], 0.0);
        let mut briefing = toy.briefing();
        briefing.goal_places = vec![ClassId::named(class)];
        let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
        let observation = toy.observe();
        memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
        (memory, briefing, track)
    }

    #[test]
    fn failures_make_objects_unavailable_for_a_time_that_depends_on_the_reason() {
        use FailureReason::*;
        // After one failed attempt: available now, after 300, after 500, after 2000 frames.
        for (reason, expected) in [
            (BeyondLimits, [false, false, true, true]),
            (HeldByOther, [false, true, true, true]),
            (Impossible, [false, false, false, true]),
            (OutOfPlay, [false, false, false, false]),
            (Broke, [false, false, false, false]),
            (Blocked, [true, true, true, true]),
            (HandFull, [true, true, true, true]),
        ] {
            let (mut memory, briefing, apple) = memory_of("apple");
            let action = Action::PickUp { object: apple, hand: Hand::Left };
            apply_outcome(&mut memory, &briefing, (action, Outcome::Failure(reason)), &[], &[]);
            let object = memory.objects.get(apple).expect("seen");
            let got = [0, 300, 500, 2000].map(|frame| object.is_available(frame));
            assert_eq!(got, expected, "{reason}");
        }
    }

    #[test]
    fn objects_put_on_the_goal_place_are_delivered_and_the_place_stays_available() {
        let (mut memory, briefing, place) = memory_of("bed");
        let apple = TrackId(40);
        let action = Action::PutOn { place, hand: Hand::Left };
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        apply_outcome(&mut memory, &briefing, (action, failed), &[apple], &[]);
        assert!(memory.objects.get(place).expect("seen").is_available(0));
        assert!(memory.delivered.is_empty());
        apply_outcome(&mut memory, &briefing, (action, Outcome::Success), &[apple], &[]);
        assert!(memory.delivered.contains(&apple));
    }
}
