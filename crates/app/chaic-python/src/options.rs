//! Options of worlds, as keywords of Python calls.

use std::ops::RangeInclusive;
use std::sync::Arc;

use chaic_agents::perception_factory::{GROUND_TRUTH, PerceptionFactory};
use chaic_core::observation::{Grants, SensorConfig};
use chaic_env::helper_registry::BuiltInWithPerception;
use chaic_env::rules::{RuleSet, RuleSetName};
use chaic_env::{AgentSlot, Appearance, EpisodeAgents, EpisodeConfig, helper_registry};
use chaic_eval::run::{MAX_IMAGE_SIZE, MIN_IMAGE_SIZE};
use chaic_learn::helpers::PolicyRegistry;
use chaic_vision::perception_registry::{PerceptionError, perception_from_name};
use pyo3::exceptions::{PyDeprecationWarning, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::depythonize;
use serde::Deserialize;

use crate::error::{from_env, integer, runtime_error, value_error};

/// Widths and heights of images, pixels.
pub const IMAGE_SIZES: RangeInclusive<u32> = MIN_IMAGE_SIZE..=MAX_IMAGE_SIZE;

/// Name of agents that the caller controls.
pub const CALLER: &str = "caller";

/// Keywords with their defaults.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Keywords {
    helper: String,
    partner: String,
    rules: String,
    set: Names,
    grants: Names,
    images: Names,
    image_size: u32,
    #[serde(alias = "minds_image_size")]
    partner_image_size: Option<u32>,
    appearance: String,
    perception: String,
    behavior: String,
}

/// One string (a name or a setting), or several of them.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a string or a list of strings")]
pub enum Names {
    One(String),
    Several(Vec<String>),
}

impl Default for Names {
    fn default() -> Names {
        Names::Several(Vec::new())
    }
}

impl Names {
    /// Returns all strings.
    pub fn into_vec(self) -> Vec<String> {
        match self {
            Names::One(name) => vec![name],
            Names::Several(names) => names,
        }
    }
}

impl Default for Keywords {
    fn default() -> Keywords {
        Keywords {
            helper: CALLER.to_owned(),
            partner: helper_registry::RULES.to_owned(),
            rules: RuleSetName::Paper.to_string(),
            set: Names::default(),
            grants: Names::default(),
            images: Names::Several(vec!["rgb".to_owned(), "depth".to_owned()]),
            image_size: 128,
            partner_image_size: None,
            appearance: "canonical".to_owned(),
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
        }
    }
}

/// Checked options of a world.
#[derive(Clone)]
pub struct Options {
    pub rules: RuleSet,
    pub sensors: SensorConfig,
    helper: String,
    partner: String,
    appearance: Appearance,
    grants: Grants,
    perception: Arc<dyn PerceptionFactory>,
    partner_image_size: Option<u32>,
}

impl Options {
    /// Parses keywords.
    ///
    /// # Errors
    /// `TypeError` for an unknown keyword or a value of the wrong type, `ValueError` for an invalid value.
    pub fn new(py: Python<'_>, keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Options> {
        warn_of_old_keywords(py, keywords)?;
        let sizes = ["image_size", "partner_image_size", "minds_image_size"];
        keywords.map_or(Ok(()), |keywords| check_integers(keywords, &sizes, &IMAGE_SIZES))?;
        let wrong = |error: pythonize::PythonizeError| PyTypeError::new_err(error.to_string());
        let keywords: Keywords =
            keywords.map(|k| depythonize(k).map_err(wrong)).transpose()?.unwrap_or_default();
        let options = Options {
            rules: rule_set(&keywords.rules, &keywords.set.into_vec())?,
            sensors: sensors(&keywords.images.into_vec(), keywords.image_size)?,
            grants: grants(&keywords.grants.into_vec())?,
            appearance: keywords.appearance.parse().map_err(value_error)?,
            perception: perception(&keywords.perception, &keywords.behavior)?,
            helper: keywords.helper,
            partner: keywords.partner,
            partner_image_size: keywords.partner_image_size,
        };
        if let Some(size) = options.partner_image_size {
            options.perception.check_image_size(size).map_err(value_error)?;
        }
        if options.sensors.ids && !options.grants.ids {
            return Err(value_error("images of ids need the grant \"ids\""));
        }
        options.agents()?;
        Ok(options)
    }

    /// Returns the configuration of an episode.
    pub fn config<'a>(
        &'a self,
        episode: &'a chaic_episodes::Episode,
        seed: u32,
    ) -> EpisodeConfig<'a> {
        EpisodeConfig {
            seed,
            rules: self.rules,
            partner: Some(self.partner.as_str()).filter(|name| *name != helper_registry::RULES),
            image_size: self.partner_image_size,
            appearance: self.appearance,
            ..EpisodeConfig::new(episode, &self.helper)
        }
    }

    /// Creates the agents of an episode.
    ///
    /// # Errors
    /// `ValueError` for an unknown helper or partner.
    pub fn agents(&self) -> PyResult<EpisodeAgents> {
        let caller = || AgentSlot::external(self.grants, self.sensors);
        let helper = match self.helper.as_str() {
            CALLER => Some(caller()),
            name => {
                let perception = Arc::clone(&self.perception);
                let built_in = BuiltInWithPerception { perception: Arc::clone(&perception) };
                let helpers = PolicyRegistry::bundled(&built_in, perception);
                helpers.check_perception(name).map_err(value_error)?;
                let found = helper_registry::find(&helpers, name, self.rules.planner);
                found.map_err(|error| from_env(&error))?.map(AgentSlot::from)
            }
        };
        let partner = match self.partner.as_str() {
            helper_registry::RULES => None,
            CALLER => Some(AgentSlot::external(Grants { goal: true, ..self.grants }, self.sensors)),
            other => {
                let problem = format!("unknown partner {other:?}; write \"rules\" or \"caller\"");
                return Err(value_error(problem));
            }
        };
        Ok(EpisodeAgents { helper, partner })
    }
}

/// Extracts the width and height of images, pixels; raises `ValueError` if it is out of range.
pub fn image_size(value: &Bound<'_, PyAny>) -> PyResult<u32> {
    integer("image_size", value, &IMAGE_SIZES)
}

/// Checks the integers among keywords. Errors of the deserializer would not name the keyword.
///
/// # Errors
/// `ValueError` if one is outside the range, `TypeError` if it is no integer.
pub fn check_integers(
    keywords: &Bound<'_, PyDict>,
    names: &[&str],
    range: &RangeInclusive<u32>,
) -> PyResult<()> {
    for name in names {
        if let Some(value) = keywords.get_item(name)?.filter(|value| !value.is_none()) {
            integer(name, &value, range)?;
        }
    }
    Ok(())
}

/// Extracts one string, or several of them.
///
/// # Errors
/// `TypeError` for other values.
pub fn strings(value: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    match value.extract::<String>() {
        Ok(string) => Ok(vec![string]),
        Err(_) => value.extract(),
    }
}

/// Returns a rule set with changes such as `world.stride_m=0.5`.
///
/// # Errors
/// `ValueError` for an unknown rule set or an invalid change.
pub fn rule_set(name: &str, set: &[String]) -> PyResult<RuleSet> {
    let rules = RuleSet::named(name.parse().map_err(value_error)?);
    set.iter().try_fold(rules, |rules, setting| rules.with(setting)).map_err(|e| from_env(&e))
}

/// Warns of keywords that have a new name.
fn warn_of_old_keywords(py: Python<'_>, keywords: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
    match keywords.map(|keywords| keywords.contains("minds_image_size")).transpose()? {
        Some(true) => {
            let category = py.get_type::<PyDeprecationWarning>();
            let message = c"the keyword minds_image_size is deprecated; use partner_image_size";
            PyErr::warn(py, &category, message, 1)
        }
        _ => Ok(()),
    }
}

/// Returns perception and behavior recognition by their names in `--perception` and `--behavior`.
///
/// # Errors
/// `ValueError` for an unknown name, `RuntimeError` if a file of weights can't be read.
pub fn perception(perception: &str, behavior: &str) -> PyResult<Arc<dyn PerceptionFactory>> {
    perception_from_name(perception, behavior).map_err(|problem| match problem {
        PerceptionError::File(_) => runtime_error(problem),
        _ => value_error(problem),
    })
}

/// Returns the grants of these names.
///
/// # Errors
/// `ValueError` for an unknown grant.
pub fn grants(names: &[String]) -> PyResult<Grants> {
    Grants::from_names(names.iter().map(String::as_str)).map_err(|name| {
        value_error(format!("unknown grant {name:?}; docs/grants.md lists all grants"))
    })
}

/// Returns sensors for images of these kinds and this size.
///
/// # Errors
/// `ValueError` for an unknown kind or a size out of range.
pub fn sensors(kinds: &[String], image_size: u32) -> PyResult<SensorConfig> {
    if !IMAGE_SIZES.contains(&image_size) {
        let range = format!("{MIN_IMAGE_SIZE} to {MAX_IMAGE_SIZE}");
        return Err(value_error(format!("image_size is {image_size}, expected {range}")));
    }
    const KINDS: [&str; 3] = ["rgb", "depth", "ids"];
    if let Some(other) = kinds.iter().find(|kind| !KINDS.contains(&kind.as_str())) {
        return Err(value_error(format!(
            "unknown kind of images {other:?}; the kinds are {}",
            KINDS.join(", ")
        )));
    }
    let [rgb, depth, ids] = KINDS.map(|name| kinds.iter().any(|kind| kind == name));
    Ok(SensorConfig { image_size, rgb, depth, ids, frame_history: None })
}
