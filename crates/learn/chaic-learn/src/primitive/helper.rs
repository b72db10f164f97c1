//! Agent that takes primitive actions by a network.

use std::sync::Arc;

use chaic_agents::perception_factory::PerceptionFactory;
use chaic_agents::policies::ExternalPolicy;
use chaic_agents::{PlannerRules, PlanningAgent};
use chaic_core::agent::Thought;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::rng::RngStream;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation, TaskId};
use chaic_env::helper_registry::Helper;
use chaic_nn::Pass;
use chaic_nn::weights::{self, WeightsError};

use super::network::PrimitiveNetwork;
use super::observation::{PrimitiveObservation, opponent_features};
use super::{ACTIONS, PAUSE, resolve_action, visible_objects};
use crate::actor_critic::ActorCritic as _;
use crate::opponent::network::{OpponentInput, OpponentModel};
use crate::opponent::tracker::OpponentTracker;

/// Network with parameter values.
#[derive(Clone, Debug)]
pub struct PrimitiveWeights {
    /// Network architecture.
    pub model: PrimitiveNetwork,
    /// Parameters, with those of the opponent model.
    pub parameters: Vec<f32>,
    /// Opponent model whose predictions are inputs, if the network has such inputs.
    pub opponent: Option<Arc<OpponentModel>>,
    /// Digest of the weights file, if they are from one.
    pub digest: Option<String>,
}

impl PrimitiveWeights {
    /// Combines a network with parameters, which include those of its opponent model.
    pub fn new(model: &PrimitiveNetwork, parameters: Vec<f32>) -> PrimitiveWeights {
        let opponent = model.opponent(&parameters).map(Arc::new);
        PrimitiveWeights { model: model.clone(), parameters, opponent, digest: None }
    }

    /// Parses a weights file.
    ///
    /// # Errors
    /// [`WeightsError`] if the file is incomplete or belongs to another network.
    pub fn from_bytes(bytes: &[u8]) -> Result<PrimitiveWeights, WeightsError> {
        let kind = weights::kind(bytes)?;
        let model = PrimitiveNetwork::from_kind(&kind);
        let model = model.unwrap_or_else(|| PrimitiveNetwork::new(OpponentInput::None));
        let parameters = weights::from_bytes(model.network(), bytes, &model.kind())?;
        let digest = Some(weights::digest(bytes));
        Ok(PrimitiveWeights { digest, ..PrimitiveWeights::new(&model, parameters) })
    }
}

/// Policies of primitive actions that play as one helper.
#[derive(Clone, Debug)]
pub enum PrimitivePolicies {
    /// One policy for all tasks.
    AllTasks(Arc<PrimitiveWeights>),
    /// One policy per task, all with the same inputs. The helper is granted the task, which selects
    /// its policy.
    ByTask(Vec<(TaskId, Arc<PrimitiveWeights>)>),
}

impl PrimitivePolicies {
    /// Combines policies of single tasks.
    ///
    /// # Errors
    /// The first task whose policy has other inputs than that of the first one.
    pub fn by_task(
        policies: impl IntoIterator<Item = (TaskId, PrimitiveWeights)>,
    ) -> Result<PrimitivePolicies, TaskId> {
        let policies: Vec<(TaskId, Arc<PrimitiveWeights>)> =
            policies.into_iter().map(|(task, weights)| (task, Arc::new(weights))).collect();
        let kinds = || policies.iter().map(|(task, weights)| (task, weights.model.kind()));
        match kinds().zip(kinds().skip(1)).find(|((_, before), (_, kind))| kind != before) {
            Some((_, (task, _))) => Err(*task),
            None => Ok(PrimitivePolicies::ByTask(policies)),
        }
    }

    /// Returns the opponent model of one of the policies; all need the same grants.
    fn opponent(&self) -> Option<Arc<OpponentModel>> {
        let any = match self {
            PrimitivePolicies::AllTasks(weights) => Some(weights),
            PrimitivePolicies::ByTask(policies) => policies.first().map(|(_, weights)| weights),
        };
        any.and_then(|weights| weights.opponent.clone())
    }

    /// Returns the policy for an episode of this task, which is unknown without the grant.
    fn find(&self, task: Option<TaskId>) -> Option<&Arc<PrimitiveWeights>> {
        match self {
            PrimitivePolicies::AllTasks(weights) => Some(weights),
            PrimitivePolicies::ByTask(policies) => {
                policies.iter().find(|(t, _)| Some(*t) == task).map(|(_, weights)| weights)
            }
        }
    }

    /// Digest of all weights files, if the policies are from files.
    fn digest(&self) -> Option<String> {
        match self {
            PrimitivePolicies::AllTasks(weights) => weights.digest.clone(),
            PrimitivePolicies::ByTask(policies) => {
                let of_task = |(task, weights): &(TaskId, Arc<PrimitiveWeights>)| {
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
    /// Creates an encoder with this perception and opponent model; returns its grants too.
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

    /// Returns the sensors, which include color and depth.
    pub(crate) fn sensors(&self) -> SensorConfig {
        SensorConfig { rgb: true, depth: true, ..self.agent.sensors() }
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

    /// Processes an observation; returns the network's input.
    pub(crate) fn encode(&mut self, observation: &Observation) -> Option<PrimitiveObservation> {
        self.agent.observe(observation);
        let briefing = self.briefing.as_ref()?;
        let opponent = match (&mut self.opponent, self.agent.memory()) {
            (Some(opponent), Some(memory)) => {
                opponent.observe(memory, briefing);
                let prediction = opponent.predict(memory, briefing, self.agent.behavior());
                let nearest = visible_objects(memory, &briefing.possible_targets).next();
                let target = nearest
                    .map_or(0.0, |object| opponent.target_probability(&prediction, object.class));
                opponent_features(&prediction, target)
            }
            _ => Vec::new(),
        };
        Some(PrimitiveObservation::new(observation, &self.agent, briefing, opponent))
    }

    /// Returns an action of [`ACTIONS`]; `None` if it cannot begin.
    pub(crate) fn action(&self, action_index: usize) -> Option<Action> {
        resolve_action(action_index, &self.agent, self.briefing.as_ref()?)
    }
}

/// Helper that takes primitive actions by a network.
pub struct PrimitiveHelper {
    policies: Arc<PrimitivePolicies>,
    encoder: ObservationEncoder,
    current: Option<CurrentPolicy>,
    rng: RngStream,
    last_action: usize,
}

/// Policy of the current episode.
struct CurrentPolicy {
    weights: Arc<PrimitiveWeights>,
    pass: Pass,
}

impl PrimitiveHelper {
    /// Creates a helper with this perception and the grants that it needs.
    pub fn create(
        policies: Arc<PrimitivePolicies>,
        rules: PlannerRules,
        perception: &dyn PerceptionFactory,
    ) -> Helper {
        let (encoder, grants) = ObservationEncoder::new(rules, perception, policies.opponent());
        let grants = Grants { task: matches!(*policies, PrimitivePolicies::ByTask(_)), ..grants };
        let rng = RngStream::new(0, "primitive policy", 0);
        let agent = PrimitiveHelper { policies, encoder, current: None, rng, last_action: 0 };
        Helper { agent: Box::new(agent), grants }
    }
}

impl Agent for PrimitiveHelper {
    fn sensors(&self) -> SensorConfig {
        self.encoder.sensors()
    }

    fn reset(&mut self, briefing: &Briefing) {
        let weights = self.policies.find(briefing.disclosure.map(|disclosure| disclosure.task));
        self.current = weights.map(|weights| {
            self.encoder.set_opponent(weights.opponent.clone());
            CurrentPolicy { weights: Arc::clone(weights), pass: weights.model.pass() }
        });
        self.encoder.reset(briefing);
        self.rng = RngStream::new(briefing.seed, "primitive policy", 0);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let Some(CurrentPolicy { weights, pass }) = &mut self.current else {
            let problem = "each policy of this helper is for one task: grant the task, and play one \
                           that has a policy";
            return Err(AgentError::Broken(problem.to_owned()));
        };
        let Some(encoded) = self.encoder.encode(observation) else { return Ok(PAUSE) };
        let PrimitiveWeights { model, parameters, .. } = &**weights;
        let output = model.forward(parameters, std::iter::once(&encoded), pass).remove(0);
        self.last_action = output.sample(self.rng.unit());
        Ok(self.encoder.action(self.last_action).unwrap_or(PAUSE))
    }

    fn perception(&self) -> Option<String> {
        self.encoder.agent.perception()
    }

    fn weights(&self) -> Option<String> {
        self.policies.digest()
    }

    fn thought(&self) -> Thought {
        Thought { plan: ACTIONS[self.last_action].to_owned(), ..self.encoder.agent.thought() }
    }
}
