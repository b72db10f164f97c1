//! By what the helpers of a run tell what is in their images.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context as _, Result};
use chaic_agents::sight::{Sight, TrueSight};

use chaic_eval::EvalError;
use chaic_eval::run::{GROUND_TRUTH, RunFolder, RunOptions};
use chaic_files::read_bounded;
use chaic_vision::behavior::network::TrainedBehavior;
use chaic_vision::behavior::recognize::Recognizing;
use chaic_vision::noisy::{FaultRates, NoisySight};
use chaic_vision::perception::LearnedSight;
use chaic_vision::trained::TrainedDetector;

use super::perception::{read_behavior, read_detector};
use crate::arguments::{EvalArguments, LEARNED};

/// As said, or as recorded for a run that is gone on with.
pub fn of_run(arguments: &EvalArguments, path: &Path) -> Result<Arc<dyn Sight>> {
    let recorded = RunFolder::read(path).ok().filter(|_| arguments.resume).map(|(_, o)| o);
    let (perception, behavior) =
        recorded.map_or((None, None), |options| (options.perception, options.behavior));
    let perception = arguments.perception().or(perception);
    let behavior = arguments.behavior().or(behavior);
    of_names(perception.as_deref(), behavior.as_deref())
}

/// The file of weights in the name of a network, `learned:FILE`.
pub fn weights_of(name: &str) -> Option<&Path> {
    name.strip_prefix(LEARNED)?.strip_prefix(':').map(Path::new)
}

/// By what one sees, and tells what others do.
fn of_names(perception: Option<&str>, behavior: Option<&str>) -> Result<Arc<dyn Sight>> {
    let sight = named_sight(perception.unwrap_or(GROUND_TRUTH))?;
    let Some(name) = behavior.filter(|name| *name != GROUND_TRUTH) else { return Ok(sight) };
    let trained = match weights_of(name) {
        Some(file) => read_behavior(file)?,
        None if name == LEARNED => TrainedBehavior::built_in(),
        None => {
            let text =
                format!("no behavior `{name}`; write {GROUND_TRUTH}, {LEARNED} or {LEARNED}:FILE");
            return Err(EvalError::Options(text).into());
        }
    };
    Ok(Arc::new(Recognizing { sight, trained: Arc::new(trained) }))
}

/// That of a run which has been played. Weights that are gone don't matter: minds aren't asked again,
/// only what they ask for is looked at.
pub fn recorded(options: &RunOptions) -> Arc<dyn Sight> {
    let of = of_names(options.perception.as_deref(), options.behavior.as_deref());
    of.unwrap_or_else(|_| Arc::new(TrueSight))
}

/// The sight of this name.
///
/// # Errors
/// If there is none, or its file can't be read.
pub fn named_sight(name: &str) -> Result<Arc<dyn Sight>> {
    /// No file of rates is larger, bytes.
    const MOST_BYTES: u64 = 1 << 20;
    const NOISY: &str = "noisy:";
    if name == GROUND_TRUTH {
        return Ok(Arc::new(TrueSight));
    }
    if name == LEARNED {
        return Ok(Arc::new(LearnedSight::new(TrainedDetector::built_in())));
    }
    if let Some(file) = weights_of(name) {
        return Ok(Arc::new(LearnedSight::new(read_detector(file)?)));
    }
    if let Some(file) = name.strip_prefix(NOISY) {
        let rates: FaultRates = serde_json::from_slice(&read_bounded(Path::new(file), MOST_BYTES)?)
            .with_context(|| file.to_owned())?;
        return Ok(Arc::new(NoisySight::new(rates, file)));
    }
    let text = format!(
        "no perception `{name}`; write {GROUND_TRUTH}, {LEARNED}, {LEARNED}:FILE or {NOISY}FILE"
    );
    Err(EvalError::Options(text).into())
}
