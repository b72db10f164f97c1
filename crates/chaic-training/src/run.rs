//! A training with a folder of its own: what it was begun with, checkpoints, curves and weights. It can
//! be stopped at any step and gone on with, bit for bit.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_files::{FileError, open_to_append, read_bounded, read_user_file, write_whole};
use chaic_nn::weights::WeightsError;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// What it was begun with.
pub const CONFIG: &str = "config.toml";
/// All that is needed to go on.
pub const CHECKPOINT: &str = "checkpoint.bin";
/// Losses and validations, a JSON object a line.
pub const CURVES: &str = "curves.jsonl";
/// No checkpoint or configuration is larger, bytes.
const MOST_BYTES: u64 = 1 << 30;

/// Why a training can't begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// The file system refuses.
    #[error(transparent)]
    File(#[from] FileError),
    /// What it is to learn from can't be kept or read.
    #[error(transparent)]
    Data(Box<dyn Error + Send + Sync>),
    /// There is something already.
    #[error("{0} isn't empty; go on with it by --resume, or choose another --out")]
    NotEmpty(PathBuf),
    /// The configuration can't be read.
    #[error("{path}: {problem}")]
    Config {
        /// Where.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The weights to begin with are none of this network.
    #[error("{path}: {problem}")]
    Weights {
        /// Where.
        path: PathBuf,
        /// What is wrong.
        problem: WeightsError,
    },
    /// The checkpoint is cut off or of another network.
    #[error("{0} is no checkpoint of this network")]
    Checkpoint(PathBuf),
    /// The loss is no number any more.
    #[error(
        "the loss of step {0} is not a number; the last checkpoint is kept, try a lower rate from there"
    )]
    NotANumber(u64),
}

impl TrainingError {
    /// For what it is to learn from.
    pub fn of_data(problem: impl Error + Send + Sync + 'static) -> TrainingError {
        TrainingError::Data(Box::new(problem))
    }
}

/// Numbers with their names.
pub type Figures = BTreeMap<String, f64>;

/// A line of the curves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// What the figures are of.
    pub of: Of,
    /// After so many steps.
    pub step: u64,
    /// The figures: means over the steps since the last record, or those of a validation.
    #[serde(flatten)]
    pub figures: Figures,
}

/// What figures are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Of {
    /// What is learned from.
    Loss,
    /// What nothing is learned from.
    Validation,
}

/// Something that is trained in a folder of its own.
pub trait Training: Sized {
    /// What it is begun with: a file in TOML.
    type Rules: Clone + Default + Serialize + DeserializeOwned;
    /// The name of the file of weights.
    const WEIGHTS: &'static str;
    /// Steps between two records of the loss.
    const RECORD_STEPS: u64 = 20;
    /// Steps between two checkpoints.
    const CHECKPOINT_STEPS: u64 = 250;
    /// Steps between two validations.
    const VALIDATION_STEPS: u64 = 1000;

    /// Before the first step; `None` if it was stopped before it was ready. `go_on` is asked now and then
    /// while it gets ready, with what has been done, which is kept in the folder.
    ///
    /// # Errors
    /// If it can't be kept or read.
    fn new(
        rules: &Self::Rules,
        folder: &Path,
        go_on: &mut dyn FnMut(&str) -> bool,
    ) -> Result<Option<Self>, TrainingError>;

    /// What is wrong with rules by which nothing can be trained.
    ///
    /// # Errors
    /// That, in a sentence.
    fn check(rules: &Self::Rules) -> Result<(), String>;

    /// Steps in all.
    fn steps(&self) -> u64;

    /// Steps taken.
    fn taken(&self) -> u64;

    /// All that is needed to go on.
    fn checkpoint(&self) -> Vec<u8>;

    /// Takes the numbers of a file of weights in place of random ones.
    ///
    /// # Errors
    /// If it isn't one of this network.
    fn begin_with(&mut self, weights: &[u8]) -> Result<(), WeightsError>;

    /// Goes on from a checkpoint; `false` if it is of another network.
    fn resume(&mut self, bytes: &[u8]) -> bool;

    /// Takes a step.
    fn step(&mut self) -> Figures;

    /// How good it is so far on what nothing is learned from, and its weights as a file.
    fn validate(&self) -> (Figures, Vec<u8>);
}

/// A training and its folder.
pub struct TrainingRun<T> {
    folder: PathBuf,
    training: T,
}

impl<T: Training> TrainingRun<T> {
    /// A new one; `None` if `go_on` says no before the first step.
    ///
    /// # Errors
    /// If the folder isn't empty, or the file system refuses.
    pub fn begin(
        folder: &Path,
        rules: &T::Rules,
        go_on: &mut dyn FnMut(&str) -> bool,
    ) -> Result<Option<TrainingRun<T>>, TrainingError> {
        let is_taken = fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
        if is_taken {
            return Err(TrainingError::NotEmpty(folder.to_owned()));
        }
        fs::create_dir_all(folder).map_err(FileError::of("can't make", folder))?;
        let path = folder.join(CONFIG);
        let text = toml::to_string(rules).expect("rules are plain data");
        write_whole(&path, text.as_bytes())?;
        let Some(training) = T::new(rules, folder, go_on)? else { return Ok(None) };
        let run = TrainingRun { folder: folder.to_owned(), training };
        run.keep()?;
        Ok(Some(run))
    }

    /// One that was begun; `None` if `go_on` says no before it is ready.
    ///
    /// # Errors
    /// If its files can't be read or aren't those of a training.
    pub fn resume(
        folder: &Path,
        go_on: &mut dyn FnMut(&str) -> bool,
    ) -> Result<Option<TrainingRun<T>>, TrainingError> {
        let path = folder.join(CONFIG);
        let rules = parse_rules::<T>(&path, &read_bounded(&path, MOST_BYTES)?)?;
        let path = folder.join(CHECKPOINT);
        // Without one it was stopped before its first step.
        let bytes = path.exists().then(|| read_bounded(&path, MOST_BYTES)).transpose()?;
        let Some(mut training) = T::new(&rules, folder, go_on)? else { return Ok(None) };
        if bytes.is_some_and(|bytes| !training.resume(&bytes)) {
            return Err(TrainingError::Checkpoint(path));
        }
        Ok(Some(TrainingRun { folder: folder.to_owned(), training }))
    }

    /// Before the first step: takes the numbers in a file of weights in place of random ones.
    ///
    /// # Errors
    /// If it can't be read, or isn't one of this network; the folder stays.
    pub fn begin_with(&mut self, path: &Path) -> Result<(), TrainingError> {
        let bytes = read_user_file(path, MOST_BYTES)?;
        let wrong = |problem| TrainingError::Weights { path: path.to_owned(), problem };
        self.training.begin_with(&bytes).map_err(wrong)?;
        self.keep()
    }

    /// Steps taken and steps in all.
    pub fn extent(&self) -> (u64, u64) {
        (self.taken(), self.training.steps())
    }

    fn taken(&self) -> u64 {
        self.training.taken()
    }

    /// Takes steps until there are no more or `stop` is raised; whether it came to the end.
    ///
    /// # Errors
    /// If the file system refuses, or the loss is no number; the last checkpoint stays.
    pub fn go_on(
        &mut self,
        stop: &AtomicBool,
        tell: &mut dyn FnMut(&Record),
    ) -> Result<bool, TrainingError> {
        let mut told: Vec<Figures> = Vec::new();
        while self.taken() < self.training.steps() {
            if stop.load(Ordering::Relaxed) {
                self.keep()?;
                return Ok(false);
            }
            let figures = self.training.step();
            let step = self.taken();
            if !figures.values().all(|x| x.is_finite()) {
                return Err(TrainingError::NotANumber(step));
            }
            told.push(figures);
            let is_last = step == self.training.steps();
            if step.is_multiple_of(T::RECORD_STEPS) || is_last {
                self.record(&Record { of: Of::Loss, step, figures: mean(&told) }, tell)?;
                told.clear();
            }
            if step.is_multiple_of(T::VALIDATION_STEPS) || is_last {
                let (figures, weights) = self.training.validate();
                self.record(&Record { of: Of::Validation, step, figures }, tell)?;
                write_whole(&self.folder.join(T::WEIGHTS), &weights)?;
            }
            if step.is_multiple_of(T::CHECKPOINT_STEPS) || is_last {
                self.keep()?;
            }
        }
        Ok(true)
    }

    fn keep(&self) -> Result<(), TrainingError> {
        let checkpoint = self.training.checkpoint();
        Ok(write_whole(&self.folder.join(CHECKPOINT), &checkpoint)?)
    }

    fn record(&self, record: &Record, tell: &mut dyn FnMut(&Record)) -> Result<(), TrainingError> {
        let path = self.folder.join(CURVES);
        let line = serde_json::to_string(record).expect("a record is plain data") + "\n";
        let written = open_to_append(&path)?.write_all(line.as_bytes());
        written.map_err(FileError::of("can't write", &path))?;
        tell(record);
        Ok(())
    }
}

/// Reads rules from a file that a user named. Rules that it does not name have their defaults.
///
/// # Errors
/// If it can't be read, names rules that aren't there, or nothing can be trained by them.
pub fn read_rules<T: Training>(path: &Path) -> Result<T::Rules, TrainingError> {
    parse_rules::<T>(path, &read_user_file(path, MOST_BYTES)?)
}

fn parse_rules<T: Training>(path: &Path, bytes: &[u8]) -> Result<T::Rules, TrainingError> {
    let wrong = |problem: String| TrainingError::Config { path: path.to_owned(), problem };
    let text = std::str::from_utf8(bytes).map_err(|e| wrong(e.to_string()))?;
    let rules: T::Rules = toml::from_str(text).map_err(|e| wrong(e.message().to_owned()))?;
    T::check(&rules).map_err(wrong)?;
    Ok(rules)
}

/// Figures of these names.
pub fn figures<const N: usize>(named: [(&str, f64); N]) -> Figures {
    named.into_iter().map(|(name, x)| (name.to_owned(), x)).collect()
}

/// The mean of each figure.
fn mean(told: &[Figures]) -> Figures {
    let mut sums = Figures::new();
    for (name, x) in told.iter().flatten() {
        *sums.entry(name.clone()).or_default() += x / told.len() as f64;
    }
    sums
}
