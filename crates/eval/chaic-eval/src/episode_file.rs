//! Reading episode files.

use std::path::Path;

use chaic_episodes::MAX_EPISODE_BYTES;
use chaic_files::read_user_file;

use crate::error::Result;

/// Reads an episode file from a path or folder that a user named. The file may be a link to a regular
/// file. Of a file that is too long it reads one byte more than the limit,
/// so that the parser says so.
///
/// # Errors
/// If it is no regular file, is longer, or can't be read.
pub fn read_episode_file(path: &Path) -> Result<Vec<u8>> {
    Ok(read_user_file(path, MAX_EPISODE_BYTES as u64 + 1)?)
}
