//! Errors of evaluation.

use std::io;
use std::path::{Path, PathBuf};

use chaic_core::AgentError;
use chaic_env::{EnvError, RunKey};
use chaic_episodes::{EpisodeError, SplitError};
use chaic_files::FileError;

/// Result with an [`EvalError`].
pub type Result<T> = std::result::Result<T, EvalError>;

/// Error of evaluation.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// An I/O operation failed.
    #[error(transparent)]
    File(#[from] FileError),
    /// A folder is not a run.
    #[error(
        "{path} is not a run: it has no run.json; give the folder that `chaic eval --out` wrote",
        path = path.display()
    )]
    NotARun {
        /// The folder.
        path: PathBuf,
    },
    /// A folder holds the runs of several partners.
    #[error(
        "{path} holds runs with several partners; name one of them, such as {run}",
        path = path.display(), run = path.join(chaic_env::helper_registry::RULES).display()
    )]
    SeveralPartners {
        /// The folder.
        path: PathBuf,
    },
    /// Not all runs of a folder for several partners were started.
    #[error(
        "{path} was stopped before the run with partner {partner} was started; give its command again \
         without --resume",
        path = path.display()
    )]
    PartnerNotStarted {
        /// The folder.
        path: PathBuf,
        /// First partner without a run.
        partner: String,
    },
    /// A run was stopped before its `run.json` was written.
    #[error(
        "the run in {path} was stopped before its run.json was written, so it can't be resumed; \
         give its command again without --resume",
        path = path.display()
    )]
    NotStarted {
        /// The folder.
        path: PathBuf,
    },
    /// A merge was interrupted before it was complete.
    #[error(
        "{path} holds an interrupted merge; run the same `chaic merge` again, or choose another --out",
        path = path.display()
    )]
    InterruptedMerge {
        /// The folder.
        path: PathBuf,
    },
    /// `run.json` was changed by hand.
    #[error(
        "{path} was changed after the run started: its options don't match their digest; undo the \
         change, or play with other options in another --out",
        path = path.display()
    )]
    Altered {
        /// The file.
        path: PathBuf,
    },
    /// Another process writes to the run.
    #[error(
        "{path} is in use by another `chaic eval`; wait for it or choose another --out",
        path = path.display()
    )]
    Locked {
        /// The run's folder.
        path: PathBuf,
    },
    /// The folder for a new run is not empty.
    #[error(
        "{path} exists and isn't empty; choose another --out, or continue the command that began it \
         (chaic eval: --resume)",
        path = path.display()
    )]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
    /// A run can't be resumed with other options.
    #[error(
        "{path} was started with {option} {recorded}, not {given}; omit {option} to resume it, or \
         choose another --out",
        path = path.display()
    )]
    OptionDiffers {
        /// The run's folder.
        path: PathBuf,
        /// Name of the option.
        option: &'static str,
        /// Value in the run.
        recorded: String,
        /// Requested value.
        given: String,
    },
    /// Another build of the same version started a run.
    #[error(
        "{path}: {episode} with {helper} and seed {seed} gives another result than before, so another \
         build of chaic {chaic} started this run; resume with that build, or choose another --out",
        path = path.display(), episode = key.episode, helper = key.helper, seed = key.seed,
        chaic = chaic_env::CHAIC_VERSION
    )]
    OtherBuild {
        /// The run's folder.
        path: PathBuf,
        /// The episode run that gave another result.
        key: RunKey,
    },
    /// An episode can't be played.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// An agent failed.
    #[error(transparent)]
    Agent(#[from] AgentError),
    /// Options are invalid or contradictory.
    #[error("{0}")]
    Options(String),
    /// The run has no such trace.
    #[error("{path} has no trace of {wanted}; it has {known}", path = path.display())]
    NoTrace {
        /// The run's folder.
        path: PathBuf,
        /// Description of the requested trace.
        wanted: String,
        /// Description of the existing traces.
        known: String,
    },
    /// A finished episode run has no trace.
    #[error(
        "{path} has no trace of {episode} with {helper} and seed {seed}, which is finished; play it again \
         with chaic eval --resume --out {path}",
        path = path.display(), episode = key.episode, helper = key.helper, seed = key.seed
    )]
    Untraced {
        /// The run's folder.
        path: PathBuf,
        /// The episode run.
        key: RunKey,
    },
    /// A run was played without traces.
    #[error(
        "{path} was played with --no-traces, so it can't be verified, replayed or scored again; \
         play it without that option",
        path = path.display()
    )]
    NoTraces {
        /// The run's folder.
        path: PathBuf,
    },
    /// The operating system refused to start a thread.
    #[error(
        "can't start thread {n} of {wanted}: {error}; choose fewer --jobs, or let the system \
         allow more threads and memory"
    )]
    NoThread {
        /// Index of the thread, from 1.
        n: usize,
        /// Number of requested threads.
        wanted: usize,
        /// Error of the operating system.
        error: io::Error,
    },
    /// The episode does not exist.
    #[error(transparent)]
    Split(#[from] SplitError),
    /// An episode file is invalid.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// An image or video can't be created.
    #[error("{0}")]
    Image(String),
}

impl EvalError {
    /// Returns whether the caller's request caused the error.
    pub fn is_usage(&self) -> bool {
        match self {
            EvalError::Options(_) | EvalError::OptionDiffers { .. } => true,
            EvalError::Split(error) => error.is_usage(),
            EvalError::Env(error) => error.is_usage(),
            _ => false,
        }
    }

    /// Returns a function that converts an I/O error, for `map_err`.
    pub fn io(operation: &'static str, path: &Path) -> impl FnOnce(io::Error) -> EvalError + use<> {
        let convert = FileError::context(operation, path);
        move |error| convert(error).into()
    }
}
