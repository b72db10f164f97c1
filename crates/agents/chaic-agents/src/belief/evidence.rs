//! Observations of the partner that bear on its goal and constraint.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::briefing::CompanionRole;
use chaic_core::geom::to_xz;
use chaic_core::{Action, Briefing, ClassId, FailureReason, Frame, Outcome, Vec2};

use super::observed_walks::ObservedWalks;
use super::visibility::{is_at_rest, is_hidden};
use super::walking_speed::WalkingSpeed;
use crate::behavior::BehaviorLog;
use crate::mapping::{MappedObject, TrackedPerson};
use crate::memory::Memory;
use crate::track::TrackId;

/// Strength of a take that is certain: granted, delivered, or held at two places.
const CERTAIN: f32 = 1.0;
/// Strength if an object was seen lying, and then in the partner's hands at another place.
const MOVED_INTO_HANDS: f32 = 0.8;
/// Strength if the partner held the object at one place only: it may lie behind the hands.
const HELD_ONCE: f32 = 0.4;
/// Strength if the object vanished from its place: small objects are overlooked from some angles.
const VANISHED: f32 = 0.3;
/// Minimum distance of two places, meters: more than the length of the arms and than the errors of
/// positions.
const OTHER_PLACE_M: f32 = 0.6;
/// Strengths, and the probabilities that such a take is real. Measured with ground-truth ids in 48
/// episodes of `gen-standard:7000..7008`: 17 of 34, 74 of 79, 47 of 47 and 99 of 99 were
/// real. The last two values are lower, for perceptions that may err.
const RELIABILITY: [(f32, f32); 4] =
    [(VANISHED, 0.5), (HELD_ONCE, 0.92), (MOVED_INTO_HANDS, 0.96), (CERTAIN, 0.98)];
/// First frame in which a person can hold a target: a full turn takes 36 frames and a pick-up 58.
const FIRST_TAKE_FRAME: Frame = 90;
/// Strength of a failed attempt that a behavior model has recognized without a grant.
const RECOGNIZED: f32 = HELD_ONCE;

/// The partner is at an object within this distance, meters.
const NEAR_M: f32 = 2.0;
/// The partner has left an object beyond this distance, meters.
const AWAY_M: f32 = 3.0;
/// Minimum time from the arrival at an object to the departure, frames: a pick-up takes less.
const VISIT_FRAMES: Frame = 60;
/// Time for which the partner counts as holding what it was seen to hold, frames.
const HANDS_FULL_FRAMES: Frame = 120;

/// Maximum height of a body, meters; higher points are errors of perception.
const MAX_BODY_M: f32 = 2.1;
/// The highest point counts if another sighting shows one at most this much lower, meters.
const CONFIRMED_M: f32 = 0.1;

/// Evidence that the partner has taken an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickUpEvidence {
    /// Class of the object.
    pub class: ClassId,
    /// Strength of the evidence, above 0 and at most 1 (certain).
    pub strength: f32,
    /// Frame in which the strength was reached.
    pub frame: Frame,
    /// Height of the object's top where it was last seen lying, meters, if it was.
    pub top_m: Option<f32>,
}

impl PickUpEvidence {
    /// Returns the probability that the take is real.
    pub fn reliability(&self) -> f32 {
        reliability(self.strength)
    }
}

/// Returns the probability that evidence of this strength is real, by linear interpolation.
pub(super) fn reliability(strength: f32) -> f32 {
    let mut low = (0.0, 0.0);
    for high in RELIABILITY {
        if strength <= high.0 {
            let t = (strength.max(0.0) - low.0) / (high.0 - low.0);
            return low.1 + t * (high.1 - low.1);
        }
        low = high;
    }
    low.1
}

/// Kind of an attempt that can fail at a person's limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttemptKind {
    /// To pick up an object.
    PickUp,
    /// To put an object on a place.
    PutOn,
    /// To remove an obstacle.
    RemoveObstacle,
}

/// Attempt of the partner that failed at its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FailedAttempt {
    /// Class of the object, place or obstacle.
    pub class: ClassId,
    /// Height of its top, meters.
    pub top_m: f32,
    /// Frame in which the attempt ended.
    pub frame: Frame,
    /// The object, place or obstacle.
    pub track: TrackId,
    /// Kind of the attempt.
    pub kind: AttemptKind,
    /// Strength of the evidence, above 0 and at most 1 (granted).
    pub strength: f32,
}

/// Observations of the partner.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Possible targets that the partner has taken. The agent's own pick-ups never count.
    pub taken: BTreeMap<TrackId, PickUpEvidence>,
    /// Attempts that failed at the partner's limits, in the order of observation.
    pub failed: Vec<FailedAttempt>,
    /// Possible targets that the partner was near, and left lying with a free hand.
    pub passed: BTreeMap<TrackId, ClassId>,
    /// Delivered possible targets, the agent's own included.
    pub delivered: BTreeMap<TrackId, ClassId>,
    /// Highest point of the partner's body seen, meters; 0 before the first sighting.
    pub max_top_m: f32,
    /// Number of observations that show the partner's body.
    pub n_sightings: u32,
    /// Estimated walking speed, meters per frame; `None` without enough sightings.
    pub speed: Option<f32>,
    /// Frame of the last sighting, or of the last granted position.
    pub last_seen: Option<Frame>,
    /// Walks away from known objects.
    pub walks: ObservedWalks,
    /// Objects that the agent itself has picked up.
    own: BTreeSet<TrackId>,
    /// Positions at which objects were last seen lying.
    lying: BTreeMap<TrackId, Lying>,
    /// The first places at which the partner seemed to hold objects.
    held_at: BTreeMap<TrackId, HeldAt>,
    /// Objects that the partner came near to.
    visits: BTreeMap<TrackId, Visit>,
    /// The two highest points seen, meters, highest first.
    highest_m: [f32; 2],
    walking: WalkingSpeed,
}

#[derive(Clone, Copy, Debug)]
struct Lying {
    at: Vec2,
    top_m: f32,
}

#[derive(Clone, Copy, Debug)]
struct HeldAt {
    partner: Vec2,
    object: Vec2,
}

#[derive(Clone, Copy, Debug)]
struct Visit {
    /// Frame in which the partner was first seen near.
    since: Frame,
    /// Frame in which the partner was first seen away.
    away: Option<Frame>,
}

impl Evidence {
    /// Adds one observation, after memory and behavior have been updated with it.
    pub fn observe(&mut self, briefing: &Briefing, memory: &Memory, behavior: &BehaviorLog) {
        self.update_own(memory);
        self.update_lying(briefing, memory);
        self.update_granted_takes(briefing, memory, behavior);
        self.update_held(briefing, memory, behavior);
        self.update_delivered(briefing, memory);
        self.update_vanished(briefing, memory);
        self.update_failed(briefing, memory, behavior);
        let partner = memory.companion(briefing, CompanionRole::Partner);
        let partner = partner.filter(|p| p.is_in_view && p.frame == memory.frame);
        if let Some(partner) = partner.filter(|p| self.last_seen != Some(p.frame)) {
            self.update_sighting(partner);
        }
        if let Some(partner) = partner {
            let at = to_xz(partner.position_in_world);
            self.update_visits(briefing, memory, behavior, at);
            self.walks.observe(briefing, memory, behavior, at);
        }
        self.update_passed(memory);
    }

    /// Returns the height of an object's top where it was last seen lying, meters.
    pub fn lying_top_m(&self, track: TrackId) -> Option<f32> {
        self.lying.get(&track).map(|l| l.top_m)
    }

    #[cfg(test)]
    pub(super) fn set_lying_top(&mut self, track: TrackId, top_m: f32) {
        self.lying.insert(track, Lying { at: Vec2::ZERO, top_m });
    }

    fn update_own(&mut self, memory: &Memory) {
        let picked = memory.history.iter().filter_map(|record| match record.action {
            Action::PickUp { object, .. } if record.outcome.is_success() => Some(object),
            _ => None,
        });
        self.own.extend(picked.chain(memory.hands.all().map(|(track, _)| track)));
        for track in &self.own {
            self.taken.remove(track);
            self.passed.remove(track);
            self.visits.remove(track);
        }
    }

    /// Records where visible objects lie, and retracts uncertain takes of them.
    fn update_lying(&mut self, briefing: &Briefing, memory: &Memory) {
        let now = memory.frame;
        let is_target = |o: &&MappedObject| briefing.possible_targets.contains(&o.class);
        let is_lying = |o: &&MappedObject| o.last_seen == now && is_at_rest(o, now);
        for object in memory.objects.iter().filter(is_target).filter(is_lying) {
            let at = to_xz(object.position_in_world);
            self.lying.insert(object.track, Lying { at, top_m: object.top_m });
            self.held_at.remove(&object.track);
            if self.taken.get(&object.track).is_some_and(|t| t.strength < CERTAIN) {
                self.taken.remove(&object.track);
            }
        }
    }

    /// Records a take, unless it is the agent's own or no possible target.
    fn record_take(
        &mut self,
        briefing: &Briefing,
        (track, class): (TrackId, ClassId),
        strength: f32,
        frame: Frame,
    ) {
        if self.own.contains(&track) || !briefing.possible_targets.contains(&class) {
            return;
        }
        self.passed.remove(&track);
        self.visits.remove(&track);
        let top_m = self.lying_top_m(track);
        let take = self.taken.entry(track).or_insert(PickUpEvidence {
            class,
            strength: 0.0,
            frame,
            top_m,
        });
        if strength > take.strength {
            *take = PickUpEvidence { class, strength, frame, top_m };
        }
    }

    fn update_granted_takes(
        &mut self,
        briefing: &Briefing,
        memory: &Memory,
        behavior: &BehaviorLog,
    ) {
        if !briefing.grants.behavior {
            return;
        }
        for taken in &behavior.partner_taken {
            self.record_take(briefing, *taken, CERTAIN, memory.frame);
        }
        for action in &behavior.actions {
            if let Action::PickUp { object, .. } = action.action
                && briefing.companion(CompanionRole::Partner) == Some(action.agent)
                && action.outcome == Some(Outcome::Success)
                && let Some(class) = memory.class_of(object)
            {
                self.record_take(briefing, (object, class), CERTAIN, action.frame);
            }
        }
    }

    /// Records the objects that the partner seems to hold in this frame.
    fn update_held(&mut self, briefing: &Briefing, memory: &Memory, behavior: &BehaviorLog) {
        let now = memory.frame;
        let is_too_early = now < FIRST_TAKE_FRAME;
        if briefing.grants.behavior || is_too_early || behavior.partner_holds_frame != Some(now) {
            return;
        }
        let Some(partner) = memory.companion(briefing, CompanionRole::Partner) else { return };
        let partner = to_xz(partner.position_in_world);
        for (track, class) in &behavior.partner_holds {
            let visible = memory.objects.get(*track).filter(|o| o.last_seen == now);
            let object = visible.map_or(partner, |o| to_xz(o.position_in_world));
            let first = *self.held_at.entry(*track).or_insert(HeldAt { partner, object });
            let is_elsewhere = |a: Vec2, b: Vec2| a.distance(b) >= OTHER_PLACE_M;
            let was_lying = visible.and(self.lying.get(track));
            // A person who passes an object is near it at two places, but the object does not move.
            let strength =
                if is_elsewhere(first.partner, partner) && is_elsewhere(first.object, object) {
                    CERTAIN
                } else if was_lying.is_some_and(|l| is_elsewhere(l.at, object)) {
                    MOVED_INTO_HANDS
                } else {
                    HELD_ONCE
                };
            self.record_take(briefing, (*track, *class), strength, now);
        }
    }

    /// Records deliveries, and takes of what others have delivered. Without granted ids or
    /// progress, a delivery of the agent itself may appear as a new track, so classes that it has
    /// picked up do not count as takes.
    fn update_delivered(&mut self, briefing: &Briefing, memory: &Memory) {
        let own_classes: BTreeSet<ClassId> =
            self.own.iter().filter_map(|track| memory.class_of(*track)).collect();
        let has_broken = |track: TrackId| {
            memory.history.iter().any(|record| {
                record.outcome == Outcome::Failure(FailureReason::Broke)
                    && record.action.subject() == Some(track)
            })
        };
        self.delivered.clear();
        let known = memory.delivered.iter().filter_map(|t| Some((*t, memory.class_of(*t)?)));
        let gone = memory.objects.iter().filter(|o| o.is_out_of_play && !has_broken(o.track));
        let gone: Vec<_> = gone.map(|o| (o.track, o.class)).collect();
        let known: Vec<_> = known.collect();
        for (track, class) in &known {
            self.record_take(briefing, (*track, *class), CERTAIN, memory.frame);
        }
        for (track, class) in gone.iter().filter(|(_, class)| !own_classes.contains(class)) {
            self.record_take(briefing, (*track, *class), CERTAIN, memory.frame);
        }
        let delivered = known.into_iter().chain(gone);
        let is_target = |(_, class): &(TrackId, ClassId)| briefing.possible_targets.contains(class);
        self.delivered.extend(delivered.filter(is_target));
    }

    fn update_vanished(&mut self, briefing: &Briefing, memory: &Memory) {
        if memory.frame < FIRST_TAKE_FRAME {
            return;
        }
        for object in memory.objects.iter().filter(|o| !o.is_present && !o.is_out_of_play) {
            self.record_take(briefing, (object.track, object.class), VANISHED, memory.frame);
        }
    }

    fn update_failed(&mut self, briefing: &Briefing, memory: &Memory, behavior: &BehaviorLog) {
        let partner = briefing.companion(CompanionRole::Partner);
        let strength = if briefing.grants.behavior { CERTAIN } else { RECOGNIZED };
        for action in behavior.actions.iter().filter(|a| Some(a.agent) == partner) {
            let kind = match action.action {
                Action::PickUp { .. } => AttemptKind::PickUp,
                Action::PutOn { .. } => AttemptKind::PutOn,
                Action::RemoveObstacle { .. } => AttemptKind::RemoveObstacle,
                _ => continue,
            };
            let (Some(track), frame) = (action.action.subject(), action.frame) else { continue };
            let is_known = self.failed.iter().any(|f| f.track == track && f.frame == frame);
            let is_failed = action.outcome == Some(Outcome::Failure(FailureReason::BeyondLimits));
            let object = memory.objects.get(track);
            if let Some(object) = object.filter(|_| is_failed && !is_known) {
                let top_m = self.lying_top_m(track).unwrap_or(object.top_m);
                let class = object.class;
                self.failed.push(FailedAttempt { class, top_m, frame, track, kind, strength });
            }
        }
    }

    fn update_sighting(&mut self, partner: &TrackedPerson) {
        self.last_seen = Some(partner.frame);
        self.walking.record(partner.frame, to_xz(partner.position_in_world));
        self.speed = self.walking.estimate();
        if partner.top_m > 0.0 && partner.top_m < MAX_BODY_M {
            self.record_top(partner.top_m);
        }
    }

    /// Records the highest point of one sighting. A single higher point raises the maximum by
    /// [`CONFIRMED_M`] at most.
    fn record_top(&mut self, top_m: f32) {
        self.n_sightings += 1;
        let [first, second] = self.highest_m;
        self.highest_m = [first.max(top_m), second.max(first.min(top_m))];
        let [first, second] = self.highest_m;
        self.max_top_m = match self.n_sightings {
            1 => first,
            _ => first.min(second + CONFIRMED_M),
        };
    }

    /// Updates the visits of the partner at `at` (x, z) to objects.
    fn update_visits(
        &mut self,
        briefing: &Briefing,
        memory: &Memory,
        behavior: &BehaviorLog,
        at: Vec2,
    ) {
        let now = memory.frame;
        let is_recent = behavior.partner_holds_frame.is_some_and(|f| f + HANDS_FULL_FRAMES > now);
        let has_free_hand = !(is_recent && behavior.partner_holds.len() >= 2);
        for object in memory.objects.iter() {
            let is_target = briefing.possible_targets.contains(&object.class);
            let is_counted = self.taken.contains_key(&object.track)
                || self.passed.contains_key(&object.track)
                || self.own.contains(&object.track);
            if !is_target || is_counted || !is_at_rest(object, now) {
                continue;
            }
            let object_at = to_xz(object.position_in_world);
            let distance_m = at.distance(object_at);
            match self.visits.get_mut(&object.track) {
                None if distance_m < NEAR_M
                    && has_free_hand
                    && !is_hidden(memory, at, object_at) =>
                {
                    self.visits.insert(object.track, Visit { since: now, away: None });
                }
                Some(visit) if distance_m < NEAR_M => visit.away = None,
                Some(visit) if distance_m > AWAY_M && now > visit.since + VISIT_FRAMES => {
                    visit.away.get_or_insert(now);
                }
                _ => {}
            }
        }
    }

    /// Adds the objects of visits to `passed` if they were seen lying after the partner had left.
    fn update_passed(&mut self, memory: &Memory) {
        let (passed, objects) = (&mut self.passed, &memory.objects);
        self.visits.retain(|track, visit| {
            let (Some(object), Some(away)) = (objects.get(*track), visit.away) else { return true };
            let is_passed = object.last_seen >= away && is_at_rest(object, memory.frame);
            if is_passed {
                passed.insert(*track, object.class);
            }
            !is_passed
        });
    }
}

#[cfg(test)]
mod tests;
