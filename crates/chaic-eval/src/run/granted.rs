//! What everybody of a run is granted beyond own images and state, as `run.json` records it.

use std::collections::BTreeMap;

use chaic_agents::partners::partner_grants;
use chaic_env::minds::{self, Helpers};
use chaic_protocol::observation::Grants;
use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::run::options::RunOptions;

/// The grants of a run. Every trace has them too; a run without traces is labeled by these.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunGrants {
    /// By helper; `none`, who is nobody, is not among them.
    pub helpers: BTreeMap<String, Grants>,
    /// The partner's.
    pub partner: Grants,
}

impl RunGrants {
    /// What these helpers ask for in a run with these options.
    ///
    /// # Errors
    /// If the options name a helper or partner that isn't there, or a rule.
    pub fn of(options: &RunOptions, helpers: &dyn Helpers) -> Result<RunGrants> {
        let rules = options.rules()?.planner;
        let mut by_name = BTreeMap::new();
        for name in &options.helpers {
            let helper = minds::find(helpers, name, rules)?;
            by_name.extend(helper.map(|h| (name.clone(), h.grants)));
        }
        let partner = minds::find_partner(helpers, options.partner.as_deref(), None, rules)?;
        let partner = partner.map_or_else(|| partner_grants(rules), |p| p.grants);
        Ok(RunGrants { helpers: by_name, partner })
    }
}
