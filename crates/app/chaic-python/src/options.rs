//! What worlds are made with, as keywords of Python calls.

use std::sync::Arc;

use chaic_agents::sight::{GROUND_TRUTH, Sight};
use chaic_core::observation::{Grants, Senses};
use chaic_env::rules::{RuleSet, RuleSetName};
use chaic_env::{Appearance, EpisodeConfig, Minds, Seat, minds};
use chaic_eval::run::{MAX_IMAGE_SIZE, MIN_IMAGE_SIZE};
use chaic_vision::sights::{SightError, named};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::depythonize;
use serde::Deserialize;

use crate::error::{failure, mistake, of_env};

/// What a seat of the caller's is called where minds are named.
pub const CALLER: &str = "caller";

/// Keywords, with what is usual.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Keywords {
    helper: String,
    partner: String,
    rules: RuleSetName,
    set: Vec<String>,
    grants: Vec<String>,
    images: Vec<String>,
    image_size: u32,
    minds_image_size: Option<u32>,
    appearance: String,
    perception: String,
    behavior: String,
}

impl Default for Keywords {
    fn default() -> Keywords {
        Keywords {
            helper: CALLER.to_owned(),
            partner: minds::RULES.to_owned(),
            rules: RuleSetName::Paper,
            set: Vec::new(),
            grants: Vec::new(),
            images: vec!["rgb".to_owned(), "depth".to_owned()],
            image_size: 128,
            minds_image_size: None,
            appearance: "canonical".to_owned(),
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
        }
    }
}

/// The same, checked.
#[derive(Clone)]
pub struct Options {
    pub rules: RuleSet,
    pub senses: Senses,
    helper: String,
    partner: String,
    appearance: Appearance,
    grants: Grants,
    sight: Arc<dyn Sight>,
    minds_image_size: Option<u32>,
}

impl Options {
    /// # Errors
    /// `TypeError` for keywords that there aren't or values of another type, `ValueError` for values
    /// that can't be.
    pub fn new(keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Options> {
        let wrong = |error: pythonize::PythonizeError| PyTypeError::new_err(error.to_string());
        let keywords: Keywords =
            keywords.map(|k| depythonize(k).map_err(wrong)).transpose()?.unwrap_or_default();
        let mut rules = RuleSet::named(keywords.rules);
        for setting in &keywords.set {
            rules = rules.with(setting).map_err(|error| of_env(&error))?;
        }
        let options = Options {
            rules,
            senses: senses(&keywords.images, keywords.image_size)?,
            grants: grants(&keywords.grants)?,
            appearance: keywords.appearance.parse().map_err(mistake)?,
            sight: sight(&keywords.perception, &keywords.behavior)?,
            helper: keywords.helper,
            partner: keywords.partner,
            minds_image_size: keywords.minds_image_size,
        };
        if let Some(size) = options.minds_image_size {
            self::senses(&[], size)?;
        }
        if options.senses.ids && !options.grants.ids {
            return Err(mistake("images of ids need the grant \"ids\""));
        }
        options.minds()?;
        Ok(options)
    }

    /// How an episode is played.
    pub fn config<'a>(
        &'a self,
        episode: &'a chaic_episodes::Episode,
        seed: u32,
    ) -> EpisodeConfig<'a> {
        EpisodeConfig {
            episode,
            seed,
            rules: self.rules,
            helper: &self.helper,
            partner: Some(self.partner.as_str()).filter(|name| *name != minds::RULES),
            image_size: self.minds_image_size,
            appearance: self.appearance,
        }
    }

    /// Fresh minds for the seats, and the caller's own.
    ///
    /// # Errors
    /// `ValueError` if nobody has such a name.
    pub fn minds(&self) -> PyResult<Minds> {
        let caller = || Seat::of_caller(self.grants, self.senses);
        let helper = match self.helper.as_str() {
            CALLER => Some(caller()),
            name => {
                let helpers = minds::Seeing { sight: Arc::clone(&self.sight) };
                let found = minds::find(&helpers, name, self.rules.planner);
                found.map_err(|error| of_env(&error))?.map(Seat::from)
            }
        };
        let partner = match self.partner.as_str() {
            minds::RULES => None,
            CALLER => Some(Seat::of_caller(Grants { goal: true, ..self.grants }, self.senses)),
            other => {
                let problem = format!("no partner {other:?}; write \"rules\" or \"caller\"");
                return Err(mistake(problem));
            }
        };
        Ok(Minds { helper, partner })
    }
}

/// By what somebody sees, and tells what others do, as `--perception` and `--behavior` name it.
///
/// # Errors
/// `ValueError` if there is no such thing, `RuntimeError` if its file can't be read.
pub fn sight(perception: &str, behavior: &str) -> PyResult<Arc<dyn Sight>> {
    named(perception, behavior).map_err(|problem| match problem {
        SightError::File(_) => failure(problem),
        _ => mistake(problem),
    })
}

/// The grants of these names.
///
/// # Errors
/// `ValueError` if there is no such grant.
pub fn grants(names: &[String]) -> PyResult<Grants> {
    Grants::of_names(names.iter().map(String::as_str))
        .map_err(|name| mistake(format!("no grant is called {name:?}; docs/grants.md has them")))
}

/// Images of these kinds and this size.
///
/// # Errors
/// `ValueError` if there are no such images.
pub fn senses(kinds: &[String], image_size: u32) -> PyResult<Senses> {
    if !(MIN_IMAGE_SIZE..=MAX_IMAGE_SIZE).contains(&image_size) {
        let range = format!("{MIN_IMAGE_SIZE} to {MAX_IMAGE_SIZE}");
        return Err(mistake(format!("image_size is {image_size}, expected {range}")));
    }
    const KINDS: [&str; 3] = ["rgb", "depth", "ids"];
    if let Some(other) = kinds.iter().find(|kind| !KINDS.contains(&kind.as_str())) {
        return Err(mistake(format!("no images {other:?}; there are {}", KINDS.join(", "))));
    }
    let [rgb, depth, ids] = KINDS.map(|name| kinds.iter().any(|kind| kind == name));
    Ok(Senses { image_size, rgb, depth, ids, film: None })
}
