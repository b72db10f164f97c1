//! What the others do, as a mind tells it from its own view: a network says what somebody did (action
//! recognition), the memory to what (action grounding; paper section 4.1).

use std::collections::VecDeque;
use std::fmt;
use std::sync::Arc;

use chaic_agents::Intent;
use chaic_agents::behavior::{BehaviorLog, BehaviorModel, SeenBehavior, SeenInteraction};
use chaic_agents::mapping::Thing;
use chaic_agents::memory::Memory;
use chaic_agents::perception::Perception;
use chaic_agents::sight::Sight;
use chaic_core::geom::xz;
use chaic_core::observation::{Film, Grants, Senses};
use chaic_core::{Action, AgentId, FailureReason, Frame, Hand, Observation, Outcome, Vec2, Vec3};
use chaic_nn::Pass;

use super::Behavior;
use super::clip::{CROPS, SLACK};
use super::crop::{Crop, FILM, Watcher};
use super::network::TrainedBehavior;
use super::report::likeliest;

/// How behaviors are told one after the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecognizerRules {
    /// Nothing is told that is less sure (original: 0.6).
    pub least_sure: f32,
    /// Nothing is told of clips that show the person in less than this share of their crops.
    pub least_seen: f32,
    /// The same isn't told again within so many frames: clips overlap.
    pub again_frames: Frame,
    /// What was done was done to something no farther than this from the person, metres in plan.
    pub reach_m: f32,
}

impl Default for RecognizerRules {
    fn default() -> RecognizerRules {
        RecognizerRules { least_sure: 0.6, least_seen: 0.2, again_frames: 45, reach_m: 2.0 }
    }
}

/// Minds that see by something and recognize by a network what others do.
#[derive(Clone)]
pub struct Recognizing {
    /// By what they see.
    pub sight: Arc<dyn Sight>,
    /// By what they recognize.
    pub trained: Arc<TrainedBehavior>,
}

impl Sight for Recognizing {
    fn name(&self) -> Option<String> {
        let sight = self.sight.name().unwrap_or_else(|| "ground_truth".to_owned());
        Some(format!("{sight}, behavior learned {}", self.trained.digest()))
    }

    fn senses(&self) -> Senses {
        self.sight.senses()
    }

    /// Those who are told the goal are bounds, and are told what others do.
    fn grants(&self, asked: Grants) -> Grants {
        Grants { behavior: asked.behavior && asked.goal, ..self.sight.grants(asked) }
    }

    fn perception(&self) -> Box<dyn Perception> {
        self.sight.perception()
    }

    fn behavior(&self, watched: AgentId) -> Option<Box<dyn BehaviorModel>> {
        Some(Box::new(LearnedBehavior::of(watched, Arc::clone(&self.trained))))
    }
}

/// Recognizes what one person does.
#[derive(Clone)]
pub struct LearnedBehavior {
    trained: Arc<TrainedBehavior>,
    rules: RecognizerRules,
    watched: AgentId,
    watcher: Watcher,
    crops: VecDeque<Crop>,
    /// Crops since a clip was looked at last.
    n_new: usize,
    /// What is between that person's hands, told from tracks.
    seen: SeenBehavior,
    /// What the network told, with what it was done to.
    told: Vec<(Behavior, SeenInteraction)>,
    /// The last of each that was told, be it known to what or not.
    last: Option<(Behavior, Frame)>,
    log: BehaviorLog,
    pass: Pass,
}

impl fmt::Debug for LearnedBehavior {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LearnedBehavior").field("log", &self.log).finish_non_exhaustive()
    }
}

impl LearnedBehavior {
    /// Watches this person.
    pub fn of(watched: AgentId, trained: Arc<TrainedBehavior>) -> LearnedBehavior {
        LearnedBehavior {
            pass: trained.pass(),
            trained,
            rules: RecognizerRules::default(),
            watched,
            watcher: Watcher::of(watched),
            crops: VecDeque::new(),
            n_new: 0,
            seen: SeenBehavior::of(watched),
            told: Vec::new(),
            last: None,
            log: BehaviorLog::default(),
        }
    }

    /// Takes in a crop; what is told of the clip that ends with it, if it is time to look at one. One
    /// clip ends soon after the end of each action: as late as those that were learned from.
    fn take_in(&mut self, crop: Crop) -> Option<(Behavior, Frame)> {
        let goes_on = self.crops.back().is_some_and(|c| c.frame + FILM.every_frames == crop.frame);
        if !goes_on {
            self.crops.clear();
        }
        let frame = crop.frame;
        self.crops.push_back(crop);
        if self.crops.len() > CROPS {
            self.crops.pop_front();
        }
        self.n_new += 1;
        if self.crops.len() < CROPS || self.n_new <= SLACK {
            return None;
        }
        self.n_new = 0;
        let n_seen = self.crops.iter().filter(|crop| !crop.is_blank()).count();
        if (n_seen as f32) < self.rules.least_seen * CROPS as f32 {
            return None;
        }
        let outputs = self.trained.outputs(self.crops.make_contiguous(), 0, &mut self.pass);
        let (behavior, sure) = likeliest(&self.trained.probabilities(&outputs));
        let is_news = self
            .last
            .is_none_or(|(last, then)| last != behavior || then + self.rules.again_frames < frame);
        (behavior != Behavior::Moving && sure >= self.rules.least_sure && is_news)
            .then_some((behavior, frame))
    }

    /// What was done, and to what.
    fn ground(&self, behavior: Behavior, memory: &Memory) -> Option<(Intent, Outcome)> {
        let at = memory.people.get(self.watched)?.position_in_world;
        let in_vain = Outcome::Failure(FailureReason::BeyondLimits);
        // With which hand can't be told; nobody reads it.
        let hand = Hand::Left;
        match behavior {
            Behavior::PickedUp => {
                let held = self.seen.log().partner_holds.first().map(|(track, _)| *track);
                let near = || self.nearest(memory, at).map(|thing| thing.track);
                let object = held.or_else(near)?;
                Some((Action::PickUp { object, hand }, Outcome::Success))
            }
            Behavior::FailedToPickUp => {
                let object = self.nearest(memory, at)?.track;
                Some((Action::PickUp { object, hand }, in_vain))
            }
            Behavior::PutIn => Some((Action::PutIn, Outcome::Success)),
            Behavior::PutOn | Behavior::FailedToPutOn => {
                let places = memory.goal_places();
                let near = places.into_iter().map(|(place, _)| place);
                let place = self.nearest_of(near, xz(at))?.track;
                let outcome = if behavior == Behavior::PutOn { Outcome::Success } else { in_vain };
                Some((Action::PutOn { place, hand }, outcome))
            }
            Behavior::Moving => None,
        }
    }

    /// The movable thing nearest to somebody who stands here.
    fn nearest<'a>(&self, memory: &'a Memory, at: Vec3) -> Option<&'a Thing> {
        let own = |thing: &Thing| memory.hands.all().any(|(track, _)| track == thing.track);
        let movable = memory.things.iter().filter(|thing| {
            thing.is_present && !thing.is_gone && thing.class.info().is_movable() && !own(thing)
        });
        self.nearest_of(movable, xz(at))
    }

    fn nearest_of<'a>(
        &self,
        things: impl Iterator<Item = &'a Thing>,
        at: Vec2,
    ) -> Option<&'a Thing> {
        let near = things.filter(|thing| thing.distance_from(at) < self.rules.reach_m);
        near.min_by(|a, b| a.distance_from(at).total_cmp(&b.distance_from(at)))
    }

    /// What the hands tell and what the network tells, one after the other. That something was taken is
    /// told once: by the hands, where they show it.
    fn merge(&self) -> BehaviorLog {
        let seen = self.seen.log();
        let mut log = seen.clone();
        let is_known = |told: &SeenInteraction| {
            told.outcome == Some(Outcome::Success)
                && told.action.subject().is_some()
                && seen.actions.iter().any(|a| a.action.subject() == told.action.subject())
        };
        let told = self.told.iter().map(|(_, told)| told);
        log.actions.extend(told.filter(|told| !is_known(told)).copied());
        log.actions.sort_by_key(|action| action.frame);
        log
    }
}

impl BehaviorModel for LearnedBehavior {
    fn reset(&mut self) {
        *self = LearnedBehavior::of(self.watched, Arc::clone(&self.trained));
    }

    fn film(&self) -> Option<Film> {
        Some(FILM)
    }

    fn watch(&mut self, observation: &Observation, memory: &Memory) {
        self.seen.watch(observation, memory);
        for crop in self.watcher.watch(observation, memory) {
            let Some((behavior, frame)) = self.take_in(crop) else { continue };
            self.last = Some((behavior, frame));
            if let Some((action, outcome)) = self.ground(behavior, memory) {
                let agent = self.watched;
                let told = SeenInteraction { agent, frame, action, outcome: Some(outcome) };
                self.told.push((behavior, told));
            }
        }
        self.log = self.merge();
    }

    fn log(&self) -> &BehaviorLog {
        &self.log
    }

    fn fork(&self) -> Box<dyn BehaviorModel> {
        Box::new(self.clone())
    }
}
