//! Configuration of the training of visual policies.

use std::path::PathBuf;
use std::sync::Arc;

use chaic_agents::perception_factory::{GROUND_TRUTH, PerceptionFactory};
use chaic_core::TaskId;
use chaic_core::rng::RngStream;
use chaic_env::RewardWeights;
use chaic_vision::perception_registry::{self, PerceptionError};
use serde::{Deserialize, Serialize};

use super::actions::ActionSpace;
use crate::ppo::PpoConfig;
use crate::reward_config;
use crate::rollout_config::{GENERATORS, TrainingAppearance, draw_episode};

/// Configuration of `chaic train visual`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VisualConfig {
    /// Seed of weights, episodes and batches.
    pub seed: u64,
    /// Meaning of the policy's outputs.
    pub action_space: ActionSpace,
    /// Total number of updates.
    #[serde(alias = "updates")]
    pub n_updates: u64,
    /// Number of parallel environments.
    #[serde(alias = "envs")]
    pub n_envs: usize,
    /// Decisions of each environment between updates.
    #[serde(alias = "rollout")]
    pub n_steps: usize,
    /// Tasks, used in turn for successive episodes. The paper trains one policy per task.
    pub tasks: Vec<TaskId>,
    /// Generators, used in turn for successive episodes, as in `[rollout]` of the other trainings.
    pub splits: Vec<String>,
    /// Weights of an opponent model (`chaic train opponent`) whose predictions the policy reads, if
    /// any (Smart-Help).
    pub opponent: Option<PathBuf>,
    /// Width and height of the images of helper and partner, pixels; a multiple of 128.
    pub image_size: u32,
    /// Perception of the helper, as `chaic eval --perception`.
    pub perception: String,
    /// Behavior recognition of the helper, as `chaic eval --behavior`.
    pub behavior: String,
    /// Light and colors of training episodes. Validation has the canonical ones.
    pub appearance: TrainingAppearance,
    /// Validation episodes per task.
    pub validation_episodes: usize,
    /// Weights of the reward terms.
    #[serde(with = "reward_config::per_action")]
    pub rewards: RewardWeights,
    /// PPO hyperparameters; the time unit of `gamma` is a decision.
    pub ppo: PpoConfig,
}

impl Default for VisualConfig {
    /// Defaults of the paper: 10^4 decisions, an update after every two, minibatches of two,
    /// otherwise as in Stable-Baselines3.
    fn default() -> VisualConfig {
        let defaults = PpoConfig::default();
        VisualConfig {
            seed: 1,
            action_space: ActionSpace::Plans,
            n_updates: 5000,
            n_envs: 1,
            n_steps: 2,
            tasks: vec![TaskId::NoConstraint],
            splits: vec![GENERATORS[0].to_owned()],
            opponent: None,
            image_size: 256,
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
            appearance: TrainingAppearance::Canonical,
            validation_episodes: 4,
            rewards: RewardWeights::STANDARD,
            ppo: PpoConfig { batch_size: 2, shards: 1, ..defaults },
        }
    }
}

impl VisualConfig {
    pub(super) fn perception_factory(&self) -> Result<Arc<dyn PerceptionFactory>, PerceptionError> {
        perception_registry::perception_from_name(&self.perception, &self.behavior)
    }

    /// Returns the id of the `k`th episode of an environment.
    pub(super) fn episode(&self, slot: usize, k: u64) -> String {
        let index = k * self.n_envs as u64 + slot as u64;
        let task = self.tasks[index as usize % self.tasks.len()];
        let split = &self.splits[index as usize / self.tasks.len() % self.splits.len()];
        draw_episode(task, split, RngStream::new(self.seed, "episodes", index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_and_generators_take_turns_over_the_environments() {
        let config = VisualConfig {
            n_envs: 2,
            tasks: vec![TaskId::LowTarget, TaskId::MovingHouse],
            splits: GENERATORS.map(str::to_owned).to_vec(),
            ..VisualConfig::default()
        };
        for (slot, k, expected) in [
            (0, 0, "low_target/gen/"),
            (1, 0, "moving_house/gen/"),
            (0, 1, "low_target/gen-standard/"),
            (1, 1, "moving_house/gen-standard/"),
            (0, 2, "low_target/gen/"),
        ] {
            let id = config.episode(slot, k);
            assert!(id.starts_with(expected), "{id} in slot {slot}, number {k}");
        }
    }
}
