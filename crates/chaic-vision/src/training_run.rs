//! A training with a folder of its own: what it was begun with, checkpoints, curves and weights. It can
//! be stopped at any step and gone on with, bit for bit.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_files::{FileError, read_bounded, write_whole};
use serde::Serialize;

use crate::evaluate::{calibrate, evaluate};
use crate::loss::Loss;
use crate::train::{Trainer, TrainingRules};
use crate::trained::TrainedDetector;
use crate::views::ViewRules;

/// What it was begun with.
pub const CONFIG: &str = "config.toml";
/// All that is needed to go on.
pub const CHECKPOINT: &str = "checkpoint.bin";
/// Losses and validations, a JSON object a line.
pub const CURVES: &str = "curves.jsonl";
/// The weights so far, for minds.
pub const WEIGHTS: &str = "detector.safetensors";

/// Steps between two records of the loss, checkpoints, and validations.
const RECORD_STEPS: u64 = 20;
const CHECKPOINT_STEPS: u64 = 250;
const VALIDATION_STEPS: u64 = 1000;
/// Views of a validation, and those that scores are calibrated by.
const VALIDATION_VIEWS: usize = 200;
const CALIBRATION_VIEWS: usize = 400;
/// No checkpoint or configuration is larger, bytes.
const MOST_BYTES: u64 = 1 << 30;

/// Why a training can't begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// The file system refuses.
    #[error(transparent)]
    File(#[from] FileError),
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
    /// The checkpoint is cut off or of another network.
    #[error("{0} is no checkpoint of this network")]
    Checkpoint(PathBuf),
    /// The loss is no number any more.
    #[error(
        "the loss of step {0} is not a number; the last checkpoint is kept, try a lower rate from there"
    )]
    NotANumber(u64),
}

/// A line of the curves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "of", rename_all = "snake_case")]
pub enum Record {
    /// Means over the steps since the last one.
    Loss {
        /// The last of these steps.
        step: u64,
        /// Cross entropy of labels.
        labels: f64,
        /// How far offsets are off.
        offsets: f64,
        /// Weighted share of pixels with the right label.
        right: f64,
        /// Of those of things.
        right_of_things: f64,
    },
    /// On views of the validation part, drawn as those for training.
    Validation {
        /// After so many steps.
        step: u64,
        /// Mean average precision at an overlap of one half.
        map50: f64,
        /// Over overlaps from 0.5 to 0.95.
        map: f64,
    },
}

/// A training and its folder.
pub struct TrainingRun {
    folder: PathBuf,
    trainer: Trainer,
    threads: usize,
}

impl TrainingRun {
    /// A new one.
    ///
    /// # Errors
    /// If the folder isn't empty, or the file system refuses.
    pub fn begin(folder: &Path, rules: TrainingRules) -> Result<TrainingRun, TrainingError> {
        let is_taken = fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
        if is_taken {
            return Err(TrainingError::NotEmpty(folder.to_owned()));
        }
        fs::create_dir_all(folder).map_err(FileError::of("can't make", folder))?;
        let path = folder.join(CONFIG);
        let text = toml::to_string(&rules).expect("rules are plain data");
        write_whole(&path, text.as_bytes())?;
        let (folder, trainer) = (folder.to_owned(), Trainer::new(rules));
        let run = TrainingRun { folder, trainer, threads: rules.shards };
        run.keep()?;
        Ok(run)
    }

    /// One that was begun.
    ///
    /// # Errors
    /// If its files can't be read or aren't those of a training.
    pub fn resume(folder: &Path) -> Result<TrainingRun, TrainingError> {
        let rules = read_rules(&folder.join(CONFIG))?;
        let path = folder.join(CHECKPOINT);
        let mut trainer = Trainer::new(rules);
        if !trainer.resume(&read_bounded(&path, MOST_BYTES)?) {
            return Err(TrainingError::Checkpoint(path));
        }
        Ok(TrainingRun { folder: folder.to_owned(), trainer, threads: rules.shards })
    }

    /// Steps taken and steps in all.
    pub fn extent(&self) -> (u64, u64) {
        (self.trainer.adam.steps, self.trainer.rules.steps)
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
        let mut losses: Vec<Loss> = Vec::new();
        while self.trainer.adam.steps < self.trainer.rules.steps {
            if stop.load(Ordering::Relaxed) {
                self.keep()?;
                return Ok(false);
            }
            let loss = self.trainer.step();
            let step = self.trainer.adam.steps;
            if !(loss.labels + loss.offsets).is_finite() {
                return Err(TrainingError::NotANumber(step));
            }
            losses.push(loss);
            let is_last = step == self.trainer.rules.steps;
            if step.is_multiple_of(RECORD_STEPS) || is_last {
                self.record(&mean(step, &losses), tell)?;
                losses.clear();
            }
            if step.is_multiple_of(VALIDATION_STEPS) || is_last {
                let mut detector = self.detector();
                let found =
                    evaluate(&detector, self.trainer.rules.views, VALIDATION_VIEWS, self.threads);
                let (map50, map) = (found.map50, found.map);
                self.record(&Record::Validation { step, map50, map }, tell)?;
                let size_px = self.trainer.rules.views.size_px;
                let views = ViewRules { size_px, ..ViewRules::NATURAL };
                detector.calibration = calibrate(&detector, views, CALIBRATION_VIEWS, self.threads);
                write_whole(&self.folder.join(WEIGHTS), &detector.to_bytes())?;
            }
            if step.is_multiple_of(CHECKPOINT_STEPS) || is_last {
                self.keep()?;
            }
        }
        Ok(true)
    }

    /// The detector so far: the slow mean of its numbers.
    fn detector(&self) -> TrainedDetector {
        TrainedDetector::uncalibrated(&self.trainer.detector, &self.trainer.average)
    }

    fn keep(&self) -> Result<(), TrainingError> {
        Ok(write_whole(&self.folder.join(CHECKPOINT), &self.trainer.checkpoint())?)
    }

    fn record(&self, record: &Record, tell: &mut dyn FnMut(&Record)) -> Result<(), TrainingError> {
        let path = self.folder.join(CURVES);
        let line = serde_json::to_string(record).expect("a record is plain data") + "\n";
        let file = OpenOptions::new().create(true).append(true).open(&path);
        let written = file.and_then(|mut file| file.write_all(line.as_bytes()));
        written.map_err(FileError::of("can't write", &path))?;
        tell(record);
        Ok(())
    }
}

/// The rules in a file; those that it doesn't name are as shipped.
///
/// # Errors
/// If it can't be read, or names rules that aren't there.
pub fn read_rules(path: &Path) -> Result<TrainingRules, TrainingError> {
    let bytes = read_bounded(path, MOST_BYTES)?;
    let wrong = |problem: String| TrainingError::Config { path: path.to_owned(), problem };
    let text = std::str::from_utf8(&bytes).map_err(|e| wrong(e.to_string()))?;
    let rules: TrainingRules = toml::from_str(text).map_err(|e| wrong(e.message().to_owned()))?;
    let crops = rules.crops.iter();
    let sides_fit = crops.clone().all(|c| {
        c.side_px.is_multiple_of(32) && (32..=rules.views.size_px as usize).contains(&c.side_px)
    });
    let is_some = crops.clone().all(|c| c.views > 0 && c.of_view > 0);
    if !sides_fit || !is_some || rules.shards == 0 || rules.steps == 0 || rules.warm_up == 0 {
        let problem = "steps, warm_up, shards, views and of_view are at least 1, and side_px is a \
                       multiple of 32 up to views.size_px";
        return Err(wrong(problem.to_owned()));
    }
    Ok(rules)
}

fn mean(step: u64, losses: &[Loss]) -> Record {
    let mean = |of: fn(&Loss) -> f64| losses.iter().map(of).sum::<f64>() / losses.len() as f64;
    Record::Loss {
        step,
        labels: mean(|l| l.labels),
        offsets: mean(|l| l.offsets),
        right: mean(|l| l.right),
        right_of_things: mean(|l| l.right_of_things),
    }
}
