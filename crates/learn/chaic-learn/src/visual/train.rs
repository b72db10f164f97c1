//! Training of visual policies by PPO, with the paper's hyperparameters by default.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

use chaic_env::rules::RuleSet;
use chaic_nn::Network;
use chaic_nn::weights::{self, WeightsError};
use chaic_training::bounds::{Bound, BoundTable, SEED, STEPS, integer};
use chaic_training::{
    Checkpoint, CheckpointError, Learner, Metrics, Trainer, TrainingError, metrics,
};
use rayon::prelude::*;

use super::env_runner::{EnvRunner, EpisodeProgress, Experience, TrainingSetup, replay};
use super::helper::{VisualHelper, VisualPolicies, VisualWeights};
use super::network::VisualNetwork;
use super::observation::IMAGE_SIZE;
use crate::actor_critic::ActorCritic as _;
use crate::opponent::network::OpponentInput;
use crate::ppo::{Schedule, ppo_bounds, update};
use crate::rollout::{RolloutEpisode, RolloutError};
use crate::rollout_config::{
    MAX_VALIDATION_EPISODES, REWARD, Validation, check_opponent, check_splits, mean, read_opponent,
    validation_episodes,
};
use crate::train::read_reference;

pub use super::config::VisualConfig;

/// Trainer of a visual policy.
pub struct VisualTrainer {
    setup: TrainingSetup,
    learner: Learner,
    updates: u64,
    /// Parameters of the initial policy, if a KL penalty refers to them.
    reference: Option<Vec<f32>>,
    runners: Vec<EnvRunner>,
    /// Progress of the environments before an update that was stopped; it is restored before the
    /// next update.
    interrupted_at: Option<Vec<EpisodeProgress>>,
    /// Transport rates of the baseline helper on the validation episodes, once they are known.
    baseline: OnceLock<Vec<f64>>,
}

impl VisualTrainer {
    fn progress(&self) -> Vec<EpisodeProgress> {
        match &self.interrupted_at {
            Some(interrupted_at) => interrupted_at.clone(),
            None => self.runners.iter().map(EnvRunner::progress).collect(),
        }
    }
}

/// Maximum number of decisions between two updates. Each takes 74 kB, all of them 5 GB.
const MAX_DECISIONS: usize = 1 << 16;
/// Maximum number of pixels of one camera summed over all environments. Each takes 25 bytes, all of
/// them 2 GB. An environment takes another 4 MB.
const MAX_CAMERA_PX: usize = 1 << 26;
/// Maximum number of decisions per optimizer step. A pass over their images takes a second and
/// cannot be stopped.
const MAX_BATCH: i64 = 512;

/// Sections of a checkpoint.
const UPDATES: &str = "visual.updates";
const EPISODES: &str = "visual.episodes_started";
const N_ACTIONS: &str = "visual.n_actions";
const ACTION_INDICES: &str = "visual.actions";

impl Trainer for VisualTrainer {
    type Config = VisualConfig;
    const KIND: &'static str = "visual";
    const WEIGHTS: &'static str = "policy.safetensors";
    const RECORD_STEPS: u64 = 10;
    const CHECKPOINT_STEPS: u64 = 10;
    const VALIDATION_STEPS: u64 = 2500;
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("n_updates", STEPS),
        ("n_envs", integer(1, 1024)),
        ("n_steps", integer(1, MAX_DECISIONS as i64)),
        ("image_size", integer(IMAGE_SIZE as i64, 1024)),
        ("validation_episodes", integer(1, MAX_VALIDATION_EPISODES)),
        (
            "rewards",
            Bound::Table(&[("delivered", REWARD), ("progress_per_m", REWARD), ("invalid", REWARD)]),
        ),
        ("ppo", Bound::Table(&ppo_bounds(MAX_BATCH))),
    ];

    fn new(
        config: &VisualConfig,
        folder: &Path,
        _: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<VisualTrainer>, TrainingError> {
        let perception = config.perception_factory().map_err(TrainingError::from_data)?;
        let opponent = read_opponent(config.opponent.as_deref())?.map(Arc::new);
        let model =
            VisualNetwork::new(config.action_space, OpponentInput::from_model(opponent.as_deref()));
        let mut learner = Learner::new(model.network(), config.seed, config.ppo.shards);
        if let (Some(range), Some(opponent)) = (model.opponent_range(), &opponent) {
            learner.parameters[range].copy_from_slice(opponent.parameters());
        }
        let reference = read_reference(&config.ppo, folder, |bytes| model.read(bytes));
        let reference = reference.map_err(TrainingError::InvalidConfig)?;
        let progress = vec![EpisodeProgress::default(); config.n_envs];
        let setup = TrainingSetup { config: config.clone(), perception, opponent, model };
        let runners = replay(&setup, &progress, stop);
        let runners = runners.map_err(|e| TrainingError::InvalidConfig(format!("`tasks` {e}")))?;
        let Some(runners) = runners else { return Ok(None) };
        Ok(Some(VisualTrainer {
            setup,
            learner,
            updates: 0,
            reference,
            runners,
            interrupted_at: None,
            baseline: OnceLock::new(),
        }))
    }

    fn check(config: &VisualConfig) -> Result<(), String> {
        let VisualConfig { n_envs, n_steps, image_size, .. } = *config;
        if config.tasks.is_empty() {
            return Err("`tasks` is empty".to_owned());
        }
        check_splits("splits", &config.splits)?;
        let opponent = read_opponent(config.opponent.as_deref()).map_err(|e| e.to_string())?;
        let image_px = image_size as usize;
        if !image_px.is_multiple_of(IMAGE_SIZE) {
            return Err(format!("`image_size` must be a multiple of {IMAGE_SIZE}, up to 1024"));
        }
        if n_envs * image_px * image_px > MAX_CAMERA_PX {
            return Err(format!(
                "`n_envs` times the square of `image_size` must be from 1 to {MAX_CAMERA_PX} to fit in memory"
            ));
        }
        if n_envs * n_steps > MAX_DECISIONS {
            return Err(format!(
                "`n_envs` times `n_steps` must be from 1 to {MAX_DECISIONS} to fit in memory"
            ));
        }
        let perception = config.perception_factory().map_err(|e| e.to_string())?;
        check_opponent("", opponent.as_ref(), &*perception)
    }

    fn read_weights(config: &VisualConfig, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        let opponent = read_opponent(config.opponent.as_deref()).ok().flatten();
        let model =
            VisualNetwork::new(config.action_space, OpponentInput::from_model(opponent.as_ref()));
        let mut parameters = model.read(weights)?;
        // Rollouts use the opponent model of the configuration, not the one in the weights file.
        if let (Some(range), Some(opponent)) = (model.opponent_range(), &opponent) {
            parameters[range].copy_from_slice(opponent.parameters());
        }
        Ok(parameters)
    }

    fn fixed_keys() -> Vec<&'static str> {
        // The first key determines the network, the other keys determine the replayed episodes.
        vec![
            "action_space",
            "seed",
            "n_envs",
            "n_steps",
            "tasks",
            "splits",
            "image_size",
            "perception",
            "behavior",
            "appearance",
        ]
    }

    fn network(&self) -> &Network {
        self.setup.model.network()
    }

    fn total_steps(&self) -> u64 {
        self.setup.config.n_updates
    }

    fn steps_done(&self) -> u64 {
        self.updates
    }

    fn checkpoint(&self) -> Checkpoint {
        // Resuming replays the current episodes by their actions.
        let progress = self.progress();
        let mut checkpoint = Checkpoint::default();
        checkpoint.insert_integers(UPDATES, vec![self.updates]);
        checkpoint.insert_integers(EPISODES, progress.iter().map(|p| p.n_started).collect());
        checkpoint
            .insert_integers(N_ACTIONS, progress.iter().map(|p| p.actions.len() as u64).collect());
        let actions = progress.into_iter().flat_map(|p| p.actions);
        checkpoint.insert_integers(ACTION_INDICES, actions.map(u64::from).collect());
        self.learner.save(&mut checkpoint);
        checkpoint
    }

    fn load_parameters(&mut self, parameters: Vec<f32>) {
        self.learner.load_parameters(parameters);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        stop: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        let updates = checkpoint.integer(UPDATES)?;
        if updates > self.setup.config.n_updates {
            return Err(CheckpointError::section(UPDATES, format!("is {updates}")));
        }
        let progress = read_progress(&self.setup.config, updates, checkpoint)?;
        let before = self.learner.state();
        self.learner.load(checkpoint)?;
        let TrainingSetup { model, opponent, .. } = &self.setup;
        if let (Some(range), Some(opponent)) = (model.opponent_range(), opponent)
            && self.learner.parameters[range] != *opponent.parameters()
        {
            self.learner.set_state(before);
            return Err(CheckpointError::Data(
                "the file of `opponent` has changed since the training began".to_owned(),
            ));
        }
        let runners = replay(&self.setup, &progress, stop);
        let runners = runners.map_err(|e| CheckpointError::section(ACTION_INDICES, e))?;
        let Some(runners) = runners else { return Ok(None) };
        (self.runners, self.updates, self.interrupted_at) = (runners, updates, None);
        Ok(Some(()))
    }

    fn step(&mut self, stop: &AtomicBool) -> Result<Option<Metrics>, TrainingError> {
        let progress = self.progress();
        if self.interrupted_at.is_some() {
            let runners = replay(&self.setup, &progress, stop);
            let runners = runners.expect("the same episodes were played before");
            let Some(runners) = runners else { return Ok(None) };
            self.runners = runners;
            self.interrupted_at = None;
        }
        let learner = self.learner.state();
        let metrics = self.update(stop);
        if metrics.is_none() {
            self.interrupted_at = Some(progress);
            self.learner.set_state(learner);
        }
        Ok(metrics)
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Metrics, Vec<u8>)>, WeightsError> {
        let VisualTrainer { setup, learner, baseline, .. } = self;
        let TrainingSetup { config, perception, model, .. } = setup;
        let parameters = learner.parameters.clone();
        let bytes = weights::to_bytes(model.network(), &parameters, &model.kind())?;
        let weights = Arc::new(VisualWeights::new(model, parameters));
        let policies = Arc::new(VisualPolicies::AllTasks(weights));
        let episodes =
            validation_episodes(&config.tasks, &config.splits, config.validation_episodes, stop);
        let Some(episodes) = episodes else { return Ok(None) };
        let rate = |episode: &RolloutEpisode| {
            let helper =
                VisualHelper::create(Arc::clone(&policies), RuleSet::PAPER.planner, &**perception);
            episode.play(helper, config.image_size, stop)
        };
        let rates: Result<Vec<Option<f64>>, RolloutError> = episodes.par_iter().map(rate).collect();
        let rates = rates.expect("generated episodes can be played");
        let Some(rates) = rates.into_iter().collect::<Option<Vec<f64>>>() else { return Ok(None) };
        let validation = Validation { perception: &**perception, baseline };
        let compared = validation.compare(&rates, &episodes, config.image_size, stop);
        let Some(mut named) = compared else { return Ok(None) };
        named.insert("tr".to_owned(), mean(&rates));
        Ok(Some((named, bytes)))
    }
}

impl VisualTrainer {
    /// Collects experience and updates the network. Returns `None` if it was stopped, with
    /// environments and learner in an unspecified state.
    fn update(&mut self, stop: &AtomicBool) -> Option<Metrics> {
        let VisualTrainer { setup, learner, updates, reference, runners, .. } = self;
        let TrainingSetup { config, model, .. } = &*setup;
        let parameters = learner.parameters.clone();
        let collect = |runner: &mut EnvRunner| runner.collect(setup, &parameters, *updates, stop);
        let experience: Result<Vec<Option<Experience>>, RolloutError> =
            runners.par_iter_mut().map(collect).collect();
        let experience = experience.expect("generated episodes can be played");
        let experience: Vec<Experience> = experience.into_iter().collect::<Option<_>>()?;
        let n = (config.n_envs * config.n_steps) as f64;
        let reward = experience.iter().map(|e| e.reward).sum::<f64>() / n;
        let invalid = experience.iter().map(|e| e.n_invalid).sum::<usize>() as f64 / n;
        let trajectories: Vec<_> = experience.into_iter().flat_map(|e| e.trajectories).collect();
        let progress_remaining = 1.0 - *updates as f32 / config.n_updates as f32;
        let schedule = Schedule { seed: config.seed, iteration: *updates, progress_remaining };
        let reference = reference.as_deref();
        let stats = update(&config.ppo, model, learner, &trajectories, reference, schedule, stop)?;
        *updates += 1;
        let mut named = metrics([("reward", reward), ("invalid", invalid)]);
        named.extend(stats.to_metrics());
        Some(named)
    }
}

/// Returns the progress of each environment, checked against the number of updates.
fn read_progress(
    config: &VisualConfig,
    updates: u64,
    checkpoint: &Checkpoint,
) -> Result<Vec<EpisodeProgress>, CheckpointError> {
    let episode_counts = checkpoint.all_integers(EPISODES)?;
    if episode_counts.len() != config.n_envs {
        return Err(CheckpointError::Data(format!(
            "`n_envs` is {}, but was {} when the training began; set it back in config.toml, or start a \
             new training",
            config.n_envs,
            episode_counts.len()
        )));
    }
    let n_actions = checkpoint.integers(N_ACTIONS, config.n_envs)?;
    let n_total = usize::try_from(n_actions.iter().fold(0, |sum: u64, n| sum.saturating_add(*n)));
    let n_total = n_total.map_err(|_| CheckpointError::section(N_ACTIONS, "is too large"))?;
    let indices = checkpoint.integers(ACTION_INDICES, n_total)?;
    // Each recorded action is one decision, and an environment starts at most one episode per
    // decision.
    let n_decisions = updates * config.n_steps as u64;
    if let Some(n) = episode_counts.iter().find(|n| **n > n_decisions) {
        return Err(CheckpointError::section(EPISODES, format!("has {n}")));
    }
    if let Some(n) = n_actions.iter().find(|n| **n > n_decisions) {
        return Err(CheckpointError::section(N_ACTIONS, format!("has {n}")));
    }
    let n_choices = config.action_space.n_actions() as u64;
    if indices.iter().any(|action_index| *action_index >= n_choices) {
        return Err(CheckpointError::section(ACTION_INDICES, "has a value that is not an action"));
    }
    let mut indices = indices.iter();
    let progress_of = |(n_started, n): (&u64, &u64)| EpisodeProgress {
        n_started: *n_started,
        actions: indices.by_ref().take(*n as usize).map(|index| *index as u16).collect(),
    };
    Ok(episode_counts.iter().zip(n_actions).map(progress_of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_training_is_resumed_with_as_many_environments_as_before() {
        let mut checkpoint = Checkpoint::default();
        checkpoint.insert_integers(EPISODES, vec![0, 1]);
        checkpoint.insert_integers(N_ACTIONS, vec![1, 0]);
        checkpoint.insert_integers(ACTION_INDICES, vec![3]);
        let read = |n_envs| {
            let config = VisualConfig { n_envs, ..VisualConfig::default() };
            read_progress(&config, 1, &checkpoint).map(|progress| progress.len())
        };
        assert_eq!(read(2), Ok(2));
        for n_envs in [1, 3] {
            let problem = read(n_envs).unwrap_err().to_string();
            let expected = format!("`n_envs` is {n_envs}, but was 2 when the training began");
            assert!(problem.contains(&expected) && !problem.contains('\n'), "{problem}");
        }
    }
}
