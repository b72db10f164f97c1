//! Configuration of the episodes that trainings of policies play.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use chaic_agents::partners::{PARTNER_VARIANTS, partner_habits};
use chaic_agents::perception_factory::{GROUND_TRUTH, PerceptionFactory};
use chaic_core::TaskId;
use chaic_core::rng::RngStream;
use chaic_env::helper_registry::{RULES, built_in};
use chaic_env::rules::RuleSet;
use chaic_env::{Appearance, RewardWeights};
use chaic_episodes::{SeedRange, find_episode};
use chaic_files::read_user_file;
use chaic_training::bounds::{Bound, BoundTable, integer, real};
use chaic_training::{Metrics, TrainingError, defined_metrics, metrics};
use chaic_vision::perception_registry::{self, PerceptionError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::opponent::network::{OpponentInput, OpponentModel};
use crate::policy::ActionSelection;
use crate::policy_kind::{MAX_MEMORY, PolicyKind, PolicyWeights};
use crate::reward_config;
use crate::rollout::{EpisodeResult, RolloutContext, RolloutEpisode, rollout_all};

/// Generators of episodes.
pub(crate) const GENERATORS: [&str; 2] = ["gen", "gen-standard"];
/// Maximum size of a weights file, bytes.
const MAX_BYTES: u64 = 1 << 28;

/// Bounds of [`RolloutConfig`].
pub(crate) const ROLLOUT_BOUNDS: BoundTable = &[
    // All decisions of an iteration's episodes are kept: about 0.3 MB per episode.
    ("episodes", integer(1, 4096)),
    ("image_size", integer(16, 1024)),
    ("n_past_decisions", integer(0, MAX_MEMORY as i64)),
    ("validation_episodes", integer(1, MAX_VALIDATION_EPISODES)),
    ("rewards", Bound::Table(REWARD_BOUNDS)),
];
/// Keys of [`RolloutConfig`] on which the inputs of a policy and the scores of its validations depend.
pub(crate) const ROLLOUT_FIXED_KEYS: &[&str] = &[
    "rollout.tasks",
    "rollout.splits",
    "rollout.validation_episodes",
    "rollout.image_size",
    "rollout.perception",
    "rollout.behavior",
    "rollout.infer_hint",
    "rollout.n_past_decisions",
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

/// Light and colors of training episodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TrainingAppearance {
    /// Appearance of the benchmark.
    Canonical,
    /// Random appearance for each episode (domain randomization), drawn from the episode's id.
    Varied,
}

/// Number of random appearances, as in the training of the detector.
const N_APPEARANCES: usize = 1 << 24;

impl TrainingAppearance {
    /// Returns the appearance of an episode.
    pub(crate) fn of_episode(self, id: &str) -> Appearance {
        match self {
            TrainingAppearance::Canonical => Appearance::Canonical,
            TrainingAppearance::Varied => {
                let mut rng = RngStream::new(0, &format!("appearance of {id}"), 0);
                Appearance::Varied { seed: rng.below(N_APPEARANCES) as u64 }
            }
        }
    }
}

/// Configuration of rollouts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RolloutConfig {
    /// Episodes per iteration.
    pub episodes: usize,
    /// Tasks, used in turn for successive episodes.
    pub tasks: Vec<TaskId>,
    /// Generators, used in turn for successive episodes: `gen` (as the paper's) and `gen-standard`
    /// (as the standard split).
    pub splits: Vec<String>,
    /// Partners, used in turn: `rules`, a name of `PARTNER_VARIANTS`, `drawn:SEED` or `habits:...`.
    /// Validation uses the rule-based partner.
    pub partners: Vec<String>,
    /// Width and height of all agents' images during training, pixels. In smaller images the helper
    /// misses objects that the partner takes (docs/learning.md).
    pub image_size: u32,
    /// Perception of the helper, as `chaic eval --perception`.
    pub perception: String,
    /// Behavior recognition of the helper, as `chaic eval --behavior`.
    pub behavior: String,
    /// Light and colors of training episodes. Validation has the canonical ones.
    pub appearance: TrainingAppearance,
    /// Weights of an opponent model (`chaic train opponent`) whose predictions the policy reads, if
    /// any.
    pub opponent: Option<PathBuf>,
    /// Adds a feature that marks the plan that the helper `infer` would choose.
    #[serde(alias = "proposals")]
    pub infer_hint: bool,
    /// Number of earlier decisions that the policy reads.
    #[serde(alias = "memory")]
    pub n_past_decisions: usize,
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
            splits: GENERATORS.map(str::to_owned).to_vec(),
            partners: vec![RULES.to_owned()],
            image_size: 256,
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
            appearance: TrainingAppearance::Canonical,
            opponent: None,
            infer_hint: false,
            n_past_decisions: 0,
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
        check_splits("rollout.splits", &self.splits)?;
        let is_known = |name: &&String| *name == RULES || partner_habits(name).is_ok();
        if let Some(name) = self.partners.iter().find(|name| !is_known(name)) {
            let names: Vec<&str> = PARTNER_VARIANTS.iter().map(|v| v.name).collect();
            let names = names.join(", ");
            return Err(format!(
                "`rollout.partners` has `{name}`, expected {RULES}, {names}, drawn:SEED or habits:..."
            ));
        }
        if self.partners.is_empty() {
            return Err("`rollout.partners` is empty".to_owned());
        }
        let perception = self.perception_factory().map_err(|e| e.to_string())?;
        perception.check_image_size(self.image_size)?;
        let opponent = self.read_opponent().map_err(|e| e.to_string())?;
        check_opponent("rollout.", opponent.as_ref(), &*perception)
    }

    pub(crate) fn read_opponent(&self) -> Result<Option<OpponentModel>, TrainingError> {
        read_opponent(self.opponent.as_deref())
    }

    /// Returns the inputs of a policy with this opponent model.
    pub(crate) fn policy_kind(&self, opponent: Option<&OpponentModel>) -> PolicyKind {
        let opponent = OpponentInput::from_model(opponent);
        PolicyKind { opponent, has_infer_hint: self.infer_hint, memory: self.n_past_decisions }
    }

    pub(crate) fn perception_factory(&self) -> Result<Arc<dyn PerceptionFactory>, PerceptionError> {
        perception_registry::perception_from_name(&self.perception, &self.behavior)
    }

    pub(crate) fn context<'a>(
        &self,
        perception: &'a dyn PerceptionFactory,
        gamma: f32,
        stop: &'a AtomicBool,
    ) -> RolloutContext<'a> {
        let RolloutConfig { image_size, rewards, .. } = *self;
        let selection = ActionSelection::TRAINING;
        RolloutContext { perception, image_size, selection, rewards, gamma, stop }
    }

    /// Returns the episodes of an iteration.
    pub(crate) fn sample_episodes(&self, seed: u64, iteration: u64) -> Vec<RolloutEpisode> {
        (0..self.episodes as u64)
            .map(|k| {
                let index = iteration * self.episodes as u64 + k;
                let round = index as usize / self.tasks.len();
                let task = self.tasks[index as usize % self.tasks.len()];
                let split = &self.splits[round % self.splits.len()];
                let partner = &self.partners[round / self.splits.len() % self.partners.len()];
                let rng = RngStream::new(seed, "episodes", index);
                let id = draw_episode(task, split, rng);
                let partner = (partner != RULES).then(|| partner.clone());
                let appearance = self.appearance.of_episode(&id);
                RolloutEpisode { id, partner, appearance }
            })
            .collect()
    }
}

/// Maximum number of seeds that are drawn to find a valid episode. All of 8,000 tested seeds had
/// one (TESTING.md).
const MAX_DRAWS: usize = 100;

/// Returns the id of a training episode of this generator, with the first drawn seed that has a valid
/// episode.
pub(crate) fn draw_episode(task: TaskId, generator: &str, mut rng: RngStream) -> String {
    let mut draw = || format!("{task}/{generator}/{}", SeedRange::POLICY_TRAIN.draw(&mut rng));
    let mut id = draw();
    for _ in 1..MAX_DRAWS {
        if find_episode(&id).is_ok() {
            break;
        }
        id = draw();
    }
    id
}

/// Returns the ids of the first `n` valid validation episodes of a task; `None` if `stop` is raised.
pub(crate) fn validation_ids(
    task: TaskId,
    generator: &str,
    n: usize,
    stop: &AtomicBool,
) -> Option<Vec<String>> {
    let SeedRange { first, count, .. } = SeedRange::POLICY_VALIDATION;
    let mut ids = Vec::new();
    for seed in first..first + count {
        if ids.len() == n {
            break;
        }
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let id = format!("{task}/{generator}/{seed}");
        if find_episode(&id).is_ok() {
            ids.push(id);
        }
    }
    Some(ids)
}

/// Reads the weights of an opponent model.
///
/// # Errors
/// If the file cannot be read or holds no opponent model.
pub(crate) fn read_opponent(path: Option<&Path>) -> Result<Option<OpponentModel>, TrainingError> {
    let parse = |path: &Path| {
        let weights_error = |problem| TrainingError::Weights { path: path.to_owned(), problem };
        OpponentModel::from_bytes(&read_user_file(path, MAX_BYTES)?).map_err(weights_error)
    };
    path.map(parse).transpose()
}

/// Checks that an opponent model gets the inputs on which it was trained. `table` precedes the keys.
///
/// # Errors
/// One line that names the keys.
pub(crate) fn check_opponent(
    table: &str,
    opponent: Option<&OpponentModel>,
    perception: &dyn PerceptionFactory,
) -> Result<(), String> {
    if opponent.is_none_or(|model| model.fits(perception)) {
        return Ok(());
    }
    Err(format!(
        "`{table}opponent` was trained with the grant `behavior`, so it needs `{table}behavior = \"gt\"`"
    ))
}

/// Checks the names of generators under a key of a configuration.
///
/// # Errors
/// One line that names the key.
pub(crate) fn check_splits(key: &str, splits: &[String]) -> Result<(), String> {
    let names = GENERATORS.join(", ");
    match splits.iter().find(|split| !GENERATORS.contains(&split.as_str())) {
        Some(split) => Err(format!("`{key}` contains `{split}`, expected {names}")),
        None if splits.is_empty() => Err(format!("`{key}` is empty, expected {names}")),
        None => Ok(()),
    }
}

/// Returns `n` validation episodes per task, from the last of the generators: the
/// standard one, if there are both. Returns `None` if `stop` is raised.
pub(crate) fn validation_episodes(
    tasks: &[TaskId],
    splits: &[String],
    n: usize,
    stop: &AtomicBool,
) -> Option<Vec<RolloutEpisode>> {
    let split = splits.last().map_or(GENERATORS[0], String::as_str);
    let of_task = |task: &TaskId| validation_ids(*task, split, n, stop);
    let ids: Option<Vec<Vec<String>>> = tasks.iter().map(of_task).collect();
    Some(ids?.into_iter().flatten().map(RolloutEpisode::new).collect())
}

/// Validation metric by which weights are selected: the mean transport rate with the selection of
/// helpers in runs.
pub(crate) const VALIDATION_TR: &str = "tr_sampled";
/// Helper that is played on the validation episodes for comparison.
const BASELINE: &str = "rhp";

/// Validation of a policy against a built-in helper on the same episodes.
pub(crate) struct Validation<'a> {
    pub perception: &'a dyn PerceptionFactory,
    /// Transport rates of the baseline by episode, once they are known.
    pub baseline: &'a OnceLock<Vec<f64>>,
}

impl Validation<'_> {
    /// Returns the mean transport rates of a policy and the metrics of [`Validation::compare`]; `None` if
    /// `stop` is raised.
    pub fn run(
        &self,
        config: &RolloutConfig,
        weights: &Arc<PolicyWeights>,
        stop: &AtomicBool,
    ) -> Option<Metrics> {
        let RolloutConfig { tasks, splits, validation_episodes: n, .. } = config;
        let episodes = validation_episodes(tasks, splits, *n, stop)?;
        // Validation computes no rewards, so the discount factor has no effect.
        let context = config.context(self.perception, 1.0, stop);
        let rates = |selection| -> Option<Vec<f64>> {
            let results = rollout_all(&episodes, weights, &RolloutContext { selection, ..context });
            let results = results.expect("generated episodes can be played")?;
            Some(results.iter().map(|result| result.tr).collect())
        };
        let sampled = rates(ActionSelection::HELPER)?;
        let greedy = rates(ActionSelection::Greedy)?;
        let mut named = self.compare(&sampled, &episodes, config.image_size, stop)?;
        named.extend(metrics([(VALIDATION_TR, mean(&sampled)), ("tr_greedy", mean(&greedy))]));
        Some(named)
    }

    /// Compares the transport rates of a policy with those of the baseline on the same episodes. Returns
    /// the baseline's mean, the mean difference, and its standard error if there are two episodes; `None`
    /// if `stop` is raised.
    pub fn compare(
        &self,
        rates: &[f64],
        episodes: &[RolloutEpisode],
        image_size: u32,
        stop: &AtomicBool,
    ) -> Option<Metrics> {
        if self.baseline.get().is_none() {
            let rate = |episode: &RolloutEpisode| {
                let helper = built_in(BASELINE, RuleSet::PAPER.planner, self.perception);
                let helper = helper.expect("it is a built-in helper");
                let rate = episode.play(helper, image_size, stop);
                rate.expect("generated episodes can be played")
            };
            let rates: Option<Vec<f64>> = episodes.par_iter().map(rate).collect();
            // If another thread has set the value, it is equal.
            let _ = self.baseline.set(rates?);
        }
        let baseline = self.baseline.get().expect("it was set above");
        Some(gain_metrics(rates, baseline))
    }
}

/// Returns the metrics of [`Validation::compare`]. One episode has no standard error.
fn gain_metrics(rates: &[f64], baseline: &[f64]) -> Metrics {
    let gains: Vec<f64> = rates.iter().zip(baseline).map(|(a, b)| a - b).collect();
    let (gain, n) = (mean(&gains), gains.len() as f64);
    let squares: f64 = gains.iter().map(|x| (x - gain) * (x - gain)).sum();
    let standard_error = (n > 1.0).then(|| (squares / (n - 1.0) / n).sqrt());
    defined_metrics([
        ("tr_baseline", Some(mean(baseline))),
        ("gain", Some(gain)),
        ("gain_se", standard_error),
    ])
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

pub(crate) fn mean_tr(results: &[EpisodeResult]) -> f64 {
    results.iter().map(|result| result.tr).sum::<f64>() / results.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_search_for_validation_episodes_can_be_stopped() {
        let ids = |n, stop| validation_ids(TaskId::LowTarget, "gen", n, &AtomicBool::new(stop));
        assert_eq!(ids(2, false).map(|ids| ids.len()), Some(2));
        assert_eq!(ids(2, true), None);
    }

    #[test]
    fn one_episode_has_no_standard_error() {
        let one = gain_metrics(&[0.5], &[0.25]);
        assert_eq!(one, metrics([("tr_baseline", 0.25), ("gain", 0.25)]));
        // Gains of 0.25 and 0.75 have a standard deviation of √(1/8).
        let two = gain_metrics(&[0.5, 1.0], &[0.25, 0.25]);
        let expected = metrics([("tr_baseline", 0.25), ("gain", 0.5), ("gain_se", 0.25)]);
        assert_eq!(two, expected);
    }

    #[test]
    fn tasks_generators_and_partners_take_turns() {
        let config = RolloutConfig {
            episodes: 4,
            tasks: vec![TaskId::LowTarget, TaskId::Shopping],
            partners: vec![RULES.to_owned(), "slow".to_owned()],
            ..RolloutConfig::default()
        };
        let episodes: Vec<RolloutEpisode> =
            (0..2).flat_map(|iteration| config.sample_episodes(1, iteration)).collect();
        let kind = |episode: &RolloutEpisode| {
            let (kind, _) = episode.id.rsplit_once('/').unwrap();
            (kind.to_owned(), episode.partner.clone())
        };
        let kinds: Vec<(String, Option<String>)> = episodes.iter().map(kind).collect();
        let expected = [
            ("low_target/gen", None),
            ("shopping/gen", None),
            ("low_target/gen-standard", None),
            ("shopping/gen-standard", None),
            ("low_target/gen", Some("slow")),
            ("shopping/gen", Some("slow")),
            ("low_target/gen-standard", Some("slow")),
            ("shopping/gen-standard", Some("slow")),
        ];
        let expected =
            expected.map(|(kind, partner)| (kind.to_owned(), partner.map(str::to_owned)));
        assert_eq!(kinds, expected);
        let ids: BTreeSet<&str> = episodes.iter().map(|episode| &*episode.id).collect();
        assert_eq!(ids.len(), episodes.len(), "every episode is another one");
    }

    #[test]
    fn varied_episodes_have_an_appearance_each() {
        let config = |appearance| RolloutConfig {
            episodes: 4,
            tasks: vec![TaskId::LowTarget],
            appearance,
            ..RolloutConfig::default()
        };
        let canonical = config(TrainingAppearance::Canonical).sample_episodes(1, 0);
        assert!(canonical.iter().all(|episode| episode.appearance == Appearance::Canonical));
        let varied = config(TrainingAppearance::Varied).sample_episodes(1, 0);
        let names: BTreeSet<String> =
            varied.iter().map(|episode| episode.appearance.to_string()).collect();
        assert!(names.len() == 4 && names.iter().all(|name| name.starts_with("varied:")));
        let ids = |episodes: &[RolloutEpisode]| -> Vec<String> {
            episodes.iter().map(|episode| episode.id.clone()).collect()
        };
        assert_eq!(ids(&varied), ids(&canonical));
        assert_eq!(varied, config(TrainingAppearance::Varied).sample_episodes(1, 0));
    }
}
