//! Training of primitive actions by PPO, with the paper's hyperparameters by default.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_agents::perception_factory::{GROUND_TRUTH, PerceptionFactory};
use chaic_core::observation::SensorConfig;
use chaic_core::rng::RngStream;
use chaic_core::{AgentError, AgentId, TaskId};
use chaic_env::helper_registry::Helper;
use chaic_env::rules::RuleSet;
use chaic_env::{
    AdvanceOutcome, AgentSlot, Env, EpisodeAgents, EpisodeConfig, RewardWeights, seeded_by_episode,
};
use chaic_episodes::{SeedRange, find_episode};
use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{Network, Pass};
use chaic_training::bounds::{Bound, BoundTable, SEED, STEPS, integer};
use chaic_training::{
    Checkpoint, CheckpointError, Learner, Metrics, Trainer, TrainingError, metrics,
};
use chaic_vision::perception_registry::{self, PerceptionError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::helper::{ObservationEncoder, PrimitiveHelper, PrimitiveWeights};
use super::network::PrimitiveNetwork;
use super::observation::{IMAGE_SIZE, PrimitiveObservation};
use super::{ACTIONS, PAUSE};
use crate::actor_critic::{ActorCritic as _, ActorCriticOutput};
use crate::opponent::network::{OpponentInput, OpponentModel};
use crate::ppo::{PpoConfig, Schedule, Trajectory, Transition, ppo_bounds, update};
use crate::reward_config;
use crate::rollout::{RolloutEpisode, RolloutError};
use crate::rollout_config::{
    GENERATORS, MAX_VALIDATION_EPISODES, REWARD, check_splits, read_opponent, validation_episodes,
};

/// Configuration of `chaic train primitive`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PrimitiveConfig {
    /// Seed of weights, episodes and batches.
    pub seed: u64,
    /// Total number of updates.
    #[serde(alias = "updates")]
    pub n_updates: u64,
    /// Number of parallel environments.
    #[serde(alias = "envs")]
    pub n_envs: usize,
    /// Decisions of each environment between updates.
    #[serde(alias = "rollout")]
    pub n_steps: usize,
    /// Tasks, whose episodes take turns. The paper trains one policy per task.
    pub tasks: Vec<TaskId>,
    /// Generators whose episodes take turns, as in `[rollout]` of the other trainings.
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
    /// Validation episodes per task.
    pub validation_episodes: usize,
    /// Weights of the reward terms.
    #[serde(with = "reward_config::per_action")]
    pub rewards: RewardWeights,
    /// PPO hyperparameters; the time unit of `gamma` is a decision.
    pub ppo: PpoConfig,
}

impl Default for PrimitiveConfig {
    /// Defaults of the paper: 10^4 decisions, an update after every two, minibatches of two,
    /// otherwise as in Stable-Baselines3.
    fn default() -> PrimitiveConfig {
        let defaults = PpoConfig::default();
        PrimitiveConfig {
            seed: 1,
            n_updates: 5000,
            n_envs: 1,
            n_steps: 2,
            tasks: vec![TaskId::NoConstraint],
            splits: vec![GENERATORS[0].to_owned()],
            opponent: None,
            image_size: 128,
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
            validation_episodes: 4,
            rewards: RewardWeights::STANDARD,
            ppo: PpoConfig { batch_size: 2, shards: 1, ..defaults },
        }
    }
}

impl PrimitiveConfig {
    fn perception_factory(&self) -> Result<Arc<dyn PerceptionFactory>, PerceptionError> {
        perception_registry::perception_from_name(&self.perception, &self.behavior)
    }

    /// Returns the id of the `k`th episode of an environment.
    fn episode(&self, slot: usize, k: u64) -> String {
        let index = k * self.n_envs as u64 + slot as u64;
        let task = self.tasks[index as usize % self.tasks.len()];
        let split = &self.splits[index as usize / self.tasks.len() % self.splits.len()];
        let seed = SeedRange::POLICY_TRAIN.draw(&mut RngStream::new(self.seed, "episodes", index));
        format!("{task}/{split}/{seed}")
    }
}

/// What all environments of a training share.
#[derive(Clone, Copy)]
struct CollectContext<'a> {
    config: &'a PrimitiveConfig,
    perception: &'a dyn PerceptionFactory,
    opponent: Option<&'a Arc<OpponentModel>>,
    model: &'a PrimitiveNetwork,
    stop: &'a AtomicBool,
}

/// Environment with the learning helper, which plays one episode after another.
struct EnvRunner {
    slot: usize,
    n_started: u64,
    env: Env,
    encoder: ObservationEncoder,
    /// Actions chosen in the current episode.
    actions: Vec<u8>,
    /// Current observation.
    observation: PrimitiveObservation,
    pass: Pass,
}

/// Outcome of an action.
struct StepOutcome {
    reward: f32,
    is_invalid: bool,
    has_ended: bool,
}

impl EnvRunner {
    fn new(
        context: &CollectContext<'_>,
        slot: usize,
        n_started: u64,
        pass: Pass,
    ) -> Result<EnvRunner, RolloutError> {
        let CollectContext { config, perception, opponent, .. } = *context;
        let episode = find_episode(&config.episode(slot, n_started))?;
        let (mut encoder, grants) =
            ObservationEncoder::new(RuleSet::PAPER.planner, perception, opponent.cloned());
        let sensors = SensorConfig { image_size: config.image_size, ..encoder.sensors() };
        let agents =
            EpisodeAgents { helper: Some(AgentSlot::external(grants, sensors)), partner: None };
        let config = EpisodeConfig {
            image_size: Some(config.image_size),
            ..EpisodeConfig::new(&episode, "learner")
        };
        let mut env = Env::new(config, agents)?;
        encoder.reset(&env.briefing(AgentId::HELPER));
        env.advance(None)?;
        let observation = env.observe(AgentId::HELPER).and_then(|o| encoder.encode(o));
        let observation = observation.expect("the helper decides before an episode ends");
        Ok(EnvRunner { slot, n_started, env, encoder, actions: Vec::new(), observation, pass })
    }

    /// Takes an action and advances to the next decision or the end. After the end the observation
    /// is outdated.
    fn act(
        &mut self,
        action_index: usize,
        rewards: &RewardWeights,
    ) -> Result<StepOutcome, RolloutError> {
        self.actions.push(action_index as u8);
        let action = self.encoder.action(action_index);
        self.env.submit(AgentId::HELPER, action.unwrap_or(PAUSE));
        let has_ended = self.env.advance(None)? == AdvanceOutcome::Ended;
        let terms = self.env.reward(AgentId::HELPER);
        let is_invalid = action.is_none() || terms.is_some_and(|t| t.is_invalid);
        let terms = terms.map(|t| chaic_env::RewardTerms { is_invalid, ..t });
        if !has_ended && let Some(observation) = self.env.observe(AgentId::HELPER) {
            self.observation =
                self.encoder.encode(observation).unwrap_or_else(|| self.observation.clone());
        }
        let reward = terms.map_or(0.0, |t| t.weigh(rewards)) as f32;
        Ok(StepOutcome { reward, is_invalid, has_ended })
    }

    fn progress(&self) -> EpisodeProgress {
        EpisodeProgress { n_started: self.n_started, actions: self.actions.clone() }
    }

    fn evaluate(&mut self, model: &PrimitiveNetwork, parameters: &[f32]) -> ActorCriticOutput {
        model.forward(parameters, std::iter::once(&self.observation), &mut self.pass).remove(0)
    }
}

/// Experience of one environment between two updates.
#[derive(Default)]
struct Experience {
    trajectories: Vec<Trajectory<PrimitiveObservation>>,
    reward: f64,
    n_invalid: usize,
}

/// Progress of an environment: number of episodes started before, and actions of the current one.
#[derive(Clone, Debug, Default)]
struct EpisodeProgress {
    n_started: u64,
    actions: Vec<u8>,
}

/// Trainer of a policy of primitive actions.
pub struct PrimitiveTrainer {
    config: PrimitiveConfig,
    perception: Arc<dyn PerceptionFactory>,
    opponent: Option<Arc<OpponentModel>>,
    model: PrimitiveNetwork,
    learner: Learner,
    updates: u64,
    runners: Vec<EnvRunner>,
    /// Progress of the environments before an update that was stopped; it is restored before the
    /// next update.
    interrupted_at: Option<Vec<EpisodeProgress>>,
}

impl PrimitiveTrainer {
    /// Replays the current episodes up to this progress; `None` if it was stopped.
    fn replay(
        &self,
        progress: &[EpisodeProgress],
        stop: &AtomicBool,
    ) -> Result<Option<Vec<EnvRunner>>, String> {
        replay(&self.context(stop), progress)
    }

    fn context<'a>(&'a self, stop: &'a AtomicBool) -> CollectContext<'a> {
        let PrimitiveTrainer { config, perception, opponent, model, .. } = self;
        CollectContext {
            config,
            perception: &**perception,
            opponent: opponent.as_ref(),
            model,
            stop,
        }
    }

    fn progress(&self) -> Vec<EpisodeProgress> {
        match &self.interrupted_at {
            Some(interrupted_at) => interrupted_at.clone(),
            None => self.runners.iter().map(EnvRunner::progress).collect(),
        }
    }

    /// Collects experience in one environment; `None` if it was stopped.
    fn collect_experience(
        context: &CollectContext<'_>,
        parameters: &[f32],
        runner: &mut EnvRunner,
        update: u64,
    ) -> Result<Option<Experience>, RolloutError> {
        let CollectContext { config, model, stop, .. } = *context;
        let index = update * config.n_envs as u64 + runner.slot as u64;
        let mut rng = RngStream::new(config.seed, "actions", index);
        let mut experience = Experience::default();
        let mut trajectory = Trajectory::default();
        for _ in 0..config.n_steps {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let output = runner.evaluate(model, parameters);
            let action_index = output.sample(rng.unit());
            let observation = runner.observation.clone();
            let outcome = runner.act(action_index, &config.rewards)?;
            experience.reward += f64::from(outcome.reward);
            experience.n_invalid += usize::from(outcome.is_invalid);
            trajectory.transitions.push(Transition {
                observation,
                action: action_index,
                log_prob: output.log_probs[action_index],
                value: output.value(),
                reward: outcome.reward,
                duration: 1.0,
            });
            if outcome.has_ended {
                experience.trajectories.push(std::mem::take(&mut trajectory));
                let (slot, n_started) = (runner.slot, runner.n_started + 1);
                let pass = runner.pass.clone();
                *runner = EnvRunner::new(context, slot, n_started, pass)?;
            }
        }
        if !trajectory.transitions.is_empty() {
            trajectory.bootstrap_value = runner.evaluate(model, parameters).value();
            experience.trajectories.push(trajectory);
        }
        Ok(Some(experience))
    }
}

/// Replays the current episodes up to this progress; `None` if it was stopped.
///
/// # Errors
/// Predicate that describes what is wrong with the progress.
fn replay(
    context: &CollectContext<'_>,
    progress: &[EpisodeProgress],
) -> Result<Option<Vec<EnvRunner>>, String> {
    let CollectContext { config, model, stop, .. } = *context;
    let replay_one = |(slot, progress): (usize, &EpisodeProgress)| {
        let failed = |e: RolloutError| format!("has an episode that cannot be played: {e}");
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let runner = EnvRunner::new(context, slot, progress.n_started, model.pass());
        let mut runner = runner.map_err(failed)?;
        for action_index in &progress.actions {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let outcome =
                runner.act(usize::from(*action_index), &config.rewards).map_err(failed)?;
            if outcome.has_ended {
                return Err("continues after the end of an episode".to_owned());
            }
        }
        Ok(Some(runner))
    };
    let runners: Result<Vec<Option<EnvRunner>>, String> =
        progress.par_iter().enumerate().map(replay_one).collect();
    Ok(runners?.into_iter().collect())
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
const UPDATES: &str = "primitive.updates";
const EPISODES: &str = "primitive.episodes_begun";
const N_ACTIONS: &str = "primitive.choices_of_each";
const ACTION_INDICES: &str = "primitive.choices";

impl Trainer for PrimitiveTrainer {
    type Config = PrimitiveConfig;
    const KIND: &'static str = "primitive";
    const WEIGHTS: &'static str = "policy.safetensors";
    const RECORD_STEPS: u64 = 50;
    const CHECKPOINT_STEPS: u64 = 500;
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
        config: &PrimitiveConfig,
        _: &Path,
        _: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<PrimitiveTrainer>, TrainingError> {
        let perception = config.perception_factory().map_err(TrainingError::from_data)?;
        let opponent = read_opponent(config.opponent.as_deref())?.map(Arc::new);
        let model = PrimitiveNetwork::new(OpponentInput::from_model(opponent.as_deref()));
        let mut learner = Learner::new(model.network(), config.seed, config.ppo.shards);
        if let (Some(range), Some(opponent)) = (model.opponent_range(), &opponent) {
            learner.parameters[range].copy_from_slice(opponent.parameters());
        }
        let progress = vec![EpisodeProgress::default(); config.n_envs];
        let context = CollectContext {
            config,
            perception: &*perception,
            opponent: opponent.as_ref(),
            model: &model,
            stop,
        };
        let runners = replay(&context, &progress);
        let runners = runners.map_err(|e| TrainingError::InvalidConfig(format!("`tasks` {e}")))?;
        let Some(runners) = runners else { return Ok(None) };
        let (config, interrupted_at) = (config.clone(), None);
        Ok(Some(PrimitiveTrainer {
            config,
            perception,
            opponent,
            model,
            learner,
            updates: 0,
            runners,
            interrupted_at,
        }))
    }

    fn check(config: &PrimitiveConfig) -> Result<(), String> {
        let PrimitiveConfig { n_envs, n_steps, image_size, .. } = *config;
        if config.tasks.is_empty() {
            return Err("`tasks` is empty".to_owned());
        }
        check_splits("splits", &config.splits)?;
        read_opponent(config.opponent.as_deref()).map_err(|e| e.to_string())?;
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
        config.perception_factory().map(|_| ()).map_err(|e| e.to_string())
    }

    fn read_weights(config: &PrimitiveConfig, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        let opponent = read_opponent(config.opponent.as_deref()).ok().flatten();
        let model = PrimitiveNetwork::new(OpponentInput::from_model(opponent.as_ref()));
        weights::from_bytes(model.network(), weights, &model.kind())
    }

    fn network(&self) -> &Network {
        self.model.network()
    }

    fn total_steps(&self) -> u64 {
        self.config.n_updates
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
        checkpoint
            .insert_bytes(ACTION_INDICES, progress.into_iter().flat_map(|p| p.actions).collect());
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
        if updates > self.config.n_updates {
            return Err(CheckpointError::section(UPDATES, format!("is {updates}")));
        }
        let progress = read_progress(&self.config, updates, checkpoint)?;
        self.learner.load(checkpoint)?;
        let runners = self.replay(&progress, stop);
        let runners = runners.map_err(|e| CheckpointError::section(ACTION_INDICES, e))?;
        let Some(runners) = runners else { return Ok(None) };
        (self.runners, self.updates, self.interrupted_at) = (runners, updates, None);
        Ok(Some(()))
    }

    fn step(&mut self, stop: &AtomicBool) -> Result<Option<Metrics>, TrainingError> {
        let progress = self.progress();
        if self.interrupted_at.is_some() {
            let runners = self.replay(&progress, stop);
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
        let PrimitiveTrainer { config, perception, model, learner, .. } = self;
        let parameters = learner.parameters.clone();
        let bytes = weights::to_bytes(model.network(), &parameters, &model.kind())?;
        let weights = Arc::new(PrimitiveWeights::new(model, parameters));
        let episodes =
            validation_episodes(&config.tasks, &config.splits, config.validation_episodes);
        let rate = |episode: &RolloutEpisode| {
            let helper = PrimitiveHelper::create(
                Arc::clone(&weights),
                RuleSet::PAPER.planner,
                &**perception,
            );
            transport_rate(&episode.id, config.image_size, helper, stop)
        };
        let rates: Result<Vec<Option<f64>>, RolloutError> = episodes.par_iter().map(rate).collect();
        let rates = rates.expect("generated episodes can be played");
        let Some(rates) = rates.into_iter().collect::<Option<Vec<f64>>>() else { return Ok(None) };
        Ok(Some((metrics([("tr", rates.iter().sum::<f64>() / rates.len() as f64)]), bytes)))
    }
}

impl PrimitiveTrainer {
    /// Collects experience and updates the network. Returns `None` if it was stopped, with
    /// environments and learner in an unspecified state.
    fn update(&mut self, stop: &AtomicBool) -> Option<Metrics> {
        let PrimitiveTrainer {
            config, perception, opponent, model, learner, updates, runners, ..
        } = self;
        let parameters = learner.parameters.clone();
        let context = CollectContext {
            config,
            perception: &**perception,
            opponent: opponent.as_ref(),
            model,
            stop,
        };
        let collect_experience = |runner: &mut EnvRunner| {
            PrimitiveTrainer::collect_experience(&context, &parameters, runner, *updates)
        };
        let experience: Result<Vec<Option<Experience>>, RolloutError> =
            runners.par_iter_mut().map(collect_experience).collect();
        let experience = experience.expect("generated episodes can be played");
        let experience: Vec<Experience> = experience.into_iter().collect::<Option<_>>()?;
        let n = (config.n_envs * config.n_steps) as f64;
        let reward = experience.iter().map(|e| e.reward).sum::<f64>() / n;
        let invalid = experience.iter().map(|e| e.n_invalid).sum::<usize>() as f64 / n;
        let trajectories: Vec<_> = experience.into_iter().flat_map(|e| e.trajectories).collect();
        let progress_remaining = 1.0 - *updates as f32 / config.n_updates as f32;
        let schedule = Schedule { seed: config.seed, iteration: *updates, progress_remaining };
        let stats = update(&config.ppo, model, learner, &trajectories, None, schedule, stop)?;
        *updates += 1;
        let mut named = metrics([("reward", reward), ("invalid", invalid)]);
        named.extend(stats.to_metrics());
        Some(named)
    }
}

/// Returns the progress of each environment, checked against the number of updates.
fn read_progress(
    config: &PrimitiveConfig,
    updates: u64,
    checkpoint: &Checkpoint,
) -> Result<Vec<EpisodeProgress>, CheckpointError> {
    let episode_counts = checkpoint.integers(EPISODES, config.n_envs)?;
    let n_actions = checkpoint.integers(N_ACTIONS, config.n_envs)?;
    let mut actions = checkpoint.bytes(ACTION_INDICES)?;
    // Every action, and every episode but the first, takes a decision.
    let n_decisions = updates * config.n_steps as u64;
    if let Some(n) = episode_counts.iter().find(|n| **n > n_decisions) {
        return Err(CheckpointError::section(EPISODES, format!("has {n}")));
    }
    if actions.iter().any(|action_index| usize::from(*action_index) >= ACTIONS.len()) {
        return Err(CheckpointError::section(ACTION_INDICES, "has a value that is not an action"));
    }
    let mut all_progress = Vec::new();
    for (n_started, n) in episode_counts.iter().zip(n_actions) {
        let split = usize::try_from(*n).ok().and_then(|n| actions.split_at_checked(n));
        let Some((episode_actions, remaining)) = split else {
            return Err(CheckpointError::section(
                ACTION_INDICES,
                format!("has fewer than {n} remaining"),
            ));
        };
        all_progress
            .push(EpisodeProgress { n_started: *n_started, actions: episode_actions.to_vec() });
        actions = remaining;
    }
    match actions {
        [] => Ok(all_progress),
        more => {
            Err(CheckpointError::section(ACTION_INDICES, format!("has {} too many", more.len())))
        }
    }
}

/// Returns the transport rate of an episode; `None` if it was stopped.
fn transport_rate(
    id: &str,
    image_size: u32,
    helper: Helper,
    stop: &AtomicBool,
) -> Result<Option<f64>, RolloutError> {
    let episode = find_episode(id)?;
    let config =
        EpisodeConfig { image_size: Some(image_size), ..EpisodeConfig::new(&episode, "learner") };
    let mut env = Env::new(config, Some(seeded_by_episode(helper, &config)))?;
    if env.run(stop, None, &mut |_| Ok::<(), AgentError>(()))? != AdvanceOutcome::Ended {
        return Ok(None);
    }
    let (done, total) = env.world().progress();
    Ok(Some(if total > 0.0 { done / total } else { 0.0 }))
}
