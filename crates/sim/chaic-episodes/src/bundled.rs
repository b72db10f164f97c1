//! The bundled episodes: 8 tasks with 12 episodes each for training and for testing.
//!
//! The 192 episodes are data, one per line in `data/train.jsonl` and `data/test.jsonl`, in the
//! order of the paper's tasks. `cargo run --release -p chaic-episodes --example bundle` regenerates
//! the files; a test fails if that would change a byte.

use chaic_core::TaskId;

use crate::attempts::GenerateError;
use crate::format::Episode;
use crate::generate::{generate, generator_info};
use crate::seeds::{BUNDLED_PER_TASK, task_index};
use crate::split::{Split, SplitError};

static TRAIN: &str = include_str!("../data/train.jsonl");
static TEST: &str = include_str!("../data/test.jsonl");

/// Text of the two bundled files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bundled {
    /// Content of `data/train.jsonl`.
    pub train: String,
    /// Content of `data/test.jsonl`.
    pub test: String,
}

impl Bundled {
    /// Returns the files that were compiled into this build.
    pub fn built_in() -> Bundled {
        Bundled { train: TRAIN.to_owned(), test: TEST.to_owned() }
    }
}

/// Returns the `k`-th episode of a task in `train`.
pub(crate) fn bundled_train(task: TaskId, k: u64) -> Result<Episode, SplitError> {
    parse_line(TRAIN, "train", task, k)
}

/// Returns the `k`-th episode of a task in `test`.
pub(crate) fn bundled_test(task: TaskId, k: u64) -> Result<Episode, SplitError> {
    parse_line(TEST, "test", task, k)
}

fn parse_line(text: &str, split: &str, task: TaskId, k: u64) -> Result<Episode, SplitError> {
    let id = format!("{task}/{split}/{k:02}");
    let line = text.lines().nth(task_index(task) * BUNDLED_PER_TASK + k as usize);
    let line = line.ok_or_else(|| SplitError::NoSuchEpisode { id: id.clone() })?;
    Ok(Episode::parse_trusted(line, &id)?)
}

/// Returns the files that the current generators would produce.
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
            let generator = generator_info(task, seeds, split.settings());
            text += &Episode::trusted(id, split.to_string(), generator, setup).to_json_line();
            text.push('\n');
        }
    }
    Ok(text)
}
