//! A network that acts.

use std::sync::Arc;

use chaic_agents::policies::External;
use chaic_agents::sight::Sight;
use chaic_agents::{Mind, PlannerRules};
use chaic_core::agent::Thought;
use chaic_core::observation::{Grants, Senses};
use chaic_core::rng::Stream;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation};
use chaic_env::minds::Helper;
use chaic_nn::Pass;
use chaic_nn::weights::{self, WeightsError};

use super::network::PrimitiveNetwork;
use super::seen::Seen;
use super::{ACTIONS, PAUSE, action_of};
use crate::actor_critic::ActorCritic as _;

/// What files of weights say that they are.
pub const KIND: &str = "chaic primitive policy 1";

/// A network with its numbers.
#[derive(Clone, Debug)]
pub struct TrainedPrimitive {
    /// The network.
    pub model: PrimitiveNetwork,
    /// Its numbers.
    pub numbers: Vec<f32>,
}

impl TrainedPrimitive {
    /// The network in a file of weights.
    ///
    /// # Errors
    /// [`WeightsError`] if it isn't a whole file of such a network.
    pub fn from_bytes(bytes: &[u8]) -> Result<TrainedPrimitive, WeightsError> {
        let model = PrimitiveNetwork::default();
        let numbers = weights::from_bytes(model.network(), bytes, KIND)?;
        Ok(TrainedPrimitive { model, numbers })
    }
}

/// A mind that looks and remembers, and leaves what to do to somebody else.
pub(crate) struct Onlooker {
    pub(crate) mind: Mind<External>,
    briefing: Option<Briefing>,
}

impl Onlooker {
    /// One that sees by this, and what it is granted.
    pub(crate) fn new(rules: PlannerRules, sight: &dyn Sight) -> (Onlooker, Grants) {
        let grants = sight.grants(Grants::PLANNER);
        let who = (AgentId::PARTNER, grants);
        let mind = Mind::watching(External::default(), rules, sight, who);
        (Onlooker { mind, briefing: None }, grants)
    }

    /// What it has to see: color, too.
    pub(crate) fn senses(&self) -> Senses {
        Senses { rgb: true, depth: true, ..self.mind.senses() }
    }

    pub(crate) fn reset(&mut self, briefing: &Briefing) {
        self.mind.reset(briefing);
        self.briefing = Some(briefing.clone());
    }

    /// Takes in an observation; what a network reads of it.
    pub(crate) fn look(&mut self, observation: &Observation) -> Option<Seen> {
        self.mind.attend(observation);
        let briefing = self.briefing.as_ref()?;
        Some(Seen::of(observation, &self.mind, briefing))
    }

    /// An action of [`ACTIONS`]; `None` if it can't be begun.
    pub(crate) fn action(&self, choice: usize) -> Option<Action> {
        action_of(choice, &self.mind, self.briefing.as_ref()?)
    }
}

/// A helper that a network moves.
pub struct PrimitiveHelper {
    onlooker: Onlooker,
    trained: Arc<TrainedPrimitive>,
    pass: Pass,
    rng: Stream,
    choice: usize,
}

impl PrimitiveHelper {
    /// One that sees by this, with what it is granted.
    pub fn helper(
        trained: Arc<TrainedPrimitive>,
        rules: PlannerRules,
        sight: &dyn Sight,
    ) -> Helper {
        let (onlooker, grants) = Onlooker::new(rules, sight);
        let pass = trained.model.pass();
        let rng = Stream::new(0, "primitive policy", 0);
        let mind = PrimitiveHelper { onlooker, trained, pass, rng, choice: 0 };
        Helper { mind: Box::new(mind), grants }
    }
}

impl Agent for PrimitiveHelper {
    fn senses(&self) -> Senses {
        self.onlooker.senses()
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.onlooker.reset(briefing);
        self.rng = Stream::new(briefing.seed, "primitive policy", 0);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let Some(seen) = self.onlooker.look(observation) else { return Ok(PAUSE) };
        let TrainedPrimitive { model, numbers } = &*self.trained;
        let said = model.forward(numbers, std::iter::once(&seen), &mut self.pass).remove(0);
        self.choice = said.sample(self.rng.unit());
        Ok(self.onlooker.action(self.choice).unwrap_or(PAUSE))
    }

    fn perception(&self) -> Option<String> {
        self.onlooker.mind.perception()
    }

    fn thought(&self) -> Thought {
        Thought { plan: ACTIONS[self.choice].to_owned(), ..self.onlooker.mind.thought() }
    }
}
