//! Complete agent: perceives, remembers, infers, decides and acts.

use std::collections::BTreeMap;

use chaic_core::agent::{BelievedObject, Thought};
use chaic_core::memory_view::MemoryView;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation, Outcome, Target};

use crate::behavior::{BehaviorLog, BehaviorModel, GroundTruthBehavior, InferredBehavior};
use crate::decision::{Context, Plan, Policy, filtered_plans};
use crate::execution::interaction::apply_outcome;
use crate::execution::steering::turn_towards;
use crate::execution::{ExecutionContext, Executor, Progress};
use crate::mapping::MappedObject;
use crate::memory::Memory;
use crate::perception::Perception;
use crate::perception_factory::{GroundTruthPerceptionFactory, PerceptionFactory};
use crate::rules::PlannerRules;
use crate::track::{Intent, TrackId, resolve_target};

/// Maximum number of plans that may end without an action within one decision; then the agent
/// waits.
const MAX_PLANS: usize = 6;
/// Duration of that wait, frames.
const PAUSE_FRAMES: u32 = 5;
/// Minimum interaction distance of an agent that targets objects by pixel, meters. It exceeds the
/// arm's length: a level camera at 1.65 m with 45 degrees of view downward sees the floor only from
/// 1.65 m on.
const MIN_PIXEL_TARGET_M: f32 = 2.2;
/// Decisions spent on getting an object into view before it is ignored.
const MAX_SEARCH_TURNS: u32 = 14;

/// Agent whose plans are chosen by a policy. Partners and helpers are both of this type.
pub struct PlanningAgent<P: Policy> {
    perception: Box<dyn Perception>,
    behavior: Box<dyn BehaviorModel>,
    policy: P,
    sensors: SensorConfig,
    perception_name: Option<String>,
    rules: PlannerRules,
    episode: Option<Episode>,
}

/// Chooses the behavior model for a watched person: granted ground truth, else the perception's
/// model, else inference from memory.
pub fn behavior_model(
    watched: AgentId,
    grants: Grants,
    factory: &dyn PerceptionFactory,
) -> Box<dyn BehaviorModel> {
    if grants.behavior {
        return Box::new(GroundTruthBehavior::default());
    }
    factory.behavior(watched).unwrap_or_else(|| Box::new(InferredBehavior::new(watched)))
}

/// State of one episode.
#[derive(Clone)]
struct Episode {
    briefing: Briefing,
    memory: Memory,
    executor: Executor,
    plan: Option<Plan>,
    /// Change count of the object map at the last choice.
    change_count: u32,
    held: Vec<TrackId>,
    /// The last action, as intent and as sent to the world.
    sent: Option<(Intent, Action)>,
    /// Object that the agent turns to in order to get it into view, and the number of these turns.
    search: Option<(TrackId, u32)>,
}

impl<P: Policy> PlanningAgent<P> {
    /// Creates an agent with perfect segmentation and granted behavior.
    pub fn new(policy: P, rules: PlannerRules) -> PlanningAgent<P> {
        PlanningAgent::with_perception(policy, rules, &GroundTruthPerceptionFactory)
    }

    /// Creates an agent with this perception, and with its behavior model if it has one.
    pub fn with_perception(
        policy: P,
        rules: PlannerRules,
        factory: &dyn PerceptionFactory,
    ) -> PlanningAgent<P> {
        let granted = || Box::new(GroundTruthBehavior::default()) as Box<dyn BehaviorModel>;
        let behavior = factory.behavior(AgentId::PARTNER).unwrap_or_else(granted);
        PlanningAgent::with(policy, factory.perception(), behavior, rules)
            .replace_perception(factory)
    }

    /// Creates an agent that watches this person; see [`behavior_model`] for how the model is
    /// chosen.
    pub fn with_watched(
        policy: P,
        rules: PlannerRules,
        factory: &dyn PerceptionFactory,
        watched: AgentId,
        grants: Grants,
    ) -> PlanningAgent<P> {
        let behavior = behavior_model(watched, grants, factory);
        PlanningAgent::with(policy, factory.perception(), behavior, rules)
            .replace_perception(factory)
    }

    /// Replaces the perception. Color stays enabled if it was.
    pub fn replace_perception(self, factory: &dyn PerceptionFactory) -> PlanningAgent<P> {
        let sensors =
            SensorConfig { rgb: self.sensors.rgb || factory.sensors().rgb, ..factory.sensors() };
        let PlanningAgent { policy, behavior, rules, .. } = self;
        let agent = PlanningAgent::with(policy, factory.perception(), behavior, rules);
        PlanningAgent { perception_name: factory.name(), sensors, ..agent }
    }

    /// Creates an agent from its parts.
    pub fn with(
        policy: P,
        perception: Box<dyn Perception>,
        behavior: Box<dyn BehaviorModel>,
        mut rules: PlannerRules,
    ) -> PlanningAgent<P> {
        if perception.uses_pixel_targets() {
            rules.pick_within_m = rules.pick_within_m.max(MIN_PIXEL_TARGET_M);
            rules.put_within_m = rules.put_within_m.max(MIN_PIXEL_TARGET_M);
        }
        let sensors = SensorConfig::DEPTH_AND_IDS;
        PlanningAgent {
            perception,
            behavior,
            policy,
            sensors,
            perception_name: None,
            rules,
            episode: None,
        }
    }

    /// Replaces the sensors, for example with a smaller image or with color.
    pub fn with_sensors(mut self, sensors: SensorConfig) -> PlanningAgent<P> {
        self.sensors = sensors;
        self
    }

    /// The current plan.
    pub fn plan(&self) -> Option<Plan> {
        self.episode.as_ref()?.plan
    }

    /// Memory of the current episode.
    pub fn memory(&self) -> Option<&Memory> {
        self.episode.as_ref().map(|e| &e.memory)
    }

    /// Known actions of the watched person.
    pub fn behavior(&self) -> &BehaviorLog {
        self.behavior.log()
    }

    /// Returns the target by which an action refers to this object; `None` if it is not in view.
    pub fn target(&self, track: TrackId) -> Option<Target> {
        self.perception.target(track)
    }

    /// The agent's policy.
    pub fn policy(&self) -> &P {
        &self.policy
    }

    /// The agent's policy, for callers that select its plan.
    pub fn policy_mut(&mut self) -> &mut P {
        &mut self.policy
    }
}

impl Episode {
    fn new(briefing: &Briefing, rules: PlannerRules) -> Episode {
        Episode {
            briefing: briefing.clone(),
            memory: Memory::new(briefing, rules),
            executor: Executor::new(briefing, &rules),
            plan: None,
            change_count: 0,
            held: Vec::new(),
            sent: None,
            search: None,
        }
    }

    fn context<'a>(&'a self, behavior: &'a dyn BehaviorModel) -> Context<'a> {
        Context {
            briefing: &self.briefing,
            memory: &self.memory,
            behavior: behavior.log(),
            is_explored: self.executor.is_explored() || self.briefing.layout.is_some(),
        }
    }

    /// Updates the memory with the observation, including the result of the last action.
    fn update(&mut self, observation: &Observation, perception: &mut dyn Perception) {
        if let Some(goal) = &observation.granted.goal {
            self.briefing.goal.get_or_insert_with(|| goal.clone());
        }
        if perception.hides_ids() {
            self.briefing.grants.ids = false;
        }
        self.memory.last = self.last_intent(observation);
        perception.update_hands(&self.memory.infer_held_objects(observation), self.memory.last);
        let percepts = perception.perceive(observation);
        let without_ids =
            perception.hides_ids().then(|| observation.without_ids(self.briefing.grants));
        let observation = without_ids.as_ref().unwrap_or(observation);
        self.memory.update(&self.briefing, observation, &percepts);
        let held: Vec<TrackId> = self.memory.hands.all().map(|(track, _)| track).collect();
        if let Some(last) = self.memory.last {
            apply_outcome(&mut self.memory, &self.briefing, last, &self.held, &held);
        }
        self.held = held;
    }

    /// Returns the action that has ended, as an intent. With ids granted, another agent's choice
    /// may have replaced it by a joint lift (the original's rules).
    fn last_intent(&self, observation: &Observation) -> Option<(Intent, Outcome)> {
        let (action, outcome) = observation.proprioception.last?;
        let intended = self.sent.filter(|(_, sent)| *sent == action).map(|(intent, _)| intent);
        let replaced = || match action.subject() {
            None | Some(Target::Entity(_)) => Some(action.map(|target| match target {
                Target::Entity(entity) => entity.into(),
                Target::Pixel { .. } => TrackId(0),
            })),
            Some(Target::Pixel { .. }) => None,
        };
        Some((intended.or_else(replaced)?, outcome))
    }

    /// Converts an intent to an action. If the object cannot be targeted now, returns a turn
    /// towards its assumed position, or `None` if it cannot be brought into view.
    fn resolve(&mut self, intent: Intent, perception: &dyn Perception) -> Option<(Intent, Action)> {
        let target = |track| perception.target(track);
        if let Some(action) = resolve_target(intent, target) {
            if !action.is_locomotion() {
                self.search = None;
            }
            return Some((intent, action));
        }
        let track = intent.subject()?;
        let n_turns = 1 + self.search.filter(|(of, _)| *of == track).map_or(0, |(_, n)| n);
        self.search = Some((track, n_turns));
        let at = self.memory.objects.get(track).map(|t| t.nearest_point(self.memory.position()));
        let turn = at.and_then(|at| turn_towards(&self.memory, at, 0.0));
        match turn.filter(|_| n_turns <= MAX_SEARCH_TURNS) {
            Some(turn) => resolve_target(turn, target).map(|action| (turn, action)),
            None => {
                self.search = None;
                None
            }
        }
    }

    /// Handles an intent whose object is in no image from here. Returns whether the plan continues
    /// from another side; otherwise the object is ignored for a while.
    fn views_from_elsewhere(&mut self, intent: Intent) -> bool {
        let Some(track) = intent.subject() else { return false };
        let goes_on = self.executor.record_unseen(&self.memory, track);
        if !goes_on {
            let until = self.memory.frame + self.memory.rules.failures.ignore_frames;
            self.memory.objects.ignore(track, until);
        }
        goes_on
    }

    /// Asks the policy for a plan; returns `None` if the current plan continues.
    fn choose<P: Policy>(
        &mut self,
        policy: &mut P,
        behavior: &dyn BehaviorModel,
    ) -> Result<Option<Plan>, AgentError> {
        let change_count = self.memory.objects.change_count();
        if let Some(current) = self.plan {
            let context = self.context(behavior);
            if !policy.reconsiders(&context, &current, change_count != self.change_count) {
                return Ok(None);
            }
        }
        if let Some(min_top_m) = policy.goal_place_min_top_m(&self.memory) {
            self.memory.set_goal_place_min_top(min_top_m);
        }
        self.memory.refresh();
        let context = self.context(behavior);
        let filter = policy.plan_filter(&context, self.plan.as_ref());
        let valid = filtered_plans(&self.memory, &self.briefing, &filter);
        let chosen = policy.choose(&context, &valid)?;
        // Only after a choice: a repeated call must find the same changes.
        self.change_count = change_count;
        Ok(match self.plan {
            Some(current) if !policy.supersedes(&chosen, &current) => None,
            _ => Some(chosen),
        })
    }

    /// Executes the next step of `plan`.
    fn step(&mut self, plan: &Plan) -> Progress {
        let mut context = ExecutionContext { memory: &mut self.memory, briefing: &self.briefing };
        self.executor.step(plan, &mut context)
    }
}

impl<P: Policy> PlanningAgent<P> {
    /// Returns the memory if the agent uses a learned perception.
    fn learned_memory(&self) -> Option<&Memory> {
        let episode = self.episode.as_ref().filter(|_| self.perception_name.is_some())?;
        Some(&episode.memory)
    }

    /// Describes the most recent observed action of another agent.
    fn describe_last_observed(&self, memory: &Memory) -> Option<String> {
        let last = self.behavior.log().actions.last()?;
        let name = |track: TrackId| match memory.objects.get(track) {
            Some(object) => format!("{} {track}", object.class.info().label),
            None => track.to_string(),
        };
        let description = match last.action {
            Action::PickUp { object, .. } => format!("picks up {}", name(object)),
            Action::PutIn => "puts something into a container".to_owned(),
            Action::PutOn { place, .. } => format!("puts something on {}", name(place)),
            Action::RemoveObstacle { obstacle, .. } => format!("removes {}", name(obstacle)),
            _ => return None,
        };
        let has_failed = matches!(last.outcome, Some(Outcome::Failure(_)));
        let suffix = if has_failed { " (failed)" } else { "" };
        Some(format!("frame {}: {} {description}{suffix}", last.frame, last.agent))
    }

    /// Decides and acts on the last [observation](Agent::observe): the second half of
    /// [`Agent::act`].
    ///
    /// # Errors
    /// The policy's error, if it cannot choose. The state is unchanged, and the call may be
    /// repeated.
    pub fn next_action(&mut self) -> Result<Action, AgentError> {
        let pause = Action::Wait { frames: PAUSE_FRAMES };
        let Some(mut episode) = self.episode.take() else { return Ok(pause) };
        let decided = self.decide(&mut episode);
        if let Ok(sent) = &decided {
            episode.sent = *sent;
        }
        self.episode = Some(episode);
        Ok(decided?.map_or(pause, |(_, action)| action))
    }

    /// Returns the next action as intent and as action; `None` for a pause. If none of the chosen
    /// plans can be executed, the agent explores, because other positions may allow them.
    fn decide(&mut self, episode: &mut Episode) -> Result<Option<(Intent, Action)>, AgentError> {
        for _ in 0..MAX_PLANS {
            let new_plan = episode.choose(&mut self.policy, self.behavior.as_ref())?;
            if let Some(plan) = new_plan {
                let thinking = self.policy.thinking_frames();
                let start = episode.memory.frame + thinking;
                episode.executor.start_plan(start, &episode.memory.rules);
                episode.plan = Some(plan);
                if thinking > 0 {
                    let frames = thinking;
                    return Ok(Some((Action::Wait { frames }, Action::Wait { frames })));
                }
            }
            let Some(plan) = episode.plan else { return Ok(None) };
            match episode.step(&plan) {
                Progress::Act(intent) => match episode.resolve(intent, self.perception.as_ref()) {
                    Some(resolved) => return Ok(Some(resolved)),
                    None if episode.views_from_elsewhere(intent) => {}
                    None => episode.plan = None,
                },
                Progress::Done | Progress::Failed => episode.plan = None,
            }
        }
        episode.executor.start_plan(episode.memory.frame, &episode.memory.rules);
        episode.plan = Some(Plan::Explore);
        Ok(match episode.step(&Plan::Explore) {
            Progress::Act(intent) => episode.resolve(intent, self.perception.as_ref()),
            Progress::Done | Progress::Failed => None,
        })
    }
}

/// Returns the objects that the agent currently believes to see.
fn visible_objects(memory: &Memory) -> Vec<BelievedObject> {
    let visible = memory.objects.iter().filter(|t| t.last_seen == memory.frame && t.is_present);
    let believed = |object: &MappedObject| BelievedObject {
        name: object.track.to_string(),
        class: object.class,
        position_cm: object.position_in_world.to_array().map(|m| (100.0 * m) as i32),
    };
    visible.map(believed).collect()
}

impl<P: Policy> Agent for PlanningAgent<P> {
    fn sensors(&self) -> SensorConfig {
        SensorConfig { frame_history: self.behavior.frame_history(), ..self.sensors }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.policy.reset(briefing);
        self.behavior.reset();
        self.perception.reset(briefing);
        let mut episode = Episode::new(briefing, self.rules);
        episode.memory.needs_view = self.perception.uses_pixel_targets();
        self.episode = Some(episode);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        self.observe(observation);
        self.next_action()
    }

    /// Updates perception, memory and behavior: the first half of [`Agent::act`].
    fn observe(&mut self, observation: &Observation) {
        let Some(episode) = &mut self.episode else { return };
        episode.update(observation, self.perception.as_mut());
        if let Some(span) = self.policy.memory_frames() {
            // The agent does not forget the object to which it walks.
            let kept = episode.plan.and_then(|plan| plan.subject()).map(|subject| subject.track);
            episode.memory.objects.forget_unseen(span, kept, episode.memory.frame);
        }
        self.behavior.observe(observation, &episode.memory);
        self.policy.observe(observation, &episode.memory, self.behavior.log());
    }

    fn perception(&self) -> Option<String> {
        self.perception_name.clone()
    }

    fn weights(&self) -> Option<String> {
        self.policy.weights()
    }

    fn recording(&self) -> Option<String> {
        self.policy.recording()
    }

    fn thought(&self) -> Thought {
        Thought {
            plan: self.plan().map_or_else(|| "think".to_owned(), |plan| plan.to_string()),
            mode: self.policy.status(),
            last_observed: self
                .learned_memory()
                .and_then(|memory| self.describe_last_observed(memory)),
            perceived: self.learned_memory().map(visible_objects).unwrap_or_default(),
            belief: self
                .episode
                .as_ref()
                .and_then(|e| self.policy.partner_belief(&e.briefing, &e.memory))
                .map(Box::new),
        }
    }

    fn memory_view(&self) -> Option<MemoryView> {
        let episode = self.episode.as_ref()?;
        Some(episode.memory.view(episode.executor.path()))
    }

    fn counters(&self) -> BTreeMap<String, u64> {
        self.policy.counters()
    }

    fn fork(&self) -> Option<Box<dyn Agent>> {
        Some(Box::new(PlanningAgent {
            perception: self.perception.fork(),
            behavior: self.behavior.fork(),
            policy: self.policy.fork()?,
            sensors: self.sensors,
            perception_name: self.perception_name.clone(),
            rules: self.rules,
            episode: self.episode.clone(),
        }))
    }
}

#[cfg(test)]
mod tests;
