//! Configuration of the episodes that trainings of policies play.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::perception_factory::{GROUND_TRUTH, PerceptionFactory};
use chaic_core::TaskId;
use chaic_core::rng::RngStream;
use chaic_env::RewardWeights;
use chaic_episodes::SeedRange;
use chaic_files::read_user_file;
use chaic_training::bounds::{Bound, BoundTable, integer, real};
use chaic_training::{Metrics, TrainingError};
use chaic_vision::perception_registry::{self, PerceptionError};
use serde::{Deserialize, Serialize};

use crate::opponent::network::OpponentModel;
use crate::policy::{ActionSelection, PolicyWeights};
use crate::reward_config;
use crate::rollout::{EpisodeResult, RolloutContext, rollout_all};

/// Maximum size of a weights file, bytes.
const MAX_BYTES: u64 = 1 << 28;

/// Bounds of [`RolloutConfig`].
pub(crate) const ROLLOUT_BOUNDS: BoundTable = &[
    // All decisions of an iteration's episodes are kept: about 0.3 MB per episode.
    ("episodes", integer(1, 4096)),
    ("image_size", integer(16, 1024)),
    ("validation_episodes", integer(1, MAX_VALIDATION_EPISODES)),
    ("rewards", Bound::Table(REWARD_BOUNDS)),
];
/// Maximum number of validation episodes per task; more take days.
pub(crate) const MAX_VALIDATION_EPISODES: i64 = 1000;
/// Bounds of the reward weights; larger returns exceed the range of the value head.
const REWARD_BOUNDS: BoundTable = &[
    ("delivered", REWARD),
    ("own_delivered", REWARD),
    ("held", REWARD),
    ("remaining_per_m", REWARD),
    ("failed", REWARD),
    ("emergency", REWARD),
];
/// Bounds of the weight of one reward term.
pub(crate) const REWARD: Bound = real(-1000.0, 1000.0);

/// Configuration of rollouts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RolloutConfig {
    /// Episodes per iteration.
    pub episodes: usize,
    /// Tasks, whose episodes take turns.
    pub tasks: Vec<TaskId>,
    /// Width and height of all agents' images during training, pixels.
    pub image_size: u32,
    /// Perception of the helper, as `chaic eval --perception`.
    pub perception: String,
    /// Behavior recognition of the helper, as `chaic eval --behavior`.
    pub behavior: String,
    /// Weights of an opponent model (`chaic train opponent`) whose predictions the policy reads, if
    /// any.
    pub opponent: Option<PathBuf>,
    /// Normalizes inputs by their running mean and standard deviation.
    pub normalize: bool,
    /// Validation episodes per task.
    pub validation_episodes: usize,
    /// Weights of the reward terms.
    #[serde(with = "reward_config::cumulative")]
    pub rewards: RewardWeights,
}

impl Default for RolloutConfig {
    fn default() -> RolloutConfig {
        RolloutConfig {
            episodes: 32,
            tasks: TaskId::paper().collect(),
            image_size: 128,
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
            opponent: None,
            normalize: false,
            validation_episodes: 3,
            rewards: RewardWeights::CUMULATIVE,
        }
    }
}

impl RolloutConfig {
    pub(crate) fn check(&self) -> Result<(), String> {
        if self.tasks.is_empty() {
            return Err("`rollout.tasks` is empty".to_owned());
        }
        self.perception_factory().map_err(|e| e.to_string())?;
        self.read_opponent().map_err(|e| e.to_string())?;
        Ok(())
    }

    pub(crate) fn read_opponent(&self) -> Result<Option<OpponentModel>, TrainingError> {
        let parse = |path: &PathBuf| {
            let weights_error = |problem| TrainingError::Weights { path: path.clone(), problem };
            OpponentModel::from_bytes(&read_user_file(path, MAX_BYTES)?).map_err(weights_error)
        };
        self.opponent.as_ref().map(parse).transpose()
    }

    pub(crate) fn perception_factory(&self) -> Result<Arc<dyn PerceptionFactory>, PerceptionError> {
        perception_registry::perception_from_name(&self.perception, &self.behavior)
    }

    pub(crate) fn context<'a>(
        &self,
        perception: &'a dyn PerceptionFactory,
        selection: ActionSelection,
        stop: &'a AtomicBool,
    ) -> RolloutContext<'a> {
        let RolloutConfig { image_size, rewards, .. } = *self;
        RolloutContext { perception, image_size, selection, rewards, stop }
    }

    /// Returns ids and seeds of the episodes of an iteration.
    pub(crate) fn sample_episodes(&self, seed: u64, iteration: u64) -> Vec<(String, u32)> {
        (0..self.episodes as u64)
            .map(|k| {
                let index = iteration * self.episodes as u64 + k;
                let task = self.tasks[index as usize % self.tasks.len()];
                let mut rng = RngStream::new(seed, "episodes", index);
                (format!("{}/gen/{}", task.name(), SeedRange::POLICY_TRAIN.draw(&mut rng)), 0)
            })
            .collect()
    }

    /// Returns transport rates on validation episodes; `None` if `stop` is raised.
    pub(crate) fn validate(
        &self,
        perception: &dyn PerceptionFactory,
        weights: &Arc<PolicyWeights>,
        stop: &AtomicBool,
    ) -> Option<Metrics> {
        let first = SeedRange::POLICY_VALIDATION.first;
        let seeds = || first..first + self.validation_episodes as u64;
        let ids: Vec<(String, u32)> = self
            .tasks
            .iter()
            .flat_map(|task| seeds().map(|seed| (format!("{}/gen/{seed}", task.name()), 0)))
            .collect();
        let selections =
            [("tr_sampled", ActionSelection::Sample), ("tr_greedy", ActionSelection::Greedy)];
        let tr = |selection| {
            let results = rollout_all(&ids, weights, &self.context(perception, selection, stop));
            Some(mean_tr(&results.expect("generated episodes can be played")?))
        };
        let tr = |(name, selection): (&str, _)| Some((name.to_owned(), tr(selection)?));
        selections.into_iter().map(tr).collect()
    }
}

pub(crate) fn mean_tr(results: &[EpisodeResult]) -> f64 {
    results.iter().map(|result| result.tr).sum::<f64>() / results.len().max(1) as f64
}
