//! Interface of trainers, and the error of a training.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use chaic_files::{FileError, LockError};
use chaic_nn::Network;
use chaic_nn::weights::WeightsError;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::bounds::BoundTable;
use crate::checkpoint::{Checkpoint, CheckpointError};
use crate::curves::Metrics;

/// Training algorithm that [`TrainingRun`](crate::TrainingRun) runs in a folder.
///
/// Long operations get a `stop` flag and check it at least once a second. If the flag is set, they
/// return `None` and leave the training unchanged.
pub trait Trainer: Sized {
    /// Configuration, stored as TOML.
    type Config: Clone + Default + Serialize + DeserializeOwned;
    /// Name of the training, as in `chaic train NAME`. Checkpoints with another name are refused.
    const KIND: &'static str;
    /// Bounds of every number in the configuration.
    const BOUNDS: BoundTable;
    /// Name of the weights file.
    const WEIGHTS: &'static str;
    /// Number of steps between two records of the training metrics.
    const RECORD_STEPS: u64 = 20;
    /// Number of steps between two checkpoints.
    const CHECKPOINT_STEPS: u64 = 250;
    /// Number of steps between two validations.
    const VALIDATION_STEPS: u64 = 1000;
    /// Validation metric that selects the kept weights: those with the highest value. With `None`,
    /// the weights of the last validation are kept. Weights without a value are kept until a
    /// validation has a value.
    const SCORE: Option<&'static str> = None;
    /// Key of the configuration that names the data of [`Trainer::input_digest`]; empty if there is none.
    const INPUT_KEY: &'static str = "";
    /// Names of files and folders in the folder of the training that [`Trainer::new`] writes. A failed
    /// start removes them, unless a file operation failed ([`TrainingError::File`]).
    const DATA: &'static [&'static str] = &[];

    /// Prepares the training for its first step; `None` if it was stopped.
    ///
    /// `progress` is called with descriptions of finished work. Collected data may be kept in
    /// `folder`.
    ///
    /// # Errors
    /// If data cannot be written or read, or cannot be used. A failed file operation is
    /// [`TrainingError::File`].
    fn new(
        config: &Self::Config,
        folder: &Path,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<Self>, TrainingError>;

    /// Checks constraints that bounds of single numbers cannot express, and the input files that
    /// the configuration names.
    ///
    /// # Errors
    /// One line that describes the problem.
    fn check(config: &Self::Config) -> Result<(), String>;

    /// Reads initial parameters for this configuration from a weights file.
    ///
    /// # Errors
    /// If the file does not fit the network, or a value is not finite.
    fn read_weights(config: &Self::Config, weights: &[u8]) -> Result<Vec<f32>, WeightsError>;

    /// Returns the keys that may not change between start and resume, such as `rollout.tasks`. The network,
    /// the data in the folder, recorded positions or the best score depend on them. Each key has a value in
    /// every configuration; the key of a table stands for all keys of the table.
    fn fixed_keys() -> Vec<&'static str> {
        Vec::new()
    }

    /// Returns the trained network.
    fn network(&self) -> &Network;

    /// Returns the total number of steps.
    fn total_steps(&self) -> u64;

    /// Returns the number of steps taken.
    fn steps_done(&self) -> u64;

    /// Returns a digest of the training data outside of the folder; `None` if there is none. A training
    /// is resumed only with the same data.
    fn input_digest(&self) -> Option<u64> {
        None
    }

    /// Returns the complete state of the training.
    fn checkpoint(&self) -> Checkpoint;

    /// Replaces the random initial parameters by those of [`Trainer::read_weights`].
    fn load_parameters(&mut self, parameters: Vec<f32>);

    /// Restores the state of a checkpoint; `None` if it was stopped.
    ///
    /// # Errors
    /// If a section does not fit this training.
    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        stop: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError>;

    /// Takes one step and returns its metrics; `None` if it was stopped before the step was
    /// complete.
    ///
    /// # Errors
    /// If data cannot be written.
    fn step(&mut self, stop: &AtomicBool) -> Result<Option<Metrics>, TrainingError>;

    /// Returns the validation metrics and the content of a weights file; `None` if it was stopped.
    ///
    /// # Errors
    /// If a parameter is not finite.
    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Metrics, Vec<u8>)>, WeightsError>;
}

/// Reason why a training cannot start, resume or continue.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// An operation of the file system failed.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file operation failed before the first step. The folder keeps the collected data, and the
    /// training can be resumed.
    #[error("{0}; the collected data is kept, continue with --resume")]
    Collection(FileError),
    /// Training data cannot be used.
    #[error(transparent)]
    Data(Box<dyn Error + Send + Sync>),
    /// The output folder has content.
    #[error("{0} isn't empty; continue it with --resume or choose another --out")]
    NotEmpty(PathBuf),
    /// The folder to resume from has no configuration.
    #[error("{0} holds no training; leave out --resume to start one")]
    NoTraining(PathBuf),
    /// The folder to resume from belongs to another kind of training.
    #[error("{path} holds a training of `chaic train {found}`, not of `chaic train {expected}`")]
    OtherKind {
        /// The folder.
        path: PathBuf,
        /// Kind of its training.
        found: String,
        /// Kind of this training.
        expected: String,
    },
    /// A configuration file is invalid.
    #[error("{path}: {problem}")]
    Config {
        /// The file.
        path: PathBuf,
        /// Description of the problem.
        problem: String,
    },
    /// The initial weights do not fit the network.
    #[error("{path}: {problem}")]
    Weights {
        /// The file.
        path: PathBuf,
        /// Description of the problem.
        problem: WeightsError,
    },
    /// A configuration that was not read from a file is invalid.
    #[error("this configuration can't be used: {0}")]
    InvalidConfig(String),
    /// Another process trains in the folder.
    #[error("{path} is in use by another `chaic train`; wait for it or choose another --out", path = .0.display())]
    Locked(PathBuf),
    /// The checkpoint is damaged or belongs to another training.
    #[error("{path} {problem}", path = path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// Description of the problem.
        problem: CheckpointError,
    },
    /// The checkpoint is missing although curves exist.
    #[error("{path} is missing, but the training has taken steps; start a new one", path = .0.display())]
    NoCheckpoint(PathBuf),
    /// A parameter or an optimizer moment is not finite.
    #[error(
        "after step {step}, {problem}; the last checkpoint is kept, resume it with a lower learning rate"
    )]
    NotFinite {
        /// Number of steps taken.
        step: u64,
        /// Name of the tensor and the problem.
        problem: String,
    },
    /// A metric of a step or of its validation is not finite; holds the step.
    #[error(
        "a metric of step {0} is not finite; the last checkpoint is kept, resume it with a lower learning rate"
    )]
    NonFiniteMetric(u64),
}

impl TrainingError {
    /// Returns whether the configuration alone causes the error.
    pub fn is_usage(&self) -> bool {
        matches!(self, TrainingError::Config { .. } | TrainingError::InvalidConfig(_))
    }

    /// Creates an error about training data.
    pub fn from_data(problem: impl Error + Send + Sync + 'static) -> TrainingError {
        TrainingError::Data(Box::new(problem))
    }
}

impl From<LockError> for TrainingError {
    fn from(error: LockError) -> TrainingError {
        match error {
            LockError::Held(path) => TrainingError::Locked(path),
            LockError::File(error) => error.into(),
        }
    }
}
