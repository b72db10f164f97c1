//! Trainers of policies that choose plans.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::perception_factory::PerceptionFactory;
use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{AdamWConfig, Network};
use chaic_training::bounds::{
    ADAM, Bound, BoundTable, FRACTION, LEARNING_RATE, SEED, SHARDS, STEPS, integer,
};
use chaic_training::{
    Checkpoint, CheckpointError, Learner, Metrics, Trainer, TrainingError, learning_rate_at,
    metrics,
};
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::candidate_scorer::{CandidateScorer, CandidateSet};
use crate::cloning::{CloningMetrics, Demonstration, EpochConfig, train_epoch};
use crate::features::{N_OPPONENT_PLAN, N_OPPONENT_STATE, N_PLAN, N_STATE};
use crate::opponent::{self, network::OpponentModel};
use crate::policy::{ActionSelection, PolicyWeights};
use crate::ppo::{MAX_BATCH, PPO_BOUNDS, PpoConfig, Schedule, update};
use crate::rollout::{rollout_all, rollout_with_expert};
use crate::rollout_config::{ROLLOUT_BOUNDS, mean_tr};

pub use crate::rollout_config::RolloutConfig;

/// Kind in weights files of policies without opponent model.
const KIND: &str = "chaic plan policy 2";
/// Kind in weights files of policies with opponent model.
const KIND_WITH_OPPONENT: &str = "chaic plan policy with opponent model 1";
/// Name of the opponent model's parameters among those of a policy.
const OPPONENT: &str = "opponent";
/// Width of the hidden layers.
const WIDTH: usize = 96;

/// Kind of network that chooses plans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolicyKind {
    /// Reads features of the memory.
    WithoutOpponent,
    /// Reads predictions of an opponent model as well (Smart-Help).
    WithOpponent,
}

impl PolicyKind {
    /// Creates the network architecture. Its parameters include those of the opponent model.
    pub fn network(self) -> CandidateScorer {
        if self == PolicyKind::WithoutOpponent {
            return CandidateScorer::new(N_STATE, N_PLAN, WIDTH, 1);
        }
        let (n_state, n_plan) = (N_STATE + N_OPPONENT_STATE, N_PLAN + N_OPPONENT_PLAN);
        let mut model = CandidateScorer::new(n_state, n_plan, WIDTH, 1);
        model
            .network
            .extra_parameters(OPPONENT, opponent::network::network().network.n_parameters());
        model
    }

    fn name(self) -> &'static str {
        if self == PolicyKind::WithoutOpponent { KIND } else { KIND_WITH_OPPONENT }
    }

    /// Combines a network of this kind with parameters.
    pub fn weights_from(self, model: &CandidateScorer, parameters: Vec<f32>) -> PolicyWeights {
        let opponent_model = |model: &CandidateScorer| {
            let range = opponent_range(model);
            Arc::new(OpponentModel::new(parameters[range].to_vec()))
        };
        let opponent = (self == PolicyKind::WithOpponent).then(|| opponent_model(model));
        PolicyWeights { model: model.clone(), parameters, opponent }
    }
}

/// Returns the range of the opponent model's parameters.
fn opponent_range(model: &CandidateScorer) -> Range<usize> {
    let found = model.network.parameters().iter().find(|p| p.name == OPPONENT);
    found.expect("the network has an opponent model").range.clone()
}

/// Parses a weights file of either kind.
///
/// # Errors
/// [`WeightsError`] if the file is incomplete or belongs to another network.
pub fn from_bytes(bytes: &[u8]) -> Result<(PolicyKind, PolicyWeights), WeightsError> {
    let read = |kind: PolicyKind| {
        let model = kind.network();
        let parameters = weights::from_bytes(&model.network, bytes, kind.name())?;
        Ok((kind, kind.weights_from(&model, parameters)))
    };
    match read(PolicyKind::WithoutOpponent) {
        Err(WeightsError::Kind { found, .. }) if found == KIND_WITH_OPPONENT => {
            read(PolicyKind::WithOpponent)
        }
        read => read,
    }
}

/// Section of a checkpoint.
const ITERATIONS: &str = "policy.iterations";

/// Network and learner with the number of iterations so far.
pub struct TrainState {
    kind: PolicyKind,
    model: CandidateScorer,
    learner: Learner,
    iterations: u64,
}

impl TrainState {
    fn new(seed: u64, shards: usize, opponent: Option<&OpponentModel>) -> TrainState {
        let kind =
            if opponent.is_some() { PolicyKind::WithOpponent } else { PolicyKind::WithoutOpponent };
        let model = kind.network();
        let mut learner = Learner::new(&model.network, seed, shards);
        if let Some(opponent) = opponent {
            learner.parameters[opponent_range(&model)].copy_from_slice(opponent.parameters());
        }
        TrainState { kind, model, learner, iterations: 0 }
    }

    fn policy_weights(&self) -> Arc<PolicyWeights> {
        Arc::new(self.kind.weights_from(&self.model, self.learner.parameters.clone()))
    }

    /// Updates the statistics that normalize the network's inputs.
    fn update_normalizer<'a>(&mut self, decisions: impl Iterator<Item = &'a CandidateSet> + Clone) {
        self.model.update_normalizer(&mut self.learner.parameters, decisions);
    }

    fn weights(&self) -> Result<Vec<u8>, WeightsError> {
        weights::to_bytes(&self.model.network, &self.learner.parameters, self.kind.name())
    }

    fn checkpoint(&self) -> Checkpoint {
        self.learner.checkpoint(ITERATIONS, self.iterations)
    }

    fn resume(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.iterations = self.learner.restore(checkpoint, ITERATIONS)?;
        Ok(())
    }
}

/// Settings that all algorithms share.
#[derive(Clone, Copy, Debug)]
pub struct TrainingSpec<'a> {
    /// Seed of weights, episodes and batches.
    pub seed: u64,
    /// Total number of iterations.
    pub iterations: u64,
    /// Configuration of rollouts.
    pub rollout: &'a RolloutConfig,
    /// Shards of a batch, which run in parallel.
    pub shards: usize,
}

/// Training algorithm with its configuration.
pub trait Algorithm: Clone + Default + Serialize + DeserializeOwned {
    /// Name of the training, as in `chaic train NAME`.
    const KIND: &'static str;
    /// Bounds of every number.
    const BOUNDS: BoundTable;

    /// Returns the settings that all algorithms share.
    fn spec(&self) -> TrainingSpec<'_>;

    /// Runs one iteration with this perception; `None` if `stop` is raised.
    fn iterate(
        &self,
        perception: &dyn PerceptionFactory,
        state: &mut TrainState,
        stop: &AtomicBool,
    ) -> Option<Metrics>;
}

/// Trainer of a policy that chooses plans.
pub struct PolicyTrainer<A> {
    config: A,
    perception: Arc<dyn PerceptionFactory>,
    state: TrainState,
}

impl<A: Algorithm> Trainer for PolicyTrainer<A> {
    type Config = A;
    const KIND: &'static str = A::KIND;
    const BOUNDS: BoundTable = A::BOUNDS;
    const WEIGHTS: &'static str = "policy.safetensors";
    const RECORD_STEPS: u64 = 1;
    const CHECKPOINT_STEPS: u64 = 5;
    const VALIDATION_STEPS: u64 = 25;

    fn new(
        config: &A,
        _: &Path,
        _: &mut dyn FnMut(&str),
        _: &AtomicBool,
    ) -> Result<Option<PolicyTrainer<A>>, TrainingError> {
        let TrainingSpec { seed, shards, rollout, .. } = config.spec();
        let perception = rollout.perception_factory().map_err(TrainingError::from_data)?;
        let opponent = rollout.read_opponent()?;
        let state = TrainState::new(seed, shards, opponent.as_ref());
        Ok(Some(PolicyTrainer { config: config.clone(), perception, state }))
    }

    fn check(config: &A) -> Result<(), String> {
        config.spec().rollout.check()
    }

    fn read_weights(config: &A, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        let has_opponent = config.spec().rollout.opponent.is_some();
        let kind =
            if has_opponent { PolicyKind::WithOpponent } else { PolicyKind::WithoutOpponent };
        weights::from_bytes(&kind.network().network, weights, kind.name())
    }

    fn network(&self) -> &Network {
        &self.state.model.network
    }

    fn total_steps(&self) -> u64 {
        self.config.spec().iterations
    }

    fn steps_done(&self) -> u64 {
        self.state.iterations
    }

    fn checkpoint(&self) -> Checkpoint {
        self.state.checkpoint()
    }

    fn load_parameters(&mut self, parameters: Vec<f32>) {
        self.state.learner.load_parameters(parameters);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        self.state.resume(checkpoint).map(Some)
    }

    fn step(&mut self, stop: &AtomicBool) -> Option<Metrics> {
        let before = self.state.learner.state();
        let metrics = self.config.iterate(&*self.perception, &mut self.state, stop);
        match metrics {
            Some(_) => self.state.iterations += 1,
            None => self.state.learner.set_state(before),
        }
        metrics
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Metrics, Vec<u8>)>, WeightsError> {
        let bytes = self.state.weights()?;
        let weights = self.state.policy_weights();
        let metrics = self.config.spec().rollout.validate(&*self.perception, &weights, stop);
        Ok(metrics.map(|metrics| (metrics, bytes)))
    }
}

/// Configuration of `chaic train ppo`: reinforcement learning by PPO.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PpoTrainingConfig {
    /// Seed of weights, episodes and batches.
    pub seed: u64,
    /// Total number of iterations.
    pub iterations: u64,
    /// Rollouts.
    #[serde(alias = "play")]
    pub rollout: RolloutConfig,
    /// PPO hyperparameters; the time unit of `gamma` is a frame.
    pub ppo: PpoConfig,
}

impl Default for PpoTrainingConfig {
    fn default() -> PpoTrainingConfig {
        PpoTrainingConfig {
            seed: 1,
            iterations: 600,
            rollout: RolloutConfig::default(),
            ppo: PpoConfig {
                gamma: 0.9995,
                gae_lambda: 0.98,
                ent_coef: 0.01,
                n_epochs: 4,
                batch_size: 512,
                learning_rate: 1e-3,
                anneal_lr: true,
                target_kl: 0.02,
                ..PpoConfig::default()
            },
        }
    }
}

impl Algorithm for PpoTrainingConfig {
    const KIND: &'static str = "ppo";
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("iterations", STEPS),
        ("rollout", Bound::Table(ROLLOUT_BOUNDS)),
        ("ppo", Bound::Table(PPO_BOUNDS)),
    ];

    fn spec(&self) -> TrainingSpec<'_> {
        let PpoTrainingConfig { seed, iterations, rollout, .. } = self;
        TrainingSpec { seed: *seed, iterations: *iterations, rollout, shards: self.ppo.shards }
    }

    fn iterate(
        &self,
        perception: &dyn PerceptionFactory,
        state: &mut TrainState,
        stop: &AtomicBool,
    ) -> Option<Metrics> {
        let ids = self.rollout.sample_episodes(self.seed, state.iterations);
        let context = self.rollout.context(perception, ActionSelection::Sample, stop);
        let results = rollout_all(&ids, &state.policy_weights(), &context);
        let results = results.expect("generated episodes can be played")?;
        let tr = mean_tr(&results);
        let frames = results.iter().map(|result| f64::from(result.frames)).sum();
        let trajectories: Vec<_> = results.into_iter().map(|result| result.trajectory).collect();
        let decisions: usize = trajectories.iter().map(|t| t.transitions.len()).sum();
        let progress_remaining = 1.0 - state.iterations as f32 / self.iterations as f32;
        let TrainState { model, learner, iterations, .. } = state;
        let schedule = Schedule { seed: self.seed, iteration: *iterations, progress_remaining };
        let stats = update(&self.ppo, model, learner, &trajectories, schedule, stop)?;
        if self.rollout.normalize {
            let transitions = trajectories.iter().flat_map(|t| &t.transitions);
            state.update_normalizer(transitions.map(|t| &t.observation));
        }
        let mut named = metrics([("tr", tr), ("frames", frames), ("decisions", decisions as f64)]);
        named.extend(stats.to_metrics());
        Some(named)
    }
}

/// Configuration of `chaic train clone`: behavior cloning of an expert.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CloningConfig {
    /// Seed of weights, episodes and batches.
    pub seed: u64,
    /// Total number of iterations.
    pub iterations: u64,
    /// Rollouts.
    #[serde(alias = "play")]
    pub rollout: RolloutConfig,
    /// Fraction of episodes that the learner drives while the expert labels its states (DAgger).
    #[serde(alias = "mixed")]
    pub learner_fraction: f32,
    /// Discount factor per frame of the returns that the value head regresses.
    #[serde(alias = "discount")]
    pub gamma: f32,
    /// Demonstrations per optimizer step.
    #[serde(alias = "batch")]
    pub batch_size: usize,
    /// Maximum learning rate.
    #[serde(alias = "rate")]
    pub learning_rate: f32,
    /// Shards of a batch, which run in parallel.
    pub shards: usize,
    /// Optimizer.
    pub adam: AdamWConfig,
}

impl Default for CloningConfig {
    fn default() -> CloningConfig {
        CloningConfig {
            seed: 1,
            iterations: 100,
            rollout: RolloutConfig::default(),
            learner_fraction: 0.5,
            gamma: 0.9995,
            batch_size: 64,
            learning_rate: 2e-3,
            shards: 2,
            adam: AdamWConfig {
                beta2: 0.999,
                weight_decay: 0.0,
                max_grad_norm: 1.0,
                ..AdamWConfig::default()
            },
        }
    }
}

impl Algorithm for CloningConfig {
    const KIND: &'static str = "clone";
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("iterations", STEPS),
        ("rollout", Bound::Table(ROLLOUT_BOUNDS)),
        ("learner_fraction", FRACTION),
        ("gamma", FRACTION),
        ("batch_size", integer(1, MAX_BATCH)),
        ("learning_rate", LEARNING_RATE),
        ("shards", SHARDS),
        ("adam", ADAM),
    ];

    fn spec(&self) -> TrainingSpec<'_> {
        let CloningConfig { seed, iterations, rollout, shards, .. } = self;
        TrainingSpec { seed: *seed, iterations: *iterations, rollout, shards: *shards }
    }

    fn iterate(
        &self,
        perception: &dyn PerceptionFactory,
        state: &mut TrainState,
        stop: &AtomicBool,
    ) -> Option<Metrics> {
        let ids = self.rollout.sample_episodes(self.seed, state.iterations);
        let context = self.rollout.context(perception, ActionSelection::Sample, stop);
        let weights = state.policy_weights();
        let rollout = |(id, seed): &(String, u32)| {
            let (fraction, gamma) = (self.learner_fraction, self.gamma);
            rollout_with_expert(id, *seed, &weights, &context, fraction, gamma)
        };
        let labeled: Result<Vec<_>, _> = ids.par_iter().map(rollout).collect();
        let labeled = labeled.expect("generated episodes can be played");
        let labeled: Vec<_> = labeled.into_iter().collect::<Option<_>>()?;
        let tr = labeled.iter().map(|(_, tr)| tr).sum::<f64>() / labeled.len().max(1) as f64;
        let demonstrations: Vec<Demonstration> =
            labeled.into_iter().flat_map(|(demonstrations, _)| demonstrations).collect();
        let learning_rate =
            learning_rate_at(state.iterations, self.learning_rate, 1, self.iterations);
        let TrainState { model, learner, iterations, .. } = state;
        let epoch = EpochConfig {
            adam: &self.adam,
            learning_rate,
            batch_size: self.batch_size,
            seed: self.seed,
            iteration: *iterations,
        };
        let stats = train_epoch(&epoch, model, learner, &demonstrations, stop)?;
        if self.rollout.normalize {
            state.update_normalizer(demonstrations.iter().map(|d| &d.observation));
        }
        let CloningMetrics { loss, agreement, value_loss } = stats;
        Some(metrics([
            ("tr", tr),
            ("demonstrations", demonstrations.len() as f64),
            ("loss", loss),
            ("agreement", agreement),
            ("value_loss", value_loss),
        ]))
    }
}
