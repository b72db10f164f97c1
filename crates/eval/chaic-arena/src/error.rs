//! Errors of sealed splits, submissions and leaderboards.

use std::path::PathBuf;

use chaic_episodes::GenerateError;
use chaic_eval::EvalError;
use chaic_files::{FileError, LockError};

use crate::partners::PartnersDigest;

/// Result with an [`ArenaError`].
pub type Result<T> = std::result::Result<T, ArenaError>;

/// Reason why a sealed split, a submission or a score cannot be made, read or accepted.
#[derive(Debug, thiserror::Error)]
pub enum ArenaError {
    /// A file operation failed.
    #[error(transparent)]
    File(#[from] FileError),
    /// A folder cannot be locked.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// An episode cannot be generated.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// A run cannot be read or verified.
    #[error(transparent)]
    Eval(#[from] EvalError),
    /// The text is not a commitment.
    #[error("not a commitment of a sealed split: {0}")]
    Format(String),
    /// The commitment is to another secret.
    #[error(
        "the secret is not that of the commitment, whose SHA-256 is {expected}; this one's is {found}"
    )]
    OtherSecret {
        /// Digest in the commitment.
        expected: String,
        /// Digest of the secret.
        found: String,
    },
    /// The secret is right, but the partners are not.
    #[error(
        "the partners differ from those of the commitment, which chaic {sealed_by} made; use that version"
    )]
    OtherPartners {
        /// Version of chaic in the commitment.
        sealed_by: String,
    },
    /// The secret or the run is right, but the episodes are not.
    #[error(
        "the episodes differ from those of the commitment, which chaic {sealed_by} made; use that version \
         and the whole split"
    )]
    OtherEpisodes {
        /// Version of chaic in the commitment.
        sealed_by: String,
    },
    /// A run was played with other partners than those of the commitment.
    #[error(
        "the run was played with {played}, but the commitment has {committed}; play it with the committed \
         partners.json"
    )]
    OtherPlayedPartners {
        /// Partners of the run.
        played: PartnersDigest,
        /// Partners of the commitment.
        committed: PartnersDigest,
    },
    /// A run was played with a list of partners, but the commitment has no partners.
    #[error(
        "the run was played with {played}, but the commitment has none; play it without --partners or with \
         --partners suite"
    )]
    UncommittedPartners {
        /// Partners of the run.
        played: PartnersDigest,
    },
    /// The folder of a split holds episodes that are not of the split.
    #[error("{} holds other episodes; choose another folder, or remove them", .0.display())]
    UnknownFiles(PathBuf),
    /// An archive, or a folder to pack, breaks a rule of archives.
    #[error("{path} is refused: {problem}", path = path.display())]
    Archive {
        /// The archive or folder.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
    /// An entry of an archive breaks a rule of archives.
    #[error("{archive} is refused: entry {number}, `{path}`, {problem}", archive = archive.display())]
    Entry {
        /// The archive.
        archive: PathBuf,
        /// Number of the entry, from 1.
        number: usize,
        /// Path of the entry, with escaped special characters.
        path: String,
        /// The problem, as the end of a sentence.
        problem: String,
    },
    /// A manifest has a wrong form or value.
    #[error("{path}: {problem}", path = path.display())]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// Line or field, and the problem.
        problem: String,
    },
    /// A submission lacks a part, or its parts contradict each other.
    #[error("the submission in {path} is refused: {problem}", path = path.display())]
    Submission {
        /// Folder of the submission.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
    /// A folder holds no complete evaluation of a submission.
    #[error("{path} can't be scored: {problem}", path = path.display())]
    Score {
        /// Folder of the evaluation.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
}
