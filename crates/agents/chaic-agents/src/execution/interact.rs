//! Going to a thing and doing something with it.

use chaic_core::geom::xz;
use chaic_core::{Action, Briefing, FailureReason, Outcome, Role, Vec2};

use super::navigate::{Destination, Nav, Navigator};
use super::walking::style;
use crate::mapping::semantic::Thing;
use crate::memory::{Memory, SETTLE_FRAMES};
use crate::track::{Intent, TrackId};

/// The arm reaches farther by so much over what an object lies on than the world lets it, metres:
/// less to be on the safe side, and, if no place to stand is found with it, more, as the map is
/// coarse.
const ARMS_BEYOND_M: [f32; 3] = [-0.08, 0.05, 0.25];
/// If there is no such place either: how near at least, metres.
const RELAXED_M: f32 = 2.4;
/// Things longer than this are walked up to at their nearest part, metres.
const LONG_M: f32 = 4.0;
/// Steps close to an object, on the way to a place to stand, before any place will do.
const MAX_STEPS: u32 = 14;

/// What an interaction says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Do this next, on the way.
    Walk(Intent),
    /// One stands before it: do the interaction.
    There,
    /// It can't be done now.
    GiveUp,
}

/// The approach to one thing.
#[derive(Clone, Debug, Default)]
pub struct Interaction {
    /// From where it was tried without success, in earlier plans too.
    tried: Vec<Vec2>,
    /// How often it was tried in this plan.
    n_tries: u32,
    /// How often the demands on a place to stand were lowered.
    n_relaxed: usize,
    /// Steps taken close by since then.
    n_steps: u32,
    /// Where it was when the plan began, if that is where one goes, as the original does.
    frozen: Option<Vec2>,
}

impl Interaction {
    /// Notes that the interaction failed because of where one stood.
    pub fn note_bad_place(&mut self, here: Vec2) {
        self.tried.push(here);
        self.n_tries += 1;
    }

    /// An approach that knows from where it did not work before.
    pub fn knowing(tried: Vec<Vec2>) -> Interaction {
        Interaction { tried, ..Interaction::default() }
    }

    /// The next step towards `track`.
    pub fn step(
        &mut self,
        memory: &mut Memory,
        navigator: &mut Navigator,
        track: TrackId,
        within_m: f32,
    ) -> Step {
        if memory.things.get(track).is_none() {
            return Step::GiveUp;
        }
        if self.n_tries >= memory.rules.failures.places_tried {
            return self.give_up(memory, track);
        }
        style(memory.rules.walking).approach(self, memory, navigator, track, within_m)
    }

    /// To where the arm reaches it.
    pub(super) fn approach_with_care(
        &mut self,
        memory: &mut Memory,
        navigator: &mut Navigator,
        track: TrackId,
        within_m: f32,
    ) -> Step {
        let Some(thing) = memory.things.get(track) else { return Step::GiveUp };
        let is_near = thing.distance_from(memory.here()) < within_m + 0.5;
        let mut destination = destination_at(thing, within_m);
        destination.avoid.clone_from(&self.tried);
        loop {
            destination.arm_m =
                ARMS_BEYOND_M.get(self.n_relaxed).map(|m| memory.motion.arm_reach_m + m);
            if destination.arm_m.is_none() {
                destination.within_m = RELAXED_M;
            }
            match navigator.step(memory, &destination) {
                Nav::Act(action) => {
                    self.n_steps += u32::from(is_near && action == Action::MoveForward);
                    if self.n_steps <= MAX_STEPS {
                        return Step::Walk(action);
                    }
                    // One does not get where one wants to: something like it must do.
                    (self.n_steps, self.n_relaxed) = (0, self.n_relaxed + 1);
                    if self.n_relaxed > ARMS_BEYOND_M.len() {
                        return Step::There;
                    }
                }
                Nav::Arrived => return Step::There,
                Nav::Unreachable if destination.arm_m.is_some() => self.n_relaxed += 1,
                Nav::Unreachable => return self.give_up(memory, track),
            }
        }
    }

    /// To where it is near enough as the crow flies.
    pub(super) fn approach_on_lattice(
        &mut self,
        memory: &mut Memory,
        navigator: &mut Navigator,
        track: TrackId,
        within_m: f32,
    ) -> Step {
        let Some(thing) = memory.things.get(track) else { return Step::GiveUp };
        let info = thing.class.info();
        let here = memory.here();
        // The original walks to a fixed point before the truck: its nearest part.
        let is_long = info.size_m[0].max(info.size_m[2]) > LONG_M;
        let mean = xz(thing.position_in_world);
        let at = match () {
            () if is_long => thing.nearest_point(here),
            () if info.is_movable() || memory.keeps_goal_in_mind() => {
                *self.frozen.get_or_insert(mean)
            }
            () => mean,
        };
        let destination = Destination { arm_m: Some(0.0), ..Destination::near(at, within_m) };
        match navigator.step(memory, &destination) {
            Nav::Act(action) => Step::Walk(action),
            Nav::Arrived => Step::There,
            Nav::Unreachable => self.give_up(memory, track),
        }
    }

    fn give_up(&self, memory: &mut Memory, track: TrackId) -> Step {
        let rules = memory.rules.failures;
        let frames = if self.n_tries == 0 { rules.unreachable_frames } else { rules.ignore_frames };
        memory.things.ignore(track, memory.frame + frames);
        Step::GiveUp
    }
}

/// Where to stand for doing something with a thing.
fn destination_at(thing: &Thing, within_m: f32) -> Destination {
    let is_small = thing.class.info().is_carriable() || thing.footprint.is_empty();
    let mean = xz(thing.position_in_world);
    let points = if is_small { vec![mean] } else { thing.footprint.clone() };
    let middle = points.iter().copied().sum::<Vec2>() / points.len() as f32;
    Destination {
        points,
        same_room_as: (!is_small).then_some(middle),
        ..Destination::near(mean, within_m)
    }
}

/// Draws the lessons of an action that has ended, whatever the plan. `held` is what was in hand
/// before it, contents included; `holds` what is now.
pub fn learn(
    memory: &mut Memory,
    briefing: &Briefing,
    last: (Intent, Outcome),
    held: &[TrackId],
    holds: &[TrackId],
) {
    let now = memory.frame;
    let (action, outcome) = last;
    let released: Vec<TrackId> = held.iter().copied().filter(|e| !holds.contains(e)).collect();
    match (action, outcome) {
        (Action::PickUp { object, .. }, Outcome::Success) => {
            memory.things.forgive(object);
            memory.things.mark_absent(object);
        }
        (Action::RemoveObstacle { obstacle, .. }, Outcome::Success) => {
            // It stands elsewhere now and is nobody's business any more.
            memory.things.mark_gone(obstacle);
            memory.things.mark_absent(obstacle);
        }
        (Action::PickUp { object, .. }, Outcome::Failure(reason))
        | (Action::RemoveObstacle { obstacle: object, .. }, Outcome::Failure(reason)) => {
            learn_failure(memory, object, reason);
        }
        (Action::PutOn { place, .. }, Outcome::Success) => {
            let is_goal =
                memory.things.get(place).is_some_and(|t| briefing.goal_places.contains(&t.class));
            for track in released.iter().copied().filter(|_| is_goal) {
                memory.things.ignore(track, now + SETTLE_FRAMES);
                memory.believe_delivered(track, place);
            }
        }
        (Action::PutOn { place, .. }, Outcome::Failure(FailureReason::BeyondLimits)) => {
            // It fell: what was not managed once is left alone for a while. The place is not, in
            // the paper's rules.
            memory.things.ignore(place, now + memory.rules.goal_blackout_frames);
            for track in released {
                memory.things.ignore(track, now + memory.rules.failures.ignore_frames);
            }
        }
        _ => {}
    }
}

fn learn_failure(memory: &mut Memory, object: TrackId, reason: FailureReason) {
    let now = memory.frame;
    let rules = memory.rules.failures;
    let reason = match reason {
        FailureReason::Broke | FailureReason::OutOfPlay => reason,
        _ if memory.rules.any_failure_counts => FailureReason::BeyondLimits,
        _ => reason,
    };
    match reason {
        FailureReason::BeyondLimits => {
            let is_heavy =
                memory.things.get(object).is_some_and(|t| t.class.info().role == Role::HeavyTarget);
            // Furniture is tried again at once, up to a limit (facts A2.5).
            if !is_heavy || memory.things.count_failure(object) >= rules.lift_tries {
                memory.things.ignore(object, now + rules.ignore_frames);
            }
        }
        FailureReason::Broke | FailureReason::OutOfPlay => memory.things.mark_gone(object),
        FailureReason::HeldByOther => {
            memory.things.mark_held(object, now + memory.rules.held_frames);
            // Whatever it looks like: the one who tried knows.
            memory.things.ignore(object, now + rules.held_for_sure_frames);
        }
        FailureReason::Impossible => memory.things.ignore(object, now + rules.impossible_frames),
        FailureReason::OutOfReach => {
            // Where it is nearer by memory than one reaches, it is no longer.
            let (here, reach_m) = (memory.here(), memory.motion.reach_limit_m);
            if memory.things.get(object).is_some_and(|t| t.distance_from(here) < reach_m) {
                memory.things.mark_absent(object);
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

    /// A memory of a room with one object straight ahead.
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
    fn failures_and_what_is_learned_from_them() {
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
            learn(&mut memory, &briefing, (action, Outcome::Failure(reason)), &[], &[]);
            let thing = memory.things.get(apple).expect("seen");
            let got = [0, 300, 500, 2000].map(|frame| thing.is_available(frame));
            assert_eq!(got, expected, "{reason}");
        }
    }

    #[test]
    fn what_is_put_on_the_goal_place_is_delivered_and_the_place_never_forgotten() {
        let (mut memory, briefing, place) = memory_of("bed");
        let apple = TrackId(40);
        let action = Action::PutOn { place, hand: Hand::Left };
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        learn(&mut memory, &briefing, (action, failed), &[apple], &[]);
        assert!(memory.things.get(place).expect("seen").is_available(0));
        assert!(memory.delivered.is_empty());
        learn(&mut memory, &briefing, (action, Outcome::Success), &[apple], &[]);
        assert!(memory.delivered.contains(&apple));
    }
}
