//! The commands, one a file.

pub mod bench;
pub mod episodes;
pub mod eval;
pub mod fidelity;
pub mod import;
pub mod llm;
pub mod render;
pub mod replay;
pub mod report;
pub mod scene;
pub mod verify;

mod bars;

use std::path::Path;

use anyhow::{Context as _, Result};
use chaic_episodes::{Episode, MAX_EPISODE_BYTES, find_episode};

/// The episode that an argument means: a file if there is one of this name, else an id.
///
/// # Errors
/// If there is neither, or the file is no valid episode.
fn episode(argument: &str) -> Result<Episode> {
    let path = Path::new(argument);
    if path.is_file() {
        return Ok(Episode::parse(&read_episode_file(path)?, argument)?);
    }
    if argument.ends_with(".json") {
        anyhow::bail!("there is no file {argument}");
    }
    Ok(find_episode(argument)?)
}

/// The bytes of a file that may be an episode; of a longer file only so many that it is seen.
fn read_episode_file(path: &Path) -> Result<Vec<u8>> {
    use std::io::Read as _;
    let file =
        std::fs::File::open(path).with_context(|| format!("can't open {}", path.display()))?;
    let mut bytes = Vec::new();
    let read = file.take(MAX_EPISODE_BYTES as u64 + 1).read_to_end(&mut bytes);
    read.with_context(|| format!("can't read {}", path.display()))?;
    Ok(bytes)
}

/// So many threads as the machine has cores, unless the user says otherwise.
fn jobs(given: Option<u16>) -> usize {
    /// More threads than any machine has use for.
    const MAX_JOBS: usize = 1024;
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    given.map_or_else(cores, usize::from).min(MAX_JOBS)
}
