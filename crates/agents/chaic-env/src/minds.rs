//! Who can be the helper of a run.

use std::path::Path;
use std::sync::Arc;

use chaic_agents::sight::{Sight, TrueSight};
use chaic_agents::{HELPERS, HelperInfo, PlannerRules};
use chaic_core::Agent;
use chaic_core::observation::Grants;

use crate::error::{EnvError, Result};
use crate::key::RunKey;

/// The name of having no helper at all.
pub const NONE: &str = "none";
/// The name of the rule-based partners.
pub const RULES: &str = "rules";

/// A helper's mind, and what it is granted.
pub struct Helper {
    /// The mind.
    pub mind: Box<dyn Agent>,
    /// What it is granted; written into every trace.
    pub grants: Grants,
}

/// Where a run gets its helpers from: by name, a fresh one for each episode.
///
/// ```
/// use chaic_env::minds::{BuiltIn, Helpers as _};
/// use chaic_agents::PlannerRules;
/// assert!(BuiltIn.make("rhp", PlannerRules::paper()).is_some());
/// assert!(BuiltIn.make("nobody", PlannerRules::paper()).is_none());
/// ```
pub trait Helpers: Sync {
    /// The names, without [`NONE`].
    fn names(&self) -> Vec<String>;

    /// A fresh helper of this name that plans by these rules, as far as they concern it.
    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper>;

    /// The helper for one episode run; for those who keep a record of their own.
    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        self.make(&key.helper, rules)
    }

    /// Ties the helpers to a run's folder, before `run.json` makes it a run and whenever it is gone
    /// on with; for those who keep a record there.
    ///
    /// # Errors
    /// If the run was begun otherwise, or the file system refuses.
    fn attach(&self, _run: &Path) -> Result<()> {
        Ok(())
    }

    /// The helpers beside which these stand, for those who add some: what follows is asked of them.
    fn others(&self) -> Option<&dyn Helpers> {
        None
    }

    /// The names of minds that may drive the partner in place of the rule-based ones.
    fn partner_names(&self) -> Vec<String> {
        self.others().map_or_else(Vec::new, Helpers::partner_names)
    }

    /// A mind of this name for the partner; of one episode run, or only to know what it asks for.
    fn partner(&self, name: &str, of: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        self.others()?.partner(name, of, rules)
    }

    /// How many episode runs with minds that [wait](Helpers::waits) are played at a time, besides
    /// those of the jobs.
    fn waiting_jobs(&self) -> usize {
        self.others().map_or(0, Helpers::waiting_jobs)
    }

    /// Whether minds of this name (or the partner's) spend their time waiting for somebody else's
    /// computer, so that others had better be played meanwhile.
    fn waits(&self, name: &str) -> bool {
        self.others().is_some_and(|others| others.waits(name))
    }
}

/// The helpers of `chaic-agents`.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn;

impl Helpers for BuiltIn {
    fn names(&self) -> Vec<String> {
        HELPERS.iter().map(|helper| helper.name.to_owned()).collect()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        built_in(name, rules, &TrueSight)
    }
}

/// The helper of `chaic-agents` of this name, who sees by this.
pub fn built_in(name: &str, rules: PlannerRules, sight: &dyn Sight) -> Option<Helper> {
    let info = HelperInfo::named(name)?;
    let grants = sight.grants((info.grants)(rules));
    Some(Helper { mind: (info.make)(rules, sight), grants })
}

/// The helpers of `chaic-agents`, who see by something else than ids from ground truth.
#[derive(Clone)]
pub struct Seeing {
    /// By what.
    pub sight: Arc<dyn Sight>,
}

impl Helpers for Seeing {
    fn names(&self) -> Vec<String> {
        BuiltIn.names()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        built_in(name, rules, &*self.sight)
    }
}

/// Refuses what is no name for another helper; `example` is how one is named, like `mine=exec:COMMAND`.
///
/// # Errors
/// Says what is wrong, in a sentence.
pub fn check_new_name(
    name: &str,
    taken: &[String],
    example: &str,
) -> std::result::Result<(), String> {
    let is_name = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
    if name.is_empty() || name.len() > 40 || !name.chars().all(is_name) {
        return Err(format!("`{name}` is no name for a helper; use letters, digits, _ and -"));
    }
    if name == NONE || taken.iter().any(|t| t == name) {
        return Err(format!(
            "there is a helper `{name}` already; name this one, for example {example}"
        ));
    }
    Ok(())
}

/// The helper of this name; `None` for [`NONE`].
///
/// # Errors
/// [`EnvError::UnknownHelper`] with all names.
pub fn find(helpers: &dyn Helpers, name: &str, rules: PlannerRules) -> Result<Option<Helper>> {
    some_or_none(helpers, name, || helpers.make(name, rules))
}

/// The helper of one episode run.
///
/// # Errors
/// [`EnvError::UnknownHelper`] with all names.
pub fn find_for(
    helpers: &dyn Helpers,
    key: &RunKey,
    rules: PlannerRules,
) -> Result<Option<Helper>> {
    some_or_none(helpers, &key.helper, || helpers.make_for(key, rules))
}

/// The mind that drives the partner; `None` for the rule-based one of its task.
///
/// # Errors
/// [`EnvError::UnknownPartner`] with all names.
pub fn find_partner(
    helpers: &dyn Helpers,
    name: Option<&str>,
    of: Option<&RunKey>,
    rules: PlannerRules,
) -> Result<Option<Helper>> {
    let Some(name) = name else { return Ok(None) };
    let known = || std::iter::once(RULES.to_owned()).chain(helpers.partner_names()).collect();
    let unknown = || EnvError::UnknownPartner { name: name.to_owned(), known: known() };
    helpers.partner(name, of, rules).map(Some).ok_or_else(unknown)
}

fn some_or_none(
    helpers: &dyn Helpers,
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
