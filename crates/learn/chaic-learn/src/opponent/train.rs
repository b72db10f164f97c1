//! Learning the opponent model from windows.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use chaic_core::geom::math;
use chaic_core::rng::Stream;
use chaic_files::{EntryKind, kind};
use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{AdamRules, Network};
use chaic_training::bounds::{ADAM, Bound, BoundTable, RATE, SEED, SHARDS, STEPS, integer, real};
use chaic_training::{
    Checkpoint, CheckpointError, Figures, Learner, Training, TrainingError, figures, rate_at,
};
use serde::{Deserialize, Serialize};

use super::collect::{
    COLLECT_BOUNDS, CollectError, CollectRules, Part, Sample, collect, read, read_given, write,
};
use super::network::{Heads, KIND, N_GOALS, OpponentModel, network};
use super::report::Report;
use super::{Goal, N_LIMITS};
use crate::actor_critic::{BySaid, Said, step};
use crate::choice_network::ChoiceNetwork;
use crate::ppo::MAX_BATCH;

/// How it is trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OpponentRules {
    /// Of weights and batches.
    pub seed: u64,
    /// Steps in all.
    pub steps: u64,
    /// Steps until the rate is reached.
    pub warm_up: u64,
    /// Windows of each step (the paper's: 32).
    pub batch: usize,
    /// Highest rate of steps.
    pub rate: f32,
    /// What an error of the target costs, beside one of the goal.
    pub target: f32,
    /// What the mean square error of the limits costs.
    pub limits: f32,
    /// Parts of a batch that are worked on side by side.
    pub shards: usize,
    /// A file of windows to learn from in place of those of `collect` (`chaic collect opponent`).
    pub windows: Option<PathBuf>,
    /// Windows of each goal that validations look at.
    pub validation_of_each: usize,
    /// How steps are taken.
    pub adam: AdamRules,
    /// Which windows are learned from.
    pub collect: CollectRules,
}

impl Default for OpponentRules {
    fn default() -> OpponentRules {
        OpponentRules {
            seed: 1,
            steps: 12_000,
            warm_up: 100,
            batch: 64,
            rate: 2e-3,
            target: 1.0,
            limits: 2.0,
            shards: 2,
            windows: None,
            validation_of_each: 1000,
            adam: AdamRules {
                beta2: 0.999,
                weight_decay: 1e-3,
                clip_norm: 1.0,
                ..AdamRules::default()
            },
            collect: CollectRules::default(),
        }
    }
}

/// The windows of a training, in its folder.
const WINDOWS: [(Part, &str); 2] =
    [(Part::Training, "windows.safetensors"), (Part::Validation, "validation.safetensors")];

/// An opponent model while it learns.
pub struct OpponentTraining {
    rules: OpponentRules,
    network: ChoiceNetwork,
    learner: Learner,
    steps: u64,
    samples: Vec<Sample>,
    /// Samples by goal, so that each goal is as likely.
    of_goal: Vec<Vec<usize>>,
    validation: Vec<Sample>,
}

/// Section of a checkpoint.
const STEPS_TAKEN: &str = "opponent.steps";

impl OpponentTraining {
    /// Returns a training on these windows before its first step.
    ///
    /// # Errors
    /// If there are no windows.
    fn with_windows(
        rules: &OpponentRules,
        samples: Vec<Sample>,
        validation: Vec<Sample>,
    ) -> Result<OpponentTraining, TrainingError> {
        let mut of_goal = vec![Vec::new(); Goal::ALL.len()];
        samples.iter().enumerate().for_each(|(k, s)| of_goal[s.goal.index()].push(k));
        of_goal.retain(|of| !of.is_empty());
        if of_goal.is_empty() {
            return Err(TrainingError::of_data(CollectError::Empty));
        }
        let network = network();
        let learner = Learner::new(&network.network, rules.seed, rules.shards);
        let rules = rules.clone();
        Ok(OpponentTraining { rules, network, learner, steps: 0, samples, of_goal, validation })
    }
}

impl Training for OpponentTraining {
    type Rules = OpponentRules;
    const KIND: &'static str = "opponent";
    const WEIGHTS: &'static str = "opponent.safetensors";
    const RECORD_STEPS: u64 = 100;
    const CHECKPOINT_STEPS: u64 = 1000;
    const VALIDATION_STEPS: u64 = 1000;
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("steps", STEPS),
        ("warm_up", STEPS),
        ("batch", integer(1, MAX_BATCH)),
        ("rate", RATE),
        ("target", real(0.0, 100.0)),
        ("limits", real(0.0, 100.0)),
        ("shards", SHARDS),
        ("validation_of_each", integer(1, 100_000)),
        ("adam", ADAM),
        ("collect", Bound::Table(COLLECT_BOUNDS)),
    ];

    fn new(
        rules: &OpponentRules,
        folder: &Path,
        progress: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<OpponentTraining>, TrainingError> {
        let mut windows = Vec::new();
        for (part, name) in WINDOWS {
            let path = folder.join(name);
            let given = rules.windows.as_ref().filter(|_| part == Part::Training);
            if let Some(given) = given {
                windows.push(read_given(given).map_err(TrainingError::of_data)?);
                continue;
            }
            if kind(&path)? != EntryKind::Missing {
                windows.push(read(&path).map_err(TrainingError::of_data)?);
                continue;
            }
            let of_each = match part {
                Part::Training => rules.collect.of_each,
                _ => rules.validation_of_each,
            };
            let collected = CollectRules { of_each, ..rules.collect.clone() };
            let made = collect(part, &collected, progress, stop).map_err(TrainingError::of_data)?;
            let Some(made) = made else { return Ok(None) };
            write(&path, &made)?;
            windows.push(made);
        }
        let (validation, samples) = (windows.remove(1), windows.remove(0));
        OpponentTraining::with_windows(rules, samples, validation).map(Some)
    }

    fn check(rules: &OpponentRules) -> Result<(), String> {
        if let Some(path) = &rules.windows {
            let windows = read(path).map_err(|e| e.to_string())?;
            if windows.is_empty() {
                return Err(format!("{}: {}", path.display(), CollectError::Empty));
            }
        }
        rules.collect.check()
    }

    fn read_weights(_: &OpponentRules, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        Ok(OpponentModel::from_bytes(weights)?.numbers().to_vec())
    }

    fn network(&self) -> &Network {
        &self.network.network
    }

    fn steps(&self) -> u64 {
        self.rules.steps
    }

    fn taken(&self) -> u64 {
        self.steps
    }

    fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        checkpoint.insert_integers(STEPS_TAKEN, vec![self.steps]);
        self.learner.save(&mut checkpoint);
        checkpoint
    }

    fn begin_with(&mut self, numbers: Vec<f32>) {
        self.learner.begin_with(numbers);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        let steps = checkpoint.integer(STEPS_TAKEN)?;
        self.learner.load(checkpoint)?;
        self.steps = steps;
        Ok(Some(()))
    }

    fn step(&mut self, _: &AtomicBool) -> Option<Figures> {
        let OpponentTraining { rules, network, learner, samples, of_goal, .. } = self;
        let mut rng = Stream::new(rules.seed, "windows of a step", self.steps);
        let mut draw = || {
            let of = &of_goal[rng.below(of_goal.len())];
            &samples[of[rng.below(of.len())]]
        };
        let batch: Vec<&Sample> = (0..rules.batch).map(|_| draw()).collect();
        let rate = rate_at(self.steps, (rules.rate, rules.warm_up, rules.steps));
        let by = |sample: &Sample, said: &Said, share, told: &mut Told| {
            gradient((rules.target, rules.limits), sample, said, share, told)
        };
        let parts = step(network, (learner, &rules.adam, rate), &batch, |s| &s.window, by);
        self.steps += 1;
        let mean = |of: fn(&Told) -> f64| parts.iter().map(of).sum::<f64>() / batch.len() as f64;
        Some(figures([
            ("goal", mean(|t| t.goal)),
            ("target", mean(|t| t.target)),
            ("limits", mean(|t| t.limits)),
        ]))
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Figures, Vec<u8>)>, WeightsError> {
        let numbers = &self.learner.average;
        let weights = weights::to_bytes(&self.network.network, numbers, KIND)?;
        let report = Report::of(&OpponentModel::new(numbers.clone()), &self.validation, stop);
        let Some(report) = report else { return Ok(None) };
        let figures = figures([
            ("goal_accuracy", report.goal_accuracy.mean),
            ("target_accuracy", report.target_accuracy.mean),
            ("limits_error", report.limits_error.mean),
        ]);
        Ok(Some((figures, weights)))
    }
}

/// What learning was like: sums over windows.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    goal: f64,
    target: f64,
    limits: f64,
}

/// The gradient of the loss of one window: cross entropies of the goal and of the target, where there is one, and the mean
/// square error of the limits.
fn gradient(
    (target_weight, limits_weight): (f32, f32),
    sample: &Sample,
    said: &Said,
    share: f32,
    told: &mut Told,
) -> BySaid {
    let Heads { log_goals, limits } = Heads::of(said);
    let goal = sample.goal.index();
    let is = |k: usize, which: usize| f32::from(u8::from(k == which));
    let mut of_state: Vec<f32> =
        (0..N_GOALS).map(|k| share * (math::exp(log_goals[k]) - is(k, goal))).collect();
    told.goal -= f64::from(log_goals[goal]);
    let part = 1.0 / N_LIMITS as f32;
    for (found, truth) in limits.iter().zip(&sample.limits) {
        let error = found - truth;
        told.limits += f64::from(part * error * error);
        let by_limit = 2.0 * part * error * found * (1.0 - found);
        of_state.push(share * limits_weight * by_limit);
    }
    let logits = match sample.target {
        Some(target) => {
            told.target -= f64::from(said.log_probabilities[target]);
            let weight = share * target_weight;
            let by = said.log_probabilities.iter().enumerate();
            by.map(|(k, l)| weight * (math::exp(*l) - is(k, target))).collect()
        }
        None => vec![0.0; said.log_probabilities.len()],
    };
    BySaid { logits, of_state }
}
