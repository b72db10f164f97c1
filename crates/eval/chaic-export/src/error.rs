//! Errors of exports.

use std::path::PathBuf;

use chaic_core::AgentId;
use chaic_env::EnvError;
use chaic_files::FileError;
use chaic_video::VideoError;
use parquet::errors::ParquetError;

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
    /// The side of the images is odd.
    #[error("images of {0} pixels cannot be a video; choose an even number")]
    Size(u32),
    /// The sampling interval does not give a whole number of images per second.
    #[error(
        "an interval of {every} frames does not divide a second of {frames_per_s} frames; choose a divisor of {frames_per_s}"
    )]
    Rate {
        /// Sampling interval, frames.
        every: u32,
        /// Frames per second of the export.
        frames_per_s: u32,
    },
    /// No generator of this version of chaic made the episode.
    #[error(
        "no generator of this version of chaic made {0}, so its license and origin are unknown; leave it out, or \
         describe it by hand"
    )]
    NotGenerated(String),
    /// An earlier episode has the same file name.
    #[error("two episodes are named like {0}; rename one")]
    RepeatedName(String),
    /// The episode has no such agent.
    #[error("{0} has no {1}")]
    NoAgent(String, AgentId),
}

impl ExportError {
    /// Returns whether the caller's request caused the error.
    pub fn is_usage(&self) -> bool {
        match self {
            ExportError::Size(_)
            | ExportError::Rate { .. }
            | ExportError::NoAgent(..)
            | ExportError::NotGenerated(_)
            | ExportError::RepeatedName(_) => true,
            ExportError::Env(error) => error.is_usage(),
            _ => false,
        }
    }
}
