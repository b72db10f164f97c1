//! The standard split: 100 generated episodes per task, each in its own surroundings.
//!
//! Episodes are generated on demand from seeds that no other split can name. Their digests must
//! equal those in `data/standard.txt` (one line per episode: id and digest), so that all builds
//! evaluate on the same episodes.

use std::fmt::Write as _;

use chaic_core::TaskId;
use xxhash_rust::xxh3::xxh3_64;

use crate::attempts::GenerateError;
use crate::format::Episode;
use crate::generate::generate_episode;
use crate::seeds::{STANDARD_PER_TASK, task_index};
use crate::split::{Split, SplitError};

/// Ids and digests (64-bit xxh3 of the episode's JSON line, in hex), in the order of tasks and
/// indices.
static TABLE: &str = include_str!("../data/standard.txt");

/// Returns the `k`-th episode of a task.
pub(crate) fn standard(task: TaskId, k: u64) -> Result<Episode, SplitError> {
    let line = TABLE.lines().nth(task_index(task) * STANDARD_PER_TASK + k as usize);
    check_digest(regenerate(task, k)?, line.unwrap_or("nothing"))
}

/// Returns the episode if its id and digest equal a line of the table.
fn check_digest(episode: Episode, line: &str) -> Result<Episode, SplitError> {
    let found = table_line(&episode);
    if found == line {
        return Ok(episode);
    }
    let digest = |line: &str| line.rsplit(' ').next().unwrap_or_default().to_owned();
    let id = episode.id().to_owned();
    Err(SplitError::NotStandard { id, expected: digest(line), found: digest(&found) })
}

/// Returns the content of `data/standard.txt` that the current generators would produce.
///
/// # Errors
/// [`GenerateError`] if a seed of the split has no episode.
pub fn standard_table() -> Result<String, GenerateError> {
    let mut text = String::new();
    for task in TaskId::paper() {
        for k in 0..STANDARD_PER_TASK as u64 {
            writeln!(text, "{}", table_line(&regenerate(task, k)?))
                .expect("writing to a string never fails");
        }
    }
    Ok(text)
}

fn table_line(episode: &Episode) -> String {
    format!("{} {:016x}", episode.id(), xxh3_64(episode.to_json_line().as_bytes()))
}

/// Generates the `k`-th episode of a task with the current generators.
fn regenerate(task: TaskId, k: u64) -> Result<Episode, GenerateError> {
    let split = Split::Standard;
    let (seeds, settings) = (split.seeds(task, k), split.settings());
    let id = split.episode_id(task, k as usize);
    generate_episode(id, split.to_string(), task, seeds, settings)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn the_table_lists_800_different_episodes() {
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

    /// `chaic episodes validate --split standard` checks all episodes.
    #[test]
    fn an_episode_is_accepted_only_with_its_own_digest() {
        for task in TaskId::paper() {
            for k in [0, 57] {
                let episode = standard(task, k).expect("the table has its digest");
                let next = TABLE.lines().nth(task_index(task) * STANDARD_PER_TASK + k as usize + 1);
                let error = check_digest(episode, next.expect("it has more lines"));
                assert!(matches!(error, Err(SplitError::NotStandard { .. })), "{task}");
            }
        }
    }
}
