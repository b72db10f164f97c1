//! Errors of the crate.

use std::path::PathBuf;

use chaic_core::{AgentId, Frame};
use chaic_world::SetupError;

/// Result type of this crate.
pub type Result<T> = std::result::Result<T, EnvError>;

/// Error of this crate.
#[derive(Debug, thiserror::Error)]
pub enum EnvError {
    /// A setup is invalid.
    #[error("the setup of {id} is invalid: {problem}")]
    Setup {
        /// Episode id.
        id: String,
        /// Problem.
        problem: SetupError,
    },
    /// The number of agent slots differs from the number of people.
    #[error("{id} has {people} people, not {slots}")]
    SlotCount {
        /// Episode id.
        id: String,
        /// Number of people.
        people: usize,
        /// Number of slots.
        slots: usize,
    },
    /// An agent can't be copied.
    #[error("the agent of the {agent} can't be copied, so the episode has no snapshots")]
    NoFork {
        /// Agent id.
        agent: AgentId,
    },
    /// A snapshot is of another episode, agents, rules or seed.
    #[error("a snapshot of {snapshot_of} doesn't fit {id} with these agents, rules and seed")]
    OtherSnapshot {
        /// Running episode.
        id: String,
        /// Episode of the snapshot.
        snapshot_of: String,
    },
    /// Environments can't form a batch, or the batch lacks an environment.
    #[error("{0}")]
    Batch(String),
    /// An image buffer has the wrong length.
    #[error("the buffer for {image} has {found} elements, expected {expected}")]
    Buffer {
        /// Kind of image.
        image: &'static str,
        /// Number of elements.
        found: usize,
        /// Required number of elements.
        expected: usize,
    },
    /// A trace is of another version of the episode.
    #[error(
        "the episode {id} has digest {found}, the trace has {expected}; use the chaic that wrote the trace"
    )]
    OtherEpisode {
        /// Episode id.
        id: String,
        /// Digest of the episode.
        found: String,
        /// Digest in the trace.
        expected: String,
    },
    /// A trace contradicts the re-simulated world.
    #[error("{episode} at frame {frame}: {problem}; the trace was altered")]
    Altered {
        /// Episode id.
        episode: String,
        /// Frame of the first difference.
        frame: Frame,
        /// Difference.
        problem: String,
    },
    /// No helper has this name.
    #[error("unknown helper `{name}`; the helpers are {known}", known = known.join(", "))]
    UnknownHelper {
        /// Name.
        name: String,
        /// Known names.
        known: Vec<String>,
    },
    /// The name of an additional helper is invalid or taken.
    #[error("{problem}")]
    HelperName {
        /// Problem and a remedy, in one line.
        problem: String,
    },
    /// No partner has this name.
    #[error("unknown partner `{name}`; the partners are {known}", known = known.join(", "))]
    UnknownPartner {
        /// Name.
        name: String,
        /// Known names.
        known: Vec<String>,
    },
    /// The parameters in the name of a partner are wrong.
    #[error("unknown partner {problem}; docs/people.md lists the parameters")]
    InvalidPartner {
        /// The name, and the problem with its parameters.
        problem: String,
    },
    /// A partner comes from a file that was not given.
    #[error(
        "the partner `{name}` comes from a file; give it with --partner recorded:PATH or policy:FILE"
    )]
    PartnerFile {
        /// Name in the run, with the digest of the file.
        name: String,
    },
    /// A trace can't be repeated by a partner, or a folder has no such traces.
    #[error("{}: {problem}", path.display())]
    Recording {
        /// File or folder.
        path: PathBuf,
        /// The problem, in one line.
        problem: String,
    },
    /// A list of partners is wrong.
    #[error("{source_name}: not a list of partners: {problem}")]
    Partners {
        /// File or other source of the list.
        source_name: String,
        /// The problem, in one line.
        problem: String,
    },
    /// A helper registry of another crate fails.
    #[error("{0}")]
    Registry(Box<dyn std::error::Error + Send + Sync>),
    /// No rule has this name.
    #[error("no rule `{name}`; the rules are {known}", known = known.join(", "))]
    UnknownRule {
        /// Name.
        name: String,
        /// Known names.
        known: Vec<String>,
    },
    /// A rule setting is invalid.
    #[error("--set {setting}: {problem}")]
    Rule {
        /// Setting.
        setting: String,
        /// Problem.
        problem: String,
    },
    /// A file has another version or format.
    #[error(
        "{path} is {found}, this program (chaic {chaic}) reads {expected}; use the chaic that wrote it",
        path = path.display(), chaic = crate::CHAIC_VERSION
    )]
    OtherVersion {
        /// File.
        path: PathBuf,
        /// Format and version of the file.
        found: String,
        /// Supported format and version.
        expected: String,
    },
    /// A file can't be parsed.
    #[error("{path}: line {line}: {problem}", path = path.display())]
    Unreadable {
        /// File.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Problem.
        problem: String,
    },
}

impl EnvError {
    /// Returns whether the caller's arguments caused the error.
    pub fn is_usage(&self) -> bool {
        use EnvError::{
            Batch, Buffer, HelperName, InvalidPartner, PartnerFile, Partners, Rule, UnknownHelper,
            UnknownPartner, UnknownRule,
        };
        matches!(
            self,
            Batch(_)
                | Buffer { .. }
                | UnknownHelper { .. }
                | HelperName { .. }
                | UnknownPartner { .. }
                | InvalidPartner { .. }
                | PartnerFile { .. }
                | Partners { .. }
                | UnknownRule { .. }
                | Rule { .. }
        )
    }
}
