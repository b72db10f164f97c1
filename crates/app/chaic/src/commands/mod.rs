//! The commands, one a file.

pub mod bench;
pub mod collect;
pub mod episodes;
pub mod eval;
pub mod export;
pub mod fidelity;
pub mod helper;
pub mod import;
pub mod llm;
pub mod merge;
pub mod opponent;
pub mod perception;
pub mod render;
pub mod replay;
pub mod report;
pub mod scene;
mod sight;
pub mod train;
pub mod verify;

mod bars;

use std::path::Path;

use anyhow::Result;
use chaic_episodes::{Episode, find_episode};
use chaic_eval::read_episode_file;

/// The episode that an argument means: a file if there is one of this name, else an id.
///
/// # Errors
/// If there is neither, or the file is no valid episode.
fn episode(argument: &str) -> Result<Episode> {
    let path = Path::new(argument);
    let is_name = argument.ends_with(".json") || (path.exists() && !path.is_dir());
    if is_name {
        return Ok(Episode::parse(&read_episode_file(path)?, argument)?);
    }
    Ok(find_episode(argument)?)
}

/// So many threads as the machine has cores, unless the user says otherwise.
fn jobs(given: Option<u16>) -> usize {
    /// More threads than any machine has use for.
    const MAX_JOBS: usize = 1024;
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    given.map_or_else(cores, usize::from).min(MAX_JOBS)
}
