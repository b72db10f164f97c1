//! Policy loaded from weights files: it chooses among plans, or it reads images.

use std::sync::Arc;

use chaic_agents::PlannerRules;
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_core::TaskId;
use chaic_env::helper_registry::Helper;
use chaic_nn::weights::{self, WeightsError};

use crate::opponent::network::OpponentModel;
use crate::policy::{ActionSelection, LearnedPolicy, policy_helper};
use crate::policy_kind::PolicyWeights;
use crate::visual::helper::{VisualHelper, VisualPolicies, VisualWeights};
use crate::visual::network::VisualNetwork;

/// Policy from one or more weights files.
pub(crate) enum LoadedPolicy {
    /// Policy that chooses among the valid plans.
    Plans(Arc<PolicyWeights>),
    /// Policies that read images.
    Visual(Arc<VisualPolicies>),
}

impl LoadedPolicy {
    /// Parses the weights of a policy for all tasks.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Result<LoadedPolicy, WeightsError> {
        if VisualNetwork::from_kind(&weights::kind(bytes)?).is_some() {
            let weights = VisualWeights::from_bytes(bytes)?;
            return Ok(LoadedPolicy::Visual(Arc::new(VisualPolicies::AllTasks(Arc::new(weights)))));
        }
        Ok(LoadedPolicy::Plans(Arc::new(PolicyWeights::from_bytes(bytes)?)))
    }

    /// Returns whether the policy can play a task.
    pub(crate) fn plays(&self, task: TaskId) -> bool {
        match self {
            LoadedPolicy::Plans(_) => true,
            LoadedPolicy::Visual(policies) => policies.plays(task),
        }
    }

    /// Returns its opponent model, if it has one.
    pub(crate) fn opponent(&self) -> Option<Arc<OpponentModel>> {
        match self {
            LoadedPolicy::Plans(weights) => weights.opponent.clone(),
            LoadedPolicy::Visual(policies) => policies.opponent(),
        }
    }

    /// Creates a helper with this policy.
    pub(crate) fn helper(&self, rules: PlannerRules, perception: &dyn PerceptionFactory) -> Helper {
        match self {
            LoadedPolicy::Plans(weights) => {
                let policy = LearnedPolicy::new(Arc::clone(weights), ActionSelection::HELPER, None);
                policy_helper(policy, rules, perception, weights.grants())
            }
            LoadedPolicy::Visual(policies) => {
                VisualHelper::create(Arc::clone(policies), rules, perception)
            }
        }
    }
}
