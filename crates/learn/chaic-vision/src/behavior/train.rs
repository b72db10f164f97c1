//! The training loop of the behavior network.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_core::rng::RngStream;
use chaic_nn::weights::WeightsError;
use chaic_nn::{AdamWConfig, Network, Tensor, TrainingPass};
use chaic_training::bounds::{
    ADAM, Bound, BoundTable, FRACTION, LEARNING_RATE, SEED, SHARDS, STEPS, integer,
};
use chaic_training::{
    Checkpoint, CheckpointError, Learner, Metrics, Trainer, TrainingError, defined_metrics,
    learning_rate_at, metrics,
};
use serde::{Deserialize, Serialize};

use chaic_agents::perception_factory::GroundTruthPerceptionFactory;

use super::Behavior;
use super::calibration::{BehaviorScores, Calibration, softmax};
use super::clip::{Clip, ClipAugmentation, ClipCounts, ClipSet, MIXED_INDEX, fill_input};
use super::collect::{Collector, collect};
use super::config::{COLLECT_BOUNDS, ClipCollectionConfig};
use super::network::{BehaviorNetwork, TrainedBehavior};
use super::report::{all_outputs, report_of_outputs};
use super::store::{ClipFolder, StoreError};
use crate::loss::ln;
use crate::views::DatasetSplit;

/// Threads that play episodes and evaluate clips; results do not depend on it.
const THREADS: usize = 2;

/// Configuration of a behavior training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BehaviorTrainingConfig {
    /// Seed of weights and batches.
    pub seed: u64,
    /// Number of steps.
    pub steps: u64,
    /// Maximum learning rate.
    #[serde(alias = "rate")]
    pub learning_rate: f32,
    /// Steps of linear warm-up.
    pub warm_up: u64,
    /// Parts of a batch that are processed in parallel.
    pub shards: usize,
    /// Clips per shard.
    #[serde(alias = "clips")]
    pub batch_size: usize,
    /// Fraction of mixed clips among clips of moving people, best as in play: 175 of 422 clips of 16 episodes
    /// (`chaic collect behavior --split validation --max-per-class 5000 --n-episodes 16`).
    #[serde(alias = "mixed")]
    pub mixed_fraction: f32,
    /// Label smoothing (Szegedy et al. 2016).
    #[serde(alias = "smoothing")]
    pub label_smoothing: f32,
    /// Configuration of clip collection.
    pub collect: ClipCollectionConfig,
    /// Configuration of the optimizer.
    pub adam: AdamWConfig,
}

impl Default for BehaviorTrainingConfig {
    fn default() -> BehaviorTrainingConfig {
        BehaviorTrainingConfig {
            seed: 1,
            steps: 13_000,
            // At 2e-3 the validation accuracy is 0.45 after 2,000 steps, at 1e-3 it is 0.78.
            learning_rate: 1e-3,
            warm_up: 100,
            shards: 2,
            batch_size: 8,
            mixed_fraction: 0.4,
            label_smoothing: 0.05,
            collect: ClipCollectionConfig::default(),
            adam: AdamWConfig { weight_decay: 0.05, ..AdamWConfig::default() },
        }
    }
}

/// State of a behavior training.
pub struct BehaviorLearner {
    /// Its configuration.
    pub config: BehaviorTrainingConfig,
    /// The network.
    pub network: BehaviorNetwork,
    /// Parameters and optimizer.
    pub learner: Learner,
    /// Clips of each behavior; mixed clips are last.
    clips: ClipsByKind,
}

/// Clips of each behavior; mixed clips are last.
type ClipsByKind = [Vec<Clip>; MIXED_INDEX + 1];

/// Metrics of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BehaviorMetrics {
    /// Mean cross entropy; NaN if a logit is not finite.
    pub loss: f64,
    /// Fraction of correctly classified clips.
    pub accuracy: f64,
}

impl BehaviorLearner {
    /// Creates the state before the first step.
    pub fn new(config: BehaviorTrainingConfig, clips: Vec<Clip>) -> BehaviorLearner {
        let network = BehaviorNetwork::new();
        let learner = Learner::new(&network.network, config.seed, config.shards);
        let mut clips_by_kind = ClipsByKind::default();
        for clip in clips {
            clips_by_kind[clip.kind()].push(clip);
        }
        BehaviorLearner { config, network, learner, clips: clips_by_kind }
    }

    /// Returns the network with the exponential moving average of its parameters.
    pub fn trained(&self) -> TrainedBehavior {
        let parameters = self.learner.ema_parameters.clone();
        let calibration = Calibration::default();
        TrainedBehavior { network: self.network.clone(), parameters, calibration }
    }

    /// Returns the expected fraction of each behavior in batches.
    pub fn batch_fractions(&self) -> BehaviorScores {
        let drawn = drawn_behaviors(&self.clips);
        let n_drawn = |k: usize| drawn.iter().filter(|behavior| **behavior == k).count();
        std::array::from_fn(|k| n_drawn(k) as f32 / drawn.len().max(1) as f32)
    }

    /// Trains on one batch, which depends on the seed and the step only.
    pub fn step(&mut self) -> BehaviorMetrics {
        let step = self.learner.adam.steps;
        let BehaviorLearner { config, network, learner, clips } = self;
        let (config, network, clips) = (&*config, &*network, &*clips);
        let shard_gradient =
            |shard: usize, parameters: &[f32], pass: &mut TrainingPass, gradient: &mut [f32]| {
                let index = step * config.shards as u64 + shard as u64;
                let mut rng = RngStream::new(config.seed, "clips", index);
                let batch: Vec<&Clip> = (0..config.batch_size)
                    .filter_map(|_| draw_clip(clips, config, &mut rng))
                    .collect();
                let shape = BehaviorNetwork::input_shape(batch.len());
                let mut input = Tensor::zeros(shape);
                let n = shape.len() / batch.len().max(1);
                for (clip, out) in batch.iter().zip(input.data.chunks_exact_mut(n.max(1))) {
                    fill_input(&clip.crops, &ClipAugmentation::random(&mut rng), out);
                }
                pass.forward(&network.network, parameters, &input);
                pass.zero_gradients();
                let logits = pass.activation(network.head).data.clone();
                let head_gradient = &mut pass.gradient(network.head).data;
                let metrics = loss(&logits, &batch, config.label_smoothing, head_gradient);
                pass.backward(&network.network, parameters, gradient);
                Some(metrics)
            };
        let learning_rate =
            learning_rate_at(step, config.learning_rate, config.warm_up, config.steps);
        let metrics = learner.step(&network.network, &config.adam, learning_rate, shard_gradient);
        let metrics = metrics.expect("no shard stops");
        let mean = |metric: fn(&BehaviorMetrics) -> f64| {
            metrics.iter().map(metric).sum::<f64>() / metrics.len() as f64
        };
        BehaviorMetrics { loss: mean(|l| l.loss), accuracy: mean(|l| l.accuracy) }
    }
}

/// Maximum number of validation clips of each behavior, and of mixed clips.
const VALIDATION_CLIPS: usize = 200;
/// Ratio of training episodes to validation episodes.
const TRAINING_EPISODES_PER_VALIDATION: usize = 4;

/// Maximum number of clips that all shards process at once. A clip takes 17 MB, which makes 9 GB.
const MAX_BATCH_CLIPS: usize = 512;

/// Maximum number of clips of a shard. A pass takes 1.5 s and cannot be interrupted.
const MAX_SHARD_CLIPS: i64 = 64;

/// Behavior training with validation clips.
pub struct BehaviorTrainer {
    learner: BehaviorLearner,
    validation: ClipSet,
}

impl BehaviorTrainer {
    /// Creates the training before its first step.
    ///
    /// # Errors
    /// If no clip shows a single action. Batches would be empty.
    pub(crate) fn with_clips(
        config: BehaviorTrainingConfig,
        training: Vec<Clip>,
        validation: ClipSet,
    ) -> Result<BehaviorTrainer, TrainingError> {
        if training.iter().all(|clip| clip.is_mixed) {
            return Err(StoreError::Empty.into());
        }
        Ok(BehaviorTrainer { learner: BehaviorLearner::new(config, training), validation })
    }
}

impl From<StoreError> for TrainingError {
    fn from(error: StoreError) -> TrainingError {
        match error {
            StoreError::File(error) => error.into(),
            error => TrainingError::from_data(error),
        }
    }
}

/// Checks that clips in the folder of a training are those of its configuration. A training that was stopped
/// before its first checkpoint has no other record of it.
fn check_clips(config: &BehaviorTrainingConfig, folder: &Path) -> Result<(), TrainingError> {
    // Only the clips for training have the numbers of the configuration.
    let (path, split) = (folder.join("clips/train"), DatasetSplit::Train);
    match ClipFolder::open(&path, split, &config.collect, &GroundTruthPerceptionFactory) {
        Ok(_) => Ok(()),
        Err(StoreError::Setting { key, recorded, requested, .. }) => Err(TrainingError::Config {
            path: folder.join(chaic_training::CONFIG),
            problem: format!(
                "`collect.{key}` is {requested}, but was {recorded} when the clips were collected; set it back, or \
                 start another training with --out"
            ),
        }),
        Err(error) => Err(error.into()),
    }
}

impl Trainer for BehaviorTrainer {
    type Config = BehaviorTrainingConfig;
    const KIND: &'static str = "behavior";
    const WEIGHTS: &'static str = "behavior.safetensors";
    const DATA: &'static [&'static str] = &["clips"];
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("steps", STEPS),
        ("learning_rate", LEARNING_RATE),
        ("warm_up", STEPS),
        ("shards", SHARDS),
        ("batch_size", integer(1, MAX_SHARD_CLIPS)),
        ("mixed_fraction", FRACTION),
        ("label_smoothing", FRACTION),
        ("collect", Bound::Table(COLLECT_BOUNDS)),
        ("adam", ADAM),
    ];

    fn new(
        config: &BehaviorTrainingConfig,
        folder: &Path,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<BehaviorTrainer>, TrainingError> {
        check_clips(config, folder)?;
        let mut clips = |split: DatasetSplit| {
            let ClipCollectionConfig { max_per_class, episodes, .. } = config.collect;
            let (max_per_class, episodes) = match split {
                DatasetSplit::Train => (max_per_class, episodes),
                _ => (
                    max_per_class.min(VALIDATION_CLIPS),
                    episodes.div_ceil(TRAINING_EPISODES_PER_VALIDATION),
                ),
            };
            let config = ClipCollectionConfig { max_per_class, episodes, ..config.collect };
            let name = split.to_string().to_lowercase();
            let perception = &GroundTruthPerceptionFactory;
            let path = folder.join("clips").join(&name);
            let folder = Some(&ClipFolder::open(&path, split, &config, perception)?);
            let collector =
                Collector { split, config: &config, perception, n_threads: THREADS, folder };
            let mut report_progress = |n: usize, counts: &ClipCounts| {
                progress(&format!("{n} {name} episodes, clips {counts:?}"));
            };
            collect(&collector, &mut report_progress, stop)
        };
        let Some(validation) = clips(DatasetSplit::Validation)? else { return Ok(None) };
        let Some(training) = clips(DatasetSplit::Train)? else { return Ok(None) };
        BehaviorTrainer::with_clips(*config, training.clips, validation).map(Some)
    }

    fn check(config: &BehaviorTrainingConfig) -> Result<(), String> {
        let batch = config.shards * config.batch_size;
        if batch > MAX_BATCH_CLIPS {
            return Err(format!(
                "shards times batch_size is {batch}; it must be from 1 to {MAX_BATCH_CLIPS}"
            ));
        }
        config.collect.check()
    }

    fn read_weights(_: &BehaviorTrainingConfig, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        Ok(TrainedBehavior::from_bytes(weights)?.parameters)
    }

    fn fixed_keys() -> Vec<&'static str> {
        // The clips in the folder depend on the first. Step and shard number the drawn batches.
        vec!["collect", "shards"]
    }

    fn network(&self) -> &Network {
        &self.learner.network.network
    }

    fn total_steps(&self) -> u64 {
        self.learner.config.steps
    }

    fn steps_done(&self) -> u64 {
        self.learner.learner.adam.steps
    }

    fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        self.learner.learner.save(&mut checkpoint);
        checkpoint
    }

    fn load_parameters(&mut self, parameters: Vec<f32>) {
        self.learner.learner.load_parameters(parameters);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        self.learner.learner.load(checkpoint).map(Some)
    }

    fn step(&mut self, _: &AtomicBool) -> Result<Option<Metrics>, TrainingError> {
        // `MAX_SHARD_CLIPS` bounds the duration of a step, so it is not interrupted.
        let BehaviorMetrics { loss, accuracy } = self.learner.step();
        Ok(Some(metrics([("loss", loss), ("accuracy", accuracy)])))
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Metrics, Vec<u8>)>, WeightsError> {
        let mut trained = self.learner.trained();
        let outputs = all_outputs(&trained, &self.validation.clips, THREADS, stop);
        let Some(outputs) = outputs else { return Ok(None) };
        let batch_fractions = self.learner.batch_fractions();
        trained.calibration = Calibration::fit(&self.validation, &outputs, &batch_fractions);
        let evaluation = report_of_outputs(&trained, &self.validation, &outputs);
        let metrics = defined_metrics([
            ("top1", evaluation.top1),
            ("top1_in_play", evaluation.top1_in_play),
            ("balanced", evaluation.balanced),
            ("mixed_as_moving", evaluation.mixed_as_moving),
        ]);
        Ok(Some((metrics, trained.to_bytes()?)))
    }
}

/// Returns the indices of the behaviors that have clips; moving is there twice, since it has the most varied
/// clips, plain and mixed ones.
fn drawn_behaviors(clips: &ClipsByKind) -> Vec<usize> {
    let moving = Behavior::Moving.index();
    (0..Behavior::ALL.len()).chain([moving]).filter(|k| !clips[*k].is_empty()).collect()
}

/// Draws a clip, uniformly over [`drawn_behaviors`].
fn draw_clip<'a>(
    clips: &'a ClipsByKind,
    config: &BehaviorTrainingConfig,
    rng: &mut RngStream,
) -> Option<&'a Clip> {
    let kind = *rng.choose(&drawn_behaviors(clips))?;
    let mixed = &clips[MIXED_INDEX];
    let is_mixed = rng.chance(config.mixed_fraction) && kind == Behavior::Moving.index();
    rng.choose(if is_mixed && !mixed.is_empty() { mixed } else { &clips[kind] })
}

/// Computes the cross entropy of logits and its gradient.
fn loss(logits: &[f32], clips: &[&Clip], smoothing: f32, gradient: &mut [f32]) -> BehaviorMetrics {
    const N: usize = Behavior::ALL.len();
    let scale = 1.0 / clips.len().max(1) as f32;
    let mut metrics = BehaviorMetrics::default();
    let rows = logits.as_chunks::<N>().0.iter().zip(gradient.as_chunks_mut::<N>().0);
    for ((outputs, gradient), clip) in rows.zip(clips) {
        let p: BehaviorScores = softmax(outputs);
        let target = clip.label.index();
        metrics.loss -= f64::from(scale * ln(p[target].max(1e-9)));
        if !outputs.iter().all(|x| x.is_finite()) {
            // Probabilities of such logits are finite and would hide a training that has diverged.
            metrics.loss = f64::NAN;
        }
        metrics.accuracy +=
            f64::from(scale) * f64::from(u8::from(p.iter().all(|x| *x <= p[target])));
        for (k, gradient) in gradient.iter_mut().enumerate() {
            let target_probability =
                smoothing / N as f32 + if k == target { 1.0 - smoothing } else { 0.0 };
            *gradient = scale * (p[k] - target_probability);
        }
    }
    metrics
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_have_the_stated_fractions() {
        let clip = |label, is_mixed| Clip { label, is_mixed, episode: 0, crops: Vec::new() };
        let clips = vec![
            clip(Behavior::PickedUp, false),
            clip(Behavior::PutIn, false),
            clip(Behavior::Moving, false),
            clip(Behavior::Moving, true),
        ];
        let learner = BehaviorLearner::new(BehaviorTrainingConfig::default(), clips);
        assert_eq!(learner.batch_fractions(), [0.25, 0.0, 0.25, 0.0, 0.0, 0.5]);
        let mut rng = RngStream::new(1, "draws", 0);
        let mut n = ClipCounts::default();
        for _ in 0..4000 {
            n[draw_clip(&learner.clips, &learner.config, &mut rng).unwrap().kind()] += 1;
        }
        let expected = [1000, 0, 1000, 0, 0, 1200, 800];
        assert!(n.iter().zip(expected).all(|(n, expected)| n.abs_diff(expected) < 120), "{n:?}");
    }
}
