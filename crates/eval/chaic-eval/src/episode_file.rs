//! Reading episode files.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use chaic_core::TaskId;
use chaic_episodes::{Episode, MAX_EPISODE_BYTES};
use chaic_files::{entries, read_user_file};

use crate::error::{EvalError, Result};

/// Reads an episode file that a user named. The path may be a link to a regular file.
///
/// Reads at most one byte more than the size limit, so that the parser reports a longer file.
///
/// # Errors
/// If the path is no regular file, or the file can't be read.
pub fn read_episode_file(path: &Path) -> Result<Vec<u8>> {
    Ok(read_user_file(path, MAX_EPISODE_BYTES as u64 + 1)?)
}

/// Reads the `.json` files of a folder that a user named, sorted by id.
///
/// # Errors
/// If the folder or a file can't be read, or a file is no episode.
pub fn read_episode_files(folder: &Path) -> Result<Vec<Episode>> {
    parse_episode_files(folder, &read_episode_file)
}

/// Reads and parses the `.json` files of a folder, sorted by id as text: `gen/10` is before `gen/2`.
pub(crate) fn parse_episode_files(
    folder: &Path,
    read: &dyn Fn(&Path) -> Result<Vec<u8>>,
) -> Result<Vec<Episode>> {
    let mut episodes = Vec::new();
    for path in episode_files(folder)? {
        let bytes = read(&path)?;
        episodes.push(Episode::parse(&bytes, &path.display().to_string())?);
    }
    episodes.sort_by(|a, b| a.id().cmp(b.id()));
    Ok(episodes)
}

/// Returns a folder's `.json` files, sorted by name.
pub(crate) fn episode_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = entries(folder)?;
    files.retain(|p| p.extension().is_some_and(|e| e == "json"));
    Ok(files)
}

/// Returns the tasks of the episodes in a folder, in the paper's order.
pub fn tasks_of_files(folder: &Path) -> Result<Vec<TaskId>> {
    let present: BTreeSet<TaskId> = read_episode_files(folder)?.iter().map(Episode::task).collect();
    if present.is_empty() {
        let text = format!("{} holds no episode file (*.json)", folder.display());
        return Err(EvalError::Options(text));
    }
    Ok(TaskId::all().filter(|t| present.contains(t)).collect())
}
