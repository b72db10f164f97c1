//! Grants of the agents of a run beyond own images and state, as in `run.json`.

use std::collections::BTreeMap;

use chaic_agents::partners::partner_grants;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_env::helper_registry::{self, HelperRegistry};
use serde::{Deserialize, Serialize};

use crate::error::{EvalError, Result};
use crate::run::options::RunOptions;

/// Grants of a run. Traces repeat them; reports of runs without traces use these.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunGrants {
    /// Grants by helper, without `none`.
    pub helpers: BTreeMap<String, Grants>,
    /// Grants of the partner.
    pub partner: Grants,
    /// Perception models by helper, for helpers that neither are granted ids nor have their own
    /// perception.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub perception: BTreeMap<String, String>,
    /// Isolation of helper processes, such as `sandbox`; without helpers in this process.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub isolation: BTreeMap<String, String>,
    /// Digests of weights by helper, for helpers with trained weights.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub weights: BTreeMap<String, String>,
    /// Time limits of one action by helper, seconds as text, for helpers in Python.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub limits_s: BTreeMap<String, String>,
}

/// Images that helpers request before their first briefing, by name; without helpers that request none.
pub(crate) type RequestedImages = BTreeMap<String, SensorConfig>;

impl RunGrants {
    /// Returns the grants that the helpers of these options request.
    ///
    /// # Errors
    /// If the options name an unknown helper, partner or rule; if the track does not allow a grant.
    pub fn new(options: &RunOptions, helpers: &dyn HelperRegistry) -> Result<RunGrants> {
        let rules = options.rules()?.planner;
        let (mut grants, mut perception) = (BTreeMap::new(), BTreeMap::new());
        let (mut isolation, mut weights) = (BTreeMap::new(), BTreeMap::new());
        let mut limits_s = BTreeMap::new();
        for name in &options.helpers {
            let helper = helper_registry::find(helpers, name, rules)?;
            let Some(helper) = helper else { continue };
            grants.insert(name.clone(), helper.grants);
            perception.extend(helper.agent.perception().map(|text| (name.clone(), text)));
            isolation.extend(helper.agent.isolation().map(|text| (name.clone(), text)));
            weights.extend(helper.agent.weights().map(|digest| (name.clone(), digest)));
            limits_s
                .extend(helpers.limit_s(name).map(|limit_s| (name.clone(), limit_s.to_string())));
        }
        let partner =
            helper_registry::find_partner(helpers, options.partner.as_deref(), None, rules)?;
        let partner = partner.map_or_else(|| partner_grants(rules), |p| p.grants);
        let granted =
            RunGrants { helpers: grants, partner, perception, isolation, weights, limits_s };
        granted.check_track(options)?;
        Ok(granted)
    }

    /// Returns the images that the helpers with an isolation request. Helpers of Python know them at once,
    /// other processes only when they are briefed. `None` if no helper has an isolation: options and
    /// version then determine all images.
    ///
    /// # Errors
    /// If the options name an unknown helper or rule.
    pub(crate) fn requested_images(
        &self,
        options: &RunOptions,
        helpers: &dyn HelperRegistry,
    ) -> Result<Option<RequestedImages>> {
        let rules = options.rules()?.planner;
        let mut images = RequestedImages::new();
        for name in self.isolation.keys() {
            let helper = helper_registry::find(helpers, name, rules)?;
            let sensors = helper.map(|helper| helper.agent.sensors());
            images.extend(sensors.filter(SensorConfig::wants_image).map(|s| (name.clone(), s)));
        }
        Ok((!self.isolation.is_empty()).then_some(images))
    }

    /// Checks that the run's track allows the grants and the isolation of all helpers, the
    /// perception and the rules.
    ///
    /// # Errors
    /// [`EvalError::Options`] with the first violation.
    pub fn check_track(&self, options: &RunOptions) -> Result<()> {
        let RunOptions { track, perception, behavior, .. } = options;
        let checked = self
            .helpers
            .iter()
            .try_for_each(|(name, grants)| {
                track.check_grants(name, *grants)?;
                track.check_isolation(name, self.isolation.get(name).map(String::as_str))
            })
            .and_then(|()| track.check_perception(perception.as_deref(), behavior.as_deref()));
        let rules = options.rules()?;
        checked.and_then(|()| track.check_rules(&rules)).map_err(EvalError::Options)
    }
}
