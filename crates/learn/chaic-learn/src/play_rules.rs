//! Which episodes trainings of policies play.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::sight::{GROUND_TRUTH, Sight};
use chaic_core::TaskId;
use chaic_core::rng::Stream;
use chaic_files::read_user_file;
use chaic_training::bounds::{Bound, BoundTable, integer, real};
use chaic_training::{Figures, TrainingError};
use chaic_vision::sights::{self, SightError};
use serde::{Deserialize, Serialize};

use crate::opponent::network::OpponentModel;
use crate::policy::{Choosing, Trained};
use crate::rewards::Rewards;
use crate::rollout::{Played, RolloutRules, play_all};

/// Seeds of generated episodes to learn from, and to validate by: none of any split, and none that perception
/// was trained on.
pub(crate) const TRAINING_SEEDS: (u64, usize) = (40_000_000, 1_000_000);
pub(crate) const VALIDATION_SEEDS: u64 = 50_000_000;

/// No file of weights is larger, bytes.
const MOST_BYTES: u64 = 1 << 28;

/// Bounds of [`PlayRules`].
pub(crate) const PLAY_BOUNDS: BoundTable = &[
    // All decisions of an iteration's episodes are kept: about 0.3 MB each.
    ("episodes", integer(1, 4096)),
    ("image_size", integer(16, 1024)),
    ("validation_episodes", integer(1, MAX_VALIDATION_EPISODES)),
    ("rewards", Bound::Table(REWARD_BOUNDS)),
];
/// Largest number of episodes of each task that validations play: more take days.
pub(crate) const MAX_VALIDATION_EPISODES: i64 = 1000;
/// Bounds of [`Rewards`]: beyond them values are too large to be learned.
const REWARD_BOUNDS: BoundTable = &[
    ("team", REWARD),
    ("own", REWARD),
    ("held", REWARD),
    ("way_per_m", REWARD),
    ("failed", REWARD),
    ("emergency", REWARD),
];
/// Bounds of the weight of one term of a reward.
pub(crate) const REWARD: Bound = real(-1000.0, 1000.0);

/// Which episodes are played, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlayRules {
    /// Episodes of each iteration.
    pub episodes: usize,
    /// The tasks whose episodes are played, by turns.
    pub tasks: Vec<TaskId>,
    /// Side of everybody's images while training, pixels.
    pub image_size: u32,
    /// By what the helper sees, and tells what its partner does: as `chaic eval` names it.
    pub perception: String,
    /// See `perception`.
    pub behavior: String,
    /// The weights of the opponent model that tells the policy of its partner (`chaic train opponent`), if there
    /// is to be one.
    pub opponent: Option<PathBuf>,
    /// Whether the network's inputs are normalized by their mean and spread so far.
    pub normalize: bool,
    /// Episodes of each task that validations play.
    pub validation_episodes: usize,
    /// What is rewarded.
    pub rewards: Rewards,
}

impl Default for PlayRules {
    fn default() -> PlayRules {
        PlayRules {
            episodes: 32,
            tasks: TaskId::paper().collect(),
            image_size: 128,
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
            opponent: None,
            normalize: false,
            validation_episodes: 3,
            rewards: Rewards::default(),
        }
    }
}

impl PlayRules {
    pub(crate) fn check(&self) -> Result<(), String> {
        if self.tasks.is_empty() {
            return Err("`play.tasks` names no task".to_owned());
        }
        self.sight().map_err(|e| e.to_string())?;
        self.read_opponent().map_err(|e| e.to_string())?;
        Ok(())
    }

    pub(crate) fn read_opponent(&self) -> Result<Option<OpponentModel>, TrainingError> {
        let read = |path: &PathBuf| {
            let wrong = |problem| TrainingError::Weights { path: path.clone(), problem };
            OpponentModel::from_bytes(&read_user_file(path, MOST_BYTES)?).map_err(wrong)
        };
        self.opponent.as_ref().map(read).transpose()
    }

    pub(crate) fn sight(&self) -> Result<Arc<dyn Sight>, SightError> {
        sights::named(&self.perception, &self.behavior)
    }

    pub(crate) fn rollout<'a>(
        &self,
        sight: &'a dyn Sight,
        choosing: Choosing,
        stop: &'a AtomicBool,
    ) -> RolloutRules<'a> {
        let PlayRules { image_size, rewards, .. } = *self;
        RolloutRules { sight, image_size, choosing, rewards, stop }
    }

    /// The episodes of an iteration.
    pub(crate) fn episodes_of(&self, seed: u64, iteration: u64) -> Vec<(String, u32)> {
        let (first, n) = TRAINING_SEEDS;
        (0..self.episodes as u64)
            .map(|k| {
                let index = iteration * self.episodes as u64 + k;
                let task = self.tasks[index as usize % self.tasks.len()];
                let drawn = Stream::new(seed, "episodes", index).below(n) as u64;
                (format!("{}/gen/{}", task.name(), first + drawn), 0)
            })
            .collect()
    }

    /// Returns transport rates on episodes that nothing is learned from; `None` if `stop` is raised meanwhile.
    pub(crate) fn validate(
        &self,
        sight: &dyn Sight,
        trained: &Arc<Trained>,
        stop: &AtomicBool,
    ) -> Option<Figures> {
        let seeds = || VALIDATION_SEEDS..VALIDATION_SEEDS + self.validation_episodes as u64;
        let ids: Vec<(String, u32)> = self
            .tasks
            .iter()
            .flat_map(|task| seeds().map(|seed| (format!("{}/gen/{seed}", task.name()), 0)))
            .collect();
        let ways = [("tr_sampled", Choosing::Sampled), ("tr_likeliest", Choosing::Likeliest)];
        let tr = |choosing| {
            let played = play_all(&ids, trained, &self.rollout(sight, choosing, stop));
            Some(mean_tr(&played.expect("generated episodes can be played")?))
        };
        let tr = |(name, choosing): (&str, _)| Some((name.to_owned(), tr(choosing)?));
        ways.into_iter().map(tr).collect()
    }
}

pub(crate) fn mean_tr(played: &[Played]) -> f64 {
    played.iter().map(|p| p.tr).sum::<f64>() / played.len().max(1) as f64
}
