//! Agent that acts by a visual policy.

use std::sync::Arc;

use chaic_agents::perception_factory::PerceptionFactory;
use chaic_agents::policies::ExternalPolicy;
use chaic_agents::{PlannerRules, PlanningAgent};
use chaic_core::agent::Thought;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::rng::RngStream;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation, TaskId};
use chaic_env::helper_registry::Helper;
use chaic_nn::TrainingPass;
use chaic_nn::weights::{self, WeightsError};

use super::actions::{
    ActionSpace, PAUSE, PRIMITIVES, resolve_plan, resolve_primitive, visible_objects,
};
use super::network::VisualNetwork;
use super::observation::{VisualObservation, opponent_features};
use crate::actor_critic::ActorCritic as _;
use crate::opponent::network::{OpponentInput, OpponentModel};
use crate::opponent::tracker::OpponentTracker;
use crate::policy::ActionSelection;

/// Extension of weights files.
pub(crate) const EXTENSION: &str = "safetensors";

/// Network with parameter values.
#[derive(Clone, Debug)]
pub struct VisualWeights {
    /// Network architecture.
    pub model: VisualNetwork,
    /// Parameters, with those of the opponent model.
    pub parameters: Vec<f32>,
    /// Opponent model whose predictions are inputs, if the network has such inputs.
    pub opponent: Option<Arc<OpponentModel>>,
    /// Digest of the weights file, if the parameters come from a file.
    pub digest: Option<String>,
}

impl VisualWeights {
    /// Combines a network with parameters, which include those of its opponent model.
    pub fn new(model: &VisualNetwork, parameters: Vec<f32>) -> VisualWeights {
        let opponent = model.opponent(&parameters).map(Arc::new);
        VisualWeights { model: model.clone(), parameters, opponent, digest: None }
    }

    /// Parses a weights file.
    ///
    /// # Errors
    /// [`WeightsError`] if the file is incomplete, belongs to another network, or was trained with other
    /// classes.
    pub fn from_bytes(bytes: &[u8]) -> Result<VisualWeights, WeightsError> {
        let kind = weights::kind(bytes)?;
        let model = VisualNetwork::from_kind(&kind);
        let model =
            model.unwrap_or_else(|| VisualNetwork::new(ActionSpace::Plans, OpponentInput::None));
        let parameters = model.read(bytes)?;
        let digest = Some(weights::digest(bytes));
        Ok(VisualWeights { digest, ..VisualWeights::new(&model, parameters) })
    }
}

/// Visual policies that play as one helper.
#[derive(Clone, Debug)]
pub enum VisualPolicies {
    /// One policy for all tasks.
    AllTasks(Arc<VisualWeights>),
    /// One policy per task, all with the same inputs and actions. The helper is granted the task,
    /// which selects its policy.
    ByTask(Vec<(TaskId, Arc<VisualWeights>)>),
}

impl VisualPolicies {
    /// Combines policies of single tasks.
    ///
    /// # Errors
    /// The first task whose policy has other inputs or actions than the policy of the first task.
    pub fn by_task(
        policies: impl IntoIterator<Item = (TaskId, VisualWeights)>,
    ) -> Result<VisualPolicies, TaskId> {
        let policies: Vec<(TaskId, Arc<VisualWeights>)> =
            policies.into_iter().map(|(task, weights)| (task, Arc::new(weights))).collect();
        let kinds = || policies.iter().map(|(task, weights)| (task, weights.model.kind()));
        match kinds().zip(kinds().skip(1)).find(|((_, before), (_, kind))| kind != before) {
            Some((_, (task, _))) => Err(*task),
            None => Ok(VisualPolicies::ByTask(policies)),
        }
    }

    /// Returns the opponent model of one of the policies; all need the same grants.
    pub(crate) fn opponent(&self) -> Option<Arc<OpponentModel>> {
        let any = match self {
            VisualPolicies::AllTasks(weights) => Some(weights),
            VisualPolicies::ByTask(policies) => policies.first().map(|(_, weights)| weights),
        };
        any.and_then(|weights| weights.opponent.clone())
    }

    /// Returns whether there is a policy for this task.
    pub(crate) fn plays(&self, task: TaskId) -> bool {
        self.find(Some(task)).is_some()
    }

    /// Returns the policy for an episode of this task; `task` is `None` without the grant.
    fn find(&self, task: Option<TaskId>) -> Option<&Arc<VisualWeights>> {
        match self {
            VisualPolicies::AllTasks(weights) => Some(weights),
            VisualPolicies::ByTask(policies) => {
                policies.iter().find(|(t, _)| Some(*t) == task).map(|(_, weights)| weights)
            }
        }
    }

    /// Digest of all weights files, if the policies are from files.
    fn digest(&self) -> Option<String> {
        match self {
            VisualPolicies::AllTasks(weights) => weights.digest.clone(),
            VisualPolicies::ByTask(policies) => {
                let of_task = |(task, weights): &(TaskId, Arc<VisualWeights>)| {
                    Some(format!("{task} {}", weights.digest.as_ref()?))
                };
                let digests: Option<Vec<String>> = policies.iter().map(of_task).collect();
                Some(weights::digest(digests?.join(" ").as_bytes()))
            }
        }
    }
}

/// Agent that perceives and remembers, while its caller chooses the actions.
pub(crate) struct ObservationEncoder {
    pub(crate) agent: PlanningAgent<ExternalPolicy>,
    briefing: Option<Briefing>,
    opponent: Option<OpponentTracker>,
}

impl ObservationEncoder {
    /// Creates an encoder with this perception and opponent model. Also returns the grants that it
    /// needs.
    pub(crate) fn new(
        rules: PlannerRules,
        perception: &dyn PerceptionFactory,
        opponent: Option<Arc<OpponentModel>>,
    ) -> (ObservationEncoder, Grants) {
        let behavior = opponent.as_ref().is_some_and(|model| model.is_granted());
        let grants = perception.grants(Grants { behavior, ..Grants::PLANNER });
        let opponent = opponent.map(OpponentTracker::new);
        let agent = PlanningAgent::with_watched(
            ExternalPolicy::default(),
            rules,
            perception,
            AgentId::PARTNER,
            grants,
        );
        (ObservationEncoder { agent, briefing: None, opponent }, grants)
    }

    /// Returns the sensors that every observation needs.
    pub(crate) fn sensors(&self) -> SensorConfig {
        SensorConfig { depth: true, ..self.agent.sensors() }
    }

    /// Replaces the opponent model by another one with the same grant.
    fn set_opponent(&mut self, opponent: Option<Arc<OpponentModel>>) {
        self.opponent = opponent.map(OpponentTracker::new);
    }

    pub(crate) fn reset(&mut self, briefing: &Briefing) {
        self.agent.reset(briefing);
        if let Some(opponent) = &mut self.opponent {
            opponent.reset(briefing);
        }
        self.briefing = Some(briefing.clone());
    }

    /// Processes an observation.
    pub(crate) fn observe(&mut self, observation: &Observation) {
        self.agent.observe(observation);
        let memory = self.agent.memory();
        if let (Some(opponent), Some(memory), Some(briefing)) =
            (&mut self.opponent, memory, &self.briefing)
        {
            opponent.observe(memory, briefing, self.agent.behavior());
        }
    }

    /// Returns the network's input, given the last observation and its color image; `None` before an
    /// episode.
    pub(crate) fn encode(
        &mut self,
        observation: &Observation,
        rgb: Option<&[u8]>,
    ) -> Option<VisualObservation> {
        let briefing = self.briefing.as_ref()?;
        let opponent = match (&mut self.opponent, self.agent.memory()) {
            (Some(opponent), Some(memory)) => {
                let prediction = opponent.predict(memory, briefing, self.agent.behavior());
                let nearest = visible_objects(memory, &briefing.possible_targets).next();
                let target = nearest
                    .map_or(0.0, |object| opponent.target_probability(&prediction, object.class));
                opponent_features(&prediction, target)
            }
            _ => Vec::new(),
        };
        Some(VisualObservation::new(observation, rgb, &self.agent, briefing, opponent))
    }

    /// Returns the next action of the current plan; `None` if a decision is due.
    pub(crate) fn continue_plan(&mut self, action_space: ActionSpace) -> Option<Action> {
        match action_space {
            // Without a plan, the agent lists the valid ones and halts; it has no other error.
            ActionSpace::Plans => self.agent.next_action().ok(),
            ActionSpace::Primitives => None,
        }
    }

    /// Begins the chosen plan or action, when a decision is due. Without a valid plan of the chosen
    /// kind the agent explores, as in the original; an action that cannot begin is a short wait.
    pub(crate) fn begin(&mut self, action_space: ActionSpace, action_index: usize) -> BegunAction {
        let begun = match action_space {
            ActionSpace::Primitives => {
                let briefing = self.briefing.as_ref();
                briefing.and_then(|it| resolve_primitive(action_index, &self.agent, it))
            }
            ActionSpace::Plans => {
                let chosen = resolve_plan(action_index, self.agent.policy().valid());
                let Some(plan) = chosen else {
                    let action = self.start_plan(EXPLORE).unwrap_or(PAUSE);
                    return BegunAction { action, is_invalid: true };
                };
                self.start_plan(plan)
            }
        };
        BegunAction { action: begun.unwrap_or(PAUSE), is_invalid: begun.is_none() }
    }

    /// Starts a valid plan; returns its first action, or `None` if it has none.
    fn start_plan(&mut self, index: usize) -> Option<Action> {
        self.agent.policy_mut().set_plan(index);
        self.agent.next_action().ok()
    }
}

/// Index of the plan to explore, which always is the first valid one.
const EXPLORE: usize = 0;

/// First action of a decision.
pub(crate) struct BegunAction {
    pub(crate) action: Action,
    /// True if the decision could not be carried out.
    pub(crate) is_invalid: bool,
}

/// Random stream of the decisions.
const RNG_STREAM: &str = "visual policy";

/// Helper that acts by a visual policy.
pub struct VisualHelper {
    policies: Arc<VisualPolicies>,
    encoder: ObservationEncoder,
    /// Task of the episode, if it is granted.
    task: Option<TaskId>,
    current: Option<CurrentPolicy>,
    rng: RngStream,
    /// Last primitive action; `None` if the policy chooses plans, which the agent describes.
    last_primitive: Option<&'static str>,
}

/// Policy of the current episode.
struct CurrentPolicy {
    weights: Arc<VisualWeights>,
    pass: TrainingPass,
}

impl VisualHelper {
    /// Creates a helper with this perception and the grants that it needs.
    pub fn create(
        policies: Arc<VisualPolicies>,
        rules: PlannerRules,
        perception: &dyn PerceptionFactory,
    ) -> Helper {
        let (encoder, grants) = ObservationEncoder::new(rules, perception, policies.opponent());
        let grants = Grants { task: matches!(*policies, VisualPolicies::ByTask(_)), ..grants };
        let rng = RngStream::new(0, RNG_STREAM, 0);
        let (task, current, last_primitive) = (None, None, None);
        let agent = VisualHelper { policies, encoder, task, current, rng, last_primitive };
        Helper { agent: Box::new(agent), grants }
    }
}

impl Agent for VisualHelper {
    fn sensors(&self) -> SensorConfig {
        // The environment renders before it is known whether a decision is due.
        SensorConfig { rgb: true, ..self.encoder.sensors() }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.task = briefing.disclosure.map(|disclosure| disclosure.task);
        let weights = self.policies.find(self.task);
        self.current = weights.map(|weights| {
            self.encoder.set_opponent(weights.opponent.clone());
            CurrentPolicy { weights: Arc::clone(weights), pass: weights.model.pass() }
        });
        self.encoder.reset(briefing);
        self.rng = RngStream::new(briefing.seed, RNG_STREAM, 0);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let Some(CurrentPolicy { weights, pass }) = &mut self.current else {
            return Err(AgentError::Broken(match self.task {
                Some(task) => format!(
                    "this helper has no policy for {task}; in a folder of policies it is the file \
                     {task}.{EXTENSION}"
                ),
                None => "each policy of this helper is for one task: grant the task".to_owned(),
            }));
        };
        let VisualWeights { model, parameters, .. } = &**weights;
        self.encoder.observe(observation);
        if let Some(action) = self.encoder.continue_plan(model.action_space()) {
            return Ok(action);
        }
        let rgb = observation.images.rgb.as_deref();
        let Some(encoded) = self.encoder.encode(observation, rgb) else { return Ok(PAUSE) };
        let output = model.forward(parameters, std::iter::once(&encoded), pass).remove(0);
        let action_index = ActionSelection::HELPER.select(&output, &mut self.rng);
        let action_space = model.action_space();
        let is_primitive = action_space == ActionSpace::Primitives;
        self.last_primitive = is_primitive.then(|| PRIMITIVES[action_index]);
        Ok(self.encoder.begin(action_space, action_index).action)
    }

    fn observe(&mut self, observation: &Observation) {
        self.encoder.observe(observation);
    }

    fn perception(&self) -> Option<String> {
        self.encoder.agent.perception()
    }

    fn weights(&self) -> Option<String> {
        self.policies.digest()
    }

    fn thought(&self) -> Thought {
        let thought = self.encoder.agent.thought();
        match self.last_primitive {
            Some(primitive) => Thought { plan: primitive.to_owned(), ..thought },
            None => thought,
        }
    }
}
