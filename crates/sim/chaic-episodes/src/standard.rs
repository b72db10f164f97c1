//! The standard split: 100 generated episodes a task, each in an environment of its own.
//!
//! The episodes are made when they are asked for, from seeds that no other split can name, and
//! compared with `data/standard.txt`, a line with id and digest each. Who gets an episode gets the
//! one that everybody else got.

use std::fmt::Write as _;

use chaic_core::TaskId;
use xxhash_rust::xxh3::xxh3_64;

use crate::format::Episode;
use crate::generate::{FIRST_BUNDLED_SEED, Seeds, generate_with, generator_info};
use crate::split::{Split, SplitError, own_place, task_index};
use crate::{GenerateError, Settings};

/// Episodes of each task in the standard split.
pub const STANDARD_PER_TASK: usize = 100;

/// Its first seed: beyond those of the bundled splits, which end below it, and those of `gen:`.
const FIRST_STANDARD_SEED: u64 = 3 * FIRST_BUNDLED_SEED;

/// Ids and digests (xxh3 of the episode's line, 64 bits in hex), in the order of tasks and numbers.
static TABLE: &str = include_str!("../data/standard.txt");

/// The `k`-th episode of a task.
pub(crate) fn standard(task: TaskId, k: u64) -> Result<Episode, SplitError> {
    let line = TABLE.lines().nth(task_index(task) * STANDARD_PER_TASK + k as usize);
    pinned(made(task, k)?, line.unwrap_or("nothing"))
}

/// The episode, if it is the one that this line of the table names.
fn pinned(episode: Episode, line: &str) -> Result<Episode, SplitError> {
    let found = line_of(&episode);
    if found == line {
        return Ok(episode);
    }
    let digest = |line: &str| line.rsplit(' ').next().unwrap_or_default().to_owned();
    let id = episode.id().to_owned();
    Err(SplitError::NotStandard { id, expected: digest(line), found: digest(&found) })
}

/// What `data/standard.txt` would be by the generators of today.
///
/// # Errors
/// [`GenerateError`] if a seed of the split has no episode.
pub fn standard_table() -> Result<String, GenerateError> {
    let mut text = String::new();
    for task in TaskId::paper() {
        for k in 0..STANDARD_PER_TASK as u64 {
            writeln!(text, "{}", line_of(&made(task, k)?)).expect("a string takes all text");
        }
    }
    Ok(text)
}

fn line_of(episode: &Episode) -> String {
    format!("{} {:016x}", episode.id(), xxh3_64(episode.to_json_line().as_bytes()))
}

/// Every episode has its own seed, and its own place.
pub(crate) fn standard_seeds(task: TaskId, k: u64) -> Seeds {
    own_place(FIRST_STANDARD_SEED + (task_index(task) * STANDARD_PER_TASK) as u64 + k)
}

/// The episode as the generators of today make it.
fn made(task: TaskId, k: u64) -> Result<Episode, GenerateError> {
    let (seeds, settings) = (standard_seeds(task, k), Settings::STANDARD);
    let setup = generate_with(task, seeds, settings)?;
    let id = Split::Standard.episode_id(task, k as usize);
    let generator = generator_info(task, seeds, settings);
    Ok(Episode::trusted(id, Split::Standard.to_string(), generator, setup))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn the_table_names_800_different_episodes() {
        let ids = TaskId::paper()
            .flat_map(|t| (0..STANDARD_PER_TASK).map(move |k| Split::Standard.episode_id(t, k)));
        let (mut digests, mut n) = (BTreeSet::new(), 0);
        for (line, id) in TABLE.lines().zip(ids) {
            let digest = line.strip_prefix(&format!("{id} ")).expect("ids are in order");
            assert_eq!(digest.len(), 16, "{line}");
            assert!(digests.insert(digest), "{line}: an earlier episode has this digest");
            n += 1;
        }
        assert_eq!((n, TABLE.lines().count()), (800, 800));
    }

    /// `chaic episodes validate --split standard` does this for all.
    #[test]
    fn some_of_each_task_have_their_digest_and_another_episode_has_not() {
        for task in TaskId::paper() {
            for k in [0, 57] {
                let episode = standard(task, k).expect("the table pins it");
                let next = TABLE.lines().nth(task_index(task) * STANDARD_PER_TASK + k as usize + 1);
                let error = pinned(episode, next.expect("it has more lines"));
                assert!(matches!(error, Err(SplitError::NotStandard { .. })), "{task}");
            }
        }
    }
}
