//! Trainers of policies that choose plans.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

use chaic_agents::perception_factory::PerceptionFactory;
use chaic_files::read_bounded;
use chaic_nn::Network;
use chaic_nn::weights::{self, WeightsError};
use chaic_training::bounds::{Bound, BoundTable, SEED, STEPS};
use chaic_training::checkpoint::Identity;
use chaic_training::{
    Checkpoint, CheckpointError, INITIAL_WEIGHTS, Learner, Metrics, Trainer, TrainingError, metrics,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::candidate_scorer::{CandidateScorer, CandidateSet};
use crate::decision_memory::N_MEMORY_PLAN_FEATURES;
use crate::opponent::network::OpponentModel;
use crate::policy_kind::{PolicyKind, PolicyWeights};
use crate::ppo::{PPO_BOUNDS, PpoConfig, Schedule, update};
use crate::rollout::rollout_all;
use crate::rollout_config::{
    ROLLOUT_BOUNDS, ROLLOUT_FIXED_KEYS, VALIDATION_TR, Validation, mean_tr,
};

mod imitation;

pub use self::imitation::{CloningConfig, ExpertConfig};
pub use crate::rollout_config::RolloutConfig;

/// Maximum size of a weights file, bytes.
const MAX_WEIGHTS_BYTES: u64 = 1 << 28;
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
    fn new(
        seed: u64,
        shards: usize,
        kind: PolicyKind,
        opponent: Option<&OpponentModel>,
    ) -> TrainState {
        let model = kind.network();
        let mut learner = Learner::new(&model.network, seed, shards);
        if let (Some(range), Some(opponent)) = (PolicyKind::opponent_range(&model), opponent) {
            learner.parameters[range].copy_from_slice(opponent.parameters());
        }
        TrainState { kind, model, learner, iterations: 0 }
    }

    /// Identity of the files of a training of this kind.
    fn identity(&self, kind: &str) -> Identity {
        Identity::new(kind, &self.model.network)
    }

    fn policy_weights(&self) -> Arc<PolicyWeights> {
        Arc::new(PolicyWeights::new(self.kind, &self.model, self.learner.parameters.clone()))
    }

    /// Returns the parameters of the opponent model, if there is one.
    fn opponent_parameters(&self) -> Option<&[f32]> {
        let range = PolicyKind::opponent_range(&self.model)?;
        Some(&self.learner.parameters[range])
    }

    /// Checks that a resumed training still has the inputs with which it began. `opponent` are the
    /// parameters in the file of the opponent model.
    ///
    /// # Errors
    /// One line that describes the change.
    fn check_inputs(&self, opponent: Option<&[f32]>, normalizes: bool) -> Result<(), String> {
        if self.opponent_parameters() != opponent {
            return Err(
                "the file of `rollout.opponent` has changed since the training began".to_owned()
            );
        }
        if normalizes && self.iterations > 0 && !self.model.has_normalizer(&self.learner.parameters)
        {
            // The first update of the statistics would change all inputs at once.
            let problem = "it began without `rollout.normalize`, so it cannot be enabled";
            return Err(problem.to_owned());
        }
        Ok(())
    }

    /// Updates the statistics that normalize the network's inputs.
    fn update_normalizer<'a>(&mut self, decisions: impl Iterator<Item = &'a CandidateSet> + Clone) {
        // The features that mark earlier decisions are zero for candidates, so they are not
        // normalized.
        let n_raw = if self.kind.memory > 0 { N_MEMORY_PLAN_FEATURES } else { 0 };
        self.model.update_normalizer(&mut self.learner.parameters, decisions, n_raw);
    }

    fn weights(&self) -> Result<Vec<u8>, WeightsError> {
        weights::to_bytes(&self.model.network, &self.learner.parameters, &self.kind.name())
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
    /// Data that an iteration needs besides the network.
    type Data: Default;
    /// Name of the training, as in `chaic train NAME`.
    const KIND: &'static str;
    /// Bounds of every number.
    const BOUNDS: BoundTable;
    /// Keys on which the data of an algorithm depends, see [`Trainer::fixed_keys`].
    const FIXED_KEYS: &'static [&'static str] = &[];

    /// Returns the settings that all algorithms share.
    fn spec(&self) -> TrainingSpec<'_>;

    /// Checks constraints that bounds of single numbers cannot express.
    ///
    /// # Errors
    /// One line that describes the problem.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// Reads the data that the iterations so far have written to `folder`.
    ///
    /// # Errors
    /// One line, if a file is missing, damaged or belongs to another training.
    fn read_data(&self, folder: &Path, state: &TrainState) -> Result<Self::Data, String>;

    /// Runs one iteration; `None` if it was stopped.
    ///
    /// # Errors
    /// If data cannot be written.
    fn iterate(
        &self,
        state: &mut TrainState,
        data: &mut Self::Data,
        context: &IterationContext<'_>,
    ) -> Result<Option<Metrics>, TrainingError>;
}

/// Context of an iteration.
#[derive(Clone, Copy)]
pub struct IterationContext<'a> {
    /// Folder of the training.
    pub folder: &'a Path,
    /// Perception of the helper.
    pub perception: &'a dyn PerceptionFactory,
    /// Stop flag.
    pub stop: &'a AtomicBool,
}

/// Trainer of a policy that chooses plans.
pub struct PolicyTrainer<A: Algorithm> {
    config: A,
    folder: PathBuf,
    perception: Arc<dyn PerceptionFactory>,
    state: TrainState,
    data: A::Data,
    /// Transport rates of the baseline helper on the validation episodes, once they are known.
    baseline: OnceLock<Vec<f64>>,
}

impl<A: Algorithm> Trainer for PolicyTrainer<A> {
    type Config = A;
    const KIND: &'static str = A::KIND;
    const BOUNDS: BoundTable = A::BOUNDS;
    const WEIGHTS: &'static str = "policy.safetensors";
    const RECORD_STEPS: u64 = 1;
    const CHECKPOINT_STEPS: u64 = 5;
    const VALIDATION_STEPS: u64 = 20;
    const SCORE: Option<&'static str> = Some(VALIDATION_TR);

    fn new(
        config: &A,
        folder: &Path,
        _: &mut dyn FnMut(&str),
        _: &AtomicBool,
    ) -> Result<Option<PolicyTrainer<A>>, TrainingError> {
        let TrainingSpec { seed, shards, rollout, .. } = config.spec();
        let perception = rollout.perception_factory().map_err(TrainingError::from_data)?;
        let opponent = rollout.read_opponent()?;
        let kind = rollout.policy_kind(opponent.as_ref());
        let state = TrainState::new(seed, shards, kind, opponent.as_ref());
        let data = config.read_data(folder, &state).map_err(TrainingError::InvalidConfig)?;
        Ok(Some(PolicyTrainer {
            config: config.clone(),
            folder: folder.to_owned(),
            perception,
            state,
            data,
            baseline: OnceLock::new(),
        }))
    }

    fn check(config: &A) -> Result<(), String> {
        config.spec().rollout.check()?;
        config.check()
    }

    fn read_weights(config: &A, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        let rollout = config.spec().rollout;
        let opponent = rollout.read_opponent().ok().flatten();
        let kind = rollout.policy_kind(opponent.as_ref());
        let model = kind.network();
        let mut parameters = weights::from_bytes(&model.network, weights, &kind.name())?;
        // The opponent model of the configuration replaces the one in the weights file.
        if let (Some(range), Some(opponent)) = (PolicyKind::opponent_range(&model), &opponent) {
            parameters[range].copy_from_slice(opponent.parameters());
        }
        if rollout.normalize && !model.has_normalizer(&parameters) {
            // The first update of the statistics would change all inputs at once.
            let problem = "trained without `rollout.normalize`, so it cannot be enabled";
            return Err(WeightsError::Configuration(problem.to_owned()));
        }
        Ok(parameters)
    }

    fn fixed_keys() -> Vec<&'static str> {
        [ROLLOUT_FIXED_KEYS, A::FIXED_KEYS].concat()
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
        // Training does not change the opponent model, so these are the parameters of its weights
        // file.
        let opponent = self.state.opponent_parameters().map(<[f32]>::to_vec);
        let before = (self.state.learner.state(), self.state.iterations);
        self.state.resume(checkpoint)?;
        let normalizes = self.config.spec().rollout.normalize;
        let checked = self.state.check_inputs(opponent.as_deref(), normalizes);
        match checked.and_then(|()| self.config.read_data(&self.folder, &self.state)) {
            Ok(data) => self.data = data,
            Err(problem) => {
                self.state.learner.set_state(before.0);
                self.state.iterations = before.1;
                return Err(CheckpointError::Data(problem));
            }
        }
        Ok(Some(()))
    }

    fn step(&mut self, stop: &AtomicBool) -> Result<Option<Metrics>, TrainingError> {
        let before = self.state.learner.state();
        let (folder, perception) = (&*self.folder, &*self.perception);
        let context = IterationContext { folder, perception, stop };
        let metrics = self.config.iterate(&mut self.state, &mut self.data, &context)?;
        match metrics {
            Some(_) => self.state.iterations += 1,
            None => self.state.learner.set_state(before),
        }
        Ok(metrics)
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Metrics, Vec<u8>)>, WeightsError> {
        let bytes = self.state.weights()?;
        let weights = self.state.policy_weights();
        let validation = Validation { perception: &*self.perception, baseline: &self.baseline };
        let metrics = validation.run(self.config.spec().rollout, &weights, stop);
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
    /// Parameters of the initial policy, for the KL penalty.
    type Data = Option<Vec<f32>>;
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

    fn read_data(&self, folder: &Path, state: &TrainState) -> Result<Option<Vec<f32>>, String> {
        read_reference(&self.ppo, folder, |bytes| {
            weights::from_bytes(&state.model.network, bytes, &state.kind.name())
        })
    }

    fn iterate(
        &self,
        state: &mut TrainState,
        reference: &mut Option<Vec<f32>>,
        context: &IterationContext<'_>,
    ) -> Result<Option<Metrics>, TrainingError> {
        let IterationContext { perception, stop, .. } = *context;
        let episodes = self.rollout.sample_episodes(self.seed, state.iterations);
        let rollout = self.rollout.context(perception, self.ppo.gamma, stop);
        let results = rollout_all(&episodes, &state.policy_weights(), &rollout);
        let results = results.map_err(TrainingError::from_data)?;
        let Some(results) = results else { return Ok(None) };
        let tr = mean_tr(&results);
        let frames = results.iter().map(|result| f64::from(result.frames)).sum();
        let trajectories: Vec<_> = results.into_iter().map(|result| result.trajectory).collect();
        let decisions: usize = trajectories.iter().map(|t| t.transitions.len()).sum();
        let progress_remaining = 1.0 - state.iterations as f32 / self.iterations as f32;
        let TrainState { model, learner, iterations, .. } = state;
        let schedule = Schedule { seed: self.seed, iteration: *iterations, progress_remaining };
        let reference = reference.as_deref();
        let stats = update(&self.ppo, model, learner, &trajectories, reference, schedule, stop);
        let Some(stats) = stats else { return Ok(None) };
        if self.rollout.normalize {
            let transitions = trajectories.iter().flat_map(|t| &t.transitions);
            state.update_normalizer(transitions.map(|t| &t.observation));
        }
        let mut named = metrics([("tr", tr), ("frames", frames), ("decisions", decisions as f64)]);
        named.extend(stats.to_metrics());
        Ok(Some(named))
    }
}

/// Reads the parameters of the initial policy from the folder of a training; `None` if there is no
/// KL penalty. `parse` parses a weights file.
///
/// # Errors
/// One line, if the training has no initial weights, or they cannot be read.
pub(crate) fn read_reference(
    config: &PpoConfig,
    folder: &Path,
    parse: impl FnOnce(&[u8]) -> Result<Vec<f32>, WeightsError>,
) -> Result<Option<Vec<f32>>, String> {
    if config.kl_coef == 0.0 {
        return Ok(None);
    }
    let path = folder.join(INITIAL_WEIGHTS);
    if !path.exists() {
        let problem = "`ppo.kl_coef` above 0 needs initial weights, which only a new training takes by \
                       --weights";
        return Err(problem.to_owned());
    }
    let bytes = read_bounded(&path, MAX_WEIGHTS_BYTES).map_err(|e| e.to_string())?;
    parse(&bytes).map(Some).map_err(|problem| format!("{}: {problem}", path.display()))
}
