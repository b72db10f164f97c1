//! By what the helpers of a run tell what is in their images.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use chaic_agents::sight::{GROUND_TRUTH, Sight, TrueSight};
use chaic_eval::EvalError;
use chaic_eval::run::{RunFolder, RunOptions};
use chaic_vision::sights::{SightError, named};

use crate::arguments::EvalArguments;

/// As said, or as recorded for a run that is gone on with.
pub fn of_run(arguments: &EvalArguments, path: &Path) -> Result<Arc<dyn Sight>> {
    let recorded = RunFolder::read(path).ok().filter(|_| arguments.resume).map(|(_, o)| o);
    let (perception, behavior) =
        recorded.map_or((None, None), |options| (options.perception, options.behavior));
    let perception = arguments.perception().or(perception);
    let behavior = arguments.behavior().or(behavior);
    of_names(perception.as_deref(), behavior.as_deref())
}

/// By what one sees, and tells what others do; ground truth if nothing is said.
///
/// # Errors
/// If there is no such sight, or its file can't be read.
pub fn of_names(perception: Option<&str>, behavior: Option<&str>) -> Result<Arc<dyn Sight>> {
    let usual = |name: Option<&str>| name.unwrap_or(GROUND_TRUTH).to_owned();
    named(&usual(perception), &usual(behavior)).map_err(|problem| match problem {
        SightError::Unknown(text) => EvalError::Options(text).into(),
        problem => problem.into(),
    })
}

/// That of a run which has been played. Weights that are gone don't matter: minds aren't asked again,
/// only what they ask for is looked at.
pub fn recorded(options: &RunOptions) -> Arc<dyn Sight> {
    let of = of_names(options.perception.as_deref(), options.behavior.as_deref());
    of.unwrap_or_else(|_| Arc::new(TrueSight))
}
