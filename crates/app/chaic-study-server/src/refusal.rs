//! Reasons why the server refuses a request of a participant.

use chaic_core::AgentError;
use chaic_files::FileError;
use chaic_web::LiveError;

/// Reason of a refusal. The text is for the participant.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// There is no participant with this code, or the participant was deleted.
    #[error("the server has no data of this participant")]
    Unknown,
    /// The token is missing or wrong.
    #[error("the token is not that of the participant")]
    Token,
    /// All slots are taken or done.
    #[error("all places of the study are taken")]
    Full,
    /// Too many requests in a short time.
    #[error("too many requests; repeat the request in a second")]
    Rate,
    /// Records are missing between the stored and the sent ones.
    #[error("the server has {stored} records; the next ones are missing")]
    Gap {
        /// Number of stored records.
        stored: usize,
    },
    /// A record is not one that this participant can have.
    #[error("record {number}: {problem}")]
    Record {
        /// Number of the record, from 0.
        number: usize,
        /// Problem.
        problem: String,
    },
    /// The participant has more data than the server takes.
    #[error("a participant has at most {0}")]
    Size(String),
    /// The trial has not begun.
    #[error("episode {0} has not begun")]
    NotBegun(usize),
    /// The trial has ended.
    #[error("the episode is over")]
    Over,
    /// The server does not hold the episode, for example after a pause.
    #[error("the episode is not open; open it again")]
    Closed,
    /// The turn is neither the next nor the last one.
    #[error("the next turn of the episode is {next}")]
    Turn {
        /// Number of the next turn.
        next: u64,
    },
    /// The content of a turn is invalid.
    #[error("the turn is invalid: {0}")]
    Input(String),
    /// The participant has not finished. The file is sent only after the end, because traces
    /// contain the goals.
    #[error("the data can be read at the end of the study")]
    Unfinished,
    /// Too many participants play at once.
    #[error("too many episodes are played at once; repeat the request later")]
    Busy,
    /// The simulator or the helper has a problem, which the researcher sees.
    #[error("the episode cannot go on")]
    Simulator(LiveError),
    /// An earlier request for the episode is not answered yet.
    #[error("an earlier request is not answered yet; repeat this request in a second")]
    InProgress,
    /// The server stops while the helper decides. The episode continues after the next start.
    #[error("the server is stopping; repeat the request after its next start")]
    Ending,
    /// The file of the participant was changed while the server ran.
    #[error("another program has changed the file of the participant")]
    Changed,
    /// A file operation failed.
    #[error("the server cannot store data now")]
    File(#[from] FileError),
}

impl From<LiveError> for Refusal {
    fn from(error: LiveError) -> Refusal {
        match error {
            LiveError::Agent(AgentError::Halted(_)) => Refusal::Ending,
            error => Refusal::Simulator(error),
        }
    }
}
