//! Behavior cloning of an expert (`chaic train clone`).

use std::path::Path;

use chaic_nn::AdamWConfig;
use chaic_training::bounds::{
    ADAM, Bound, BoundTable, FRACTION, LEARNING_RATE, SEED, SHARDS, STEPS, integer,
};
use chaic_training::{Metrics, TrainingError, learning_rate_at, metrics};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Algorithm, IterationContext, TrainState, TrainingSpec};
use crate::actor_critic::Optimizer;
use crate::cloning::{CloningMetrics, Demonstration, EXPERTS, ExpertInfo, FitConfig, fit};
use crate::demonstrations::Demonstrations;
use crate::ppo::MAX_BATCH;
use crate::rollout::{RolloutEpisode, rollout_with_expert};
use crate::rollout_config::{ROLLOUT_BOUNDS, RolloutConfig};

/// Maximum memory of all demonstrations, bytes: 16 GiB.
const MAX_DEMONSTRATION_BYTES: u64 = 1 << 34;
/// Memory of the demonstrations of an episode, and additional memory per past decision that they
/// contain, bytes.
const EPISODE_BYTES: u64 = 100_000;
const PAST_DECISION_BYTES: u64 = 45_000;

/// Expert of `chaic train clone`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExpertConfig {
    /// Name of the helper that is imitated, see [`EXPERTS`].
    pub helper: String,
}

impl Default for ExpertConfig {
    fn default() -> ExpertConfig {
        ExpertConfig { helper: EXPERTS[0].name.to_owned() }
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
    /// Expert.
    #[serde(alias = "teacher")]
    pub expert: ExpertConfig,
    /// Rollouts.
    #[serde(alias = "play")]
    pub rollout: RolloutConfig,
    /// Fraction of episodes that the learner drives while the expert labels its states (DAgger).
    /// The expert drives all episodes of the first iteration.
    #[serde(alias = "mixed")]
    pub learner_fraction: f32,
    /// Maximum number of episodes whose demonstrations are kept, the latest ones.
    pub max_episodes: usize,
    /// Label smoothing: probability mass that is spread evenly over all candidates. It preserves
    /// some exploration for later reinforcement learning.
    pub label_smoothing: f32,
    /// Discount factor per frame of the returns that the value head regresses.
    #[serde(alias = "discount")]
    pub gamma: f32,
    /// Optimizer steps per iteration.
    pub n_steps: usize,
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
            expert: ExpertConfig::default(),
            rollout: RolloutConfig::default(),
            learner_fraction: 0.7,
            max_episodes: 8192,
            label_smoothing: 0.0,
            gamma: 0.9998,
            n_steps: 200,
            batch_size: 128,
            learning_rate: 1e-3,
            shards: 2,
            adam: AdamWConfig {
                beta2: 0.999,
                weight_decay: 0.01,
                max_grad_norm: 1.0,
                ..AdamWConfig::default()
            },
        }
    }
}

impl Algorithm for CloningConfig {
    type Data = Demonstrations;
    const KIND: &'static str = "clone";
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("iterations", STEPS),
        ("rollout", Bound::Table(ROLLOUT_BOUNDS)),
        ("learner_fraction", FRACTION),
        // `check` bounds the memory of all demonstrations.
        ("max_episodes", integer(1, 100_000)),
        ("label_smoothing", FRACTION),
        ("gamma", FRACTION),
        ("n_steps", integer(1, 100_000)),
        ("batch_size", integer(1, MAX_BATCH)),
        ("learning_rate", LEARNING_RATE),
        ("shards", SHARDS),
        ("adam", ADAM),
    ];
    // The labels of all demonstrations.
    const FIXED_KEYS: &'static [&'static str] = &["expert.helper", "gamma", "rollout.rewards"];

    fn spec(&self) -> TrainingSpec<'_> {
        let CloningConfig { seed, iterations, rollout, shards, .. } = self;
        TrainingSpec { seed: *seed, iterations: *iterations, rollout, shards: *shards }
    }

    fn check(&self) -> Result<(), String> {
        let name = &self.expert.helper;
        if ExpertInfo::find_expert(name).is_none() {
            let names: Vec<&str> = EXPERTS.iter().map(|expert| expert.name).collect();
            return Err(format!("`expert.helper` is `{name}`, expected {}", names.join(", ")));
        }
        let n_past_decisions = self.rollout.n_past_decisions;
        let episode_bytes = EPISODE_BYTES + n_past_decisions as u64 * PAST_DECISION_BYTES;
        let max = MAX_DEMONSTRATION_BYTES / episode_bytes;
        if self.max_episodes as u64 > max {
            return Err(format!(
                "`max_episodes` is {}; with `rollout.n_past_decisions = {n_past_decisions}` it must be from 1 to \
                 {max} to fit in memory",
                self.max_episodes
            ));
        }
        Ok(())
    }

    fn read_data(&self, folder: &Path, state: &TrainState) -> Result<Demonstrations, String> {
        let (identity, n_features) = (state.identity(Self::KIND), state.kind.n_features());
        Demonstrations::read(folder, state.iterations, self.max_episodes, &identity, n_features)
    }

    fn iterate(
        &self,
        state: &mut TrainState,
        data: &mut Demonstrations,
        context: &IterationContext<'_>,
    ) -> Result<Option<Metrics>, TrainingError> {
        let IterationContext { folder, perception, stop } = *context;
        let expert = ExpertInfo::find_expert(&self.expert.helper).expect("it was checked");
        let played = self.rollout.sample_episodes(self.seed, state.iterations);
        let rollout = self.rollout.context(perception, self.gamma, stop);
        let weights = state.policy_weights();
        let learner_fraction = if state.iterations == 0 { 0.0 } else { self.learner_fraction };
        let record = |episode: &RolloutEpisode| {
            rollout_with_expert(episode, &weights, &rollout, expert, learner_fraction)
        };
        let labeled: Result<Vec<_>, _> = played.par_iter().map(record).collect();
        let labeled = labeled.map_err(TrainingError::from_data)?;
        let Some(labeled) = labeled.into_iter().collect::<Option<Vec<_>>>() else {
            return Ok(None);
        };
        let tr = labeled.iter().map(|(_, tr)| tr).sum::<f64>() / labeled.len().max(1) as f64;
        let episodes: Vec<Vec<Demonstration>> =
            labeled.into_iter().map(|(demonstrations, _)| demonstrations).collect();
        let all = data.with(&episodes, self.max_episodes);
        let learning_rate =
            learning_rate_at(state.iterations, self.learning_rate, 1, self.iterations);
        if self.rollout.normalize {
            let demonstrations = episodes.iter().flatten();
            state.update_normalizer(demonstrations.map(|d| &d.observation));
        }
        let fit_config = FitConfig {
            optimizer: Optimizer { adam: &self.adam, learning_rate },
            label_smoothing: self.label_smoothing,
            n_steps: self.n_steps,
            batch_size: self.batch_size,
            seed: self.seed,
            iteration: state.iterations,
        };
        let stats = fit(&fit_config, &state.model, &mut state.learner, &all, stop);
        let Some(stats) = stats else { return Ok(None) };
        let identity = state.identity(Self::KIND);
        Demonstrations::write(folder, state.iterations, &episodes, &identity)?;
        data.add(episodes, self.max_episodes);
        let CloningMetrics { loss, agreement, value_loss } = stats;
        Ok(Some(metrics([
            ("tr", tr),
            ("demonstrations", data.episodes.iter().map(Vec::len).sum::<usize>() as f64),
            ("loss", loss),
            ("agreement", agreement),
            ("value_loss", value_loss),
        ])))
    }
}
