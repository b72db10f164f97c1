//! Policy of either kind, from weights files.

use std::sync::Arc;

use chaic_agents::PlannerRules;
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_env::helper_registry::Helper;
use chaic_nn::weights::{self, WeightsError};

use crate::policy::{ActionSelection, LearnedPolicy, policy_helper};
use crate::policy_kind::PolicyWeights;
use crate::primitive::helper::{PrimitiveHelper, PrimitivePolicies, PrimitiveWeights};
use crate::primitive::network::PrimitiveNetwork;

/// Policy from one or more weights files.
pub(crate) enum LoadedPolicy {
    /// Policy that chooses plans.
    Plans(Arc<PolicyWeights>),
    /// Policies that choose primitive actions.
    Actions(Arc<PrimitivePolicies>),
}

impl LoadedPolicy {
    /// Parses the weights of a policy for all tasks.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Result<LoadedPolicy, WeightsError> {
        if PrimitiveNetwork::from_kind(&weights::kind(bytes)?).is_some() {
            let weights = PrimitiveWeights::from_bytes(bytes)?;
            return Ok(LoadedPolicy::Actions(Arc::new(PrimitivePolicies::AllTasks(Arc::new(
                weights,
            )))));
        }
        Ok(LoadedPolicy::Plans(Arc::new(PolicyWeights::from_bytes(bytes)?)))
    }

    /// Creates a helper with this policy.
    pub(crate) fn helper(&self, rules: PlannerRules, perception: &dyn PerceptionFactory) -> Helper {
        match self {
            LoadedPolicy::Plans(weights) => {
                let policy = LearnedPolicy::new(Arc::clone(weights), ActionSelection::HELPER, None);
                policy_helper(policy, rules, perception, weights.grants())
            }
            LoadedPolicy::Actions(policies) => {
                PrimitiveHelper::create(Arc::clone(policies), rules, perception)
            }
        }
    }
}
