//! What everybody of a run is granted beyond own images and state, as `run.json` records it.

use std::collections::BTreeMap;

use chaic_agents::partners::partner_grants;
use chaic_core::observation::Grants;
use chaic_env::minds::{self, Helpers};
use serde::{Deserialize, Serialize};

use crate::error::{EvalError, Result};
use crate::run::options::RunOptions;

/// The grants of a run. Every trace has them too; a run without traces is labeled by these.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunGrants {
    /// By helper; `none`, who is nobody, is not among them.
    pub helpers: BTreeMap<String, Grants>,
    /// The partner's.
    pub partner: Grants,
    /// By what helpers tell what is in their images, where that is neither granted nor their author's
    /// affair.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub perception: BTreeMap<String, String>,
    /// How the processes of helpers are confined, such as `sandbox`; without helpers of this process.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub isolation: BTreeMap<String, String>,
}

impl RunGrants {
    /// What these helpers ask for in a run with these options.
    ///
    /// # Errors
    /// If the options name a helper or partner that isn't there, or a rule; if the track refuses what a
    /// helper is granted.
    pub fn of(options: &RunOptions, helpers: &dyn Helpers) -> Result<RunGrants> {
        let rules = options.rules()?.planner;
        let (mut by_name, mut perception) = (BTreeMap::new(), BTreeMap::new());
        let mut isolation = BTreeMap::new();
        for name in &options.helpers {
            let helper = minds::find(helpers, name, rules)?;
            let Some(helper) = helper else { continue };
            by_name.insert(name.clone(), helper.grants);
            perception.extend(helper.mind.perception().map(|by| (name.clone(), by)));
            isolation.extend(helper.mind.isolation().map(|by| (name.clone(), by)));
        }
        let partner = minds::find_partner(helpers, options.partner.as_deref(), None, rules)?;
        let partner = partner.map_or_else(|| partner_grants(rules), |p| p.grants);
        let granted = RunGrants { helpers: by_name, partner, perception, isolation };
        granted.check_track(options)?;
        Ok(granted)
    }

    /// Checks that the run's track allows all grants of helpers and how they are confined, the perception and
    /// the rules.
    ///
    /// # Errors
    /// [`EvalError::Options`] with the first that it refuses.
    pub fn check_track(&self, options: &RunOptions) -> Result<()> {
        let RunOptions { track, perception, behavior, .. } = options;
        let checked = self
            .helpers
            .iter()
            .try_for_each(|(name, grants)| {
                track.check_grants(name, *grants)?;
                track.check_isolation(name, self.isolation.get(name).map(String::as_str))
            })
            .and_then(|()| track.check_sight(perception.as_deref(), behavior.as_deref()));
        let rules = options.rules()?;
        checked.and_then(|()| track.check_rules(&rules)).map_err(EvalError::Options)
    }
}
