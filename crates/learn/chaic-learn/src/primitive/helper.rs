//! Agent that takes primitive actions by a network.

use std::sync::Arc;

use chaic_agents::perception_factory::PerceptionFactory;
use chaic_agents::policies::ExternalPolicy;
use chaic_agents::{PlannerRules, PlanningAgent};
use chaic_core::agent::Thought;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::rng::RngStream;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation};
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
}

impl PrimitiveWeights {
    /// Combines a network with parameters, which include those of its opponent model.
    pub fn new(model: &PrimitiveNetwork, parameters: Vec<f32>) -> PrimitiveWeights {
        let opponent = model.opponent(&parameters).map(Arc::new);
        PrimitiveWeights { model: model.clone(), parameters, opponent }
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
        Ok(PrimitiveWeights::new(&model, parameters))
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
    encoder: ObservationEncoder,
    weights: Arc<PrimitiveWeights>,
    pass: Pass,
    rng: RngStream,
    last_action: usize,
}

impl PrimitiveHelper {
    /// Creates a helper with this perception and the grants that it needs.
    pub fn create(
        weights: Arc<PrimitiveWeights>,
        rules: PlannerRules,
        perception: &dyn PerceptionFactory,
    ) -> Helper {
        let (encoder, grants) =
            ObservationEncoder::new(rules, perception, weights.opponent.clone());
        let pass = weights.model.pass();
        let rng = RngStream::new(0, "primitive policy", 0);
        let agent = PrimitiveHelper { encoder, weights, pass, rng, last_action: 0 };
        Helper { agent: Box::new(agent), grants }
    }
}

impl Agent for PrimitiveHelper {
    fn sensors(&self) -> SensorConfig {
        self.encoder.sensors()
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.encoder.reset(briefing);
        self.rng = RngStream::new(briefing.seed, "primitive policy", 0);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let Some(encoded) = self.encoder.encode(observation) else { return Ok(PAUSE) };
        let PrimitiveWeights { model, parameters, .. } = &*self.weights;
        let output = model.forward(parameters, std::iter::once(&encoded), &mut self.pass).remove(0);
        self.last_action = output.sample(self.rng.unit());
        Ok(self.encoder.action(self.last_action).unwrap_or(PAUSE))
    }

    fn perception(&self) -> Option<String> {
        self.encoder.agent.perception()
    }

    fn thought(&self) -> Thought {
        Thought { plan: ACTIONS[self.last_action].to_owned(), ..self.encoder.agent.thought() }
    }
}
