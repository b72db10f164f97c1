//! What can go wrong, with what it went wrong with, and what to do.

use std::io;
use std::path::{Path, PathBuf};

use chaic_episodes::{EpisodeError, SplitError};
use chaic_world::SetupError;

use crate::metrics::RunKey;

/// The result of anything in this crate.
pub type Result<T> = std::result::Result<T, EvalError>;

/// What can go wrong.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// The operating system refused something.
    #[error("can't {what} {path}: {refusal}", path = path.display())]
    Io {
        /// What was tried, for example `write`.
        what: &'static str,
        /// With which file or folder.
        path: PathBuf,
        /// The refusal.
        refusal: io::Error,
    },
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
    /// A file is of another version or format.
    #[error(
        "{path} is of {found}, this program (chaic {chaic}) reads {expected}; use the chaic that \
         wrote it",
        path = path.display(), chaic = crate::CHAIC_VERSION
    )]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// What it says it is.
        found: String,
        /// What was expected.
        expected: String,
    },
    /// A file can't be understood.
    #[error("{path}: line {line}: {problem}", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
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
        chaic = crate::CHAIC_VERSION
    )]
    OtherCode {
        /// The run's folder.
        path: PathBuf,
        /// The episode run that was played again.
        key: RunKey,
    },
    /// Options make no run.
    #[error("{0}")]
    Options(String),
    /// No helper has this name.
    #[error("unknown helper `{name}`; the helpers are {known}", known = known.join(", "))]
    UnknownHelper {
        /// The name.
        name: String,
        /// All names.
        known: Vec<String>,
    },
    /// No mind for the partner has this name.
    #[error("unknown partner `{name}`; the partners are {known}", known = known.join(", "))]
    UnknownPartner {
        /// The name.
        name: String,
        /// All names.
        known: Vec<String>,
    },
    /// A run or trace names an episode that isn't what it was.
    #[error(
        "the episode {id} has digest {found}, the trace was played on {expected}; it needs the \
         chaic that wrote it"
    )]
    OtherEpisode {
        /// The episode.
        id: String,
        /// Digest of the episode as it is.
        found: String,
        /// Digest of the episode that was played.
        expected: String,
    },
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
    /// Helpers from elsewhere can't take part.
    #[error("{0}")]
    Helpers(Box<dyn std::error::Error + Send + Sync>),
    /// There is no such episode.
    #[error(transparent)]
    Split(#[from] SplitError),
    /// An episode file is wrong.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// A setup can't become a world.
    #[error("the setup of {id} makes no world: {problem}")]
    Setup {
        /// The episode.
        id: String,
        /// Why.
        problem: SetupError,
    },
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
        use EvalError::{OptionDiffers, Options, Split, UnknownHelper, UnknownPartner};
        matches!(
            self,
            Options(_)
                | UnknownHelper { .. }
                | UnknownPartner { .. }
                | OptionDiffers { .. }
                | Split(_)
        )
    }

    /// For `map_err` on what the operating system may refuse.
    pub fn io(what: &'static str, path: &Path) -> impl FnOnce(io::Error) -> EvalError + use<> {
        let path = path.to_owned();
        move |refusal| EvalError::Io { what, path, refusal }
    }
}
