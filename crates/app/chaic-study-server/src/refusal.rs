//! Reasons why the server refuses a request of a participant.

use chaic_files::FileError;

/// Reason of a refusal. The text is for the participant.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// There is no participant with this code, or no more.
    #[error("the server has no data of this participant")]
    Unknown,
    /// The token is missing or another one.
    #[error("the token is not that of the participant")]
    Token,
    /// All slots are taken or done.
    #[error("all places of the study are taken")]
    Full,
    /// Too many requests in a short time.
    #[error("too many requests; repeat it in a second")]
    Rate,
    /// Records are missing between the stored and the sent ones.
    #[error("records from {stored} on are missing")]
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
    /// The file of the participant was changed while the server ran.
    #[error("another program has changed the file of the participant")]
    Changed,
    /// A file operation failed.
    #[error("the server cannot store data now")]
    File(#[from] FileError),
}
