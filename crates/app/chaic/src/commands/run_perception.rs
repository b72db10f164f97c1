//! Perception of the helpers of a run.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use chaic_agents::perception_factory::{
    GROUND_TRUTH, GroundTruthPerceptionFactory, PerceptionFactory,
};
use chaic_eval::EvalError;
use chaic_eval::run::{RunFolder, RunOptions};
use chaic_vision::perception_registry::{PerceptionError, perception_from_name};

use crate::arguments::EvalArguments;

/// Returns the perception of a run: the given one, or the recorded one of a resumed run.
///
/// # Errors
/// Those of [`perception_by_name`], and if the perception cannot read images of the run's size.
pub fn perception_of_run(
    arguments: &EvalArguments,
    path: &Path,
) -> Result<Arc<dyn PerceptionFactory>> {
    let recorded = RunFolder::read(path).ok().filter(|_| arguments.resume).map(|(_, o)| o);
    let (perception, behavior) =
        recorded.map_or((None, None), |options| (options.perception, options.behavior));
    let perception = arguments.perception().or(perception);
    let behavior = arguments.behavior().or(behavior);
    let perception = perception_by_name(perception.as_deref(), behavior.as_deref())?;
    if let Some(size) = arguments.size.filter(|_| arguments.has_perceiving_helpers()) {
        perception.check_image_size(size).map_err(EvalError::Options)?;
    }
    Ok(perception)
}

/// Returns the object detection and behavior recognition of these names; the default is ground truth.
///
/// # Errors
/// If a name is unknown, or its file cannot be read.
pub fn perception_by_name(
    perception: Option<&str>,
    behavior: Option<&str>,
) -> Result<Arc<dyn PerceptionFactory>> {
    let or_default = |name: Option<&str>| name.unwrap_or(GROUND_TRUTH).to_owned();
    let found = perception_from_name(&or_default(perception), &or_default(behavior));
    found.map_err(|error| match error {
        PerceptionError::Unknown(text) => EvalError::Options(text).into(),
        error => error.into(),
    })
}

/// Returns the perception of a finished run, or ground truth if its weights file no longer exists.
///
/// Replays do not run agents again and need only the sensors that the agents request.
pub fn recorded_perception(options: &RunOptions) -> Arc<dyn PerceptionFactory> {
    let found = perception_by_name(options.perception.as_deref(), options.behavior.as_deref());
    found.unwrap_or_else(|_| Arc::new(GroundTruthPerceptionFactory))
}
