//! What can be wrong with a data set or a package.

use std::path::{Path, PathBuf};

use chaic_episodes::EpisodeError;

/// Why something can't be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file or folder isn't there, or can't be read.
    #[error("{}: {problem}", path.display())]
    Unreadable {
        /// Which one.
        path: PathBuf,
        /// What it was wanted for, or what the system says.
        problem: String,
    },
    /// The package is of a version whose furniture nobody has compared with the tables.
    #[error("{}: is tdw {found}, expected {expected}; get it by `{get}`", path.display())]
    WrongVersion {
        /// The file that says so.
        path: PathBuf,
        /// Which version it is.
        found: String,
        /// Which versions are read.
        expected: &'static str,
        /// How to get one.
        get: &'static str,
    },
    /// The file isn't JSON, or a field is missing or of the wrong kind.
    #[error("{}: {field}: {problem}", path.display())]
    Field {
        /// The file.
        path: PathBuf,
        /// Path of the field within the file, for example `[3].task.goal_task`.
        field: String,
        /// What is wrong, and what was expected.
        problem: String,
    },
    /// The episode that came out can't be played.
    #[error("{}: makes an episode that can't be played: {source}", path.display())]
    Unplayable {
        /// The file that it was made from.
        path: PathBuf,
        /// What is wrong with it.
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
