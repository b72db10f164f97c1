//! Everything that helpers can see by, by name: what `--perception` and `--behavior` take.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use chaic_agents::sight::{GROUND_TRUTH, Sight, TrueSight};
use chaic_files::{FileError, read_user_file};
use chaic_nn::weights::WeightsError;

use crate::behavior::network::TrainedBehavior;
use crate::behavior::recognize::Recognizing;
use crate::noisy::{FaultRates, NoisySight};
use crate::perception::LearnedSight;
use crate::trained::TrainedDetector;

/// Networks; with `:FILE`, those of other weights.
pub const LEARNED: &str = "learned";
/// Ground truth with the faults of the shipped detector; with `:FILE`, with those of a file of rates.
pub const NOISY: &str = "noisy";

/// No file of weights or rates is larger, bytes.
const MOST_BYTES: u64 = 1 << 28;

/// Why nobody can see by something of this name.
#[derive(Debug, thiserror::Error)]
pub enum SightError {
    /// Nothing is called so.
    #[error("{0}")]
    Unknown(String),
    /// Its file can't be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// Its weights are none.
    #[error("{}: {problem}", path.display())]
    Weights {
        /// Where.
        path: PathBuf,
        /// What is wrong.
        problem: WeightsError,
    },
    /// Its rates are none.
    #[error("{}: {problem}", path.display())]
    Rates {
        /// Where.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}

/// The file of weights in the name of a network, `learned:FILE`.
pub fn weights_of(name: &str) -> Option<&Path> {
    name.strip_prefix(LEARNED)?.strip_prefix(':').map(Path::new)
}

/// The detector in a file.
///
/// # Errors
/// If it can't be read or is none.
pub fn read_detector(path: &Path) -> Result<TrainedDetector, SightError> {
    let wrong = |problem| SightError::Weights { path: path.to_owned(), problem };
    TrainedDetector::from_bytes(&read_user_file(path, MOST_BYTES)?).map_err(wrong)
}

/// The behavior network in a file.
///
/// # Errors
/// If it can't be read or is none.
pub fn read_behavior(path: &Path) -> Result<TrainedBehavior, SightError> {
    let wrong = |problem| SightError::Weights { path: path.to_owned(), problem };
    TrainedBehavior::from_bytes(&read_user_file(path, MOST_BYTES)?).map_err(wrong)
}

/// By what one sees, and tells what others do.
///
/// # Errors
/// [`SightError`]
pub fn named(perception: &str, behavior: &str) -> Result<Arc<dyn Sight>, SightError> {
    let sight = seeing(perception)?;
    let trained = match weights_of(behavior) {
        Some(file) => read_behavior(file)?,
        None if behavior == GROUND_TRUTH => return Ok(sight),
        None if behavior == LEARNED => TrainedBehavior::built_in(),
        None => {
            return Err(SightError::Unknown(format!(
                "no behavior `{behavior}`; write {GROUND_TRUTH}, {LEARNED} or {LEARNED}:FILE"
            )));
        }
    };
    Ok(Arc::new(Recognizing { sight, trained: Arc::new(trained) }))
}

fn seeing(name: &str) -> Result<Arc<dyn Sight>, SightError> {
    if name == GROUND_TRUTH {
        return Ok(Arc::new(TrueSight));
    }
    if name == LEARNED {
        return Ok(Arc::new(LearnedSight::new(TrainedDetector::built_in())));
    }
    if let Some(file) = weights_of(name) {
        return Ok(Arc::new(LearnedSight::new(read_detector(file)?)));
    }
    if name == NOISY {
        return Ok(Arc::new(NoisySight::new(FaultRates::built_in(), NOISY.to_owned())));
    }
    if let Some(file) = name.strip_prefix(NOISY).and_then(|rest| rest.strip_prefix(':')) {
        let path = Path::new(file);
        let wrong = |e: serde_json::Error| SightError::Rates {
            path: path.to_owned(),
            problem: e.to_string(),
        };
        let rates: FaultRates =
            serde_json::from_slice(&read_user_file(path, MOST_BYTES)?).map_err(wrong)?;
        return Ok(Arc::new(NoisySight::new(rates, format!("{NOISY} {file}"))));
    }
    Err(SightError::Unknown(format!(
        "no perception `{name}`; write {GROUND_TRUTH}, {LEARNED}, {LEARNED}:FILE, {NOISY} or {NOISY}:FILE"
    )))
}
