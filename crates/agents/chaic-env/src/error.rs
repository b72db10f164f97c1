//! What can go wrong, with what it went wrong with, and what to do.

use std::path::PathBuf;

use chaic_core::{AgentId, Frame};
use chaic_world::SetupError;

/// The result of anything in this crate.
pub type Result<T> = std::result::Result<T, EnvError>;

/// What can go wrong.
#[derive(Debug, thiserror::Error)]
pub enum EnvError {
    /// A setup can't become a world.
    #[error("the setup of {id} makes no world: {problem}")]
    Setup {
        /// The episode.
        id: String,
        /// Why.
        problem: SetupError,
    },
    /// There are seats for more or fewer people than an episode has.
    #[error("{id} has {people} people, not {seats}")]
    Seats {
        /// The episode.
        id: String,
        /// How many people it has.
        people: usize,
        /// How many seats there are.
        seats: usize,
    },
    /// A mind can't be copied.
    #[error("the mind of the {agent} can't be copied, so that there is no snapshot of the episode")]
    NoFork {
        /// Whose mind.
        agent: AgentId,
    },
    /// A snapshot is of another episode, or of other minds, rules or seeds.
    #[error("a snapshot of {of} doesn't fit {id} with these minds, rules and seed")]
    OtherSnapshot {
        /// The episode under way.
        id: String,
        /// The episode of the snapshot.
        of: String,
    },
    /// Environments can't be stepped together.
    #[error("{0}")]
    Batch(String),
    /// A buffer for images has another length than its images.
    #[error("the buffer for {image} has {found} numbers, it needs {expected}")]
    Buffer {
        /// Which image.
        image: &'static str,
        /// How many numbers it has.
        found: usize,
        /// How many it needs.
        expected: usize,
    },
    /// A trace was played on another episode.
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
    /// A trace doesn't fit the world that it was played in.
    #[error("{episode} at frame {frame}: {problem}; the trace was altered")]
    Altered {
        /// The episode.
        episode: String,
        /// The frame up to which it fits.
        frame: Frame,
        /// What doesn't fit.
        problem: String,
    },
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
    /// Minds from elsewhere can't take part.
    #[error("{0}")]
    Minds(Box<dyn std::error::Error + Send + Sync>),
    /// No rule has this name.
    #[error("no rule `{name}`; the rules are {known}", known = known.join(", "))]
    UnknownRule {
        /// The name.
        name: String,
        /// All names.
        known: Vec<String>,
    },
    /// A rule can't be set so.
    #[error("--set {setting}: {problem}")]
    Rule {
        /// What was asked for.
        setting: String,
        /// What is wrong with it.
        problem: String,
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
}

impl EnvError {
    /// Whether it is about what the caller asked for, rather than what came of it.
    pub fn is_usage(&self) -> bool {
        use EnvError::{Rule, UnknownHelper, UnknownPartner, UnknownRule};
        matches!(
            self,
            UnknownHelper { .. } | UnknownPartner { .. } | UnknownRule { .. } | Rule { .. }
        )
    }
}
