//! Partner whose plans a network chooses.

use std::sync::Arc;

use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::{PlannerRules, PlanningAgent, partner_grants};
use chaic_core::rng::RngStream;
use chaic_core::{AgentError, Briefing};
use chaic_env::helper_registry::Helper;
use chaic_nn::TrainingPass;
use chaic_nn::weights::{self, WeightsError};

use super::features::{N_PARTNER_PLAN_FEATURES, N_PARTNER_STATE_FEATURES, PartnerEncoder};
use crate::actor_critic::ActorCritic as _;
use crate::candidate_scorer::{CandidateScorer, CandidateSet};
use crate::policy::ActionSelection;

/// Kind of network in weights files.
pub const PARTNER_KIND: &str = "chaic partner policy 1";
/// Width of the hidden layers.
const WIDTH: usize = 48;

/// Returns the network architecture of a partner's policy.
pub fn partner_network() -> CandidateScorer {
    CandidateScorer::new(N_PARTNER_STATE_FEATURES, N_PARTNER_PLAN_FEATURES, WIDTH, 1)
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

/// Chooses a partner's plans by a network. Choices are due as for a rule-based partner.
#[derive(Clone)]
pub struct LearnedPartnerPolicy {
    weights: Arc<PartnerWeights>,
    selection: ActionSelection,
    pass: TrainingPass,
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
        let rules = context.memory.rules;
        let interval = rules.time.replan_interval_frames;
        let is_due = match current {
            _ if !rules.replans => false,
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

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_agents::behavior::BehaviorLog;
    use chaic_agents::memory::Memory;
    use chaic_core::AgentId;
    use chaic_env::{Env, EpisodeAgents, EpisodeConfig};
    use chaic_episodes::find_episode;

    #[test]
    fn an_unfinished_plan_is_reconsidered_if_the_rules_replan() {
        let episode = find_episode("low_target/gen/40000001").unwrap();
        let config = EpisodeConfig::new(&episode, "none");
        let env = Env::new(config, EpisodeAgents::new(None, None)).unwrap();
        let briefing = env.briefing(AgentId::PARTNER);
        let model = partner_network();
        let parameters = model.network.init_parameters(1);
        let weights = Arc::new(PartnerWeights { model, parameters, digest: String::new() });
        let behavior = BehaviorLog::default();
        for replans in [true, false] {
            let rules = PlannerRules { replans, ..PlannerRules::paper() };
            let mut memory = Memory::new(&briefing, rules);
            let mut policy =
                LearnedPartnerPolicy::new(Arc::clone(&weights), ActionSelection::Greedy);
            for (plan, frame, has_changed, is_due) in [
                (Plan::Explore, 39, false, false),
                (Plan::Explore, 39, true, replans),
                (Plan::Explore, 40, false, replans),
                (Plan::Deliver, 40, true, false),
            ] {
                memory.frame = frame;
                let (briefing, memory) = (&briefing, &memory);
                let context = Context { briefing, memory, behavior: &behavior, is_explored: false };
                let found = policy.reconsiders(&context, &plan, has_changed);
                assert_eq!(found, is_due, "{plan:?} at {frame}, {has_changed}, {replans}");
                assert_eq!(policy.encoder.reconsidered(), is_due.then_some(plan));
            }
        }
    }
}
