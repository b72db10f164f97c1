//! Errors of studies.

use std::path::PathBuf;

use chaic_episodes::SplitError;
use chaic_files::FileError;

/// Reason why a study or its data cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A file operation failed.
    #[error(transparent)]
    File(#[from] FileError),
    /// The definition of a study has a problem.
    #[error("{path}: {problem}", path = path.display())]
    Definition {
        /// The file.
        path: PathBuf,
        /// Key and expectation.
        problem: String,
    },
    /// An episode of the study does not exist.
    #[error("{path}: {problem}", path = path.display())]
    Episode {
        /// The file that names the episode.
        path: PathBuf,
        /// Id and expectation.
        problem: SplitError,
    },
    /// The file of a participant has a problem.
    #[error("{path}, line {line}: {problem}", path = path.display())]
    Data {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// Problem.
        problem: String,
    },
    /// The text is no participant code.
    #[error("`{0}` is no participant code; a code has 10 letters and digits, such as K7QXM2RBTA")]
    Code(String),
    /// The folder for an export is not empty.
    #[error("{path} is not empty; name a new folder", path = path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
}

impl StudyError {
    /// Returns whether the caller's request caused the error.
    pub fn is_usage(&self) -> bool {
        match self {
            StudyError::Definition { .. } | StudyError::Code(_) => true,
            StudyError::Episode { problem, .. } => problem.is_usage(),
            _ => false,
        }
    }
}

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, StudyError>;
