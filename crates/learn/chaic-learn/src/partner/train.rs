//! Training of a partner's policy by behavior cloning.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use chaic_agents::partners::PartnerHabits;
use chaic_core::TaskId;
use chaic_core::rng::RngStream;
use chaic_env::Digest;
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _, NONE};
use chaic_env::recording::{Recording, Recordings};
use chaic_episodes::find_episode;
use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{AdamWConfig, Network};
use chaic_training::bounds::{
    ADAM, BoundTable, FRACTION, LEARNING_RATE, SEED, SHARDS, STEPS, integer,
};
use chaic_training::checkpoint::Identity;
use chaic_training::{
    Checkpoint, CheckpointError, Learner, Metrics, Trainer, TrainingError, defined_metrics,
    learning_rate_at, metrics,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::demonstrator::{DemonstrationEpisode, Demonstrator, PartnerDecision};
use super::features::{N_PARTNER_PLAN_FEATURES, N_PARTNER_STATE_FEATURES, nearest_wanted};
use super::policy::{PARTNER_KIND, partner_network};
use super::recordings::read_recordings;
use crate::actor_critic::{ActorCritic as _, Optimizer};
use crate::candidate_scorer::CandidateScorer;
use crate::cloning::{CloningMetrics, Demonstration, FitConfig, fit};
use crate::demonstrations::Demonstrations;
use crate::ppo::MAX_BATCH;
use crate::rollout::RolloutError;
use crate::rollout_config::{
    GENERATORS, MAX_VALIDATION_EPISODES, check_splits, draw_episode, validation_ids,
};

/// Section of a checkpoint.
const ITERATIONS: &str = "partner.iterations";
/// Validation metric by which weights are selected: mean log-likelihood of the demonstrated choices, nats.
const LOG_LIKELIHOOD: &str = "log_likelihood";
/// Every fifth recording is used for validation.
const VALIDATION_INTERVAL: usize = 5;

/// Configuration of `chaic train partner`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PartnerCloningConfig {
    /// Seed of weights, episodes, habits and batches.
    pub seed: u64,
    /// Total number of iterations.
    pub iterations: u64,
    /// Episodes that each iteration plays.
    pub episodes: usize,
    /// Tasks, used in turn for successive episodes.
    pub tasks: Vec<TaskId>,
    /// Generators, used in turn for successive episodes: `gen` and `gen-standard`.
    pub splits: Vec<String>,
    /// Helpers, used in turn: `none` or the name of a built-in one.
    pub helpers: Vec<String>,
    /// Trace or folder of traces whose partners are imitated, each in its episode. Without it, partners
    /// with drawn habits are imitated in generated episodes.
    pub recordings: Option<PathBuf>,
    /// Width and height of all agents' images, pixels.
    pub image_size: u32,
    /// Validation episodes per task. With recordings, every fifth recording is used for validation
    /// instead.
    pub validation_episodes: usize,
    /// Maximum number of episodes whose demonstrations are kept, the latest ones.
    pub max_episodes: usize,
    /// Label smoothing: probability mass that is spread evenly over all candidates.
    pub label_smoothing: f32,
    /// Optimizer steps per iteration.
    pub n_steps: usize,
    /// Demonstrations per optimizer step.
    pub batch_size: usize,
    /// Maximum learning rate.
    pub learning_rate: f32,
    /// Shards of a batch, which run in parallel.
    pub shards: usize,
    /// Optimizer.
    pub adam: AdamWConfig,
}

impl Default for PartnerCloningConfig {
    fn default() -> PartnerCloningConfig {
        PartnerCloningConfig {
            seed: 1,
            iterations: 20,
            episodes: 64,
            tasks: TaskId::paper().collect(),
            splits: GENERATORS.map(str::to_owned).to_vec(),
            helpers: vec![NONE.to_owned(), "rhp".to_owned()],
            recordings: None,
            image_size: 256,
            validation_episodes: 5,
            max_episodes: 8192,
            label_smoothing: 0.0,
            n_steps: 200,
            batch_size: 128,
            learning_rate: 2e-3,
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

/// Training or validation part of the recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RecordingPart {
    Training,
    Validation,
}

impl PartnerCloningConfig {
    /// Reads the recordings; `None` if drawn partners are imitated.
    fn read_recordings(&self) -> Result<Option<Recordings>, TrainingError> {
        let read = |path: &PathBuf| read_recordings(path).map_err(TrainingError::from_data);
        self.recordings.as_ref().map(read).transpose()
    }

    /// Returns an episode with a drawn partner.
    fn drawn(&self, id: String, stream: &str, index: u64) -> DemonstrationEpisode {
        let mut rng = RngStream::new(self.seed, stream, index);
        let seed = (0..4).fold(0, |s, _| s << 16 | rng.below(1 << 16) as u64);
        let partner = Demonstrator::Habits(PartnerHabits::draw(seed));
        DemonstrationEpisode { id, partner, helper: self.helper(index as usize) }
    }

    fn helper(&self, index: usize) -> String {
        self.helpers[index / self.tasks.len() % self.helpers.len()].clone()
    }

    /// Returns the episodes of an iteration. Recordings are played once.
    fn training_episodes(
        &self,
        recordings: Option<&[Recording]>,
        iteration: u64,
    ) -> Vec<DemonstrationEpisode> {
        let indices = (0..self.episodes as u64).map(|k| iteration * self.episodes as u64 + k);
        let Some(recordings) = recordings else {
            return indices.map(|index| self.generated(index)).collect();
        };
        let recorded = |index: u64| Some(self.recorded(recordings.get(index as usize)?));
        indices.filter_map(recorded).collect()
    }

    fn recorded(&self, recording: &Recording) -> DemonstrationEpisode {
        let partner = Demonstrator::Recorded(recording.clone());
        DemonstrationEpisode { id: recording.episode.clone(), partner, helper: NONE.to_owned() }
    }

    fn generated(&self, index: u64) -> DemonstrationEpisode {
        let task = self.tasks[index as usize % self.tasks.len()];
        let round = index as usize / self.tasks.len() / self.helpers.len();
        let split = &self.splits[round % self.splits.len()];
        let rng = RngStream::new(self.seed, "demonstration episodes", index);
        let id = draw_episode(task, split, rng);
        self.drawn(id, "demonstrated habits", index)
    }

    /// Returns the validation episodes: those of the recordings, or those of each task, from the last
    /// generator. Returns `None` if `stop` is raised.
    fn validation_episodes(
        &self,
        recordings: Option<&Recordings>,
        stop: &AtomicBool,
    ) -> Option<Vec<DemonstrationEpisode>> {
        if let Some(recordings) = recordings {
            let recordings = part_of(recordings, RecordingPart::Validation);
            return Some(recordings.iter().map(|recording| self.recorded(recording)).collect());
        }
        let split = self.splits.last().map_or(GENERATORS[0], String::as_str);
        let of_task = |t: &TaskId| validation_ids(*t, split, self.validation_episodes, stop);
        let ids: Option<Vec<Vec<String>>> = self.tasks.iter().map(of_task).collect();
        let ids = ids?;
        // The tasks take turns.
        let in_turn =
            (0..self.validation_episodes).flat_map(|k| ids.iter().filter_map(move |i| i.get(k)));
        let episodes = in_turn.zip(0..);
        let drawn =
            |(id, index): (&String, u64)| self.drawn(id.clone(), "validation habits", index);
        Some(episodes.map(drawn).collect())
    }
}

/// Returns one part of the recordings.
fn part_of(recordings: &Recordings, part: RecordingPart) -> Vec<Recording> {
    let is_held_out = |k: usize| k.is_multiple_of(VALIDATION_INTERVAL);
    let all = recordings.iter().enumerate();
    let chosen = all.filter(|(k, _)| is_held_out(*k) == (part == RecordingPart::Validation));
    chosen.map(|(_, recording)| recording.clone()).collect()
}

/// Checks that the episode of a recording can be played.
///
/// # Errors
/// One line that names the episode.
fn check_episode(recording: &Recording) -> Result<(), String> {
    let episode = find_episode(&recording.episode).map_err(|e| format!("`recordings`: {e}"))?;
    if Digest::of_setup(episode.setup()) == recording.setup {
        return Ok(());
    }
    let id = &recording.episode;
    Err(format!("`recordings` contains {id} of another version; use the chaic that wrote it"))
}

/// Trainer of a partner's policy.
pub struct PartnerCloningTrainer {
    config: PartnerCloningConfig,
    folder: PathBuf,
    recordings: Option<Vec<Recording>>,
    /// Digest of all recordings, if any.
    input: Option<Digest>,
    model: CandidateScorer,
    learner: Learner,
    iterations: u64,
    data: Demonstrations,
    validation: Vec<DemonstrationEpisode>,
    /// Choices of the validation episodes, once they were played.
    validation_decisions: OnceLock<Vec<PartnerDecision>>,
}

impl PartnerCloningTrainer {
    fn identity(&self) -> Identity {
        Identity::new(Self::KIND, &self.model.network)
    }

    fn read_data(&self) -> Result<Demonstrations, String> {
        let n_features = (N_PARTNER_STATE_FEATURES, N_PARTNER_PLAN_FEATURES);
        let max_episodes = self.config.max_episodes;
        let identity = self.identity();
        Demonstrations::read(&self.folder, self.iterations, max_episodes, &identity, n_features)
    }

    fn play(
        &self,
        episodes: &[DemonstrationEpisode],
        stop: &AtomicBool,
    ) -> Result<Option<Vec<Vec<PartnerDecision>>>, RolloutError> {
        let size = self.config.image_size;
        let played: Result<Vec<_>, _> =
            episodes.par_iter().map(|episode| episode.play(size, stop)).collect();
        Ok(played?.into_iter().collect())
    }
}

impl Trainer for PartnerCloningTrainer {
    type Config = PartnerCloningConfig;
    const KIND: &'static str = "partner";
    const WEIGHTS: &'static str = "partner.safetensors";
    const RECORD_STEPS: u64 = 1;
    const CHECKPOINT_STEPS: u64 = 1;
    const VALIDATION_STEPS: u64 = 5;
    const SCORE: Option<&'static str> = Some(LOG_LIKELIHOOD);
    const INPUT_KEY: &'static str = "recordings";
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("iterations", STEPS),
        ("episodes", integer(1, 4096)),
        ("image_size", integer(16, 1024)),
        ("validation_episodes", integer(1, MAX_VALIDATION_EPISODES)),
        ("max_episodes", integer(1, 100_000)),
        ("label_smoothing", FRACTION),
        ("n_steps", integer(1, 100_000)),
        ("batch_size", integer(1, MAX_BATCH)),
        ("learning_rate", LEARNING_RATE),
        ("shards", SHARDS),
        ("adam", ADAM),
    ];

    fn new(
        config: &PartnerCloningConfig,
        folder: &Path,
        _: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<PartnerCloningTrainer>, TrainingError> {
        let all = config.read_recordings()?;
        let Some(validation) = config.validation_episodes(all.as_ref(), stop) else {
            return Ok(None);
        };
        let recordings = all.as_ref().map(|all| part_of(all, RecordingPart::Training));
        // The name of the recordings contains the digest of their contents.
        let input = all.map(|all| Digest::of_bytes(all.to_string().as_bytes()));
        let model = partner_network();
        let learner = Learner::new(&model.network, config.seed, config.shards);
        Ok(Some(PartnerCloningTrainer {
            recordings,
            input,
            validation,
            config: config.clone(),
            folder: folder.to_owned(),
            model,
            learner,
            iterations: 0,
            data: Demonstrations::default(),
            validation_decisions: OnceLock::new(),
        }))
    }

    fn check(config: &PartnerCloningConfig) -> Result<(), String> {
        check_splits("splits", &config.splits)?;
        if config.tasks.is_empty() || config.helpers.is_empty() {
            let key = if config.tasks.is_empty() { "tasks" } else { "helpers" };
            return Err(format!("`{key}` is empty"));
        }
        let known = [vec![NONE.to_owned()], BuiltInHelpers.names()].concat();
        if let Some(name) = config.helpers.iter().find(|name| !known.contains(name)) {
            return Err(format!("`helpers` has `{name}`, expected {}", known.join(", ")));
        }
        let all = config.read_recordings().map_err(|e| e.to_string())?;
        let Some(all) = all else { return Ok(()) };
        for part in [RecordingPart::Training, RecordingPart::Validation] {
            let recordings = part_of(&all, part);
            if recordings.is_empty() {
                return Err("`recordings` has a single recording, expected two or more".to_owned());
            }
            recordings.iter().try_for_each(check_episode)?;
        }
        Ok(())
    }

    fn read_weights(_: &PartnerCloningConfig, bytes: &[u8]) -> Result<Vec<f32>, WeightsError> {
        weights::from_bytes(&partner_network().network, bytes, PARTNER_KIND)
    }

    fn fixed_keys() -> Vec<&'static str> {
        // `seed` draws the habits of the validation, `episodes` decides which recordings were played.
        vec!["seed", "episodes", "tasks", "splits", "helpers", "image_size", "validation_episodes"]
    }

    fn network(&self) -> &Network {
        &self.model.network
    }

    fn total_steps(&self) -> u64 {
        self.config.iterations
    }

    fn steps_done(&self) -> u64 {
        self.iterations
    }

    fn input_digest(&self) -> Option<u64> {
        self.input.map(|digest| digest.0)
    }

    fn checkpoint(&self) -> Checkpoint {
        self.learner.checkpoint(ITERATIONS, self.iterations)
    }

    fn load_parameters(&mut self, parameters: Vec<f32>) {
        self.learner.load_parameters(parameters);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        self.iterations = self.learner.restore(checkpoint, ITERATIONS)?;
        self.data = self.read_data().map_err(CheckpointError::Data)?;
        Ok(Some(()))
    }

    fn step(&mut self, stop: &AtomicBool) -> Result<Option<Metrics>, TrainingError> {
        let played = self.config.training_episodes(self.recordings.as_deref(), self.iterations);
        let played = self.play(&played, stop).map_err(TrainingError::from_data)?;
        let Some(played) = played else { return Ok(None) };
        let demonstration = |decision: PartnerDecision| Demonstration {
            observation: decision.observation,
            action: decision.action,
            value_target: 0.0,
        };
        let episodes: Vec<Vec<Demonstration>> = played
            .into_iter()
            .map(|decisions| decisions.into_iter().map(demonstration).collect())
            .collect();
        let config = &self.config;
        let all = self.data.with(&episodes, config.max_episodes);
        let learning_rate =
            learning_rate_at(self.iterations, config.learning_rate, 1, config.iterations);
        let fit_config = FitConfig {
            optimizer: Optimizer { adam: &config.adam, learning_rate },
            label_smoothing: config.label_smoothing,
            n_steps: config.n_steps,
            batch_size: config.batch_size,
            seed: config.seed,
            iteration: self.iterations,
        };
        let before = self.learner.state();
        let stats = fit(&fit_config, &self.model, &mut self.learner, &all, stop);
        let Some(CloningMetrics { loss, agreement, .. }) = stats else {
            self.learner.set_state(before);
            return Ok(None);
        };
        Demonstrations::write(&self.folder, self.iterations, &episodes, &self.identity())?;
        self.data.add(episodes, self.config.max_episodes);
        self.iterations += 1;
        let n = self.data.episodes.iter().map(Vec::len).sum::<usize>() as f64;
        Ok(Some(metrics([("demonstrations", n), ("loss", loss), ("agreement", agreement)])))
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Metrics, Vec<u8>)>, WeightsError> {
        let parameters = &self.learner.parameters;
        let bytes = weights::to_bytes(&self.model.network, parameters, PARTNER_KIND)?;
        if self.validation_decisions.get().is_none() {
            let played = self.play(&self.validation, stop);
            let Some(played) = played.expect("validation episodes can be played") else {
                return Ok(None);
            };
            // If another thread has set the value, it is equal.
            let _ = self.validation_decisions.set(played.into_iter().flatten().collect());
        }
        let decisions = self.validation_decisions.get().expect("it was set above");
        Ok(Some((imitation_metrics(&self.model, parameters, decisions), bytes)))
    }
}

/// Returns the mean log-likelihood of the demonstrated choices, nats, and three accuracies: of the
/// network, of the rules, and of taking the nearest wanted target. The accuracies are over all choices,
/// and over choices of a target.
fn imitation_metrics(
    model: &CandidateScorer,
    parameters: &[f32],
    decisions: &[PartnerDecision],
) -> Metrics {
    let mut pass = model.pass();
    let (mut log_likelihood, mut n_picks) = (0.0, 0.0);
    let [mut network, mut rules, mut pick_network, mut pick_rules, mut pick_nearest] = [0.0; 5];
    for decision in decisions {
        let observations = std::iter::once(&decision.observation);
        let output = model.forward(parameters, observations, &mut pass).remove(0);
        let agrees = |action: Option<usize>| f64::from(u8::from(action == Some(decision.action)));
        let (by_network, by_rules) = (agrees(Some(output.argmax())), agrees(decision.rules_action));
        log_likelihood += f64::from(output.log_probs[decision.action]);
        network += by_network;
        rules += by_rules;
        if decision.is_pick {
            n_picks += 1.0;
            pick_network += by_network;
            pick_rules += by_rules;
            pick_nearest += agrees(nearest_wanted(&decision.observation));
        }
    }
    let n = decisions.len() as f64;
    let of_all = |sum: f64| (n > 0.0).then_some(sum / n);
    let of_targets = |n_agreeing: f64| (n_picks > 0.0).then_some(n_agreeing / n_picks);
    defined_metrics([
        (LOG_LIKELIHOOD, of_all(log_likelihood)),
        ("accuracy", of_all(network)),
        ("accuracy_of_rules", of_all(rules)),
        ("target_accuracy", of_targets(pick_network)),
        ("target_accuracy_of_rules", of_targets(pick_rules)),
        ("target_accuracy_of_nearest", of_targets(pick_nearest)),
        ("choices", Some(n)),
        ("target_choices", Some(n_picks)),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_without_choices_are_undefined() {
        let model = partner_network();
        let parameters = model.network.init_parameters(1);
        let metrics = imitation_metrics(&model, &parameters, &[]);
        // A log-likelihood of 0 would be the best one.
        assert_eq!(metrics, super::metrics([("choices", 0.0), ("target_choices", 0.0)]));
    }
}
