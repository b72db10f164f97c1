//! The bundled benchmark, the standard split, and episodes without end.
//!
//! The 192 bundled episodes are data, a line each in `data/train.jsonl` and `data/test.jsonl`, in
//! the order of the paper's tasks. `cargo run --release -p chaic-episodes --example bundle` writes
//! them anew; a test says whether that would change anything.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use chaic_core::TaskId;
use chaic_core::task::{Origin, TASKS};

use crate::format::{Episode, EpisodeError};
use crate::generate::{FIRST_BUNDLED_SEED, GenerateError, Seeds, generate_with, generator_info};
use crate::standard::{STANDARD_PER_TASK, standard, standard_seeds};
use crate::{Settings, generate};

/// Episodes of each task in each of the bundled splits (paper, "Dataset Construction").
pub const BUNDLED_PER_TASK: usize = 12;
/// Different surroundings of a task within a bundled split; each is used twice.
const PLACES_PER_SPLIT: u64 = 6;

static TRAIN: &str = include_str!("../data/train.jsonl");
static TEST: &str = include_str!("../data/test.jsonl");

/// A set of episodes: `train`, `test`, `standard`, `gen:A..B` or `gen-standard:A..B`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Split {
    /// The bundled episodes to learn from.
    Train,
    /// The bundled episodes to be compared on.
    Test,
    /// 100 generated episodes a task that are the same for everybody, to rank helpers on.
    Standard,
    /// Generated episodes of these seeds; a seed is the number of its episode.
    Generated(Range<u64>),
    /// The same, made with the settings of the standard split.
    GeneratedStandard(Range<u64>),
}

/// Why there is no such episode.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SplitError {
    /// The text names no split.
    #[error(
        "no split `{text}`; write train, test, standard, gen:A..B or gen-standard:A..B with \
         A < B <= {FIRST_BUNDLED_SEED}"
    )]
    Syntax {
        /// What was written.
        text: String,
    },
    /// The text names no episode.
    #[error(
        "no episode `{id}`; write for example obstacle/test/07, obstacle/standard/007 or obstacle/gen/123"
    )]
    NoSuchEpisode {
        /// What was written.
        id: String,
    },
    /// This build makes another episode than the one that the standard split names.
    #[error(
        "{id}: this build makes an episode of digest {found}, the standard split names {expected}; \
         its generators are not those of the split: report this"
    )]
    NotStandard {
        /// The episode.
        id: String,
        /// The digest that is committed.
        expected: String,
        /// The digest of what was made.
        found: String,
    },
    /// The generator failed.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// A bundled episode can't be read: the build is broken.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
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
    /// How many episodes it has of a task: those that are the same for everybody are of the paper's
    /// tasks only.
    pub fn len_of(&self, task: TaskId) -> usize {
        let is_papers = task.info().origin != Origin::Ours;
        match self {
            Split::Train | Split::Test | Split::Standard if !is_papers => 0,
            Split::Train | Split::Test => BUNDLED_PER_TASK,
            Split::Standard => STANDARD_PER_TASK,
            Split::Generated(seeds) | Split::GeneratedStandard(seeds) => {
                seeds.end.saturating_sub(seeds.start) as usize
            }
        }
    }

    /// The name of the surroundings of its k-th episode of a task, as
    /// [`GeneratorInfo::environment`](crate::GeneratorInfo::environment) has it, without making the
    /// episode.
    pub fn environment(&self, task: TaskId, k: u64) -> String {
        generator_info(task, self.seeds(task, k), self.settings()).environment()
    }

    /// With which settings its episodes are made.
    fn settings(&self) -> Settings {
        match self {
            Split::Train | Split::Test | Split::Generated(_) => Settings::PAPER,
            Split::Standard | Split::GeneratedStandard(_) => Settings::STANDARD,
        }
    }

    fn seeds(&self, task: TaskId, k: u64) -> Seeds {
        let base = match self {
            Split::Train => FIRST_BUNDLED_SEED,
            Split::Test => 2 * FIRST_BUNDLED_SEED,
            Split::Standard => return standard_seeds(task, k),
            Split::Generated(seeds) | Split::GeneratedStandard(seeds) => {
                return own_place(seeds.start + k);
            }
        };
        // All indoor tasks share the houses of a split, so that they can be compared.
        let place = base + k % PLACES_PER_SPLIT;
        Seeds { place, episode: base + (task_index(task) * BUNDLED_PER_TASK) as u64 + k }
    }

    /// The name of its `k`-th episode of a task, which [`find_episode`] takes.
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

/// The episodes of a task in a split, in order. Bundled ones are read, others generated one at a
/// time as they are asked for.
pub fn episodes(
    split: &Split,
    task: TaskId,
) -> impl Iterator<Item = Result<Episode, SplitError>> + Send + use<> {
    let split = split.clone();
    (0..split.len_of(task) as u64).map(move |k| match &split {
        Split::Train => bundled(TRAIN, "train", task, k),
        Split::Test => bundled(TEST, "test", task, k),
        Split::Standard => standard(task, k),
        Split::Generated(seeds) => generated(task, seeds.start + k, Settings::PAPER),
        Split::GeneratedStandard(seeds) => generated(task, seeds.start + k, Settings::STANDARD),
    })
}

/// The episode of this name: `TASK/train/NN`, `TASK/test/NN`, `TASK/standard/NNN`, `TASK/gen/SEED` or
/// `TASK/gen-standard/SEED`; each may be followed by `/KIND` for another partner than the task's.
///
/// # Errors
/// [`SplitError::NoSuchEpisode`] if the name is none.
pub fn find_episode(id: &str) -> Result<Episode, SplitError> {
    let no_such = || SplitError::NoSuchEpisode { id: id.to_owned() };
    let parts: Vec<&str> = id.split('/').collect();
    let (task, split, number) = match parts[..] {
        [task, split, number] => (task, split, number),
        [task, split, number, kind] => {
            let kind = kind.parse().map_err(|_| no_such())?;
            return Ok(find_episode(&[task, split, number].join("/"))?.with_partner(kind)?);
        }
        _ => return Err(no_such()),
    };
    let task: TaskId = task.parse().map_err(|_| no_such())?;
    let number: u64 = number.parse().map_err(|_| no_such())?;
    match split {
        "train" if number < Split::Train.len_of(task) as u64 => bundled(TRAIN, split, task, number),
        "test" if number < Split::Test.len_of(task) as u64 => bundled(TEST, split, task, number),
        "standard" if number < Split::Standard.len_of(task) as u64 => standard(task, number),
        "gen" if number < FIRST_BUNDLED_SEED => generated(task, number, Settings::PAPER),
        "gen-standard" if number < FIRST_BUNDLED_SEED => {
            generated(task, number, Settings::STANDARD)
        }
        _ => Err(no_such()),
    }
}

fn bundled(text: &str, split: &str, task: TaskId, k: u64) -> Result<Episode, SplitError> {
    let id = format!("{task}/{split}/{k:02}");
    let line = text.lines().nth(task_index(task) * BUNDLED_PER_TASK + k as usize);
    let line = line.ok_or_else(|| SplitError::NoSuchEpisode { id: id.clone() })?;
    Ok(Episode::parse_trusted(line, &id)?)
}

pub(crate) fn task_index(task: TaskId) -> usize {
    TASKS.iter().position(|t| t.id == task).expect("the table lists every task")
}

/// Generated episodes share no surroundings.
pub(crate) fn own_place(seed: u64) -> Seeds {
    Seeds { place: seed, episode: seed }
}

fn generated(task: TaskId, seed: u64, settings: Settings) -> Result<Episode, SplitError> {
    let seeds = own_place(seed);
    let setup = generate_with(task, seeds, settings)?;
    let word = if settings == Settings::STANDARD { "gen-standard" } else { "gen" };
    let id = format!("{task}/{word}/{seed}");
    let generator = generator_info(task, seeds, settings);
    Ok(Episode::trusted(id, "generated".to_owned(), generator, setup))
}

/// The text of the two bundled files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bundled {
    /// `data/train.jsonl`.
    pub train: String,
    /// `data/test.jsonl`.
    pub test: String,
}

impl Bundled {
    /// The files as they were built in.
    pub fn built_in() -> Bundled {
        Bundled { train: TRAIN.to_owned(), test: TEST.to_owned() }
    }
}

/// What the generators of today would bundle.
///
/// # Errors
/// [`GenerateError`] if a seed of the bundle has no episode.
pub fn regenerate_bundled() -> Result<Bundled, GenerateError> {
    Ok(Bundled { train: regenerate(&Split::Train)?, test: regenerate(&Split::Test)? })
}

fn regenerate(split: &Split) -> Result<String, GenerateError> {
    let mut text = String::new();
    for task in TaskId::paper() {
        for k in 0..BUNDLED_PER_TASK as u64 {
            let seeds = split.seeds(task, k);
            let setup = generate(task, seeds)?;
            let id = split.episode_id(task, k as usize);
            let generator = generator_info(task, seeds, Settings::PAPER);
            text += &Episode::trusted(id, split.to_string(), generator, setup).to_json_line();
            text.push('\n');
        }
    }
    Ok(text)
}
