//! Reading episode files.

use std::path::Path;

use chaic_episodes::MAX_EPISODE_BYTES;
use chaic_files::read_bounded;

use crate::error::Result;

/// The bytes of an episode file. Of a file that is too long it reads one byte more than the limit,
/// so that the parser says so.
///
/// # Errors
/// If it is no regular file, is longer, or can't be read.
pub fn read_episode_file(path: &Path) -> Result<Vec<u8>> {
    Ok(read_bounded(path, MAX_EPISODE_BYTES as u64 + 1)?)
}
