//! Errors of exports.

use std::path::PathBuf;

use chaic_core::AgentId;
use chaic_env::EnvError;
use chaic_files::FileError;
use chaic_video::VideoError;
use parquet::errors::ParquetError;

use crate::lerobot::FRAMES_PER_S;

/// Error when a data set is exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The trace does not match its episode.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A table cannot be written.
    #[error("{path}: {problem}")]
    Table {
        /// Path of the table.
        path: PathBuf,
        /// Error of the Parquet library.
        problem: ParquetError,
    },
    /// A video cannot be written.
    #[error(transparent)]
    Video(#[from] VideoError),
    /// The folder is not empty.
    #[error("{0} isn't empty; choose another --out")]
    NotEmpty(PathBuf),
    /// The sampling interval does not give a whole number of images per second.
    #[error(
        "an interval of {0} frames does not divide a second of {FRAMES_PER_S} frames; choose a divisor of {FRAMES_PER_S}"
    )]
    Rate(u32),
    /// The episode has no such agent.
    #[error("{0} has no {1}")]
    NoAgent(String, AgentId),
}
