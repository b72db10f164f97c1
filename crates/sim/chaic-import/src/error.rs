//! Errors of data sets and packages.

use std::path::{Path, PathBuf};

use chaic_episodes::EpisodeError;

/// Error when a data set or an episode is imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file or folder is missing or not readable.
    #[error("{}: {problem}", path.display())]
    Unreadable {
        /// Path of the file or folder.
        path: PathBuf,
        /// Expected content, or the system's error message.
        problem: String,
    },
    /// The package has a version that the tables were not compared with.
    #[error("{}: is tdw {found}, expected {expected}; get it by `{get}`", path.display())]
    WrongVersion {
        /// File that contains the version.
        path: PathBuf,
        /// Version that was found.
        found: String,
        /// Supported versions.
        expected: &'static str,
        /// Command that downloads a supported version.
        get: &'static str,
    },
    /// The file is not JSON, or a field is missing or has the wrong type.
    #[error("{}: {field}: {problem}", path.display())]
    Field {
        /// Path of the file.
        path: PathBuf,
        /// Path of the field within the file, for example `[3].task.goal_task`.
        field: String,
        /// Problem and expected value.
        problem: String,
    },
    /// The imported episode cannot be played.
    #[error("{}: the episode cannot be played: {source}", path.display())]
    Unplayable {
        /// File that the episode was made from.
        path: PathBuf,
        /// Problem of the episode.
        source: EpisodeError,
    },
}

impl ImportError {
    pub(crate) fn unreadable(path: &Path, problem: impl Into<String>) -> ImportError {
        ImportError::Unreadable { path: path.to_owned(), problem: problem.into() }
    }

    pub(crate) fn field(
        path: &Path,
        field: impl Into<String>,
        problem: impl Into<String>,
    ) -> ImportError {
        ImportError::Field { path: path.to_owned(), field: field.into(), problem: problem.into() }
    }
}
