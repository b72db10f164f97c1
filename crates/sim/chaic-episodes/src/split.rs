//! Names, sizes and seeds of the sets of episodes.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use chaic_core::TaskId;
use chaic_core::capability::UnknownPersonChange;
use chaic_core::task::TaskOrigin;

use crate::Settings;
use crate::attempts::GenerateError;
use crate::format::EpisodeError;
use crate::generate::generator_info;
use crate::seeds::{
    BUNDLED_PER_TASK, FIRST_BUNDLED_SEED, GeneratorSeeds, STANDARD_PER_TASK, SeedRange, task_index,
};

/// Different surroundings of a task within a bundled split; each is used twice.
const PLACES_PER_SPLIT: u64 = 6;

/// A set of episodes: `train`, `test`, `standard`, `gen:A..B` or `gen-standard:A..B`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Split {
    /// Bundled episodes for training and tuning.
    Train,
    /// Bundled episodes for comparison with the paper.
    Test,
    /// Fixed set of 100 generated episodes per task, for ranking helpers.
    Standard,
    /// Generated episodes of these seeds; a seed is the number of its episode.
    Generated(Range<u64>),
    /// Generated episodes of these seeds with the settings of the standard split.
    GeneratedStandard(Range<u64>),
}

/// Error when an episode or a split is looked up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SplitError {
    /// The text names no split.
    #[error(
        "no split `{text}`; write train, test, standard, gen:A..B or gen-standard:A..B with \
         A < B <= {FIRST_BUNDLED_SEED}"
    )]
    Syntax {
        /// Text that was parsed.
        text: String,
    },
    /// The text names no episode.
    #[error(
        "no episode `{id}`; write for example obstacle/test/07, obstacle/standard/007 or obstacle/gen/123"
    )]
    NoSuchEpisode {
        /// Text that was parsed.
        id: String,
    },
    /// The last part of an episode's name is no change of the partner.
    #[error("episode `{id}`: {problem}")]
    Partner {
        /// Text that was parsed.
        id: String,
        /// Cause.
        problem: UnknownPersonChange,
    },
    /// The changed partner cannot play the episode.
    #[error(transparent)]
    Unplayable(EpisodeError),
    /// This build generates an episode that differs from the one in the standard split.
    #[error(
        "{id}: this build generates an episode with digest {found}, but the standard split expects \
         {expected}; the generators differ from those of the split: report this"
    )]
    NotStandard {
        /// Name of the episode.
        id: String,
        /// Digest in `data/standard.txt`.
        expected: String,
        /// Digest of the generated episode.
        found: String,
    },
    /// The generator failed.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// A bundled episode is not readable: the build is broken.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
}

impl SplitError {
    /// Returns whether the caller's request caused the error; otherwise, the build is at fault.
    pub fn is_usage(&self) -> bool {
        match self {
            SplitError::Syntax { .. }
            | SplitError::NoSuchEpisode { .. }
            | SplitError::Partner { .. }
            | SplitError::Unplayable(_) => true,
            SplitError::NotStandard { .. } | SplitError::Generate(_) | SplitError::Episode(_) => {
                false
            }
        }
    }
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Split::Train => f.pad("train"),
            Split::Test => f.pad("test"),
            Split::Standard => f.pad("standard"),
            Split::Generated(seeds) => f.pad(&format!("gen:{}..{}", seeds.start, seeds.end)),
            Split::GeneratedStandard(seeds) => {
                f.pad(&format!("gen-standard:{}..{}", seeds.start, seeds.end))
            }
        }
    }
}

impl FromStr for Split {
    type Err = SplitError;

    fn from_str(text: &str) -> Result<Split, SplitError> {
        let seeds = |range: &str| {
            let (a, b) = range.split_once("..")?;
            let (a, b) = (a.parse().ok()?, b.parse().ok()?);
            (a < b && b <= FIRST_BUNDLED_SEED).then_some(a..b)
        };
        let split = match text.split_once(':') {
            None if text == "train" => Some(Split::Train),
            None if text == "test" => Some(Split::Test),
            None if text == "standard" => Some(Split::Standard),
            Some(("gen", range)) => seeds(range).map(Split::Generated),
            Some(("gen-standard", range)) => seeds(range).map(Split::GeneratedStandard),
            _ => None,
        };
        split.ok_or_else(|| SplitError::Syntax { text: text.to_owned() })
    }
}

impl Split {
    /// Returns the number of episodes of a task. Fixed splits contain the paper's tasks only.
    pub fn len_of(&self, task: TaskId) -> usize {
        let is_in_paper = task.info().origin != TaskOrigin::Chaic;
        match self {
            Split::Train | Split::Test | Split::Standard if !is_in_paper => 0,
            Split::Train | Split::Test => BUNDLED_PER_TASK,
            Split::Standard => STANDARD_PER_TASK,
            Split::Generated(seeds) | Split::GeneratedStandard(seeds) => {
                seeds.end.saturating_sub(seeds.start) as usize
            }
        }
    }

    /// Returns [`GeneratorInfo::environment`](crate::GeneratorInfo::environment) of the `k`-th
    /// episode of a task without generating the episode.
    pub fn environment(&self, task: TaskId, k: u64) -> String {
        generator_info(task, self.seeds(task, k), self.settings()).environment()
    }

    /// Returns the generator settings of the episodes.
    pub(crate) fn settings(&self) -> Settings {
        match self {
            Split::Train | Split::Test | Split::Generated(_) => Settings::PAPER,
            Split::Standard | Split::GeneratedStandard(_) => Settings::STANDARD,
        }
    }

    /// Returns the seeds of the `k`-th episode of a task.
    pub(crate) fn seeds(&self, task: TaskId, k: u64) -> GeneratorSeeds {
        let first = match self {
            Split::Train => SeedRange::BUNDLED_TRAIN.first,
            Split::Test => SeedRange::BUNDLED_TEST.first,
            Split::Standard => {
                // Every episode has its own surroundings.
                let index = (task_index(task) * STANDARD_PER_TASK) as u64 + k;
                return GeneratorSeeds::from_seed(SeedRange::STANDARD.first + index);
            }
            Split::Generated(seeds) | Split::GeneratedStandard(seeds) => {
                return GeneratorSeeds::from_seed(seeds.start + k);
            }
        };
        // All indoor tasks share the houses of a split, so that they can be compared.
        let place = first + k % PLACES_PER_SPLIT;
        GeneratorSeeds { place, episode: first + (task_index(task) * BUNDLED_PER_TASK) as u64 + k }
    }

    /// Returns the name of the `k`-th episode of a task, which
    /// [`find_episode`](crate::find_episode) accepts.
    pub fn episode_id(&self, task: TaskId, k: usize) -> String {
        match self {
            Split::Train | Split::Test => format!("{task}/{self}/{k:02}"),
            Split::Standard => format!("{task}/{self}/{k:03}"),
            Split::Generated(seeds) => format!("{task}/gen/{}", seeds.start + k as u64),
            Split::GeneratedStandard(seeds) => {
                format!("{task}/gen-standard/{}", seeds.start + k as u64)
            }
        }
    }
}
