//! Observed behavior of other agents: a log of their actions and held objects.

use std::collections::BTreeMap;

use chaic_core::geom::horizontal_distance;
use chaic_core::observation::FrameHistorySpec;
use chaic_core::{Action, AgentId, ClassId, Frame, Hand, Observation, Outcome, Vec3};

use crate::mapping::MappedObject;
use crate::memory::Memory;
use crate::track::{Intent, TrackId};

/// An object seen within this distance of its previous position has not been moved, meters.
const SAME_PLACE_M: f32 = 0.4;

/// Action of another agent, as far as the observer knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedInteraction {
    /// The acting agent.
    pub agent: AgentId,
    /// Frame in which the action ended, or began if it is in progress.
    pub frame: Frame,
    /// The action.
    pub action: Intent,
    /// Outcome; `None` while the action is in progress.
    pub outcome: Option<Outcome>,
}

/// Known actions and held objects of other agents.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BehaviorLog {
    /// Interactions of other agents (no locomotion), oldest first. The entry of an ended action
    /// replaces its entry in progress.
    pub actions: Vec<ObservedInteraction>,
    /// Objects that the partner held when last observed, including contents.
    pub partner_holds: Vec<(TrackId, ClassId)>,
    /// Frame of that observation.
    pub partner_holds_frame: Option<Frame>,
    /// All objects that the partner is known to have picked up, in that order.
    pub partner_taken: Vec<(TrackId, ClassId)>,
}

impl BehaviorLog {
    /// Returns the objects that the partner held when last observed, if that was less than
    /// `max_age` frames ago.
    pub fn partner_load(&self, now: Frame, max_age: Frame) -> &[(TrackId, ClassId)] {
        match self.partner_holds_frame.is_some_and(|frame| frame + max_age > now) {
            true => &self.partner_holds,
            false => &[],
        }
    }

    /// Returns the agent's last known completed attempt to pick something up.
    pub fn last_pick_of(&self, agent: AgentId) -> Option<(&ObservedInteraction, TrackId)> {
        let has_ended = |a: &&ObservedInteraction| a.agent == agent && a.outcome.is_some();
        self.actions.iter().rev().filter(has_ended).find_map(|a| match a.action {
            Action::PickUp { object, .. } => Some((a, object)),
            _ => None,
        })
    }
}

/// Recognizes the actions of other agents.
pub trait BehaviorModel: Send {
    /// Starts an episode.
    fn reset(&mut self);

    /// Frame history that the model requires as input, if any.
    fn frame_history(&self) -> Option<FrameHistorySpec> {
        None
    }

    /// Processes one observation, after the memory has been updated with it.
    fn observe(&mut self, observation: &Observation, memory: &Memory);

    /// Returns the log so far.
    fn log(&self) -> &BehaviorLog;

    /// Returns a copy that continues identically.
    fn fork(&self) -> Box<dyn BehaviorModel>;
}

/// Copies the granted behavior into the log; stays empty without the grant.
#[derive(Clone, Debug, Default)]
pub struct GroundTruthBehavior {
    log: BehaviorLog,
}

impl BehaviorModel for GroundTruthBehavior {
    fn reset(&mut self) {
        self.log = BehaviorLog::default();
    }

    fn observe(&mut self, observation: &Observation, _: &Memory) {
        let log = &mut self.log;
        for granted in &observation.granted.behavior {
            let new = ObservedInteraction {
                agent: granted.agent,
                frame: granted.frame,
                action: granted.action.map(TrackId::from),
                outcome: granted.outcome,
            };
            // A known attempt that is reported again, or its end. Otherwise it is a new attempt.
            let is_same = |old: &&mut ObservedInteraction| {
                let is_repeated = old.frame == new.frame && old.outcome == new.outcome;
                let is_end = old.outcome.is_none() && new.outcome.is_some();
                old.agent == new.agent && old.action == new.action && (is_repeated || is_end)
            };
            match log.actions.iter_mut().rev().take(4).find(is_same) {
                Some(old) => *old = new,
                None => log.actions.push(new),
            }
        }
        if let Some(hands) = &observation.granted.partner_hands {
            log.partner_holds = hands
                .iter()
                .flatten()
                .flat_map(|h| {
                    std::iter::once((h.entity, h.class)).chain(h.contents.iter().copied())
                })
                .map(|(entity, class)| (entity.into(), class))
                .collect();
            // Furniture is held by both hands and appears twice.
            log.partner_holds.sort_unstable();
            log.partner_holds.dedup();
            log.partner_holds_frame = Some(observation.frame);
            for held in &log.partner_holds {
                if !log.partner_taken.contains(held) {
                    log.partner_taken.push(*held);
                }
            }
        }
    }

    fn log(&self) -> &BehaviorLog {
        &self.log
    }

    fn fork(&self) -> Box<dyn BehaviorModel> {
        Box::new(self.clone())
    }
}

/// Infers what one person picks up from the observer's own memory, without grants. An object
/// between the person's hands that was not there before counts as taken. If it is seen again at its old
/// position, the pick-up is removed. The model cannot detect failed attempts, or where objects
/// are put.
#[derive(Clone, Debug)]
pub struct InferredBehavior {
    watched: AgentId,
    log: BehaviorLog,
    /// Positions at which objects were seen lying before they were taken.
    lying_positions: BTreeMap<TrackId, Vec3>,
}

impl InferredBehavior {
    /// Creates a model that watches this person.
    pub fn new(watched: AgentId) -> InferredBehavior {
        InferredBehavior { watched, log: BehaviorLog::default(), lying_positions: BTreeMap::new() }
    }

    /// Removes inferred pick-ups of objects that still lie at their old position. Objects that lie
    /// anywhere no longer count as held.
    fn revert_pick_ups(&mut self, memory: &Memory) {
        let is_lying =
            |t: &&MappedObject| t.last_seen == memory.frame && t.held_until <= memory.frame;
        for object in memory.objects.iter().filter(is_lying).filter(|t| t.class.info().is_movable())
        {
            let at = object.position_in_world;
            self.log.partner_holds.retain(|(track, _)| *track != object.track);
            let is_taken = self.log.partner_taken.iter().any(|(track, _)| *track == object.track);
            if !is_taken {
                self.lying_positions.insert(object.track, at);
                continue;
            }
            // At another place, it was put down after a real pick-up.
            let before = self.lying_positions.get(&object.track);
            if before.is_some_and(|b| b.distance(at) < SAME_PLACE_M) {
                let is_it = |a: &ObservedInteraction| a.action.subject() == Some(object.track);
                self.log.partner_taken.retain(|(track, _)| *track != object.track);
                self.log.actions.retain(|action| !is_it(action));
            }
        }
    }

    /// Returns whether an object in view is in the hands of the watched person rather than of
    /// another one.
    fn holds(&self, memory: &Memory, object: &MappedObject) -> bool {
        let is_held = object.last_seen == memory.frame && object.held_until > memory.frame;
        let from = |p: &crate::mapping::TrackedPerson| {
            horizontal_distance(p.position_in_world, object.position_in_world)
        };
        let in_view = memory.people.iter().filter(|p| p.is_in_view);
        let nearest = in_view.min_by(|a, b| from(a).total_cmp(&from(b)));
        is_held && nearest.is_some_and(|p| p.agent == self.watched)
    }
}

impl BehaviorModel for InferredBehavior {
    fn reset(&mut self) {
        *self = InferredBehavior::new(self.watched);
    }

    fn observe(&mut self, observation: &Observation, memory: &Memory) {
        self.revert_pick_ups(memory);
        if !memory.people.get(self.watched).is_some_and(|p| p.is_in_view) {
            return;
        }
        let held = memory.objects.iter().filter(|t| self.holds(memory, t));
        let held: Vec<(TrackId, ClassId)> = held.map(|t| (t.track, t.class)).collect();
        let log = &mut self.log;
        for object in &held {
            if !log.partner_taken.contains(object) {
                log.partner_taken.push(*object);
                // An object that was never seen lying may lie where it seems to be held.
                if let Some(seen) = memory.objects.get(object.0) {
                    self.lying_positions.entry(object.0).or_insert(seen.position_in_world);
                }
                log.actions.push(ObservedInteraction {
                    agent: self.watched,
                    frame: observation.frame,
                    // The hand is unknown, and no code reads it.
                    action: Action::PickUp { object: object.0, hand: Hand::Left },
                    outcome: Some(Outcome::Success),
                });
            }
        }
        (log.partner_holds, log.partner_holds_frame) = (held, Some(observation.frame));
    }

    fn log(&self) -> &BehaviorLog {
        &self.log
    }

    fn fork(&self) -> Box<dyn BehaviorModel> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::{Detection, Percepts};
    use crate::test_support::{Toy, seen, seen_partner};
    use chaic_core::EntityId;
    use chaic_core::observation::{HeldIdentity, ObservedAction};
    use chaic_core::{Hand, Outcome};

    #[test]
    fn a_load_has_an_age() {
        let apple = (TrackId(20), ClassId::named("apple"));
        let mut log = BehaviorLog { partner_holds: vec![apple], ..BehaviorLog::default() };
        assert!(log.partner_load(10, 300).is_empty(), "it was never observed");
        log.partner_holds_frame = Some(100);
        assert_eq!(log.partner_load(399, 300), [apple]);
        assert!(log.partner_load(400, 300).is_empty());
    }

    #[test]
    fn the_end_of_an_action_replaces_its_start_and_held_objects_are_collected() {
        let toy = Toy::room(4.0, 4.0);
        let memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        let mut model = GroundTruthBehavior::default();
        let apple = (TrackId(20), ClassId::named("apple"));
        let mut granted_action = ObservedAction {
            agent: AgentId::PARTNER,
            frame: 10,
            action: Action::PickUp { object: EntityId(20), hand: Hand::Left },
            outcome: None,
        };
        let mut observation = toy.observe();
        observation.granted.behavior = vec![granted_action];
        model.observe(&observation, &memory);
        assert_eq!(model.log().last_pick_of(AgentId::PARTNER), None, "it is under way");
        (granted_action.frame, granted_action.outcome) = (40, Some(Outcome::Success));
        observation.granted.behavior = vec![granted_action];
        let held = HeldIdentity { entity: EntityId(20), class: apple.1, contents: vec![] };
        observation.granted.partner_hands = Some([Some(held.clone()), Some(held)]);
        model.observe(&observation, &memory);
        model.observe(&observation, &memory);
        let [one] = &model.log().actions[..] else { panic!("one action is one record") };
        assert_eq!((one.frame, one.outcome), (granted_action.frame, granted_action.outcome));
        assert_eq!(model.log().partner_taken, vec![apple]);
        let last = model.log().last_pick_of(AgentId::PARTNER);
        assert_eq!(last.map(|(_, object)| object), Some(apple.0));
        assert_eq!(model.log().last_pick_of(AgentId::CHILD), None);
    }

    #[test]
    fn a_new_attempt_on_the_same_object_is_another_record() {
        let toy = Toy::room(4.0, 4.0);
        let memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        let mut model = GroundTruthBehavior::default();
        let failed = Some(Outcome::Failure(chaic_core::FailureReason::BeyondLimits));
        // The first end is not observed. The third attempt begins when the second one ends.
        let reports = [(10, None), (50, None), (90, failed), (90, None), (90, None), (130, failed)];
        for (frame, outcome) in reports {
            let mut observation = toy.observe();
            observation.granted.behavior = vec![ObservedAction {
                agent: AgentId::PARTNER,
                frame,
                action: Action::PickUp { object: EntityId(20), hand: Hand::Left },
                outcome,
            }];
            model.observe(&observation, &memory);
        }
        let records: Vec<_> = model.log().actions.iter().map(|a| (a.frame, a.outcome)).collect();
        assert_eq!(records, [(10, None), (90, failed), (130, failed)]);
    }

    #[test]
    fn an_object_seen_lying_is_no_longer_held() {
        // At its first position it was never taken. Elsewhere it was put down.
        for (lies_at, n_taken) in [(2.0, 0), (-2.0, 1)] {
            let mut toy = Toy::room(8.0, 8.0);
            let briefing = toy.briefing();
            let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
            let mut model = InferredBehavior::new(AgentId::PARTNER);
            let apple = |x: f32| seen(TrackId(20), "apple", [x, 1.0, -3.0], 0.1, 0.1);
            let partner = || seen_partner(0.0, -3.0);
            // Detections of successive frames; the expected numbers of objects taken and held.
            let observations = [
                (vec![partner(), apple(2.0)], 0, 0),
                (vec![partner(), apple(0.5)], 1, 1),
                (vec![apple(lies_at)], n_taken, 0),
            ];
            for (detections, n_taken, n_held) in observations {
                toy.frame += 10;
                let observation = toy.observe();
                let percepts = Percepts { detections, ..Percepts::default() };
                memory.update(&briefing, &observation, &percepts);
                model.observe(&observation, &memory);
                let (taken, held) = (&model.log().partner_taken, &model.log().partner_holds);
                assert_eq!((taken.len(), held.len()), (n_taken, n_held), "frame {}", toy.frame);
            }
        }
    }

    #[test]
    fn an_object_that_appears_in_a_persons_hands_was_taken_by_that_person() {
        let mut toy = Toy::room(8.0, 8.0);
        let briefing = toy.briefing();
        let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
        let mut model = InferredBehavior::new(AgentId::PARTNER);
        let detection = |track: TrackId, class: &str, at: [f32; 3]| Detection {
            track,
            class: ClassId::named(class),
            confidence: 1.0,
            person: u16::try_from(track.0).ok().and_then(|e| EntityId(e).agent()),
            pixel: [0, 0],
            position_in_world: at.into(),
            bottom_m: at[1],
            top_m: at[1] + 0.1,
            n_pixels: 100,
            footprint: vec![],
        };
        let partner = |x: f32| {
            detection(EntityId::from_agent(AgentId::PARTNER).into(), "person", [x, 1.0, -3.0])
        };
        let child =
            detection(EntityId::from_agent(AgentId::CHILD).into(), "person", [-3.0, 0.6, -3.0]);
        let apple = |x: f32| detection(TrackId(20), "apple", [x, 1.0, -3.0]);
        let pear = detection(TrackId(21), "orange", [-2.8, 0.6, -3.0]);
        // Detections of successive frames; the expected numbers of objects taken and held by the
        // partner.
        let observations: [(Vec<Detection>, usize, usize); 4] = [
            (vec![partner(0.0), apple(2.0)], 0, 0),
            (vec![partner(1.6), apple(1.9)], 0, 0),
            (vec![partner(0.0), apple(0.5), child, pear], 1, 1),
            (vec![partner(0.0)], 1, 0),
        ];
        for (k, (detections, n_taken, n_held)) in observations.into_iter().enumerate() {
            toy.frame = 10 * k as Frame;
            let observation = toy.observe();
            let percepts = Percepts { detections, ..Percepts::default() };
            memory.update(&briefing, &observation, &percepts);
            model.observe(&observation, &memory);
            let log = model.log();
            assert_eq!(
                (log.partner_taken.len(), log.partner_holds.len()),
                (n_taken, n_held),
                "{k}"
            );
            assert_eq!(log.actions.len(), n_taken, "each pick-up is one action");
        }
        assert_eq!(model.log().partner_taken[0].0, TrackId(20), "the child holds the other object");
        // The apple lies elsewhere: it was taken, and put down there.
        for frame in [42, 44, 46] {
            toy.frame = frame;
            let observation = toy.observe();
            let percepts = Percepts { detections: vec![apple(-2.0)], ..Percepts::default() };
            memory.update(&briefing, &observation, &percepts);
            model.observe(&observation, &memory);
            assert_eq!(model.log().partner_taken.len(), 1, "frame {frame}");
        }
        // The apple is seen at its first position, so it was never taken.
        toy.frame = 50;
        let observation = toy.observe();
        let percepts = Percepts { detections: vec![apple(2.0)], ..Percepts::default() };
        memory.update(&briefing, &observation, &percepts);
        model.observe(&observation, &memory);
        assert!(model.log().partner_taken.is_empty() && model.log().actions.is_empty());
        // Out of sight nothing changes.
        toy.frame = 100;
        let observation = toy.observe();
        memory.update(&briefing, &observation, &Percepts::default());
        model.observe(&observation, &memory);
        assert_eq!(model.log().partner_holds_frame, Some(30));
        model.reset();
        assert!(model.log().partner_taken.is_empty());
    }
}
