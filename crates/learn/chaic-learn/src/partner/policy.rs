//! Partner whose plans a network chooses.

use std::sync::Arc;

use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::{PlannerRules, PlanningAgent, partner_grants};
use chaic_core::rng::RngStream;
use chaic_core::{AgentError, Briefing};
use chaic_env::helper_registry::Helper;
use chaic_nn::Pass;
use chaic_nn::weights::{self, WeightsError};

use super::features::{N_PARTNER_PLAN, N_PARTNER_STATE, PartnerEncoder};
use crate::actor_critic::ActorCritic as _;
use crate::candidate_scorer::{CandidateScorer, CandidateSet};
use crate::policy::ActionSelection;

/// Kind of network in weights files.
pub const PARTNER_KIND: &str = "chaic partner policy 1";
/// Width of the hidden layers.
const WIDTH: usize = 48;

/// Returns the network architecture of a partner's policy.
pub fn partner_network() -> CandidateScorer {
    CandidateScorer::new(N_PARTNER_STATE, N_PARTNER_PLAN, WIDTH, 1)
}

/// Network of a partner's policy with parameter values.
#[derive(Clone, Debug)]
pub struct PartnerWeights {
    /// Network architecture.
    pub model: CandidateScorer,
    /// Parameters.
    pub parameters: Vec<f32>,
    /// Digest of the weights file.
    pub digest: String,
}

impl PartnerWeights {
    /// Parses a weights file.
    ///
    /// # Errors
    /// [`WeightsError`] if the file is incomplete or belongs to another network.
    pub fn from_bytes(bytes: &[u8]) -> Result<PartnerWeights, WeightsError> {
        let model = partner_network();
        let parameters = weights::from_bytes(&model.network, bytes, PARTNER_KIND)?;
        Ok(PartnerWeights { model, parameters, digest: weights::digest(bytes) })
    }

    /// Creates a partner that samples its plans from the distribution that it learned.
    pub fn partner(self: &Arc<Self>, rules: PlannerRules) -> Helper {
        let policy = LearnedPartnerPolicy::new(Arc::clone(self), ActionSelection::TRAINING);
        let agent = Box::new(PlanningAgent::new(policy, rules));
        Helper { agent, grants: partner_grants(rules) }
    }
}

/// Chooses a partner's plans by a network. Choices are due as for the rules.
#[derive(Clone)]
pub struct LearnedPartnerPolicy {
    weights: Arc<PartnerWeights>,
    selection: ActionSelection,
    pass: Pass,
    rng: RngStream,
    encoder: PartnerEncoder,
}

impl LearnedPartnerPolicy {
    /// Creates a policy.
    pub fn new(weights: Arc<PartnerWeights>, selection: ActionSelection) -> LearnedPartnerPolicy {
        LearnedPartnerPolicy {
            pass: weights.model.pass(),
            weights,
            selection,
            rng: RngStream::new(0, "learned partner", 0),
            encoder: PartnerEncoder::default(),
        }
    }

    fn choose_among(&mut self, observation: &CandidateSet) -> usize {
        let PartnerWeights { model, parameters, .. } = &*self.weights;
        let outputs = model.forward(parameters, std::iter::once(observation), &mut self.pass);
        self.selection.select(&outputs[0], &mut self.rng)
    }
}

impl Policy for LearnedPartnerPolicy {
    fn reset(&mut self, briefing: &Briefing) {
        self.rng = RngStream::new(briefing.seed, "learned partner", 0);
        self.encoder = PartnerEncoder::default();
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let candidates = self.encoder.candidates(valid);
        let plan = match candidates[..] {
            [single] => single,
            _ => candidates[self.choose_among(&self.encoder.encode(context, &candidates))],
        };
        self.encoder.record(plan, context.memory.frame);
        Ok(plan)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        let interval = context.memory.rules.time.replan_interval_frames;
        let is_due = match current {
            Plan::Deliver | Plan::PutIn | Plan::LiftWith(_) | Plan::TurnAround => false,
            _ => has_changed || context.memory.frame >= self.encoder.last_frame() + interval,
        };
        self.encoder.set_reconsidered(is_due.then_some(*current));
        is_due
    }

    fn weights(&self) -> Option<String> {
        Some(self.weights.digest.clone())
    }

    fn fork(&self) -> Option<LearnedPartnerPolicy> {
        Some(self.clone())
    }
}
