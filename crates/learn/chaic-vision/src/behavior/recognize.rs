//! Behavior model of an agent, from its own view. A network recognizes the action (action
//! recognition), memory the object (action grounding; paper, section 4.1).

use std::collections::VecDeque;
use std::fmt;
use std::sync::Arc;

use chaic_agents::Intent;
use chaic_agents::behavior::{BehaviorLog, BehaviorModel, InferredBehavior, ObservedInteraction};
use chaic_agents::mapping::MappedObject;
use chaic_agents::memory::Memory;
use chaic_agents::perception::Perception;
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_core::geom::to_xz;
use chaic_core::observation::{FrameHistorySpec, Grants, SensorConfig};
use chaic_core::{Action, AgentId, FailureReason, Frame, Hand, Observation, Outcome, Vec2, Vec3};
use chaic_nn::TrainingPass;

use super::Behavior;
use super::clip::{CROPS, N_EXTRA_CROPS, is_seen_enough};
use super::crop::{HISTORY, PersonCrop, PersonCropper, visible_position};
use super::network::TrainedBehavior;
use super::report::most_probable;

/// Thresholds of recognition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecognizerConfig {
    /// Minimum probability of a reported behavior (original: 0.6).
    pub min_confidence: f32,
    /// Frames within which a behavior is not reported again, since clips overlap.
    pub refractory_frames: Frame,
    /// Maximum horizontal distance between the person and the object of an action, meters.
    pub reach_m: f32,
}

impl Default for RecognizerConfig {
    fn default() -> RecognizerConfig {
        RecognizerConfig { min_confidence: 0.6, refractory_frames: 45, reach_m: 2.0 }
    }
}

/// Factory of agents with learned action recognition.
#[derive(Clone)]
pub struct LearnedBehaviorFactory {
    /// Factory of their perception.
    pub perception: Arc<dyn PerceptionFactory>,
    /// Behavior network.
    pub model: Arc<TrainedBehavior>,
}

impl PerceptionFactory for LearnedBehaviorFactory {
    fn name(&self) -> Option<String> {
        let perception = self.perception.name().unwrap_or_else(|| "ground_truth".to_owned());
        Some(format!("{perception}, behavior learned {}", self.model.digest()))
    }

    fn sensors(&self) -> SensorConfig {
        self.perception.sensors()
    }

    fn image_step(&self) -> u32 {
        self.perception.image_step()
    }

    /// Helpers with a granted goal are upper bounds and keep their granted behaviors.
    fn grants(&self, requested: Grants) -> Grants {
        Grants {
            behavior: requested.behavior && requested.goal,
            ..self.perception.grants(requested)
        }
    }

    fn perception(&self) -> Box<dyn Perception> {
        self.perception.perception()
    }

    fn behavior(&self, person: AgentId) -> Option<Box<dyn BehaviorModel>> {
        Some(Box::new(LearnedBehavior::new(person, Arc::clone(&self.model))))
    }
}

/// Recognizes the behaviors of one person.
#[derive(Clone)]
pub struct LearnedBehavior {
    model: Arc<TrainedBehavior>,
    config: RecognizerConfig,
    person: AgentId,
    cropper: PersonCropper,
    crops: VecDeque<PersonCrop>,
    /// Crops since the last classified clip.
    n_new: usize,
    /// Interactions inferred from tracks of held objects.
    inferred: InferredBehavior,
    /// Recognized interactions with known objects.
    recognized: Vec<ObservedInteraction>,
    /// Last recognized behavior, with or without a known object.
    last: Option<(Behavior, Frame)>,
    log: BehaviorLog,
    pass: TrainingPass,
}

impl fmt::Debug for LearnedBehavior {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LearnedBehavior").field("log", &self.log).finish_non_exhaustive()
    }
}

impl LearnedBehavior {
    /// Creates a model of this person.
    pub fn new(person: AgentId, model: Arc<TrainedBehavior>) -> LearnedBehavior {
        LearnedBehavior {
            pass: model.pass(),
            model,
            config: RecognizerConfig::default(),
            person,
            cropper: PersonCropper::default(),
            crops: VecDeque::new(),
            n_new: 0,
            inferred: InferredBehavior::new(person),
            recognized: Vec::new(),
            last: None,
            log: BehaviorLog::default(),
        }
    }

    /// Appends a crop; classifies the clip that ends with it if one is due. A clip ends soon after
    /// each action, as in training data.
    fn push(&mut self, crop: PersonCrop) -> Option<(Behavior, Frame)> {
        let is_contiguous =
            self.crops.back().is_some_and(|c| c.frame + HISTORY.every_frames == crop.frame);
        if !is_contiguous {
            self.crops.clear();
        }
        let frame = crop.frame;
        self.crops.push_back(crop);
        if self.crops.len() > CROPS {
            self.crops.pop_front();
        }
        self.n_new += 1;
        if self.crops.len() < CROPS || self.n_new <= N_EXTRA_CROPS {
            return None;
        }
        self.n_new = 0;
        if !is_seen_enough(&self.crops) {
            return None;
        }
        let outputs = self.model.outputs(self.crops.make_contiguous(), 0, &mut self.pass);
        let (behavior, probability) = most_probable(&self.model.probabilities(&outputs));
        let is_new = self.last.is_none_or(|(last, last_frame)| {
            last != behavior || last_frame + self.config.refractory_frames < frame
        });
        (behavior != Behavior::Moving && probability >= self.config.min_confidence && is_new)
            .then_some((behavior, frame))
    }

    /// Returns the action of a behavior with its object.
    fn ground(&self, behavior: Behavior, memory: &Memory) -> Option<(Intent, Outcome)> {
        let at = memory.people.get(self.person)?.position_in_world;
        let beyond_limits = Outcome::Failure(FailureReason::BeyondLimits);
        // The hand is unknown, and no policy reads it.
        let hand = Hand::Left;
        match behavior {
            Behavior::PickedUp => {
                let held = self.inferred.log().partner_holds.first().map(|(track, _)| *track);
                let near = || self.nearest(memory, at).map(|object| object.track);
                let object = held.or_else(near)?;
                Some((Action::PickUp { object, hand }, Outcome::Success))
            }
            Behavior::FailedToPickUp => {
                let object = self.nearest(memory, at)?.track;
                Some((Action::PickUp { object, hand }, beyond_limits))
            }
            Behavior::PutIn => Some((Action::PutIn, Outcome::Success)),
            Behavior::PutOn | Behavior::FailedToPutOn => {
                let places = memory.goal_places();
                let near = places.into_iter().map(|(place, _)| place);
                let place = self.nearest_among(near, to_xz(at))?.track;
                let outcome =
                    if behavior == Behavior::PutOn { Outcome::Success } else { beyond_limits };
                Some((Action::PutOn { place, hand }, outcome))
            }
            Behavior::Moving => None,
        }
    }

    /// Returns the nearest movable object that no person holds.
    fn nearest<'a>(&self, memory: &'a Memory, at: Vec3) -> Option<&'a MappedObject> {
        let is_held =
            |object: &MappedObject| memory.hands.all().any(|(track, _)| track == object.track);
        let movable = memory.objects.iter().filter(|object| {
            object.is_present
                && !object.is_out_of_play
                && object.class.info().is_movable()
                && object.held_until <= memory.frame
                && !is_held(object)
        });
        self.nearest_among(movable, to_xz(at))
    }

    fn nearest_among<'a>(
        &self,
        objects: impl Iterator<Item = &'a MappedObject>,
        at: Vec2,
    ) -> Option<&'a MappedObject> {
        let in_reach = objects.filter(|object| object.distance_from(at) < self.config.reach_m);
        in_reach.min_by(|a, b| a.distance_from(at).total_cmp(&b.distance_from(at)))
    }

    /// Merges the interactions inferred from tracks with the recognized ones. A pick-up that both
    /// contain is reported once.
    fn merge(&self) -> BehaviorLog {
        let inferred = self.inferred.log();
        let mut log = inferred.clone();
        let is_inferred = |recognized: &ObservedInteraction| {
            recognized.outcome == Some(Outcome::Success)
                && recognized.action.subject().is_some()
                && inferred
                    .actions
                    .iter()
                    .any(|a| a.action.subject() == recognized.action.subject())
        };
        let only_recognized =
            self.recognized.iter().filter(|interaction| !is_inferred(interaction));
        log.actions.extend(only_recognized.copied());
        log.actions.sort_by_key(|action| action.frame);
        log
    }
}

impl BehaviorModel for LearnedBehavior {
    fn reset(&mut self) {
        *self = LearnedBehavior::new(self.person, Arc::clone(&self.model));
    }

    fn frame_history(&self) -> Option<FrameHistorySpec> {
        Some(HISTORY)
    }

    fn observe(&mut self, observation: &Observation, memory: &Memory) {
        self.inferred.observe(observation, memory);
        let at = visible_position(memory, self.person);
        let images = &observation.frame_history;
        for crop in self.cropper.crop(observation.frame, images, at) {
            let Some((behavior, frame)) = self.push(crop) else { continue };
            self.last = Some((behavior, frame));
            if let Some((action, outcome)) = self.ground(behavior, memory) {
                let agent = self.person;
                let recognized =
                    ObservedInteraction { agent, frame, action, outcome: Some(outcome) };
                self.recognized.push(recognized);
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
