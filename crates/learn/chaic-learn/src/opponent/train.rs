//! Training of the opponent model.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use chaic_core::geom::math;
use chaic_core::rng::RngStream;
use chaic_env::Digest;
use chaic_files::{EntryKind, kind, read_bounded, write_atomically};
use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{AdamWConfig, Network};
use chaic_training::bounds::{
    ADAM, Bound, BoundTable, LEARNING_RATE, SEED, SHARDS, STEPS, integer, real,
};
use chaic_training::{
    CONFIG, Checkpoint, CheckpointError, Learner, Metrics, Settings, Trainer, TrainingError,
    changed_setting, defined_metrics, learning_rate_at, metrics,
};
use serde::{Deserialize, Serialize};

use super::collect::{
    COLLECT_BOUNDS, CollectError, DatasetSplit, LabeledWindow, WindowCollectionConfig, collect,
    read, read_from_user_path, read_with_digest, write,
};
use super::network::{Heads, N_GOALS, OpponentModel, kind as model_kind, network};
use super::report::OpponentReport;
use super::{N_BODY_LIMITS, OpponentGoal};
use crate::actor_critic::{ActorCriticOutput, Optimizer, OutputGrad, optimizer_step};
use crate::candidate_scorer::CandidateScorer;
use crate::ppo::MAX_BATCH;

/// Configuration of `chaic train opponent`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OpponentConfig {
    /// Seed of weights and batches.
    pub seed: u64,
    /// Total number of steps.
    pub steps: u64,
    /// Steps of linear learning rate warm-up.
    pub warm_up: u64,
    /// Windows per step (paper: 32).
    #[serde(alias = "batch")]
    pub batch_size: usize,
    /// Maximum learning rate.
    #[serde(alias = "rate")]
    pub learning_rate: f32,
    /// Coefficient of the target loss, relative to the goal loss.
    #[serde(alias = "target")]
    pub target_coef: f32,
    /// Coefficient of the mean squared error of the limits.
    #[serde(alias = "limits")]
    pub limits_coef: f32,
    /// Shards of a batch, which run in parallel.
    pub shards: usize,
    /// File of windows that replaces those of `collect` (see `chaic collect opponent`).
    pub windows: Option<PathBuf>,
    /// Maximum number of validation windows per goal.
    #[serde(alias = "validation_of_each")]
    pub validation_max_per_class: usize,
    /// Fraction of the training windows that is held out for validation, instead of windows of other
    /// episodes. Windows of one episode are similar, so the validation metrics are then too
    /// optimistic.
    pub held_out_fraction: f32,
    /// Optimizer.
    pub adam: AdamWConfig,
    /// Collection of windows.
    pub collect: WindowCollectionConfig,
}

impl Default for OpponentConfig {
    fn default() -> OpponentConfig {
        OpponentConfig {
            seed: 1,
            steps: 12_000,
            warm_up: 100,
            batch_size: 64,
            learning_rate: 2e-3,
            target_coef: 1.0,
            limits_coef: 2.0,
            shards: 2,
            windows: None,
            validation_max_per_class: 1000,
            held_out_fraction: 0.0,
            adam: AdamWConfig {
                beta2: 0.999,
                weight_decay: 1e-3,
                max_grad_norm: 1.0,
                ..AdamWConfig::default()
            },
            collect: WindowCollectionConfig::default(),
        }
    }
}

/// Files of training and validation windows in the training folder.
const WINDOWS: &str = "windows.safetensors";
const VALIDATION_WINDOWS: &str = "validation.safetensors";
/// File of the settings with which the windows were collected.
const DATA_SETTINGS: &str = "data.json";
/// Maximum size of the file of settings, bytes: a hundred times the common one.
const MAX_SETTINGS_BYTES: u64 = 1 << 16;

impl OpponentConfig {
    /// Returns the values of the keys that determine the training and validation windows.
    fn data_settings(&self) -> Settings {
        let collect = serde_json::to_value(&self.collect).expect("a configuration serializes");
        let collect = collect.as_object().into_iter().flatten();
        let mut settings: Settings =
            collect.map(|(key, value)| (format!("collect.{key}"), value.to_string())).collect();
        let mut insert = |key: &str, value: String| settings.insert(key.to_owned(), value);
        insert("held_out_fraction", self.held_out_fraction.to_string());
        insert("validation_max_per_class", self.validation_max_per_class.to_string());
        if self.held_out_fraction > 0.0 {
            // The seed selects the held-out windows.
            insert("seed", self.seed.to_string());
        }
        settings
    }

    /// Records the settings of the windows in a training folder, once.
    fn record_settings(&self, folder: &Path) -> Result<(), TrainingError> {
        let path = folder.join(DATA_SETTINGS);
        if kind(&path)? == EntryKind::Missing {
            let settings = serde_json::to_string_pretty(&self.data_settings());
            let settings = settings.expect("texts serialize") + "\n";
            write_atomically(&path, settings.as_bytes())?;
        }
        Ok(())
    }

    /// Checks that the windows in a training folder are those of this configuration. Folders of earlier
    /// builds have no record.
    fn check_settings(&self, folder: &Path) -> Result<(), TrainingError> {
        let path = folder.join(DATA_SETTINGS);
        if kind(&path)? == EntryKind::Missing {
            return Ok(());
        }
        let bytes = read_bounded(&path, MAX_SETTINGS_BYTES)?;
        let recorded = serde_json::from_slice::<Settings>(&bytes);
        let invalid = |e: serde_json::Error| {
            let problem = format!("no record of settings: {e}");
            TrainingError::from_data(CollectError::Format { path: path.clone(), problem })
        };
        let recorded = recorded.map_err(invalid)?;
        match changed_setting(&recorded, &self.data_settings(), "the windows were collected") {
            Some(problem) => Err(TrainingError::Config { path: folder.join(CONFIG), problem }),
            None => Ok(()),
        }
    }

    /// Reads the windows of one split from the training folder, or collects and writes them; `None` if
    /// it was stopped.
    fn read_or_collect(
        &self,
        split: DatasetSplit,
        folder: &Path,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<Vec<LabeledWindow>>, TrainingError> {
        let (name, max_per_class, none) = match split {
            DatasetSplit::Train => (WINDOWS, self.collect.max_per_class, CollectError::Empty),
            _ => (VALIDATION_WINDOWS, self.validation_max_per_class, CollectError::NoValidation),
        };
        let path = folder.join(name);
        let is_granted = self.collect.granted;
        if kind(&path)? != EntryKind::Missing {
            return read(&path, is_granted).map(Some).map_err(TrainingError::from_data);
        }
        let config = WindowCollectionConfig { max_per_class, ..self.collect.clone() };
        let collected =
            collect(split, &config, progress, stop).map_err(TrainingError::from_data)?;
        let Some(collected) = collected else { return Ok(None) };
        if collected.is_empty() {
            return Err(TrainingError::from_data(none));
        }
        self.record_settings(folder)?;
        write(&path, &collected, is_granted)?;
        Ok(Some(collected))
    }
}

/// Trainer of the opponent model.
pub struct OpponentTrainer {
    config: OpponentConfig,
    network: CandidateScorer,
    learner: Learner,
    steps: u64,
    samples: Vec<LabeledWindow>,
    /// Indices of samples by goal. Batches draw a goal uniformly, then a sample of this goal.
    by_goal: Vec<Vec<usize>>,
    validation: Vec<LabeledWindow>,
    /// Digest of the file that `windows` names, if any.
    input: Option<Digest>,
}

/// Validation metric by which weights are selected.
const GOAL_ACCURACY: &str = "goal_accuracy";
/// Section of a checkpoint.
const STEPS_TAKEN: &str = "opponent.steps";

impl OpponentTrainer {
    /// Creates a trainer on these windows.
    ///
    /// # Errors
    /// If there are no windows to train on, or none to validate with.
    fn with_windows(
        config: &OpponentConfig,
        samples: Vec<LabeledWindow>,
        validation: Vec<LabeledWindow>,
        input: Option<Digest>,
    ) -> Result<OpponentTrainer, TrainingError> {
        let mut by_goal = vec![Vec::new(); OpponentGoal::ALL.len()];
        samples.iter().enumerate().for_each(|(k, s)| by_goal[s.goal.index()].push(k));
        by_goal.retain(|samples| !samples.is_empty());
        if by_goal.is_empty() {
            return Err(TrainingError::from_data(CollectError::Empty));
        }
        if validation.is_empty() {
            return Err(TrainingError::from_data(CollectError::NoValidation));
        }
        let network = network();
        let learner = Learner::new(&network.network, config.seed, config.shards);
        let config = config.clone();
        Ok(OpponentTrainer {
            config,
            network,
            learner,
            steps: 0,
            samples,
            by_goal,
            validation,
            input,
        })
    }
}

impl Trainer for OpponentTrainer {
    type Config = OpponentConfig;
    const KIND: &'static str = "opponent";
    const WEIGHTS: &'static str = "opponent.safetensors";
    const RECORD_STEPS: u64 = 100;
    const CHECKPOINT_STEPS: u64 = 1000;
    const VALIDATION_STEPS: u64 = 1000;
    const SCORE: Option<&'static str> = Some(GOAL_ACCURACY);
    const INPUT_KEY: &'static str = "windows";
    const DATA: &'static [&'static str] = &[WINDOWS, VALIDATION_WINDOWS, DATA_SETTINGS];
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("steps", STEPS),
        ("warm_up", STEPS),
        ("batch_size", integer(1, MAX_BATCH)),
        ("learning_rate", LEARNING_RATE),
        ("target_coef", real(0.0, 100.0)),
        ("limits_coef", real(0.0, 100.0)),
        ("shards", SHARDS),
        ("validation_max_per_class", integer(1, 100_000)),
        ("held_out_fraction", real(0.0, 0.9)),
        ("adam", ADAM),
        ("collect", Bound::Table(COLLECT_BOUNDS)),
    ];

    fn new(
        config: &OpponentConfig,
        folder: &Path,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<OpponentTrainer>, TrainingError> {
        config.check_settings(folder)?;
        // Validation windows come first: they take less time, and a training without any is refused.
        let validation = if config.held_out_fraction > 0.0 {
            None
        } else {
            let split = DatasetSplit::Validation;
            let windows = config.read_or_collect(split, folder, progress, stop)?;
            let Some(windows) = windows else { return Ok(None) };
            Some(windows)
        };
        let (mut samples, input) = if let Some(path) = &config.windows {
            let read = read_with_digest(path, config.collect.granted);
            let (windows, digest) = read.map_err(TrainingError::from_data)?;
            (windows, Some(digest))
        } else {
            let windows = config.read_or_collect(DatasetSplit::Train, folder, progress, stop)?;
            let Some(windows) = windows else { return Ok(None) };
            (windows, None)
        };
        config.record_settings(folder)?;
        let validation = validation.unwrap_or_else(|| hold_out(&mut samples, config));
        OpponentTrainer::with_windows(config, samples, validation, input).map(Some)
    }

    fn check(config: &OpponentConfig) -> Result<(), String> {
        if let Some(path) = &config.windows {
            let windows = read_from_user_path(path, config.collect.granted);
            let windows = windows.map_err(|e| e.to_string())?;
            if windows.is_empty() {
                return Err(format!("{}: {}", path.display(), CollectError::Empty));
            }
        } else {
            config.collect.check_memory()?;
        }
        config.collect.check()
    }

    fn read_weights(config: &OpponentConfig, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        weights::from_bytes(&network().network, weights, model_kind(config.collect.granted))
    }

    fn network(&self) -> &Network {
        &self.network.network
    }

    fn total_steps(&self) -> u64 {
        self.config.steps
    }

    fn steps_done(&self) -> u64 {
        self.steps
    }

    fn input_digest(&self) -> Option<u64> {
        self.input.map(|digest| digest.0)
    }

    fn checkpoint(&self) -> Checkpoint {
        self.learner.checkpoint(STEPS_TAKEN, self.steps)
    }

    fn load_parameters(&mut self, parameters: Vec<f32>) {
        self.learner.load_parameters(parameters);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        self.steps = self.learner.restore(checkpoint, STEPS_TAKEN)?;
        Ok(Some(()))
    }

    fn step(&mut self, _: &AtomicBool) -> Result<Option<Metrics>, TrainingError> {
        let OpponentTrainer { config, network, learner, samples, by_goal, .. } = self;
        let mut rng = RngStream::new(config.seed, "windows of a step", self.steps);
        let mut draw = || {
            let indices = &by_goal[rng.below(by_goal.len())];
            &samples[indices[rng.below(indices.len())]]
        };
        let batch: Vec<&LabeledWindow> = (0..config.batch_size).map(|_| draw()).collect();
        let learning_rate =
            learning_rate_at(self.steps, config.learning_rate, config.warm_up, config.steps);
        let shards = optimizer_step(
            network,
            learner,
            Optimizer { adam: &config.adam, learning_rate },
            &batch,
            |sample| &sample.window,
            |sample, output, weight, stats| gradient(config, sample, output, weight, stats),
            |_| true,
        );
        self.steps += 1;
        let mean =
            |loss: fn(&Losses) -> f64| shards.iter().map(loss).sum::<f64>() / batch.len() as f64;
        Ok(Some(metrics([
            ("goal", mean(|t| t.goal)),
            ("target", mean(|t| t.target)),
            ("limits", mean(|t| t.limits)),
        ])))
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Metrics, Vec<u8>)>, WeightsError> {
        let parameters = &self.learner.ema_parameters;
        let is_granted = self.config.collect.granted;
        let weights = weights::to_bytes(&self.network.network, parameters, model_kind(is_granted))?;
        let model = OpponentModel::new(parameters.clone(), is_granted);
        let report = OpponentReport::new(&model, &self.validation, stop);
        let Some(report) = report else { return Ok(None) };
        let metrics = defined_metrics([
            (GOAL_ACCURACY, report.goal_accuracy.mean),
            ("target_accuracy", report.target_accuracy.mean),
            ("limits_error", report.limits_error.mean),
        ]);
        Ok(Some((metrics, weights)))
    }
}

/// Removes a random fraction of the windows, at least one, and returns it.
fn hold_out(windows: &mut Vec<LabeledWindow>, config: &OpponentConfig) -> Vec<LabeledWindow> {
    RngStream::new(config.seed, "held-out windows", 0).shuffle(windows);
    let n = (windows.len() as f32 * config.held_out_fraction) as usize;
    windows.split_off(windows.len().saturating_sub(n.max(1)))
}

/// Sums of losses over windows.
#[derive(Clone, Copy, Debug, Default)]
struct Losses {
    goal: f64,
    target: f64,
    limits: f64,
}

/// Returns the gradient of the loss of one window: cross entropies of goal and target, if there is
/// one, and mean squared error of the limits.
fn gradient(
    config: &OpponentConfig,
    sample: &LabeledWindow,
    output: &ActorCriticOutput,
    weight: f32,
    stats: &mut Losses,
) -> OutputGrad {
    let Heads { log_goals, limits } = Heads::new(output);
    let goal = sample.goal.index();
    let one_hot = |k: usize, label: usize| f32::from(u8::from(k == label));
    let mut values: Vec<f32> =
        (0..N_GOALS).map(|k| weight * (math::exp(log_goals[k]) - one_hot(k, goal))).collect();
    stats.goal -= f64::from(log_goals[goal]);
    let fraction = 1.0 / N_BODY_LIMITS as f32;
    for (predicted, truth) in limits.iter().zip(&sample.limits) {
        let error = predicted - truth;
        stats.limits += f64::from(fraction * error * error);
        let grad_limit = 2.0 * fraction * error * predicted * (1.0 - predicted);
        values.push(weight * config.limits_coef * grad_limit);
    }
    let logits = match sample.target {
        Some(target) => {
            stats.target -= f64::from(output.log_probs[target]);
            let coefficient = weight * config.target_coef;
            let log_probs = output.log_probs.iter().enumerate();
            log_probs.map(|(k, l)| coefficient * (math::exp(*l) - one_hot(k, target))).collect()
        }
        None => vec![0.0; output.log_probs.len()],
    };
    OutputGrad { logits, values }
}
