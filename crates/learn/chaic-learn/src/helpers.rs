//! Trained policies as named helpers of a run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use chaic_agents::PlannerRules;
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_env::helper_registry::{Helper, HelperRegistry, check_new_name};
use chaic_env::{EnvError, RunKey};
use chaic_files::{read_bounded, read_user_file, write_atomically};
use chaic_nn::weights::{self, WeightsError};
use serde::{Deserialize, Serialize};

use crate::policy::{ActionSelection, LearnedPolicy, policy_helper};
use crate::policy_kind::PolicyWeights;
use crate::primitive::helper::{PrimitiveHelper, PrimitiveWeights};
use crate::primitive::network::PrimitiveNetwork;

/// File in a run's folder that lists its policies.
pub const FILE: &str = "policies.json";
/// Maximum size of that file and of a weights file, bytes.
const MAX_BYTES: u64 = 1 << 28;

/// Policy with a helper name.
pub struct NamedPolicy {
    name: String,
    digest: String,
    weights: LoadedWeights,
}

/// Content of a weights file.
enum LoadedWeights {
    /// Policy that chooses plans.
    Plans(Arc<PolicyWeights>),
    /// Policy that chooses primitive actions.
    Actions(Arc<PrimitiveWeights>),
}

impl LoadedWeights {
    fn from_bytes(bytes: &[u8]) -> Result<LoadedWeights, WeightsError> {
        if PrimitiveNetwork::from_kind(&weights::kind(bytes)?).is_some() {
            return Ok(LoadedWeights::Actions(Arc::new(PrimitiveWeights::from_bytes(bytes)?)));
        }
        Ok(LoadedWeights::Plans(Arc::new(PolicyWeights::from_bytes(bytes)?)))
    }

    fn helper(&self, rules: PlannerRules, perception: &dyn PerceptionFactory) -> Helper {
        match self {
            LoadedWeights::Plans(weights) => {
                let policy = LearnedPolicy::new(Arc::clone(weights), ActionSelection::HELPER, None);
                policy_helper(policy, rules, perception, weights.grants())
            }
            LoadedWeights::Actions(weights) => {
                PrimitiveHelper::create(Arc::clone(weights), rules, perception)
            }
        }
    }
}

/// Entry of a run's list of policies.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PolicyRecord {
    name: String,
    weights: String,
}

/// Reason why a policy cannot be a helper.
#[derive(Debug, thiserror::Error)]
enum PolicyError {
    #[error("{0}")]
    Name(String),
    #[error("{}: {problem}", path.display())]
    Weights { path: PathBuf, problem: WeightsError },
    #[error(
        "{} was started with other weights for `{name}`; give the same file or choose another --out",
        run.display()
    )]
    OtherWeights { run: PathBuf, name: String },
}

impl From<PolicyError> for EnvError {
    fn from(error: PolicyError) -> EnvError {
        EnvError::Registry(error.into())
    }
}

impl NamedPolicy {
    /// Reads a policy from a weights file.
    ///
    /// # Errors
    /// If the file cannot be read or holds no policy.
    pub fn read(name: &str, path: &Path) -> chaic_env::Result<NamedPolicy> {
        let bytes = read_user_file(path, MAX_BYTES).map_err(|e| EnvError::Registry(e.into()))?;
        let weights_error = |problem| PolicyError::Weights { path: path.to_owned(), problem };
        let weights = LoadedWeights::from_bytes(&bytes).map_err(weights_error)?;
        Ok(NamedPolicy { name: name.to_owned(), digest: weights::digest(&bytes), weights })
    }
}

/// Registry of policies, with another registry as fallback.
pub struct PolicyRegistry<'a> {
    policies: Vec<NamedPolicy>,
    fallback: &'a dyn HelperRegistry,
    perception: Arc<dyn PerceptionFactory>,
}

impl<'a> PolicyRegistry<'a> {
    /// Adds policies with this perception to the helpers of another registry.
    ///
    /// # Errors
    /// If a name is invalid or taken.
    pub fn with_fallback(
        fallback: &'a dyn HelperRegistry,
        policies: Vec<NamedPolicy>,
        perception: Arc<dyn PerceptionFactory>,
    ) -> chaic_env::Result<PolicyRegistry<'a>> {
        let mut taken = fallback.names();
        for NamedPolicy { name, .. } in &policies {
            check_new_name(name, &taken, "mine=policy:FILE").map_err(PolicyError::Name)?;
            taken.push(name.clone());
        }
        Ok(PolicyRegistry { policies, fallback, perception })
    }

    fn records(&self) -> Vec<PolicyRecord> {
        let record =
            |p: &NamedPolicy| PolicyRecord { name: p.name.clone(), weights: p.digest.clone() };
        self.policies.iter().map(record).collect()
    }
}

impl HelperRegistry for PolicyRegistry<'_> {
    fn names(&self) -> Vec<String> {
        let policies = self.policies.iter().map(|p| p.name.clone());
        self.fallback.names().into_iter().chain(policies).collect()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        let Some(policy) = self.policies.iter().find(|p| p.name == name) else {
            return self.fallback.make(name, rules);
        };
        Some(policy.weights.helper(rules, &*self.perception))
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        let is_policy = self.policies.iter().any(|p| p.name == key.helper);
        if is_policy { self.make(&key.helper, rules) } else { self.fallback.make_for(key, rules) }
    }

    fn attach_run(&self, run: &Path) -> chaic_env::Result<()> {
        self.fallback.attach_run(run)?;
        let (path, records) = (run.join(FILE), self.records());
        let registry_error = |problem: chaic_files::FileError| EnvError::Registry(problem.into());
        if path.exists() {
            let bytes = read_bounded(&path, MAX_BYTES).map_err(registry_error)?;
            let earlier: Vec<PolicyRecord> = serde_json::from_slice(&bytes)
                .map_err(|e| EnvError::Registry(format!("{}: {e}", path.display()).into()))?;
            if let Some(changed) = earlier.into_iter().find(|r| !records.contains(r)) {
                return Err(
                    PolicyError::OtherWeights { run: run.to_owned(), name: changed.name }.into()
                );
            }
        }
        if records.is_empty() {
            return Ok(());
        }
        let text =
            serde_json::to_vec_pretty(&records).expect("names and digests serialize to JSON");
        write_atomically(&path, &text).map_err(registry_error)
    }

    fn fallback(&self) -> Option<&dyn HelperRegistry> {
        Some(self.fallback)
    }
}
