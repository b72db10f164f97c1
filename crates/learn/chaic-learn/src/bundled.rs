//! Helpers whose trained weights are part of chaic. Their model cards are in `weights/README.md`.

use std::sync::LazyLock;

use chaic_agents::PlannerRules;
use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_core::observation::Grants;

use crate::loaded_policy::LoadedPolicy;

/// Table entry of a helper with bundled weights.
pub struct BundledHelper {
    /// Name in commands and files.
    pub name: &'static str,
    /// Description in a few words, for lists.
    pub about: &'static str,
    policy: LazyLock<LoadedPolicy>,
}

/// Content of the weights file of a policy for all tasks.
macro_rules! policy {
    ($file:literal) => {
        LazyLock::new(|| {
            let bytes = include_bytes!(concat!("../weights/", $file, ".safetensors"));
            LoadedPolicy::from_bytes(bytes).expect("bundled weights are valid")
        })
    };
}

/// All bundled helpers.
static BUNDLED_HELPERS: [BundledHelper; 1] = [BundledHelper {
    name: "cloned",
    about: "network that imitates infer",
    policy: policy!("cloned"),
}];

impl BundledHelper {
    /// Returns all bundled helpers.
    pub fn all() -> &'static [BundledHelper] {
        &BUNDLED_HELPERS
    }

    /// Returns the helper with this name.
    pub fn find(name: &str) -> Option<&'static BundledHelper> {
        BUNDLED_HELPERS.iter().find(|helper| helper.name == name)
    }

    /// Returns the grants that the helper requests with ground-truth perception.
    pub fn grants(&self) -> Grants {
        self.policy.helper(PlannerRules::paper(), &GroundTruthPerceptionFactory).grants
    }

    pub(crate) fn policy(&self) -> &LoadedPolicy {
        &self.policy
    }
}
