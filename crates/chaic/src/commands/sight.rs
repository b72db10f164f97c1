//! By what the helpers of a run tell what is in their images.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context as _, Result};
use chaic_agents::perception::{Sight, TrueSight};

use chaic_eval::EvalError;
use chaic_eval::run::{GROUND_TRUTH, RunFolder, RunOptions};
use chaic_files::read_bounded;
use chaic_vision::noisy::{FaultRates, NoisySight};
use chaic_vision::perception::LearnedSight;

use super::perception::read_detector;
use crate::arguments::EvalArguments;

/// As said, or as recorded for a run that is gone on with.
pub fn of_run(arguments: &EvalArguments, path: &Path) -> Result<Arc<dyn Sight>> {
    let recorded = || RunFolder::read(path).ok().and_then(|(_, options)| options.perception);
    let named = match &arguments.perception {
        None if arguments.resume => recorded(),
        named => named.clone(),
    };
    named.map_or_else(|| Ok(Arc::new(TrueSight) as Arc<dyn Sight>), |name| named_sight(&name))
}

/// That of a run which has been played. Weights that are gone don't matter: minds aren't asked again,
/// only what they ask for is looked at.
pub fn recorded(options: &RunOptions) -> Arc<dyn Sight> {
    let named = options.perception.as_deref().and_then(|name| named_sight(name).ok());
    named.unwrap_or_else(|| Arc::new(TrueSight))
}

fn named_sight(name: &str) -> Result<Arc<dyn Sight>> {
    const LEARNED: &str = "learned:";
    /// No file of rates is larger, bytes.
    const MOST_BYTES: u64 = 1 << 20;
    const NOISY: &str = "noisy:";
    if name == GROUND_TRUTH {
        return Ok(Arc::new(TrueSight));
    }
    if let Some(file) = name.strip_prefix(LEARNED) {
        return Ok(Arc::new(LearnedSight::new(read_detector(Path::new(file))?)));
    }
    if let Some(file) = name.strip_prefix(NOISY) {
        let rates: FaultRates = serde_json::from_slice(&read_bounded(Path::new(file), MOST_BYTES)?)
            .with_context(|| file.to_owned())?;
        return Ok(Arc::new(NoisySight::new(rates, file)));
    }
    let text =
        format!("no perception `{name}`; write {GROUND_TRUTH}, {LEARNED}FILE or {NOISY}FILE");
    Err(EvalError::Options(text).into())
}
