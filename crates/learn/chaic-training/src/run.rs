//! A training with a folder of its own: what it was begun with, checkpoints, curves and weights. It can
//! be stopped at any step and gone on with, bit for bit.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_files::{
    FileError, FolderLock, LOCK, LockError, UNFINISHED, entries, read_bounded, read_user_file,
    write_whole,
};
use chaic_nn::Network;
use chaic_nn::weights::WeightsError;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::bounds::BoundTable;
use crate::checkpoint::{Checkpoint, CheckpointError, Identity};
use crate::config::{check_rules, config_text, read_own_rules};
use crate::curves::{self, Figures, Of, Position, Record};

/// What it was begun with.
pub const CONFIG: &str = "config.toml";
/// All that is needed to go on.
pub const CHECKPOINT: &str = "checkpoint.bin";
/// Copy of the weights that it was begun with, if any.
pub const INITIAL_WEIGHTS: &str = "initial.safetensors";
/// Largest checkpoint or file of weights that is read, bytes: a hundred times that of the largest network.
const MAX_BYTES: u64 = 1 << 30;

/// Sections that every checkpoint has besides those of its training.
const FIGURE_NAMES: &str = "run.figure_names";
const FIGURES: &str = "run.figures";
const VALIDATION_IS_DUE: &str = "run.validation_is_due";

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
    /// The configuration that was given can't be used.
    #[error("this configuration can't be used: {0}")]
    Rules(String),
    /// Another process trains in the folder.
    #[error("{path} is in use by another `chaic train`; wait for it or choose another --out", path = .0.display())]
    Locked(PathBuf),
    /// The checkpoint is damaged or of another training.
    #[error("{path} {problem}", path = path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: CheckpointError,
    },
    /// There is no checkpoint where there must be one.
    #[error("{path} is missing, but the training has taken steps; begin a new one", path = .0.display())]
    NoCheckpoint(PathBuf),
    /// A weight or a moment of the optimizer is not finite.
    #[error(
        "after step {step}, {problem}; the last checkpoint is kept, try a lower rate from there"
    )]
    NotFinite {
        /// Steps taken.
        step: u64,
        /// Which one.
        problem: String,
    },
    /// The loss is no number any more.
    #[error(
        "the loss of step {0} is not a number; the last checkpoint is kept, try a lower rate from there"
    )]
    NotANumber(u64),
}

impl TrainingError {
    /// Returns whether what was asked for can't be, by its configuration alone.
    pub fn is_usage(&self) -> bool {
        matches!(self, TrainingError::Config { .. } | TrainingError::Rules(_))
    }

    /// For what it is to learn from.
    pub fn of_data(problem: impl Error + Send + Sync + 'static) -> TrainingError {
        TrainingError::Data(Box::new(problem))
    }
}

impl From<LockError> for TrainingError {
    fn from(error: LockError) -> TrainingError {
        match error {
            LockError::Held(path) => TrainingError::Locked(path),
            LockError::File(refused) => refused.into(),
        }
    }
}

/// Something that is trained in a folder of its own.
///
/// Long work gets a `stop` flag, which it checks at least once a second; where it was raised, the work returns
/// `None` and leaves the training as it was.
pub trait Training: Sized {
    /// What it is begun with: a file in TOML.
    type Rules: Clone + Default + Serialize + DeserializeOwned;
    /// Name of the training, as `chaic train` takes it. A checkpoint of another name is refused.
    const KIND: &'static str;
    /// Bounds of every number in the rules.
    const BOUNDS: BoundTable;
    /// The name of the file of weights.
    const WEIGHTS: &'static str;
    /// Steps between two records of the loss.
    const RECORD_STEPS: u64 = 20;
    /// Steps between two checkpoints.
    const CHECKPOINT_STEPS: u64 = 250;
    /// Steps between two validations.
    const VALIDATION_STEPS: u64 = 1000;

    /// Prepares the training for its first step; `None` if it was stopped meanwhile. `progress` is called with
    /// what has been done, which is kept in the folder.
    ///
    /// # Errors
    /// If data can't be kept or read.
    fn new(
        rules: &Self::Rules,
        folder: &Path,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<Self>, TrainingError>;

    /// Checks what bounds of single numbers can't say, and the inputs that the rules name.
    ///
    /// # Errors
    /// One line that says what is wrong.
    fn check(rules: &Self::Rules) -> Result<(), String>;

    /// Returns the numbers in a file of weights that a training by these rules can begin with.
    ///
    /// # Errors
    /// If it isn't one of this network, or a number is not finite.
    fn read_weights(rules: &Self::Rules, weights: &[u8]) -> Result<Vec<f32>, WeightsError>;

    /// The network that is trained.
    fn network(&self) -> &Network;

    /// Steps in all.
    fn steps(&self) -> u64;

    /// Steps taken.
    fn taken(&self) -> u64;

    /// Returns all that is needed to go on.
    fn checkpoint(&self) -> Checkpoint;

    /// Takes these numbers, of [`Training::read_weights`], in place of random ones.
    fn begin_with(&mut self, numbers: Vec<f32>);

    /// Goes on from a checkpoint; `None` if it was stopped meanwhile.
    ///
    /// # Errors
    /// If a section doesn't fit this training.
    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        stop: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError>;

    /// Takes a step; `None` if it was stopped meanwhile, and the step not taken.
    fn step(&mut self, stop: &AtomicBool) -> Option<Figures>;

    /// Returns how good it is so far on what nothing is learned from, and its weights as a file; `None` if it
    /// was stopped meanwhile.
    ///
    /// # Errors
    /// If a weight is not finite.
    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Figures, Vec<u8>)>, WeightsError>;
}

/// A training and its folder, which is locked meanwhile.
pub struct TrainingRun<T> {
    folder: PathBuf,
    training: T,
    /// Figures of the steps since the last record.
    unrecorded: Vec<Figures>,
    /// Whether the validation of the last step is still to be done.
    validation_is_due: bool,
    _lock: FolderLock,
}

/// Returns the checkpoint file of a training with the figures of its steps since the last record.
///
/// # Errors
/// If a number is not finite.
pub fn checkpoint_bytes<T: Training>(
    training: &T,
    unrecorded: &[Figures],
) -> Result<Vec<u8>, CheckpointError> {
    let mut checkpoint = training.checkpoint();
    insert_progress(&mut checkpoint, unrecorded, false);
    checkpoint.to_bytes(&identity(training))
}

/// Goes on with a training from a checkpoint file; `None` if it was stopped meanwhile.
///
/// # Errors
/// If the file is damaged or of another training.
pub fn restore<T: Training>(
    training: &mut T,
    bytes: &[u8],
    stop: &AtomicBool,
) -> Result<Option<Checkpoint>, CheckpointError> {
    let checkpoint = Checkpoint::from_bytes(bytes, &identity(training))?;
    if training.resume(&checkpoint, stop)?.is_none() {
        return Ok(None);
    }
    let (taken, steps) = (training.taken(), training.steps());
    if taken > steps {
        let problem = format!("has {taken} steps taken, of {steps} in {CONFIG}");
        return Err(CheckpointError::section("steps", problem));
    }
    Ok(Some(checkpoint))
}

pub(crate) fn identity<T: Training>(training: &T) -> Identity {
    Identity::new(T::KIND, training.network())
}

fn insert_progress(checkpoint: &mut Checkpoint, unrecorded: &[Figures], validation_is_due: bool) {
    let names: Vec<&str> = unrecorded.iter().take(1).flat_map(|f| f.keys().map(|k| &**k)).collect();
    checkpoint.insert_bytes(FIGURE_NAMES, names.join("\n").into_bytes());
    let values = unrecorded.iter().flat_map(|figures| figures.values().copied());
    checkpoint.insert_doubles(FIGURES, values.collect());
    checkpoint.insert_integers(VALIDATION_IS_DUE, vec![u64::from(validation_is_due)]);
}

/// Returns the figures since the last record, and whether a validation is due.
fn progress_of(checkpoint: &Checkpoint) -> Result<(Vec<Figures>, bool), CheckpointError> {
    let names = std::str::from_utf8(checkpoint.bytes(FIGURE_NAMES)?)
        .map_err(|_| CheckpointError::section(FIGURE_NAMES, "is no text"))?;
    let names: Vec<&str> = names.split('\n').collect();
    let values = checkpoint.doubles(FIGURES)?;
    if !values.len().is_multiple_of(names.len()) {
        return Err(CheckpointError::section(FIGURES, "does not fit the names of figures"));
    }
    let of_step = |values: &[f64]| {
        names.iter().map(|name| (*name).to_owned()).zip(values.iter().copied()).collect()
    };
    let unrecorded = values.chunks_exact(names.len()).map(of_step).collect();
    let validation_is_due = checkpoint.integer(VALIDATION_IS_DUE)?;
    Ok((unrecorded, validation_is_due != 0))
}

impl<T: Training> TrainingRun<T> {
    /// Begins a training, with the weights in a file or with random ones; `None` if it was stopped before the
    /// first step. `progress` is called with what has been done.
    ///
    /// # Errors
    /// If rules or weights can't be used, the folder is in use or not empty, or the file system refuses. The
    /// folder then holds no training to resume.
    pub fn begin(
        folder: &Path,
        rules: &T::Rules,
        weights: Option<&Path>,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<TrainingRun<T>>, TrainingError> {
        check_rules::<T>(rules).map_err(TrainingError::Rules)?;
        let read = |path| read_weights::<T>(rules, path, read_user_file(path, MAX_BYTES)?);
        let weights = weights.map(read).transpose()?;
        if let Err(refusal) = check_is_empty(folder) {
            // Who trains here says more than that something lies here.
            if folder.join(LOCK).exists() {
                FolderLock::take(folder)?;
            }
            return Err(refusal);
        }
        let is_new = !folder.exists();
        fs::create_dir_all(folder).map_err(FileError::of("can't make", folder))?;
        let lock = FolderLock::take(folder)?;
        // Another process may have begun between the first look and the lock.
        check_is_empty(folder)?;
        let begun = begin_locked::<T>(folder, rules, weights, progress, stop);
        if begun.is_err() {
            clear(folder, is_new);
        }
        Ok(begun?.map(|training| TrainingRun {
            folder: folder.to_owned(),
            training,
            unrecorded: Vec::new(),
            validation_is_due: false,
            _lock: lock,
        }))
    }

    /// Goes on with a training that was begun; `None` if it was stopped before it was ready.
    ///
    /// # Errors
    /// If its files can't be read, are damaged or aren't those of a training, or the folder is in use.
    pub fn resume(
        folder: &Path,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<TrainingRun<T>>, TrainingError> {
        // A folder without a configuration gets no lock file.
        let rules = read_own_rules::<T>(&folder.join(CONFIG))?;
        let lock = FolderLock::take(folder)?;
        let path = folder.join(CHECKPOINT);
        // Without one it was stopped before its first step. A link that leads nowhere is one that is lost.
        let has_checkpoint = fs::symlink_metadata(&path).is_ok();
        let bytes = has_checkpoint.then(|| read_bounded(&path, MAX_BYTES)).transpose()?;
        if bytes.is_none() && curves::is_begun(folder) {
            return Err(TrainingError::NoCheckpoint(path));
        }
        let Some(mut training) = T::new(&rules, folder, progress, stop)? else { return Ok(None) };
        let (mut unrecorded, mut validation_is_due) = (Vec::new(), false);
        match bytes {
            Some(bytes) => {
                let wrong = |problem| TrainingError::Checkpoint { path: path.clone(), problem };
                let restored = restore(&mut training, &bytes, stop).map_err(wrong)?;
                let Some(checkpoint) = restored else { return Ok(None) };
                (unrecorded, validation_is_due) = progress_of(&checkpoint).map_err(wrong)?;
            }
            None => {
                let initial = folder.join(INITIAL_WEIGHTS);
                if initial.exists() {
                    let bytes = read_bounded(&initial, MAX_BYTES)?;
                    training.begin_with(read_weights::<T>(&rules, &initial, bytes)?.numbers);
                }
            }
        }
        let of = if validation_is_due { Of::Loss } else { Of::Validation };
        curves::cut_back(folder, Some(Position { step: training.taken(), of }))?;
        let folder = folder.to_owned();
        Ok(Some(TrainingRun { folder, training, unrecorded, validation_is_due, _lock: lock }))
    }

    /// Steps taken and steps in all.
    pub fn extent(&self) -> (u64, u64) {
        (self.taken(), self.training.steps())
    }

    fn taken(&self) -> u64 {
        self.training.taken()
    }

    /// Takes steps until there are no more or `stop` is raised; returns whether it came to the end.
    ///
    /// # Errors
    /// If the file system refuses, or the loss or a weight is no number; the last checkpoint stays.
    pub fn go_on(
        &mut self,
        stop: &AtomicBool,
        report: &mut dyn FnMut(&Record),
    ) -> Result<bool, TrainingError> {
        while self.validation_is_due || self.taken() < self.training.steps() {
            let is_done = !stop.load(Ordering::Relaxed)
                && (self.validation_is_due || self.step(stop, report)?)
                && (!self.validation_is_due || self.validate(stop, report)?);
            if !is_done {
                self.keep()?;
                return Ok(false);
            }
            let step = self.taken();
            if step.is_multiple_of(T::CHECKPOINT_STEPS) || step == self.training.steps() {
                self.keep()?;
            }
        }
        Ok(true)
    }

    /// Takes a step and records the loss if that is due; returns whether the step was taken.
    fn step(
        &mut self,
        stop: &AtomicBool,
        report: &mut dyn FnMut(&Record),
    ) -> Result<bool, TrainingError> {
        let Some(figures) = self.training.step(stop) else { return Ok(false) };
        let step = self.taken();
        if !figures.values().all(|x| x.is_finite()) {
            return Err(TrainingError::NotANumber(step));
        }
        self.unrecorded.push(figures);
        let is_last = step == self.training.steps();
        if step.is_multiple_of(T::RECORD_STEPS) || is_last {
            let figures = curves::mean(&self.unrecorded);
            self.unrecorded.clear();
            self.record(&Record { of: Of::Loss, step, figures }, report)?;
        }
        self.validation_is_due = step.is_multiple_of(T::VALIDATION_STEPS) || is_last;
        Ok(true)
    }

    /// Validates, records that and writes the weights; returns whether it was done.
    fn validate(
        &mut self,
        stop: &AtomicBool,
        report: &mut dyn FnMut(&Record),
    ) -> Result<bool, TrainingError> {
        let step = self.taken();
        let not_finite =
            |problem: WeightsError| TrainingError::NotFinite { step, problem: problem.to_string() };
        let validated = self.training.validate(stop).map_err(not_finite)?;
        let Some((figures, weights)) = validated else { return Ok(false) };
        self.record(&Record { of: Of::Validation, step, figures }, report)?;
        write_whole(&self.folder.join(T::WEIGHTS), &weights)?;
        self.validation_is_due = false;
        Ok(true)
    }

    fn keep(&self) -> Result<(), TrainingError> {
        let mut checkpoint = self.training.checkpoint();
        insert_progress(&mut checkpoint, &self.unrecorded, self.validation_is_due);
        let step = self.taken();
        let bytes = checkpoint
            .to_bytes(&identity(&self.training))
            .map_err(|problem| TrainingError::NotFinite { step, problem: problem.to_string() })?;
        Ok(write_whole(&self.folder.join(CHECKPOINT), &bytes)?)
    }

    fn record(
        &self,
        record: &Record,
        report: &mut dyn FnMut(&Record),
    ) -> Result<(), TrainingError> {
        curves::append(&self.folder, record)?;
        report(record);
        Ok(())
    }
}

/// A file of weights that was read and checked.
struct InitialWeights {
    bytes: Vec<u8>,
    numbers: Vec<f32>,
}

fn read_weights<T: Training>(
    rules: &T::Rules,
    path: &Path,
    bytes: Vec<u8>,
) -> Result<InitialWeights, TrainingError> {
    let wrong = |problem| TrainingError::Weights { path: path.to_owned(), problem };
    let numbers = T::read_weights(rules, &bytes).map_err(wrong)?;
    Ok(InitialWeights { bytes, numbers })
}

/// Begins a training in a folder that is locked and empty.
fn begin_locked<T: Training>(
    folder: &Path,
    rules: &T::Rules,
    weights: Option<InitialWeights>,
    progress: &mut dyn FnMut(&str),
    stop: &AtomicBool,
) -> Result<Option<T>, TrainingError> {
    if let Some(weights) = &weights {
        // For a training that is stopped before its first checkpoint.
        write_whole(&folder.join(INITIAL_WEIGHTS), &weights.bytes)?;
    }
    // Its presence makes the folder a training, so it is written last.
    write_whole(&folder.join(CONFIG), config_text::<T>(rules).as_bytes())?;
    let Some(mut training) = T::new(rules, folder, progress, stop)? else { return Ok(None) };
    if let Some(weights) = weights {
        training.begin_with(weights.numbers);
    }
    let wrong = |problem| TrainingError::Checkpoint { path: folder.join(CHECKPOINT), problem };
    let bytes = checkpoint_bytes(&training, &[]).map_err(wrong)?;
    write_whole(&folder.join(CHECKPOINT), &bytes)?;
    Ok(Some(training))
}

/// Refuses a folder with anything but what a training leaves that was killed before it began.
fn check_is_empty(folder: &Path) -> Result<(), TrainingError> {
    if !folder.exists() {
        return Ok(());
    }
    let leftovers = [LOCK, INITIAL_WEIGHTS].map(str::to_owned);
    let unfinished = [INITIAL_WEIGHTS, CONFIG].map(|name| format!("{name}{UNFINISHED}"));
    let is_leftover = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str());
        leftovers.iter().chain(&unfinished).any(|leftover| Some(leftover.as_str()) == name)
    };
    match entries(folder)?.iter().all(is_leftover) {
        true => Ok(()),
        false => Err(TrainingError::NotEmpty(folder.to_owned())),
    }
}

/// Removes what makes a folder a training, after its beginning failed; the folder too if it is new and holds
/// nothing else.
fn clear(folder: &Path, is_new: bool) {
    // The failure is what is reported; what cannot be removed stays.
    for name in [CONFIG, INITIAL_WEIGHTS, CHECKPOINT] {
        let _ = fs::remove_file(folder.join(name));
    }
    if is_new {
        let _ = fs::remove_file(folder.join(LOCK));
        let _ = fs::remove_dir(folder);
    }
}
