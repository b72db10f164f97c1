//! Registries that create helpers and partners by name.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use chaic_agents::partners::{self, HabitsError, PARTNER_VARIANTS};
use chaic_agents::perception_factory::{GroundTruthPerceptionFactory, PerceptionFactory};
use chaic_agents::{HELPERS, HelperInfo, PlannerRules};
use chaic_core::observation::Grants;
use chaic_core::{Agent, TaskId};

use crate::digest::Digest;
use crate::error::{EnvError, Result};
use crate::key::RunKey;

/// Name for no helper.
pub const NONE: &str = "none";
/// Name of the rule-based partners.
pub const RULES: &str = "rules";
/// Prefix of a partner that repeats recordings: `recorded:PATH` in commands, `recorded:DIGEST` in runs.
pub const RECORDED: &str = "recorded:";
/// Prefix of a partner with trained weights: `policy:FILE` in commands, `policy:DIGEST` in runs.
pub const POLICY: &str = "policy:";
/// Prefixes of partners from files. Runs name them by digest, so they need the files again to resume.
pub const PARTNER_FILES: [&str; 2] = [RECORDED, POLICY];

/// Largest number of characters of a helper's name, which is the name of a folder.
const MAX_NAME: usize = 40;

/// A helper and its grants.
pub struct Helper {
    /// Agent.
    pub agent: Box<dyn Agent>,
    /// Grants; every trace records them.
    pub grants: Grants,
}

/// Registry that creates a new helper for each episode, by name.
///
/// ```
/// use chaic_agents::PlannerRules;
/// use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _};
/// assert!(BuiltInHelpers.make("rhp", PlannerRules::paper()).is_some());
/// assert!(BuiltInHelpers.make("unknown", PlannerRules::paper()).is_none());
/// ```
pub trait HelperRegistry: Sync {
    /// Returns the names of all helpers, without [`NONE`].
    fn names(&self) -> Vec<String>;

    /// Creates a helper; `None` for an unknown name.
    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper>;

    /// Creates the helper of one episode run. Override it to keep a record per run.
    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        self.make(&key.helper, rules)
    }

    /// Returns the registry that this one extends; the default methods below delegate to it.
    fn fallback(&self) -> Option<&dyn HelperRegistry> {
        None
    }

    /// Checks that a helper can play a task.
    ///
    /// # Errors
    /// One line with the reason, such as a file that is missing.
    fn check_task(&self, name: &str, task: TaskId) -> std::result::Result<(), String> {
        self.fallback().map_or(Ok(()), |registry| registry.check_task(name, task))
    }

    /// Returns the time limit of one action of a helper in seconds, if the run is to record it in `run.json`.
    fn limit_s(&self, name: &str) -> Option<f64> {
        self.fallback()?.limit_s(name)
    }

    /// Receives the run folder before `run.json` is written and on every resume. Override it to keep
    /// records there.
    ///
    /// # Errors
    /// If the run was started with other helpers, or on a file system error.
    fn attach_run(&self, run: &Path) -> Result<()> {
        self.fallback().map_or(Ok(()), |registry| registry.attach_run(run))
    }

    /// Returns the names of agents that can replace the rule-based partner.
    fn partner_names(&self) -> Vec<String> {
        self.fallback().map_or_else(built_in_partner_names, HelperRegistry::partner_names)
    }

    /// Creates the partner of one episode run; without a key, an agent to read grants and sensors from.
    fn partner(&self, name: &str, key: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        match self.fallback() {
            Some(registry) => registry.partner(name, key, rules),
            None => built_in_partner(name, rules),
        }
    }

    /// Returns the episodes that the partner can play, with the digests of their setups; `None` for a
    /// partner that can play any.
    fn partner_episodes(&self, name: &str) -> Option<BTreeMap<String, Digest>> {
        self.fallback()?.partner_episodes(name)
    }

    /// Returns the number of concurrent episode runs with [slow](HelperRegistry::is_slow) agents, in
    /// addition to the jobs.
    fn waiting_jobs(&self) -> usize {
        self.fallback().map_or(0, HelperRegistry::waiting_jobs)
    }

    /// Returns whether agents of this name wait for a remote service most of the time, so that other
    /// episodes can run meanwhile. The name may be a partner's.
    fn is_slow(&self, name: &str) -> bool {
        self.fallback().is_some_and(|registry| registry.is_slow(name))
    }
}

/// Registry of the helpers of `chaic-agents`, with ground-truth perception.
#[derive(Clone, Copy, Debug)]
pub struct BuiltInHelpers;

impl HelperRegistry for BuiltInHelpers {
    fn names(&self) -> Vec<String> {
        HELPERS.iter().map(|helper| helper.name.to_owned()).collect()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        built_in(name, rules, &GroundTruthPerceptionFactory)
    }
}

/// Creates a helper of `chaic-agents` with the given perception; `None` for an unknown name.
pub fn built_in(
    name: &str,
    rules: PlannerRules,
    perception: &dyn PerceptionFactory,
) -> Option<Helper> {
    let info = HelperInfo::find_helper(name)?;
    let grants = perception.grants((info.grants)(rules));
    Some(Helper { agent: (info.make)(rules, perception), grants })
}

/// Returns the names of the partners of `chaic-agents` that deviate from the rules.
pub fn built_in_partner_names() -> Vec<String> {
    PARTNER_VARIANTS.iter().map(|variant| variant.name.to_owned()).collect()
}

/// Creates a partner of `chaic-agents` that deviates from the rules: one of the
/// [names](built_in_partner_names), `habits:...` or `drawn:SEED`; `None` for any other name.
pub fn built_in_partner(name: &str, rules: PlannerRules) -> Option<Helper> {
    let habits = partners::partner_habits(name).ok()?;
    let grants = partners::partner_grants(rules);
    Some(Helper { agent: partners::partner_variant(habits, rules), grants })
}

/// Registry of the helpers of `chaic-agents` with the given perception.
#[derive(Clone)]
pub struct BuiltInWithPerception {
    /// Perception of the helpers.
    pub perception: Arc<dyn PerceptionFactory>,
}

impl HelperRegistry for BuiltInWithPerception {
    fn names(&self) -> Vec<String> {
        BuiltInHelpers.names()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        built_in(name, rules, &*self.perception)
    }
}

/// Checks the name of an additional helper. `example` is an option that names one, such as
/// `mine=exec:COMMAND`.
///
/// # Errors
/// One sentence that describes the problem.
pub fn check_new_name(
    name: &str,
    taken: &[String],
    example: &str,
) -> std::result::Result<(), String> {
    let is_name = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
    if name.is_empty() || name.len() > MAX_NAME || !name.chars().all(is_name) {
        return Err(format!(
            "`{name}` is not a valid name for a helper; use 1 to {MAX_NAME} letters, digits, _ and -"
        ));
    }
    if name == NONE || taken.iter().any(|t| t == name) {
        return Err(format!(
            "there is a helper `{name}` already; name this one, for example {example}"
        ));
    }
    Ok(())
}

/// Creates the helper of this name; `None` for [`NONE`].
///
/// # Errors
/// [`EnvError::UnknownHelper`] with the known names.
pub fn find(
    helpers: &dyn HelperRegistry,
    name: &str,
    rules: PlannerRules,
) -> Result<Option<Helper>> {
    create_unless_none(helpers, name, || helpers.make(name, rules))
}

/// Creates the helper of one episode run; `None` for [`NONE`].
///
/// # Errors
/// [`EnvError::UnknownHelper`] with the known names.
pub fn find_for(
    helpers: &dyn HelperRegistry,
    key: &RunKey,
    rules: PlannerRules,
) -> Result<Option<Helper>> {
    create_unless_none(helpers, &key.helper, || helpers.make_for(key, rules))
}

/// Creates the partner of this name; `None` for the rule-based partner of the task.
///
/// # Errors
/// [`EnvError::UnknownPartner`] with the known names, or [`EnvError::InvalidPartner`] if the
/// parameters in a name are wrong.
pub fn find_partner(
    helpers: &dyn HelperRegistry,
    name: Option<&str>,
    key: Option<&RunKey>,
    rules: PlannerRules,
) -> Result<Option<Helper>> {
    let Some(name) = name else { return Ok(None) };
    let known = || std::iter::once(RULES.to_owned()).chain(helpers.partner_names()).collect();
    let unknown = || match partners::partner_habits(name) {
        _ if PARTNER_FILES.iter().any(|prefix| name.starts_with(prefix)) => {
            EnvError::PartnerFile { name: name.to_owned() }
        }
        Err(HabitsError::Invalid(problem)) => EnvError::InvalidPartner { problem },
        _ => EnvError::UnknownPartner { name: name.to_owned(), known: known() },
    };
    helpers.partner(name, key, rules).map(Some).ok_or_else(unknown)
}

fn create_unless_none(
    helpers: &dyn HelperRegistry,
    name: &str,
    make: impl FnOnce() -> Option<Helper>,
) -> Result<Option<Helper>> {
    if name == NONE {
        return Ok(None);
    }
    let unknown = || {
        let known = std::iter::once(NONE.to_owned()).chain(helpers.names()).collect();
        EnvError::UnknownHelper { name: name.to_owned(), known }
    };
    make().map(Some).ok_or_else(unknown)
}

#[cfg(test)]
mod tests;
