//! Trained policies as helpers of a run, by name.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use chaic_agents::PlannerRules;
use chaic_agents::sight::Sight;
use chaic_env::minds::{Helper, Helpers, check_new_name};
use chaic_env::{EnvError, RunKey};
use chaic_files::{read_bounded, read_user_file, write_whole};
use chaic_nn::weights::{self, WeightsError};
use serde::{Deserialize, Serialize};

use crate::policy::{Choosing, LearnedPolicy, Trained, drive};
use crate::primitive::helper::{KIND, PrimitiveHelper, TrainedPrimitive};
use crate::train::from_bytes;

/// The file with the policies of a run.
pub const FILE: &str = "policies.json";
/// Neither that file nor one of weights is larger, bytes.
const MOST_BYTES: u64 = 1 << 28;

/// A policy under a name of its own.
pub struct NamedPolicy {
    name: String,
    digest: String,
    trained: Loaded,
}

/// What a file of weights has.
enum Loaded {
    /// A policy that chooses plans.
    Plans(Arc<Trained>),
    /// One that chooses single actions.
    Actions(Arc<TrainedPrimitive>),
}

impl Loaded {
    fn from_bytes(bytes: &[u8]) -> Result<Loaded, WeightsError> {
        match from_bytes(bytes) {
            Ok((_, trained)) => Ok(Loaded::Plans(Arc::new(trained))),
            Err(WeightsError::Kind { found, .. }) if found == KIND => {
                Ok(Loaded::Actions(Arc::new(TrainedPrimitive::from_bytes(bytes)?)))
            }
            Err(problem) => Err(problem),
        }
    }

    fn helper(&self, rules: PlannerRules, sight: &dyn Sight) -> Helper {
        match self {
            Loaded::Plans(trained) => {
                let policy = LearnedPolicy::new(Arc::clone(trained), Choosing::Sampled, None);
                drive(policy, rules, sight)
            }
            Loaded::Actions(trained) => PrimitiveHelper::helper(Arc::clone(trained), rules, sight),
        }
    }
}

/// What a run's folder tells of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Recorded {
    name: String,
    weights: String,
}

/// Why a policy can't be a helper.
#[derive(Debug, thiserror::Error)]
enum Refusal {
    #[error("{0}")]
    Name(String),
    #[error("{}: {problem}", path.display())]
    Weights { path: PathBuf, problem: WeightsError },
    #[error(
        "{} was begun with other weights for `{name}`; give the same file again, or choose another --out",
        run.display()
    )]
    Other { run: PathBuf, name: String },
}

impl From<Refusal> for EnvError {
    fn from(refusal: Refusal) -> EnvError {
        EnvError::Minds(refusal.into())
    }
}

impl NamedPolicy {
    /// The policy in a file of weights.
    ///
    /// # Errors
    /// If it can't be read or isn't one.
    pub fn read(name: &str, path: &Path) -> chaic_env::Result<NamedPolicy> {
        let bytes = read_user_file(path, MOST_BYTES).map_err(|e| EnvError::Minds(e.into()))?;
        let wrong = |problem| Refusal::Weights { path: path.to_owned(), problem };
        let trained = Loaded::from_bytes(&bytes).map_err(wrong)?;
        Ok(NamedPolicy { name: name.to_owned(), digest: weights::digest(&bytes), trained })
    }
}

/// Policies, besides the helpers of elsewhere.
pub struct Policies<'a> {
    policies: Vec<NamedPolicy>,
    others: &'a dyn Helpers,
    sight: Arc<dyn Sight>,
}

impl<'a> Policies<'a> {
    /// Adds policies, which see by this, to the helpers of elsewhere.
    ///
    /// # Errors
    /// If a name is none, or is taken.
    pub fn beside(
        others: &'a dyn Helpers,
        policies: Vec<NamedPolicy>,
        sight: Arc<dyn Sight>,
    ) -> chaic_env::Result<Policies<'a>> {
        let mut taken = others.names();
        for NamedPolicy { name, .. } in &policies {
            check_new_name(name, &taken, "mine=policy:FILE").map_err(Refusal::Name)?;
            taken.push(name.clone());
        }
        Ok(Policies { policies, others, sight })
    }

    fn recorded(&self) -> Vec<Recorded> {
        let recorded =
            |p: &NamedPolicy| Recorded { name: p.name.clone(), weights: p.digest.clone() };
        self.policies.iter().map(recorded).collect()
    }
}

impl Helpers for Policies<'_> {
    fn names(&self) -> Vec<String> {
        let own = self.policies.iter().map(|p| p.name.clone());
        self.others.names().into_iter().chain(own).collect()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        let Some(own) = self.policies.iter().find(|p| p.name == name) else {
            return self.others.make(name, rules);
        };
        Some(own.trained.helper(rules, &*self.sight))
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        let is_own = self.policies.iter().any(|p| p.name == key.helper);
        if is_own { self.make(&key.helper, rules) } else { self.others.make_for(key, rules) }
    }

    fn attach(&self, run: &Path) -> chaic_env::Result<()> {
        self.others.attach(run)?;
        let (path, own) = (run.join(FILE), self.recorded());
        let minds = |problem: chaic_files::FileError| EnvError::Minds(problem.into());
        if path.exists() {
            let bytes = read_bounded(&path, MOST_BYTES).map_err(minds)?;
            let begun: Vec<Recorded> = serde_json::from_slice(&bytes)
                .map_err(|e| EnvError::Minds(format!("{}: {e}", path.display()).into()))?;
            if let Some(other) = begun.into_iter().find(|b| !own.contains(b)) {
                return Err(Refusal::Other { run: run.to_owned(), name: other.name }.into());
            }
        }
        if own.is_empty() {
            return Ok(());
        }
        let text = serde_json::to_vec_pretty(&own).expect("names and digests are JSON");
        write_whole(&path, &text).map_err(minds)
    }

    fn others(&self) -> Option<&dyn Helpers> {
        Some(self.others)
    }
}
