//! What the others do: a log of their actions and holdings, as far as it is known.

use std::collections::BTreeMap;

use chaic_core::geom::horizontal_distance;
use chaic_core::observation::Film;
use chaic_core::{Action, AgentId, ClassId, Frame, Hand, Observation, Outcome, Vec3};

use crate::mapping::Thing;
use crate::memory::Memory;
use crate::track::{Intent, TrackId};

/// A thing that is seen this near to where it lay before has not been moved, metres.
const SAME_PLACE_M: f32 = 0.4;

/// Something that somebody else did, as far as its onlooker can tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenInteraction {
    /// Who did it.
    pub agent: AgentId,
    /// When it ended (or began, if under way).
    pub frame: Frame,
    /// What it was.
    pub action: Intent,
    /// How it ended; `None` while under way.
    pub outcome: Option<Outcome>,
}

/// What is known of the others' doings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BehaviorLog {
    /// Their actions other than moving about, oldest first; an action under way is replaced by
    /// its end.
    pub actions: Vec<SeenInteraction>,
    /// What the partner held when that was known last, contents included.
    pub partner_holds: Vec<(TrackId, ClassId)>,
    /// When that was.
    pub partner_holds_frame: Option<Frame>,
    /// Every object that the partner was ever known to take, in the order of taking.
    pub partner_took: Vec<(TrackId, ClassId)>,
}

impl BehaviorLog {
    /// The last known attempt of this person to pick something up that has ended.
    pub fn last_pick_of(&self, agent: AgentId) -> Option<(&SeenInteraction, TrackId)> {
        let has_ended = |seen: &&SeenInteraction| seen.agent == agent && seen.outcome.is_some();
        self.actions.iter().rev().filter(has_ended).find_map(|seen| match seen.action {
            Action::PickUp { object, .. } => Some((seen, object)),
            _ => None,
        })
    }
}

/// Recognizes what the others do.
pub trait BehaviorModel: Send {
    /// Begins an episode.
    fn reset(&mut self);

    /// The film that it looks at, if it looks at one.
    fn film(&self) -> Option<Film> {
        None
    }

    /// Looks at one observation, after the memory has taken it in.
    fn watch(&mut self, observation: &Observation, memory: &Memory);

    /// What is known so far.
    fn log(&self) -> &BehaviorLog;

    /// A copy that goes on as this one would.
    fn fork(&self) -> Box<dyn BehaviorModel>;
}

/// Reads what was granted, and nothing else; silent without a grant.
#[derive(Clone, Debug, Default)]
pub struct GroundTruthBehavior {
    log: BehaviorLog,
}

impl BehaviorModel for GroundTruthBehavior {
    fn reset(&mut self) {
        self.log = BehaviorLog::default();
    }

    fn watch(&mut self, observation: &Observation, _: &Memory) {
        let log = &mut self.log;
        for seen in &observation.granted.behavior {
            let seen = SeenInteraction {
                agent: seen.agent,
                frame: seen.frame,
                action: seen.action.map(TrackId::from),
                outcome: seen.outcome,
            };
            let same = |old: &&mut SeenInteraction| {
                old.agent == seen.agent
                    && old.action == seen.action
                    && (old.frame == seen.frame || old.outcome.is_none())
            };
            match log.actions.iter_mut().rev().take(4).find(same) {
                Some(old) => *old = seen,
                None => log.actions.push(seen),
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
                if !log.partner_took.contains(held) {
                    log.partner_took.push(*held);
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

/// Infers what one person takes from the own memory alone: what is between that person's hands,
/// and was not there before, has been taken; what then still lies where it lay has not. Nothing is
/// granted for it. That an attempt failed, or what was put where, it can't tell.
#[derive(Clone, Debug)]
pub struct SeenBehavior {
    watched: AgentId,
    log: BehaviorLog,
    /// Where things lay when they were seen lying.
    lay_at: BTreeMap<TrackId, Vec3>,
}

impl SeenBehavior {
    /// Watches this person.
    pub fn of(watched: AgentId) -> SeenBehavior {
        SeenBehavior { watched, log: BehaviorLog::default(), lay_at: BTreeMap::new() }
    }

    /// Takes back what was inferred of things that still lie where they lay.
    fn see_lying(&mut self, memory: &Memory) {
        let lies = |t: &&Thing| t.last_seen == memory.frame && t.held_until <= memory.frame;
        for thing in memory.things.iter().filter(lies).filter(|t| t.class.info().is_movable()) {
            let at = thing.position_in_world;
            let before = self.lay_at.insert(thing.track, at);
            if before.is_some_and(|b| b.distance(at) < SAME_PLACE_M) {
                let is_it = |a: &SeenInteraction| a.action.subject() == Some(thing.track);
                self.log.partner_took.retain(|(track, _)| *track != thing.track);
                self.log.actions.retain(|action| !is_it(action));
            }
        }
    }

    /// Whether a thing in the image is in the watched person's hands, not in somebody else's.
    fn holds(&self, memory: &Memory, thing: &Thing) -> bool {
        let is_held = thing.last_seen == memory.frame && thing.held_until > memory.frame;
        let from = |p: &crate::mapping::Person| {
            horizontal_distance(p.position_in_world, thing.position_in_world)
        };
        let in_view = memory.people.iter().filter(|p| p.is_in_view);
        let nearest = in_view.min_by(|a, b| from(a).total_cmp(&from(b)));
        is_held && nearest.is_some_and(|p| p.agent == self.watched)
    }
}

impl BehaviorModel for SeenBehavior {
    fn reset(&mut self) {
        *self = SeenBehavior::of(self.watched);
    }

    fn watch(&mut self, observation: &Observation, memory: &Memory) {
        self.see_lying(memory);
        if !memory.people.get(self.watched).is_some_and(|p| p.is_in_view) {
            return;
        }
        let held = memory.things.iter().filter(|t| self.holds(memory, t));
        let held: Vec<(TrackId, ClassId)> = held.map(|t| (t.track, t.class)).collect();
        let log = &mut self.log;
        for thing in &held {
            if !log.partner_took.contains(thing) {
                log.partner_took.push(*thing);
                log.actions.push(SeenInteraction {
                    agent: self.watched,
                    frame: observation.frame,
                    // With which hand can't be told; nobody reads it.
                    action: Action::PickUp { object: thing.0, hand: Hand::Left },
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
    use crate::test_support::Toy;
    use chaic_core::EntityId;
    use chaic_core::observation::{Identity, SeenAction};
    use chaic_core::{Hand, Outcome};

    #[test]
    fn an_action_under_way_is_replaced_by_its_end_and_holdings_are_collected() {
        let toy = Toy::room(4.0, 4.0);
        let memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        let mut model = GroundTruthBehavior::default();
        let apple = (TrackId(20), ClassId::named("apple"));
        let mut seen = SeenAction {
            agent: AgentId::PARTNER,
            frame: 10,
            action: Action::PickUp { object: EntityId(20), hand: Hand::Left },
            outcome: None,
        };
        let mut observation = toy.observe();
        observation.granted.behavior = vec![seen];
        model.watch(&observation, &memory);
        assert_eq!(model.log().last_pick_of(AgentId::PARTNER), None, "it is under way");
        (seen.frame, seen.outcome) = (40, Some(Outcome::Success));
        observation.granted.behavior = vec![seen];
        let held = Identity { entity: EntityId(20), class: apple.1, contents: vec![] };
        observation.granted.partner_hands = Some([Some(held.clone()), Some(held)]);
        model.watch(&observation, &memory);
        model.watch(&observation, &memory);
        let [one] = &model.log().actions[..] else { panic!("one action is one record") };
        assert_eq!((one.frame, one.outcome), (seen.frame, seen.outcome));
        assert_eq!(model.log().partner_took, vec![apple]);
        let last = model.log().last_pick_of(AgentId::PARTNER);
        assert_eq!(last.map(|(_, object)| object), Some(apple.0));
        assert_eq!(model.log().last_pick_of(AgentId::CHILD), None);
    }

    #[test]
    fn what_comes_into_somebodys_hands_was_taken_by_that_one() {
        let mut toy = Toy::room(8.0, 8.0);
        let briefing = toy.briefing();
        let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
        let mut model = SeenBehavior::of(AgentId::PARTNER);
        let detection = |track: TrackId, class: &str, at: [f32; 3]| Detection {
            track,
            class: ClassId::named(class),
            person: u16::try_from(track.0).ok().and_then(|e| EntityId(e).agent()),
            pixel: [0, 0],
            position_in_world: at.into(),
            bottom_m: at[1],
            top_m: at[1] + 0.1,
            n_pixels: 100,
            footprint: vec![],
        };
        let partner = |x: f32| {
            detection(EntityId::of_agent(AgentId::PARTNER).into(), "person", [x, 1.0, -3.0])
        };
        let child =
            detection(EntityId::of_agent(AgentId::CHILD).into(), "person", [-3.0, 0.6, -3.0]);
        let apple = |x: f32| detection(TrackId(20), "apple", [x, 1.0, -3.0]);
        let pear = detection(TrackId(21), "orange", [-2.8, 0.6, -3.0]);
        // What is seen in turn; what the partner is known to have taken, and to hold.
        let moments: [(Vec<Detection>, usize, usize); 4] = [
            (vec![partner(0.0), apple(2.0)], 0, 0),
            (vec![partner(1.6), apple(1.9)], 0, 0),
            (vec![partner(0.0), apple(0.5), child, pear], 1, 1),
            (vec![partner(0.0)], 1, 0),
        ];
        for (k, (detections, took, holds)) in moments.into_iter().enumerate() {
            toy.frame = 10 * k as Frame;
            let observation = toy.observe();
            let percepts = Percepts { detections, ..Percepts::default() };
            memory.update(&briefing, &observation, &percepts);
            model.watch(&observation, &memory);
            let log = model.log();
            assert_eq!((log.partner_took.len(), log.partner_holds.len()), (took, holds), "{k}");
            assert_eq!(log.actions.len(), took, "each taking is one action");
        }
        assert_eq!(model.log().partner_took[0].0, TrackId(20), "the child's is the child's");
        // Seen lying where it lay at first, it was never taken.
        toy.frame = 50;
        let observation = toy.observe();
        let percepts = Percepts { detections: vec![apple(2.0)], ..Percepts::default() };
        memory.update(&briefing, &observation, &percepts);
        model.watch(&observation, &memory);
        assert!(model.log().partner_took.is_empty() && model.log().actions.is_empty());
        // Out of sight nothing is learned, and what was known stays.
        toy.frame = 100;
        let observation = toy.observe();
        memory.update(&briefing, &observation, &Percepts::default());
        model.watch(&observation, &memory);
        assert_eq!(model.log().partner_holds_frame, Some(30));
        model.reset();
        assert!(model.log().partner_took.is_empty());
    }
}
