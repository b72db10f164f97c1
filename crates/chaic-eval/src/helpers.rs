//! Who can be the helper of a run.

use chaic_agents::{HELPERS, PlannerRules, helper, helper_grants};
use chaic_protocol::Agent;
use chaic_protocol::observation::Grants;

use crate::error::{EvalError, Result};

/// The name of having no helper at all.
pub const NONE: &str = "none";

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
/// use chaic_eval::helpers::{BuiltIn, Helpers as _};
/// use chaic_agents::PlannerRules;
/// assert!(BuiltIn.make("rhp", PlannerRules::paper()).is_some());
/// assert!(BuiltIn.make("nobody", PlannerRules::paper()).is_none());
/// ```
pub trait Helpers: Sync {
    /// The names, without [`NONE`].
    fn names(&self) -> Vec<String>;

    /// A fresh helper of this name that plans by these rules, as far as they concern it.
    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper>;
}

/// The helpers of `chaic-agents`.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn;

impl Helpers for BuiltIn {
    fn names(&self) -> Vec<String> {
        HELPERS.iter().map(|n| (*n).to_owned()).collect()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        Some(Helper { mind: helper(name, rules)?, grants: helper_grants(name, rules) })
    }
}

/// The helper of this name; `None` for [`NONE`].
///
/// # Errors
/// [`EvalError::UnknownHelper`] with all names.
pub fn find(helpers: &dyn Helpers, name: &str, rules: PlannerRules) -> Result<Option<Helper>> {
    if name == NONE {
        return Ok(None);
    }
    let unknown = || {
        let known = std::iter::once(NONE.to_owned()).chain(helpers.names()).collect();
        EvalError::UnknownHelper { name: name.to_owned(), known }
    };
    helpers.make(name, rules).map(Some).ok_or_else(unknown)
}
