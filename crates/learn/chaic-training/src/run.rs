//! Training in its own folder: configuration, checkpoints, curves and weights. A training can be
//! stopped at any step and resumed with bit-identical results.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_files::{
    EntryKind, FolderLock, LOCK, TEMPORARY_SUFFIX, create_folders, entries, kind, read_bounded,
    read_user_file, remove_empty_folder, remove_file, remove_folder, write_atomically,
};
use chaic_nn::weights::WeightsError;

use crate::checkpoint::{Checkpoint, CheckpointError, Identity, Section};
use crate::config::{check_config, config_text, read_written_config};
use crate::curves::{self, CurveRecord, Metrics, Phase, Position};
use crate::settings::{self, Settings, changed_setting};
use crate::trainer::{Trainer, TrainingError};

/// Name of the configuration file.
pub const CONFIG: &str = "config.toml";
/// Name of the checkpoint file.
pub const CHECKPOINT: &str = "checkpoint.bin";
/// Name of the copy of the initial weights, if any were given.
pub const INITIAL_WEIGHTS: &str = "initial.safetensors";
/// Maximum size of a checkpoint or weights file, bytes: a hundred times that of the largest
/// network.
const MAX_BYTES: u64 = 1 << 30;

/// Sections that every checkpoint has besides those of its trainer.
const METRIC_NAMES: &str = "run.figure_names";
const METRIC_COUNTS: &str = "run.figure_counts";
const METRIC_VALUES: &str = "run.figures";
const VALIDATION_IS_DUE: &str = "run.validation_is_due";
const BEST_SCORE: &str = "run.best_score";
const INPUT_DIGEST: &str = "run.input_digest";

/// Training with its locked folder.
pub struct TrainingRun<T> {
    folder: PathBuf,
    trainer: T,
    /// Metrics of the steps since the last record.
    pending_metrics: Vec<Metrics>,
    /// True while the validation after the last step is pending.
    validation_is_due: bool,
    /// Highest value so far of the metric [`Trainer::SCORE`].
    best_score: Option<f64>,
    /// Values of [`Trainer::fixed_keys`].
    settings: Settings,
    _lock: FolderLock,
}

/// Returns the content of a checkpoint file, with the metrics of the steps since the last record.
/// Like checkpoints of earlier builds, it records no settings.
///
/// # Errors
/// If a value is not finite.
pub fn checkpoint_bytes<T: Trainer>(
    trainer: &T,
    pending_metrics: &[Metrics],
) -> Result<Vec<u8>, CheckpointError> {
    complete_checkpoint(trainer, pending_metrics, false, None).to_bytes(&identity(trainer))
}

/// Restores a training from the content of a checkpoint file; `None` if it was stopped.
///
/// # Errors
/// If the file is damaged or belongs to another training, or the training data has changed.
pub fn restore<T: Trainer>(
    trainer: &mut T,
    bytes: &[u8],
    stop: &AtomicBool,
) -> Result<Option<Checkpoint>, CheckpointError> {
    let checkpoint = Checkpoint::from_bytes(bytes, &identity(trainer))?;
    check_input(trainer, &checkpoint)?;
    if trainer.resume(&checkpoint, stop)?.is_none() {
        return Ok(None);
    }
    let (done, total) = (trainer.steps_done(), trainer.total_steps());
    if done > total {
        let problem = format!("has {done} steps taken, of {total} in {CONFIG}");
        return Err(CheckpointError::section("steps", problem));
    }
    Ok(Some(checkpoint))
}

pub(crate) fn identity<T: Trainer>(trainer: &T) -> Identity {
    Identity::new(T::KIND, trainer.network())
}

/// Returns a message about a setting whose value differs from that in the content of a checkpoint file;
/// `None` if there is no such setting.
fn changed_since<T: Trainer>(
    bytes: &[u8],
    current: &Settings,
) -> Result<Option<String>, CheckpointError> {
    let (checkpoint, _) = Checkpoint::of_kind(bytes, T::KIND)?;
    let recorded = settings::recorded(&checkpoint)?;
    Ok(changed_setting(&recorded, current, "the training began"))
}

/// Checks that the training data has not changed since the start of the training.
fn check_input<T: Trainer>(trainer: &T, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
    // A checkpoint of an earlier version has no digest.
    let expected = input_section(trainer);
    if checkpoint.sections.get(INPUT_DIGEST).is_none_or(|recorded| *recorded == expected) {
        return Ok(());
    }
    let key = T::INPUT_KEY;
    Err(CheckpointError::Data(format!(
        "the data of `{key}` has changed since the training began; restore it or start a new training"
    )))
}

/// Returns the section with the digest of the training data, empty if there is none.
fn input_section<T: Trainer>(trainer: &T) -> Section {
    Section::Integers(trainer.input_digest().into_iter().collect())
}

/// Returns the checkpoint of a trainer with the sections of the run.
fn complete_checkpoint<T: Trainer>(
    trainer: &T,
    pending_metrics: &[Metrics],
    validation_is_due: bool,
    best_score: Option<f64>,
) -> Checkpoint {
    let mut checkpoint = trainer.checkpoint();
    checkpoint.sections.insert(INPUT_DIGEST.to_owned(), input_section(trainer));
    let names: Vec<&str> =
        pending_metrics.iter().flat_map(|m| m.keys().map(|name| &**name)).collect();
    checkpoint.insert_bytes(METRIC_NAMES, names.join("\n").into_bytes());
    // Steps of different stages have different metrics.
    let counts = pending_metrics.iter().map(|metrics| metrics.len() as u64);
    checkpoint.insert_bytes(METRIC_COUNTS, counts.flat_map(u64::to_le_bytes).collect());
    let values = pending_metrics.iter().flat_map(|metrics| metrics.values().copied());
    checkpoint.insert_doubles(METRIC_VALUES, values.collect());
    checkpoint.insert_integers(VALIDATION_IS_DUE, vec![u64::from(validation_is_due)]);
    checkpoint.insert_doubles(BEST_SCORE, best_score.into_iter().collect());
    checkpoint
}

/// Returns the metrics since the last record, whether a validation is due, and the best score.
fn read_progress(
    checkpoint: &Checkpoint,
) -> Result<(Vec<Metrics>, bool, Option<f64>), CheckpointError> {
    let names = std::str::from_utf8(checkpoint.bytes(METRIC_NAMES)?)
        .map_err(|_| CheckpointError::section(METRIC_NAMES, "is not UTF-8 text"))?;
    let names: Vec<&str> = names.split('\n').collect();
    let values = checkpoint.doubles(METRIC_VALUES)?;
    let counts: Vec<usize> = match checkpoint.bytes(METRIC_COUNTS) {
        Ok(bytes) => {
            let counts = bytes.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes));
            counts.map(|count| count as usize).collect()
        }
        // A checkpoint of an earlier version has the same names for all steps.
        Err(_) => vec![names.len(); values.len() / names.len()],
    };
    let n = counts.iter().fold(0, |sum: usize, count| sum.saturating_add(*count));
    if n != values.len() {
        return Err(CheckpointError::section(METRIC_VALUES, "does not fit the names of metrics"));
    }
    let mut named = names.iter().cycle().zip(values);
    let pending_metrics = counts
        .into_iter()
        .map(|count| {
            let of_step = named.by_ref().take(count);
            of_step.map(|(name, x)| (curves::current_name(name).to_owned(), *x)).collect()
        })
        .collect();
    let validation_is_due = checkpoint.integer(VALIDATION_IS_DUE)?;
    let best_score = match checkpoint.doubles(BEST_SCORE)? {
        [] => None,
        [score] => Some(*score),
        _ => return Err(CheckpointError::section(BEST_SCORE, "has more than one value")),
    };
    Ok((pending_metrics, validation_is_due != 0, best_score))
}

impl<T: Trainer> TrainingRun<T> {
    /// Starts a training with the weights of a file or with random ones; `None` if it was stopped
    /// before the first step. `progress` is called with descriptions of finished work.
    ///
    /// # Errors
    /// If configuration or weights are invalid, the folder is in use or not empty, or a file
    /// operation fails. The folder then holds no training to resume, except after
    /// [`TrainingError::Collection`].
    pub fn start(
        folder: &Path,
        config: &T::Config,
        weights: Option<&Path>,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<TrainingRun<T>>, TrainingError> {
        check_config::<T>(config).map_err(TrainingError::InvalidConfig)?;
        let read = |path| read_weights::<T>(config, path, read_user_file(path, MAX_BYTES)?);
        let weights = weights.map(read).transpose()?;
        if let Err(error) = check_is_empty(folder) {
            // "In use" is a more helpful message than "not empty".
            if folder.join(LOCK).exists() {
                FolderLock::acquire(folder)?;
            }
            return Err(error);
        }
        let is_new = !folder.exists();
        create_folders(folder)?;
        let lock = FolderLock::acquire(folder)?;
        // Another process may have started between the first check and the lock.
        check_is_empty(folder)?;
        let settings = settings::values(config, &T::fixed_keys());
        let started = start_locked::<T>(folder, config, &settings, weights, progress, stop)
            .map_err(|error| clean_up_failed_start(folder, T::DATA, is_new, error))?;
        Ok(started.map(|trainer| TrainingRun {
            folder: folder.to_owned(),
            trainer,
            pending_metrics: Vec::new(),
            validation_is_due: false,
            best_score: None,
            settings,
            _lock: lock,
        }))
    }

    /// Resumes a training; `None` if it was stopped before it was ready.
    ///
    /// # Errors
    /// If the folder holds no training, files cannot be read, are damaged or belong to another
    /// training, the training data or a fixed setting has changed, or the folder is in use.
    pub fn resume(
        folder: &Path,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<TrainingRun<T>>, TrainingError> {
        // A folder without a configuration gets no lock file.
        let path = folder.join(CONFIG);
        if kind(&path)? == EntryKind::Missing {
            return Err(TrainingError::NoTraining(folder.to_owned()));
        }
        let config = read_written_config::<T>(&path)
            .map_err(|error| other_kind::<T>(folder).unwrap_or(error))?;
        let lock = FolderLock::acquire(folder)?;
        let path = folder.join(CHECKPOINT);
        // No checkpoint: the training was stopped before its first step. A dangling link counts as
        // lost.
        let has_checkpoint = fs::symlink_metadata(&path).is_ok();
        let bytes = has_checkpoint.then(|| read_bounded(&path, MAX_BYTES)).transpose()?;
        if bytes.is_none() && curves::has_lines(folder) {
            return Err(TrainingError::NoCheckpoint(path));
        }
        let checkpoint_error = |problem| TrainingError::Checkpoint { path: path.clone(), problem };
        let settings = settings::values(&config, &T::fixed_keys());
        if let Some(bytes) = &bytes {
            // Changed settings may imply other data or another network, so this check comes first.
            let problem = changed_since::<T>(bytes, &settings).map_err(checkpoint_error)?;
            if let Some(problem) = problem {
                return Err(TrainingError::Config { path: folder.join(CONFIG), problem });
            }
        }
        let Some(mut trainer) = T::new(&config, folder, progress, stop)? else { return Ok(None) };
        let (mut pending_metrics, mut validation_is_due, mut best_score) =
            (Vec::new(), false, None);
        match bytes {
            Some(bytes) => {
                let restored = restore(&mut trainer, &bytes, stop).map_err(checkpoint_error)?;
                let Some(checkpoint) = restored else { return Ok(None) };
                (pending_metrics, validation_is_due, best_score) =
                    read_progress(&checkpoint).map_err(checkpoint_error)?;
            }
            None => {
                let initial = folder.join(INITIAL_WEIGHTS);
                if initial.exists() {
                    let bytes = read_bounded(&initial, MAX_BYTES)?;
                    trainer
                        .load_parameters(read_weights::<T>(&config, &initial, bytes)?.parameters);
                }
                write_initial_checkpoint(&trainer, &settings, folder)?;
            }
        }
        let phase = if validation_is_due { Phase::Train } else { Phase::Validation };
        let position = Position { step: trainer.steps_done(), phase };
        let last = curves::truncate_after(folder, Some(position))?;
        // If the configuration now ends the training here, its last step was not validated.
        validation_is_due |= position.step > 0
            && position.step == trainer.total_steps()
            && last != Some(Position { phase: Phase::Validation, ..position });
        let folder = folder.to_owned();
        Ok(Some(TrainingRun {
            folder,
            trainer,
            pending_metrics,
            validation_is_due,
            best_score,
            settings,
            _lock: lock,
        }))
    }

    /// Returns the number of steps taken and the total number of steps.
    pub fn progress(&self) -> (u64, u64) {
        (self.steps_done(), self.trainer.total_steps())
    }

    fn steps_done(&self) -> u64 {
        self.trainer.steps_done()
    }

    /// Takes steps until all are taken or `stop` is raised; returns whether all were taken.
    ///
    /// # Errors
    /// If a file operation fails, or a metric or parameter is not finite. The last checkpoint is
    /// kept.
    pub fn run(
        &mut self,
        stop: &AtomicBool,
        report: &mut dyn FnMut(&CurveRecord),
    ) -> Result<bool, TrainingError> {
        while self.validation_is_due || self.steps_done() < self.trainer.total_steps() {
            let is_done = !stop.load(Ordering::Relaxed)
                && (self.validation_is_due || self.step(stop, report)?)
                && (!self.validation_is_due || self.validate(stop, report)?);
            if !is_done {
                self.write_checkpoint()?;
                return Ok(false);
            }
            let step = self.steps_done();
            if step.is_multiple_of(T::CHECKPOINT_STEPS) || step == self.trainer.total_steps() {
                self.write_checkpoint()?;
            }
        }
        Ok(true)
    }

    /// Takes a step and records the training metrics if due; returns whether the step was taken.
    fn step(
        &mut self,
        stop: &AtomicBool,
        report: &mut dyn FnMut(&CurveRecord),
    ) -> Result<bool, TrainingError> {
        let Some(metrics) = self.trainer.step(stop)? else { return Ok(false) };
        let step = self.steps_done();
        check_finite(&metrics, step)?;
        self.pending_metrics.push(metrics);
        let is_last = step == self.trainer.total_steps();
        if step.is_multiple_of(T::RECORD_STEPS) || is_last {
            let metrics = curves::mean(&self.pending_metrics);
            self.pending_metrics.clear();
            self.record(&CurveRecord { phase: Phase::Train, step, metrics }, report)?;
        }
        self.validation_is_due = step.is_multiple_of(T::VALIDATION_STEPS) || is_last;
        Ok(true)
    }

    /// Validates, records the metrics, and writes the weights. Weights without a higher score do
    /// not replace scored weights. Returns whether the validation was completed.
    fn validate(
        &mut self,
        stop: &AtomicBool,
        report: &mut dyn FnMut(&CurveRecord),
    ) -> Result<bool, TrainingError> {
        let step = self.steps_done();
        let not_finite =
            |problem: WeightsError| TrainingError::NotFinite { step, problem: problem.to_string() };
        let validated = self.trainer.validate(stop).map_err(not_finite)?;
        let Some((metrics, weights)) = validated else { return Ok(false) };
        check_finite(&metrics, step)?;
        let score = T::SCORE.and_then(|name| metrics.get(name).copied());
        let is_best = self.best_score.is_none_or(|best| score.is_some_and(|score| score > best));
        if is_best {
            write_atomically(&self.folder.join(T::WEIGHTS), &weights)?;
        }
        // Resuming treats the last line of the curves as proof that its validation is complete, so
        // the weights are written first.
        self.record(&CurveRecord { phase: Phase::Validation, step, metrics }, report)?;
        if is_best {
            self.best_score = score;
        }
        self.validation_is_due = false;
        Ok(true)
    }

    fn write_checkpoint(&self) -> Result<(), TrainingError> {
        let (is_due, best_score) = (self.validation_is_due, self.best_score);
        let mut checkpoint =
            complete_checkpoint(&self.trainer, &self.pending_metrics, is_due, best_score);
        settings::record(&self.settings, &mut checkpoint);
        let step = self.steps_done();
        let bytes = checkpoint
            .to_bytes(&identity(&self.trainer))
            .map_err(|problem| TrainingError::NotFinite { step, problem: problem.to_string() })?;
        Ok(write_atomically(&self.folder.join(CHECKPOINT), &bytes)?)
    }

    fn record(
        &self,
        record: &CurveRecord,
        report: &mut dyn FnMut(&CurveRecord),
    ) -> Result<(), TrainingError> {
        curves::append(&self.folder, record)?;
        report(record);
        Ok(())
    }
}

/// Checks that metrics are finite. Undefined ones are left out of [`Metrics`].
fn check_finite(metrics: &Metrics, step: u64) -> Result<(), TrainingError> {
    let is_finite = metrics.values().all(|x| x.is_finite());
    is_finite.then_some(()).ok_or(TrainingError::NonFiniteMetric(step))
}

/// Content of a weights file with its parsed parameters.
struct InitialWeights {
    bytes: Vec<u8>,
    parameters: Vec<f32>,
}

fn read_weights<T: Trainer>(
    config: &T::Config,
    path: &Path,
    bytes: Vec<u8>,
) -> Result<InitialWeights, TrainingError> {
    let weights_error = |problem| TrainingError::Weights { path: path.to_owned(), problem };
    let parameters = T::read_weights(config, &bytes).map_err(weights_error)?;
    Ok(InitialWeights { bytes, parameters })
}

/// Starts a training in a folder that is locked and empty.
fn start_locked<T: Trainer>(
    folder: &Path,
    config: &T::Config,
    settings: &Settings,
    weights: Option<InitialWeights>,
    progress: &mut dyn FnMut(&str),
    stop: &AtomicBool,
) -> Result<Option<T>, TrainingError> {
    let initial = folder.join(INITIAL_WEIGHTS);
    match &weights {
        // A training that is stopped before its first checkpoint resumes from this copy.
        Some(weights) => write_atomically(&initial, &weights.bytes)?,
        // A training that was killed before it started may have left one.
        None if fs::symlink_metadata(&initial).is_ok() => remove_file(&initial)?,
        None => {}
    }
    // This file makes the folder a training, so it is written last.
    write_atomically(&folder.join(CONFIG), config_text::<T>(config).as_bytes())?;
    let Some(mut trainer) = T::new(config, folder, progress, stop)? else { return Ok(None) };
    if let Some(weights) = weights {
        trainer.load_parameters(weights.parameters);
    }
    write_initial_checkpoint(&trainer, settings, folder)?;
    Ok(Some(trainer))
}

/// Writes the checkpoint of a training before its first step. If curves exist without a checkpoint,
/// the checkpoint is lost.
fn write_initial_checkpoint<T: Trainer>(
    trainer: &T,
    settings: &Settings,
    folder: &Path,
) -> Result<(), TrainingError> {
    let path = folder.join(CHECKPOINT);
    let mut checkpoint = complete_checkpoint(trainer, &[], false, None);
    settings::record(settings, &mut checkpoint);
    let bytes = match checkpoint.to_bytes(&identity(trainer)) {
        Ok(bytes) => bytes,
        Err(problem) => return Err(TrainingError::Checkpoint { path, problem }),
    };
    Ok(write_atomically(&path, &bytes)?)
}

/// Refuses a folder with more than the leftovers of a training that was killed before it started.
fn check_is_empty(folder: &Path) -> Result<(), TrainingError> {
    if !folder.exists() {
        return Ok(());
    }
    let leftovers = [LOCK, INITIAL_WEIGHTS].map(str::to_owned);
    let unfinished = [INITIAL_WEIGHTS, CONFIG].map(|name| format!("{name}{TEMPORARY_SUFFIX}"));
    let is_leftover = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str());
        leftovers.iter().chain(&unfinished).any(|leftover| Some(leftover.as_str()) == name)
    };
    match entries(folder)?.iter().all(is_leftover) {
        true => Ok(()),
        false => Err(TrainingError::NotEmpty(folder.to_owned())),
    }
}

/// Returns the error about a folder whose checkpoint is of another kind of training; `None` if it is
/// of this kind or cannot be read.
fn other_kind<T: Trainer>(folder: &Path) -> Option<TrainingError> {
    let bytes = read_bounded(&folder.join(CHECKPOINT), MAX_BYTES).ok()?;
    match Checkpoint::of_kind(&bytes, T::KIND) {
        Err(CheckpointError::Kind { found, expected }) => {
            Some(TrainingError::OtherKind { path: folder.to_owned(), found, expected })
        }
        _ => None,
    }
}

/// Returns the error of a failed start. Collected data is kept if a file operation failed, on a full disk
/// for example: such a training can be resumed. Otherwise the training is removed.
fn clean_up_failed_start(
    folder: &Path,
    data: &[&str],
    is_new: bool,
    error: TrainingError,
) -> TrainingError {
    let exists = |name: &&str| fs::symlink_metadata(folder.join(name)).is_ok();
    match error {
        TrainingError::File(problem) if data.iter().any(exists) => {
            TrainingError::Collection(problem)
        }
        error => {
            remove_training(folder, data, is_new);
            error
        }
    }
}

/// Removes the files that make a folder a training, and its collected data. A new folder is removed too
/// if it is then empty.
fn remove_training(folder: &Path, data: &[&str], is_new: bool) {
    // The original failure is reported; files that cannot be removed stay.
    for name in [CONFIG, INITIAL_WEIGHTS, CHECKPOINT].iter().chain(data) {
        let path = folder.join(name);
        let is_folder = kind(&path).is_ok_and(|kind| kind == EntryKind::Folder);
        let _ = if is_folder { remove_folder(&path) } else { remove_file(&path) };
    }
    if is_new {
        let _ = remove_file(&folder.join(LOCK));
        let _ = remove_empty_folder(folder);
    }
}
