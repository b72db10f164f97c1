//! The training loop of the behavior network.

use std::path::Path;

use chaic_nn::weights::WeightsError;
use chaic_nn::{AdamRules, Pass, Tensor};
use chaic_protocol::rng::Stream;
use chaic_training::{Figures, Learner, Training, TrainingError, figures, rate_at};
use serde::{Deserialize, Serialize};

use chaic_agents::sight::TrueSight;

use super::Behavior;
use super::clip::{Clip, Look, read};
use super::collect::{CollectRules, Collector, collect};
use super::network::{BehaviorNetwork, Outputs, TrainedBehavior, softmax};
use super::report::{calibrate, outputs_of, report};
use super::store::{ClipFolder, StoreError};
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

    /// Goes on from a checkpoint; `false` if it is of another network.
    pub fn resume(&mut self, bytes: &[u8]) -> bool {
        self.learner.resume(&self.rules.adam, bytes)
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
            told
        };
        let rate = rate_at(step, (rules.rate, rules.warm_up, rules.steps));
        let told = learner.step(&network.network, (&rules.adam, rate), work);
        let mean =
            |of: fn(&BehaviorLoss) -> f64| told.iter().map(of).sum::<f64>() / told.len() as f64;
        BehaviorLoss { loss: mean(|l| l.loss), right: mean(|l| l.right) }
    }
}

/// Clips of a validation, of each behavior.
const VALIDATION_CLIPS: usize = 60;
/// One of so many episodes is for validation.
const VALIDATION_PART: usize = 4;

/// A behavior network while it learns, with clips to validate it by.
pub struct BehaviorTraining {
    trainer: BehaviorTrainer,
    validation: Vec<Clip>,
}

impl Training for BehaviorTraining {
    type Rules = BehaviorRules;
    const WEIGHTS: &'static str = "behavior.safetensors";

    fn new(
        rules: &BehaviorRules,
        folder: &Path,
        go_on: &mut dyn FnMut(&str) -> bool,
    ) -> Result<Option<BehaviorTraining>, TrainingError> {
        let clips = |part: Part, go_on: &mut dyn FnMut(&str) -> bool| {
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
            let mut is_whole = true;
            let clips = collect(&collector, &mut |n, counts| {
                is_whole = go_on(&format!("{n} {name} episodes, clips {counts:?}"));
                is_whole
            })?;
            Ok::<_, StoreError>(is_whole.then_some(clips))
        };
        let Some(validation) = clips(Part::Validation, go_on).map_err(TrainingError::of_data)?
        else {
            return Ok(None);
        };
        let Some(training) = clips(Part::Training, go_on).map_err(TrainingError::of_data)? else {
            return Ok(None);
        };
        let trainer = BehaviorTrainer::new(*rules, training);
        Ok(Some(BehaviorTraining { trainer, validation }))
    }

    fn check(rules: &BehaviorRules) -> Result<(), String> {
        let least = rules.shards.min(rules.clips).min(rules.collect.of_each);
        if least == 0 || rules.collect.episodes == 0 || rules.steps == 0 || rules.warm_up == 0 {
            return Err(
                "steps, warm_up, shards, clips, collect.of_each and collect.episodes are at \
                        least 1"
                    .to_owned(),
            );
        }
        Ok(())
    }

    fn steps(&self) -> u64 {
        self.trainer.rules.steps
    }

    fn taken(&self) -> u64 {
        self.trainer.learner.adam.steps
    }

    fn checkpoint(&self) -> Vec<u8> {
        self.trainer.learner.checkpoint()
    }

    fn begin_with(&mut self, weights: &[u8]) -> Result<(), WeightsError> {
        self.trainer.learner.begin_with(TrainedBehavior::from_bytes(weights)?.numbers);
        Ok(())
    }

    fn resume(&mut self, bytes: &[u8]) -> bool {
        self.trainer.resume(bytes)
    }

    fn step(&mut self) -> Figures {
        let BehaviorLoss { loss, right } = self.trainer.step();
        figures([("loss", loss), ("right", right)])
    }

    fn validate(&self) -> (Figures, Vec<u8>) {
        let mut trained = self.trainer.trained();
        let outputs = outputs_of(&trained, &self.validation, THREADS);
        trained.sharpness = calibrate(&self.validation, &outputs);
        let found = report(&trained, &self.validation, THREADS);
        let figures = figures([
            ("top1", found.top1),
            ("balanced", found.balanced),
            ("mixed_as_moving", found.mixed_as_moving),
        ]);
        (figures, trained.to_bytes())
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
