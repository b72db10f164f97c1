//! Policy that chooses plans by a network.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::helpers::explore_unknown_area;
use chaic_agents::memory::Memory;
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_agents::{PlannerRules, PlanningAgent};
use chaic_core::observation::Grants;
use chaic_core::rng::RngStream;
use chaic_core::{AgentError, AgentId, Briefing, Frame, Observation};
use chaic_env::helper_registry::Helper;
use chaic_nn::TrainingPass;

use crate::actor_critic::{ActorCritic as _, ActorCriticOutput};
use crate::candidate_scorer::CandidateSet;
use crate::features::FeatureEncoder;
use crate::plan_history::may_replace;
use crate::policy_kind::PolicyWeights;

/// Creates a helper with this policy. The perception may remove some of the given grants. The
/// helper observes the partner through the perception, and explores like `infer`.
pub fn policy_helper<P: Policy>(
    policy: P,
    rules: PlannerRules,
    perception: &dyn PerceptionFactory,
    grants: Grants,
) -> Helper {
    let (grants, rules) = (perception.grants(grants), explore_unknown_area(rules));
    let agent = PlanningAgent::with_watched(policy, rules, perception, AgentId::PARTNER, grants);
    Helper { agent: Box::new(agent), grants }
}

/// Selection of an action from a distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ActionSelection {
    /// Sampled from the softmax of the logits divided by this temperature, above 0.
    Sample {
        /// 1 samples from the policy's distribution; lower values prefer probable actions.
        temperature: f32,
    },
    /// Most probable action.
    Greedy,
}

impl ActionSelection {
    /// Samples from the policy's distribution, as during training.
    pub const TRAINING: ActionSelection = ActionSelection::Sample { temperature: 1.0 };
    /// Selection of helpers in runs. On 80 validation episodes, one policy had a transport rate of
    /// 0.53 with greedy selection, and 0.50 at temperature 0.5. Greedy selection could repeat a
    /// failing attempt forever, so the temperature is low but not 0.
    pub const HELPER: ActionSelection = ActionSelection::Sample { temperature: 0.2 };

    /// Selects an action; draws from `rng` if it samples.
    pub(crate) fn select(self, output: &ActorCriticOutput, rng: &mut RngStream) -> usize {
        match self {
            ActionSelection::Sample { temperature } => output.sample_at(temperature, rng.unit()),
            ActionSelection::Greedy => output.argmax(),
        }
    }
}

/// Recorded decision.
#[derive(Clone, Debug, PartialEq)]
pub struct StepRecord {
    /// Frame of the decision.
    pub frame: Frame,
    /// Features of the decision.
    pub observation: CandidateSet,
    /// Index of the chosen candidate.
    pub action: usize,
    /// Log-probability of the chosen candidate.
    pub log_prob: f32,
    /// Value estimate.
    pub value: f32,
}

/// Recorded decisions of one episode.
pub type StepLog = Arc<Mutex<Vec<StepRecord>>>;

/// Chooses plans by a network.
#[derive(Clone)]
pub struct LearnedPolicy {
    weights: Arc<PolicyWeights>,
    selection: ActionSelection,
    log: Option<StepLog>,
    pass: TrainingPass,
    rng: RngStream,
    features: FeatureEncoder,
}

impl LearnedPolicy {
    /// Creates a policy that records its decisions in `log`, if given.
    pub fn new(
        weights: Arc<PolicyWeights>,
        selection: ActionSelection,
        log: Option<StepLog>,
    ) -> LearnedPolicy {
        let pass = weights.model.pass();
        let rng = RngStream::new(0, "plans", 0);
        let features = weights.encoder();
        LearnedPolicy { weights, selection, log, pass, rng, features }
    }

    /// Encoder of its inputs.
    pub(crate) fn features(&mut self) -> &mut FeatureEncoder {
        &mut self.features
    }

    /// Chooses and records one of several candidates, given their encoding.
    pub(crate) fn choose_among(
        &mut self,
        candidates: &[Plan],
        observation: CandidateSet,
        frame: Frame,
    ) -> Plan {
        let PolicyWeights { model, parameters, .. } = &*self.weights;
        let output =
            model.forward(parameters, std::iter::once(&observation), &mut self.pass).remove(0);
        let action = self.selection.select(&output, &mut self.rng);
        let plan = candidates[action];
        self.features.record(plan, Some(action), frame);
        if let Some(log) = &self.log {
            let record = StepRecord {
                frame,
                observation,
                action,
                log_prob: output.log_probs[action],
                value: output.value(),
            };
            log.lock().unwrap_or_else(PoisonError::into_inner).push(record);
        }
        plan
    }
}

impl Policy for LearnedPolicy {
    fn reset(&mut self, briefing: &Briefing) {
        self.rng = RngStream::new(briefing.seed, "learned policy", 0);
        self.features.reset(briefing);
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let candidates = self.features.history.candidates(valid);
        let frame = context.memory.frame;
        if let [single] = candidates[..] {
            self.features.record(single, None, frame);
            return Ok(single);
        }
        let observation = self.features.encode(context, valid, &candidates);
        Ok(self.choose_among(&candidates, observation, frame))
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        self.features.history.begin_reconsideration(context, current, has_changed)
    }

    fn supersedes(&self, new: &Plan, current: &Plan) -> bool {
        may_replace(new, current)
    }

    fn goal_place_min_top_m(&self, memory: &Memory) -> Option<f32> {
        self.features.goal_place_min_top_m(memory)
    }

    fn observe(&mut self, observation: &Observation, memory: &Memory, behavior: &BehaviorLog) {
        self.features.observe(observation, memory, behavior);
    }

    fn weights(&self) -> Option<String> {
        self.weights.digest.clone()
    }

    fn counters(&self) -> BTreeMap<String, u64> {
        let n = self.features.history.n_chosen_by_kind.iter().map(|n| u64::from(*n)).sum();
        BTreeMap::from([("choices".to_owned(), n)])
    }

    fn fork(&self) -> Option<LearnedPolicy> {
        self.log.is_none().then(|| self.clone())
    }
}
