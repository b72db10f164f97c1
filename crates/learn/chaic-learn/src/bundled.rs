//! Helpers and partners whose trained weights are part of chaic. Their model cards are in `weights/README.md`.

use std::sync::{Arc, LazyLock};

use chaic_agents::PlannerRules;
use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_core::TaskId;
use chaic_core::observation::Grants;

use crate::loaded_policy::LoadedPolicy;
use crate::partner::policy::PartnerWeights;
use crate::visual::helper::{VisualPolicies, VisualWeights};

/// Table entry of a helper with bundled weights.
pub struct BundledHelper {
    /// Name in commands and files.
    pub name: &'static str,
    /// Description in a few words, for lists.
    pub about: &'static str,
    policy: LazyLock<LoadedPolicy>,
}

/// Content of a weights file.
macro_rules! weights_file {
    ($name:expr) => {
        &include_bytes!(concat!("../weights/", $name, ".safetensors"))[..]
    };
}

/// One policy for all tasks.
macro_rules! policy {
    ($name:literal) => {
        LazyLock::new(|| {
            LoadedPolicy::from_bytes(weights_file!($name)).expect("bundled weights are valid")
        })
    };
}

/// Visual policies, one per task, from a folder.
macro_rules! policies_by_task {
    ($folder:literal) => {
        LazyLock::new(|| {
            load_by_task([
                (TaskId::NoConstraint, weights_file!(concat!($folder, "/no_constraint"))),
                (TaskId::LowTarget, weights_file!(concat!($folder, "/low_target"))),
                (TaskId::Obstacle, weights_file!(concat!($folder, "/obstacle"))),
                (TaskId::HighTarget, weights_file!(concat!($folder, "/high_target"))),
                (TaskId::HighGoal, weights_file!(concat!($folder, "/high_goal"))),
                (TaskId::HighContainer, weights_file!(concat!($folder, "/high_container"))),
                (TaskId::Shopping, weights_file!(concat!($folder, "/shopping"))),
                (TaskId::MovingHouse, weights_file!(concat!($folder, "/moving_house"))),
            ])
        })
    };
}

fn load_by_task(files: [(TaskId, &[u8]); 8]) -> LoadedPolicy {
    let policies = files.map(|(task, bytes)| {
        (task, VisualWeights::from_bytes(bytes).expect("bundled weights are valid"))
    });
    let policies = VisualPolicies::by_task(policies).expect("their inputs are the same");
    LoadedPolicy::Visual(Arc::new(policies))
}

/// All bundled helpers.
static BUNDLED_HELPERS: [BundledHelper; 5] = [
    BundledHelper {
        name: "cloned",
        about: "network that imitates infer",
        policy: policy!("cloned"),
    },
    BundledHelper {
        name: "rl",
        about: "infer with corrections learned by PPO",
        policy: policy!("rl"),
    },
    BundledHelper {
        name: "rl_paper",
        about: "plans from images: RL baseline of the paper",
        policy: policies_by_task!("rl_paper"),
    },
    BundledHelper {
        name: "smart_help",
        about: "plans from images and a model of the partner: Smart-Help baseline of the paper",
        policy: policies_by_task!("smart_help"),
    },
    BundledHelper {
        name: "smart_help_plus",
        about: "cloned with a model of the partner",
        policy: policy!("smart_help_plus"),
    },
];

/// Table entry of a partner with bundled weights.
pub struct BundledPartner {
    /// Name in commands and files.
    pub name: &'static str,
    /// Description in a few words, for lists.
    pub about: &'static str,
    weights: LazyLock<Arc<PartnerWeights>>,
}

/// All bundled partners.
static BUNDLED_PARTNERS: [BundledPartner; 1] = [BundledPartner {
    name: "cloned",
    about: "chooses its plans by a network that imitates partners with drawn habits",
    weights: LazyLock::new(|| {
        let weights = PartnerWeights::from_bytes(weights_file!("partner"));
        Arc::new(weights.expect("bundled weights are valid"))
    }),
}];

impl BundledPartner {
    /// Returns all bundled partners.
    pub fn all() -> &'static [BundledPartner] {
        &BUNDLED_PARTNERS
    }

    /// Returns the partner with this name.
    pub fn find(name: &str) -> Option<&'static BundledPartner> {
        BUNDLED_PARTNERS.iter().find(|partner| partner.name == name)
    }

    pub(crate) fn weights(&self) -> &Arc<PartnerWeights> {
        &self.weights
    }
}

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
