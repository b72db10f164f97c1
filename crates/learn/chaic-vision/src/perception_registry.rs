//! Perception and behavior models by name: the values of `--perception` and `--behavior`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use chaic_agents::perception_factory::{
    GROUND_TRUTH, GT_TRACKS, GroundTruthPerceptionFactory, GroundTruthTracksFactory,
    PerceptionFactory,
};
use chaic_files::{FileError, read_user_file};
use chaic_nn::weights::WeightsError;

use crate::behavior::network::TrainedBehavior;
use crate::behavior::recognize::LearnedBehaviorFactory;
use crate::noisy::{DetectorNoiseModel, NoisyPerceptionFactory};
use crate::perception::{GT_NAMES, LearnedPerceptionFactory};
use crate::trained::TrainedDetector;

/// Name of the learned models; `learned:FILE` reads other weights.
pub const LEARNED: &str = "learned";
/// Name of ground truth with the error rates of the bundled detector; `noisy:FILE` reads other
/// rates.
pub const NOISY: &str = "noisy";

/// Name of the perception with ground-truth masks and classes, and tracks of the tracker. It measures
/// the cost of tracking errors.
pub const GT_MASKS: &str = "gt_masks";

/// Maximum size of a file of weights or rates, bytes.
const MAX_BYTES: u64 = 1 << 28;

/// Error of a perception or behavior name.
#[derive(Debug, thiserror::Error)]
pub enum PerceptionError {
    /// The name is unknown, or lacks its file.
    #[error("{0}")]
    Unknown(String),
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file holds no weights of this network.
    #[error("{}: {problem}; use weights that `chaic train` of this version wrote", path.display())]
    Weights {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        problem: WeightsError,
    },
    /// The file holds the first stage of a detector, which is no perception of helpers.
    #[error(
        "{file}: the detector lacks its second stage; train it with `chaic train detection --weights \
         {file} --set steps=0 --out DIR`",
        file = path.display()
    )]
    OneStage {
        /// Path of the file.
        path: PathBuf,
    },
    /// The file holds no error rates.
    #[error("{}: {problem}", path.display())]
    Rates {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        problem: String,
    },
}

/// Returns the weights file of a name such as `learned:FILE`.
pub fn weights_of(name: &str) -> Option<&Path> {
    file_of(name, LEARNED)
}

/// Returns the file of a name such as `KIND:FILE`.
fn file_of<'a>(name: &'a str, kind: &str) -> Option<&'a Path> {
    name.strip_prefix(kind)?.strip_prefix(':').map(Path::new)
}

/// Checks that a name such as `KIND:FILE` has a file, for these kinds.
fn check_has_file(name: &str, kinds: &[&str]) -> Result<(), PerceptionError> {
    match name.strip_suffix(':') {
        Some(kind) if kinds.contains(&kind) => Err(PerceptionError::Unknown(format!(
            "`{name}` has no file after the colon; write {kind}:FILE or {kind}"
        ))),
        _ => Ok(()),
    }
}

/// Reads a detector of one or two stages from a file.
///
/// # Errors
/// If the file cannot be read or holds no detector.
pub fn read_detector(path: &Path) -> Result<TrainedDetector, PerceptionError> {
    let weights_error = |problem| PerceptionError::Weights { path: path.to_owned(), problem };
    TrainedDetector::from_bytes(&read_user_file(path, MAX_BYTES)?).map_err(weights_error)
}

/// Reads a detector for helpers from a file.
///
/// # Errors
/// As [`read_detector`], and if the detector has only its first stage, as after the first part of
/// the training.
fn read_complete_detector(path: &Path) -> Result<TrainedDetector, PerceptionError> {
    let detector = read_detector(path)?;
    match detector.second_stage {
        Some(_) => Ok(detector),
        None => Err(PerceptionError::OneStage { path: path.to_owned() }),
    }
}

/// Reads a behavior network from a file.
///
/// # Errors
/// If the file cannot be read or holds no behavior network.
pub fn read_behavior(path: &Path) -> Result<TrainedBehavior, PerceptionError> {
    let weights_error = |problem| PerceptionError::Weights { path: path.to_owned(), problem };
    TrainedBehavior::from_bytes(&read_user_file(path, MAX_BYTES)?).map_err(weights_error)
}

/// Creates the perception factory for a perception name and a behavior name.
///
/// # Errors
/// [`PerceptionError`]
pub fn perception_from_name(
    perception: &str,
    behavior: &str,
) -> Result<Arc<dyn PerceptionFactory>, PerceptionError> {
    check_has_file(perception, &[LEARNED, GT_NAMES, NOISY])?;
    check_has_file(behavior, &[LEARNED])?;
    let factory = factory_from_name(perception)?;
    let trained = match weights_of(behavior) {
        Some(file) => read_behavior(file)?,
        None if behavior == GROUND_TRUTH => return Ok(factory),
        None if behavior == LEARNED => TrainedBehavior::built_in(),
        None => {
            return Err(PerceptionError::Unknown(format!(
                "no behavior `{behavior}`; write {GROUND_TRUTH}, {LEARNED} or {LEARNED}:FILE"
            )));
        }
    };
    Ok(Arc::new(LearnedBehaviorFactory { perception: factory, model: Arc::new(trained) }))
}

fn factory_from_name(name: &str) -> Result<Arc<dyn PerceptionFactory>, PerceptionError> {
    if name == GROUND_TRUTH {
        return Ok(Arc::new(GroundTruthPerceptionFactory));
    }
    if name == GT_TRACKS {
        return Ok(Arc::new(GroundTruthTracksFactory));
    }
    if name == LEARNED {
        return Ok(Arc::new(LearnedPerceptionFactory::new(TrainedDetector::built_in())));
    }
    if let Some(file) = weights_of(name) {
        return Ok(Arc::new(LearnedPerceptionFactory::new(read_complete_detector(file)?)));
    }
    if name == GT_NAMES {
        let detector = TrainedDetector::built_in();
        return Ok(Arc::new(LearnedPerceptionFactory::with_true_names(detector)));
    }
    if let Some(file) = file_of(name, GT_NAMES) {
        let detector = read_complete_detector(file)?;
        return Ok(Arc::new(LearnedPerceptionFactory::with_true_names(detector)));
    }
    if name == GT_MASKS {
        let noise = DetectorNoiseModel::none();
        return Ok(Arc::new(NoisyPerceptionFactory::new(noise, GT_MASKS.to_owned())));
    }
    if name == NOISY {
        return Ok(Arc::new(NoisyPerceptionFactory::new(
            DetectorNoiseModel::built_in(),
            NOISY.to_owned(),
        )));
    }
    if let Some(path) = file_of(name, NOISY) {
        let rates_error =
            |problem: String| PerceptionError::Rates { path: path.to_owned(), problem };
        let bytes = read_user_file(path, MAX_BYTES)?;
        let rates: DetectorNoiseModel =
            serde_json::from_slice(&bytes).map_err(|e| rates_error(e.to_string()))?;
        rates.check().map_err(rates_error)?;
        // The digest in the recorded name shows whether the file has changed since the recording.
        let recorded_name =
            format!("{NOISY} {} {}", path.display(), chaic_nn::weights::digest(&bytes));
        return Ok(Arc::new(NoisyPerceptionFactory::new(rates, recorded_name)));
    }
    Err(PerceptionError::Unknown(format!(
        "no perception `{name}`; write {GROUND_TRUTH}, {GT_TRACKS}, {GT_MASKS}, {GT_NAMES}, \
         {GT_NAMES}:FILE, {LEARNED}, {LEARNED}:FILE, {NOISY} or {NOISY}:FILE"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_without_the_file_after_its_colon_is_refused() {
        for (perception, behavior) in [
            ("learned:", GROUND_TRUTH),
            ("gt_names:", GROUND_TRUTH),
            ("noisy:", GROUND_TRUTH),
            (GROUND_TRUTH, "learned:"),
        ] {
            let error = perception_from_name(perception, behavior).err().expect(perception);
            assert!(matches!(error, PerceptionError::Unknown(_)), "{error}");
            let text = error.to_string();
            assert!(text.contains(":` has no file after the colon"), "{text}");
        }
    }

    #[test]
    fn files_that_hold_no_complete_detector_are_refused_in_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("weights.safetensors");
        let refused = |bytes: Option<&[u8]>, words: &str| {
            if let Some(bytes) = bytes {
                std::fs::write(&path, bytes).unwrap();
            }
            for kind in [LEARNED, GT_NAMES] {
                let name = format!("{kind}:{}", path.display());
                let problem = perception_from_name(&name, GROUND_TRUTH).err().expect(words);
                let problem = problem.to_string();
                let names_file = problem.contains("weights.safetensors");
                let is_clear = names_file && problem.contains(words) && !problem.contains('\n');
                assert!(is_clear, "{words}: {problem}");
            }
        };
        refused(None, "weights.safetensors");
        let complete = TrainedDetector::built_in();
        let bytes = complete.to_bytes().unwrap();
        refused(Some(&bytes[..bytes.len() / 2]), "not a weights file");
        let behavior = TrainedBehavior::built_in().to_bytes().unwrap();
        refused(Some(&behavior), "weights of `chaic behavior 4`, expected `chaic detector 2");
        let one_stage = TrainedDetector { second_stage: None, ..complete };
        refused(Some(&one_stage.to_bytes().unwrap()), "lacks its second stage; train it with");
        // Evaluation and further training accept a detector with only the first stage.
        assert!(read_detector(&path).unwrap().second_stage.is_none());
        std::fs::write(&path, &bytes).unwrap();
        let name = format!("{LEARNED}:{}", path.display());
        assert!(perception_from_name(&name, GROUND_TRUTH).is_ok());
    }
}
