//! The training loop of the behavior network.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_core::rng::Stream;
use chaic_nn::weights::WeightsError;
use chaic_nn::{AdamRules, Network, Pass, Tensor};
use chaic_training::bounds::{ADAM, Bound, BoundTable, RATE, SEED, SHARDS, SHARE, STEPS, integer};
use chaic_training::{
    Checkpoint, CheckpointError, Figures, Learner, Training, TrainingError, figures, rate_at,
};
use serde::{Deserialize, Serialize};

use chaic_agents::sight::TrueSight;

use super::Behavior;
use super::clip::{Clip, Look, read};
use super::collect::{COLLECT_BOUNDS, CollectRules, Collector, Counts, collect};
use super::network::{BehaviorNetwork, Outputs, TrainedBehavior, softmax};
use super::report::{calibrate, outputs_of, report};
use super::store::ClipFolder;
use crate::loss::ln;
use crate::views::Part;

/// Threads that play episodes and look at clips; what comes of it doesn't depend on them.
const THREADS: usize = 2;

/// What is trained on, and how.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BehaviorRules {
    /// Of weights and batches.
    pub seed: u64,
    /// Steps in all.
    pub steps: u64,
    /// Highest rate of steps.
    pub rate: f32,
    /// Steps during which it rises.
    pub warm_up: u64,
    /// Parts of a batch that are worked on side by side.
    pub shards: usize,
    /// Clips of each part.
    pub clips: usize,
    /// Share of clips of moving people that are mixed.
    pub mixed: f32,
    /// How much of a label is shared out among all behaviors (Szegedy et al. 2016).
    pub smoothing: f32,
    /// How clips are made.
    pub collect: CollectRules,
    /// How steps are taken.
    pub adam: AdamRules,
}

impl Default for BehaviorRules {
    fn default() -> BehaviorRules {
        BehaviorRules {
            seed: 1,
            steps: 6_000,
            rate: 2e-3,
            warm_up: 100,
            shards: 2,
            clips: 8,
            mixed: 0.6,
            smoothing: 0.05,
            collect: CollectRules::default(),
            adam: AdamRules { weight_decay: 0.05, ..AdamRules::default() },
        }
    }
}

/// A behavior network while it learns.
pub struct BehaviorTrainer {
    /// Its rules.
    pub rules: BehaviorRules,
    /// The network.
    pub network: BehaviorNetwork,
    /// What is learned.
    pub learner: Learner,
    /// Clips of each behavior, and mixed ones.
    clips: [Vec<Clip>; Behavior::ALL.len() + 1],
}

/// What a step is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BehaviorLoss {
    /// Mean cross entropy.
    pub loss: f64,
    /// Share of clips told right.
    pub right: f64,
}

impl BehaviorTrainer {
    /// Before the first step.
    pub fn new(rules: BehaviorRules, clips: Vec<Clip>) -> BehaviorTrainer {
        let network = BehaviorNetwork::new();
        let learner = Learner::new(&network.network, rules.seed, rules.shards);
        let mut sorted: [Vec<Clip>; Behavior::ALL.len() + 1] = Default::default();
        for clip in clips {
            let kind = if clip.is_mixed { Behavior::ALL.len() } else { clip.label.index() };
            sorted[kind].push(clip);
        }
        BehaviorTrainer { rules, network, learner, clips: sorted }
    }

    /// The network so far: the slow mean of its numbers.
    pub fn trained(&self) -> TrainedBehavior {
        let numbers = self.learner.average.clone();
        TrainedBehavior { network: self.network.clone(), numbers, sharpness: 1.0 }
    }

    /// Takes a step; which clips are looked at depends on the seed and the step alone.
    pub fn step(&mut self) -> BehaviorLoss {
        let step = self.learner.adam.steps;
        let BehaviorTrainer { rules, network, learner, clips } = self;
        let (rules, network, clips) = (&*rules, &*network, &*clips);
        let work = |shard: usize, numbers: &[f32], pass: &mut Pass, by: &mut [f32]| {
            let index = step * rules.shards as u64 + shard as u64;
            let mut rng = Stream::new(rules.seed, "clips", index);
            let chosen: Vec<&Clip> =
                (0..rules.clips).filter_map(|_| choose(clips, rules, &mut rng)).collect();
            let shape = BehaviorNetwork::input_shape(chosen.len());
            let mut input = Tensor::zeros(shape);
            let n = shape.numbers() / chosen.len().max(1);
            for (clip, out) in chosen.iter().zip(input.data.chunks_exact_mut(n.max(1))) {
                read(&clip.crops, &Look::random(&mut rng), out);
            }
            pass.forward(&network.network, numbers, &input);
            pass.begin_backward();
            let made = pass.made(network.head).data.clone();
            let by_head = &mut pass.gradient(network.head).data;
            let told = loss(&made, &chosen, rules.smoothing, by_head);
            pass.backward(&network.network, numbers, by);
            Some(told)
        };
        let rate = rate_at(step, (rules.rate, rules.warm_up, rules.steps));
        let told = learner.step(&network.network, (&rules.adam, rate), work);
        let told = told.expect("no shard stops");
        let mean =
            |of: fn(&BehaviorLoss) -> f64| told.iter().map(of).sum::<f64>() / told.len() as f64;
        BehaviorLoss { loss: mean(|l| l.loss), right: mean(|l| l.right) }
    }
}

/// Clips of a validation, of each behavior.
const VALIDATION_CLIPS: usize = 60;
/// One of so many episodes is for validation.
const VALIDATION_PART: usize = 4;

/// Largest number of clips that the shards work on at once. Each takes 17 MB, so that all take 9 GB.
const MAX_BATCH_CLIPS: usize = 512;

/// Largest number of clips of one shard. A pass over them takes 1.5 s, and can't be stopped.
const MAX_SHARD_CLIPS: i64 = 64;

/// A behavior network while it learns, with clips to validate it by.
pub struct BehaviorTraining {
    trainer: BehaviorTrainer,
    validation: Vec<Clip>,
}

impl BehaviorTraining {
    /// Returns a training on these clips before its first step.
    pub(crate) fn with_clips(
        rules: BehaviorRules,
        training: Vec<Clip>,
        validation: Vec<Clip>,
    ) -> BehaviorTraining {
        BehaviorTraining { trainer: BehaviorTrainer::new(rules, training), validation }
    }
}

impl Training for BehaviorTraining {
    type Rules = BehaviorRules;
    const KIND: &'static str = "behavior";
    const WEIGHTS: &'static str = "behavior.safetensors";
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("steps", STEPS),
        ("rate", RATE),
        ("warm_up", STEPS),
        ("shards", SHARDS),
        ("clips", integer(1, MAX_SHARD_CLIPS)),
        ("mixed", SHARE),
        ("smoothing", SHARE),
        ("collect", Bound::Table(COLLECT_BOUNDS)),
        ("adam", ADAM),
    ];

    fn new(
        rules: &BehaviorRules,
        folder: &Path,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<BehaviorTraining>, TrainingError> {
        let mut clips = |part: Part| {
            let CollectRules { of_each, episodes, .. } = rules.collect;
            let (of_each, episodes) = match part {
                Part::Training => (of_each, episodes),
                _ => (of_each.min(VALIDATION_CLIPS), episodes.div_ceil(VALIDATION_PART)),
            };
            let rules = CollectRules { of_each, episodes, ..rules.collect };
            let name = format!("{part:?}").to_lowercase();
            let folder = ClipFolder::open(&folder.join("clips").join(&name), part, &rules)?;
            let (sight, folder) = (&TrueSight, Some(&folder));
            let collector = Collector { part, rules: &rules, sight, n_threads: THREADS, folder };
            let mut told = |n: usize, counts: &Counts| {
                progress(&format!("{n} {name} episodes, clips {counts:?}"));
            };
            collect(&collector, &mut told, stop)
        };
        let validation = clips(Part::Validation).map_err(TrainingError::of_data)?;
        let Some(validation) = validation else { return Ok(None) };
        let training = clips(Part::Training).map_err(TrainingError::of_data)?;
        let Some(training) = training else { return Ok(None) };
        Ok(Some(BehaviorTraining::with_clips(*rules, training, validation)))
    }

    fn check(rules: &BehaviorRules) -> Result<(), String> {
        let batch = rules.shards * rules.clips;
        if batch > MAX_BATCH_CLIPS {
            return Err(format!(
                "shards times clips is {batch}; it must be from 1 to {MAX_BATCH_CLIPS}"
            ));
        }
        Ok(())
    }

    fn read_weights(_: &BehaviorRules, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        Ok(TrainedBehavior::from_bytes(weights)?.numbers)
    }

    fn network(&self) -> &Network {
        &self.trainer.network.network
    }

    fn steps(&self) -> u64 {
        self.trainer.rules.steps
    }

    fn taken(&self) -> u64 {
        self.trainer.learner.adam.steps
    }

    fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        self.trainer.learner.save(&mut checkpoint);
        checkpoint
    }

    fn begin_with(&mut self, numbers: Vec<f32>) {
        self.trainer.learner.begin_with(numbers);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        self.trainer.learner.load(checkpoint).map(Some)
    }

    fn step(&mut self, _: &AtomicBool) -> Option<Figures> {
        // MAX_SHARD_CLIPS bounds how long it takes.
        let BehaviorLoss { loss, right } = self.trainer.step();
        Some(figures([("loss", loss), ("right", right)]))
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Figures, Vec<u8>)>, WeightsError> {
        let mut trained = self.trainer.trained();
        let outputs = outputs_of(&trained, &self.validation, THREADS, stop);
        let Some(outputs) = outputs else { return Ok(None) };
        trained.sharpness = calibrate(&self.validation, &outputs);
        let found = report(&trained, &self.validation, THREADS, stop);
        let Some(found) = found else { return Ok(None) };
        let figures = figures([
            ("top1", found.top1),
            ("balanced", found.balanced),
            ("mixed_as_moving", found.mixed_as_moving),
        ]);
        Ok(Some((figures, trained.to_bytes()?)))
    }
}

/// A clip, of each behavior equally often.
fn choose<'a>(
    clips: &'a [Vec<Clip>; Behavior::ALL.len() + 1],
    rules: &BehaviorRules,
    rng: &mut Stream,
) -> Option<&'a Clip> {
    let there: Vec<usize> = (0..Behavior::ALL.len()).filter(|k| !clips[*k].is_empty()).collect();
    let kind = *rng.choose(&there)?;
    let mixed = &clips[Behavior::ALL.len()];
    let is_mixed = rng.chance(rules.mixed) && kind == Behavior::Moving.index();
    rng.choose(if is_mixed && !mixed.is_empty() { mixed } else { &clips[kind] })
}

/// The cross entropy of outputs for clips, with its gradient.
fn loss(made: &[f32], clips: &[&Clip], smoothing: f32, by: &mut [f32]) -> BehaviorLoss {
    const N: usize = Behavior::ALL.len();
    let part = 1.0 / clips.len().max(1) as f32;
    let mut told = BehaviorLoss::default();
    let rows = made.as_chunks::<N>().0.iter().zip(by.as_chunks_mut::<N>().0);
    for ((outputs, by), clip) in rows.zip(clips) {
        let p: Outputs = softmax(outputs);
        let own = clip.label.index();
        told.loss -= f64::from(part * ln(p[own].max(1e-9)));
        told.right += f64::from(part) * f64::from(u8::from(p.iter().all(|x| *x <= p[own])));
        for (k, by) in by.iter_mut().enumerate() {
            let wanted = smoothing / N as f32 + if k == own { 1.0 - smoothing } else { 0.0 };
            *by = part * (p[k] - wanted);
        }
    }
    told
}
