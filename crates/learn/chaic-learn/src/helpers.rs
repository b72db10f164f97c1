//! Trained policies as named helpers and partners of a run.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use chaic_agents::PlannerRules;
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_core::TaskId;
use chaic_env::helper_registry::{Helper, HelperRegistry, POLICY, check_new_name};
use chaic_env::{EnvError, RunKey};
use chaic_files::{EntryKind, FileError, kind, read_user_file};
use chaic_nn::weights::WeightsError;

use crate::bundled::{BundledHelper, BundledPartner};
use crate::loaded_policy::LoadedPolicy;
use crate::partner::policy::PartnerWeights;
use crate::visual::helper::{EXTENSION, VisualPolicies, VisualWeights};

/// Maximum size of a weights file, bytes.
const MAX_BYTES: u64 = 1 << 28;

/// Policy with a helper name.
pub struct NamedPolicy {
    name: String,
    /// Weights file, or folder with one per task.
    path: PathBuf,
    policy: LoadedPolicy,
}

/// Reason why a policy cannot be a helper.
#[derive(Debug, thiserror::Error)]
enum PolicyError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{}: {problem}", path.display())]
    Weights { path: PathBuf, problem: WeightsError },
    #[error(
        "{} has no weights file of a task, such as {}.{EXTENSION}",
        path.display(),
        TaskId::NoConstraint
    )]
    EmptyFolder { path: PathBuf },
    #[error("{}: other inputs or actions than the policies of other tasks in this folder", path.display())]
    OtherInputs { path: PathBuf },
}

impl From<PolicyError> for EnvError {
    fn from(error: PolicyError) -> EnvError {
        EnvError::Registry(error.into())
    }
}

impl NamedPolicy {
    /// Reads a policy from a weights file, or visual policies from a folder with one
    /// file per task, `TASK.safetensors`.
    ///
    /// # Errors
    /// If a file cannot be read or holds no policy; if the folder has no such file.
    pub fn read(name: &str, path: &Path) -> chaic_env::Result<NamedPolicy> {
        let is_folder = fs::metadata(path).is_ok_and(|metadata| metadata.is_dir());
        let policy = if is_folder {
            LoadedPolicy::Visual(Arc::new(read_folder(path)?))
        } else {
            let bytes = read_user_file(path, MAX_BYTES).map_err(PolicyError::from)?;
            let weights_error = |problem| PolicyError::Weights { path: path.to_owned(), problem };
            LoadedPolicy::from_bytes(&bytes).map_err(weights_error)?
        };
        Ok(NamedPolicy { name: name.to_owned(), path: path.to_owned(), policy })
    }
}

/// Trained policy of a partner.
pub struct PartnerPolicy {
    name: String,
    weights: Arc<PartnerWeights>,
}

impl PartnerPolicy {
    /// Reads the policy of a partner from a weights file.
    ///
    /// # Errors
    /// If the file cannot be read or holds no policy of a partner.
    pub fn read(path: &Path) -> chaic_env::Result<PartnerPolicy> {
        let bytes = read_user_file(path, MAX_BYTES).map_err(PolicyError::from)?;
        let weights_error = |problem| PolicyError::Weights { path: path.to_owned(), problem };
        let weights = PartnerWeights::from_bytes(&bytes).map_err(weights_error)?;
        let name = format!("{POLICY}{}", weights.digest);
        Ok(PartnerPolicy { name, weights: Arc::new(weights) })
    }

    /// Name of the partner in runs: `policy:` and the digest of its weights.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// Reads one visual policy per task.
fn read_folder(folder: &Path) -> Result<VisualPolicies, PolicyError> {
    let path_of = |task: TaskId| folder.join(format!("{task}.{EXTENSION}"));
    let mut policies = Vec::new();
    for task in TaskId::all() {
        let path = path_of(task);
        if kind(&path)? == EntryKind::Missing {
            continue;
        }
        let bytes = read_user_file(&path, MAX_BYTES)?;
        let weights = VisualWeights::from_bytes(&bytes);
        policies.push((task, weights.map_err(|problem| PolicyError::Weights { path, problem })?));
    }
    if policies.is_empty() {
        return Err(PolicyError::EmptyFolder { path: folder.to_owned() });
    }
    VisualPolicies::by_task(policies)
        .map_err(|task| PolicyError::OtherInputs { path: path_of(task) })
}

/// Registry of bundled and given policies, with another registry as fallback.
pub struct PolicyRegistry<'a> {
    policies: Vec<NamedPolicy>,
    partners: &'a [PartnerPolicy],
    fallback: &'a dyn HelperRegistry,
    perception: Arc<dyn PerceptionFactory>,
}

impl<'a> PolicyRegistry<'a> {
    /// Adds the bundled helpers with this perception to the helpers of another registry.
    pub fn bundled(
        fallback: &'a dyn HelperRegistry,
        perception: Arc<dyn PerceptionFactory>,
    ) -> PolicyRegistry<'a> {
        PolicyRegistry { policies: Vec::new(), partners: &[], fallback, perception }
    }

    /// Adds policies as partners.
    pub fn with_partners(self, partners: &'a [PartnerPolicy]) -> PolicyRegistry<'a> {
        PolicyRegistry { partners, ..self }
    }

    /// Adds policies as helpers.
    ///
    /// # Errors
    /// If a name is invalid or taken.
    pub fn with_policies(
        self,
        policies: Vec<NamedPolicy>,
    ) -> chaic_env::Result<PolicyRegistry<'a>> {
        let mut taken = self.names();
        for NamedPolicy { name, .. } in &policies {
            check_new_name(name, &taken, "mine=policy:FILE")
                .map_err(|problem| EnvError::HelperName { problem })?;
            taken.push(name.clone());
        }
        Ok(PolicyRegistry { policies, ..self })
    }

    fn given(&self, name: &str) -> Option<&NamedPolicy> {
        self.policies.iter().find(|p| p.name == name)
    }

    fn policy(&self, name: &str) -> Option<&LoadedPolicy> {
        let given = self.given(name).map(|p| &p.policy);
        given.or_else(|| BundledHelper::find(name).map(BundledHelper::policy))
    }

    /// Checks that a helper's opponent model, if it has one, gets the inputs on which it was trained.
    ///
    /// # Errors
    /// One line, if the perception withholds the partner's actions that the model needs.
    pub fn check_perception(&self, name: &str) -> Result<(), String> {
        let opponent = self.policy(name).and_then(LoadedPolicy::opponent);
        if opponent.is_none_or(|model| model.fits(&*self.perception)) {
            return Ok(());
        }
        let file = self.given(name).map(|given| format!(" ({})", given.path.display()));
        Err(format!(
            "`{name}`{} has an opponent model that was trained with the grant `behavior`, which learned \
             behavior replaces; select behavior `gt` (`--behavior gt`), or leave the helper out",
            file.unwrap_or_default()
        ))
    }
}

impl HelperRegistry for PolicyRegistry<'_> {
    fn names(&self) -> Vec<String> {
        let bundled = BundledHelper::all().iter().map(|helper| helper.name.to_owned());
        let policies = self.policies.iter().map(|p| p.name.clone());
        self.fallback.names().into_iter().chain(bundled).chain(policies).collect()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        match self.policy(name) {
            Some(policy) => Some(policy.helper(rules, &*self.perception)),
            None => self.fallback.make(name, rules),
        }
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        match self.policy(&key.helper) {
            Some(policy) => Some(policy.helper(rules, &*self.perception)),
            None => self.fallback.make_for(key, rules),
        }
    }

    fn check_task(&self, name: &str, task: TaskId) -> Result<(), String> {
        let Some(policy) = self.policy(name) else {
            return self.fallback.check_task(name, task);
        };
        self.check_perception(name)?;
        if policy.plays(task) {
            return Ok(());
        }
        Err(match self.given(name) {
            Some(given) => format!(
                "{} has no {task}.{EXTENSION}, so `{name}` can't play {task}; add the file, or select \
                 other tasks",
                given.path.display()
            ),
            None => format!("`{name}` has no policy for {task}; select other tasks"),
        })
    }

    fn fallback(&self) -> Option<&dyn HelperRegistry> {
        Some(self.fallback)
    }

    fn partner_names(&self) -> Vec<String> {
        let bundled = BundledPartner::all().iter().map(|partner| partner.name.to_owned());
        self.fallback.partner_names().into_iter().chain(bundled).collect()
    }

    fn partner(&self, name: &str, key: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        let given = self.partners.iter().find(|partner| partner.name == name);
        let given = given.map(|partner| &partner.weights);
        match given.or_else(|| BundledPartner::find(name).map(BundledPartner::weights)) {
            Some(weights) => Some(weights.partner(rules)),
            None => self.fallback.partner(name, key, rules),
        }
    }
}
