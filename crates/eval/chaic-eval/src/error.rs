//! What can go wrong, with what it went wrong with, and what to do.

use std::io;
use std::path::{Path, PathBuf};

use chaic_core::AgentError;
use chaic_env::{EnvError, RunKey};
use chaic_episodes::{EpisodeError, SplitError};
use chaic_files::FileError;

/// The result of anything in this crate.
pub type Result<T> = std::result::Result<T, EvalError>;

/// What can go wrong.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// The operating system refused something.
    #[error(transparent)]
    File(#[from] FileError),
    /// A folder isn't a run.
    #[error(
        "{path} is no run: it has no run.json; give the folder that `chaic eval --out` wrote",
        path = path.display()
    )]
    NotARun {
        /// The folder.
        path: PathBuf,
    },
    /// A run was stopped before it began.
    #[error(
        "a run in {path} was stopped before anything was recorded, so there is nothing to go on \
         with; give its command again without --resume",
        path = path.display()
    )]
    NotBegun {
        /// The folder.
        path: PathBuf,
    },
    /// A merge was interrupted before it was complete.
    #[error(
        "{path} holds an interrupted merge; run the same `chaic merge` again, or choose another --out",
        path = path.display()
    )]
    StoppedMerge {
        /// The folder.
        path: PathBuf,
    },
    /// `run.json` is not what the run wrote.
    #[error(
        "{path} was changed after the run began: its options don't fit their digest; undo the \
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
    /// The folder for a new run has something in it.
    #[error(
        "{path} exists and isn't empty; choose another --out, or go on with a run there by --resume",
        path = path.display()
    )]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
    /// A run can't be resumed with other options.
    #[error(
        "{path} was begun with {option} {recorded}, not {given}; leave {option} away to go on, or \
         choose another --out",
        path = path.display()
    )]
    OptionDiffers {
        /// The run's folder.
        path: PathBuf,
        /// The option.
        option: &'static str,
        /// Its value in the run.
        recorded: String,
        /// Its value now.
        given: String,
    },
    /// Another build of the same version began a run.
    #[error(
        "{path}: {episode} with {helper} and seed {seed} comes out otherwise than it did, so another \
         build of chaic {chaic} began this; go on with that one, or begin anew in another --out",
        path = path.display(), episode = key.episode, helper = key.helper, seed = key.seed,
        chaic = chaic_env::CHAIC_VERSION
    )]
    OtherCode {
        /// The run's folder.
        path: PathBuf,
        /// The episode run that was played again.
        key: RunKey,
    },
    /// An episode can't be played.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// A mind can't decide.
    #[error(transparent)]
    Agent(#[from] AgentError),
    /// Options make no run.
    #[error("{0}")]
    Options(String),
    /// There is no such trace in a run.
    #[error("{path} has no trace of {wanted}; it has {known}", path = path.display())]
    NoTrace {
        /// The run's folder.
        path: PathBuf,
        /// What was asked for.
        wanted: String,
        /// What there is instead.
        known: String,
    },
    /// A finished episode run has no trace.
    #[error(
        "{path} has no trace of {episode} with {helper} and seed {seed}, which is finished; play it again \
         by chaic eval --resume --out {path}",
        path = path.display(), episode = key.episode, helper = key.helper, seed = key.seed
    )]
    Untraced {
        /// The run's folder.
        path: PathBuf,
        /// The episode run.
        key: RunKey,
    },
    /// A run was told to keep no traces.
    #[error(
        "{path} was played with --no-traces, so there is nothing to verify, replay or score anew; \
         play it again without that option",
        path = path.display()
    )]
    NoTraces {
        /// The run's folder.
        path: PathBuf,
    },
    /// The system gives no more threads.
    #[error(
        "can't start thread {n} of {wanted}: {refusal}; choose fewer --jobs, or let the system \
         allow more threads and memory"
    )]
    NoThread {
        /// The thread, from 1.
        n: usize,
        /// How many are wanted.
        wanted: usize,
        /// The refusal.
        refusal: io::Error,
    },
    /// There is no such episode.
    #[error(transparent)]
    Split(#[from] SplitError),
    /// An episode file is wrong.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// A trace's actions don't lead where the trace says.
    #[error("{0}")]
    Difference(String),
    /// A picture or video can't be made.
    #[error("{0}")]
    Picture(String),
}

impl EvalError {
    /// Whether it is about what the caller asked for, rather than what came of it.
    pub fn is_usage(&self) -> bool {
        match self {
            EvalError::Options(_) | EvalError::OptionDiffers { .. } | EvalError::Split(_) => true,
            EvalError::Env(error) => error.is_usage(),
            _ => false,
        }
    }

    /// For `map_err` on what the operating system may refuse.
    pub fn io(what: &'static str, path: &Path) -> impl FnOnce(io::Error) -> EvalError + use<> {
        let refused = FileError::of(what, path);
        move |refusal| refused(refusal).into()
    }
}
