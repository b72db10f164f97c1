//! Errors that keep a server from starting or end it.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use chaic_env::EnvError;
use chaic_files::{FileError, LockError};
use chaic_study::StudyError;

/// Reason why a server cannot run.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// A file operation failed.
    #[error(transparent)]
    File(#[from] FileError),
    /// The folder is in use.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// The file of a participant cannot be read.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The file of a participant is not one of this study.
    #[error("{path}, line {line}: {problem}", path = path.display())]
    Data {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// Problem.
        problem: String,
    },
    /// The file of a token is damaged.
    #[error("{} holds no digest of a token; remove it, and the participant cannot go on", .0.display())]
    Token(PathBuf),
    /// A condition has a helper that the server does not have.
    #[error(transparent)]
    Helper(#[from] EnvError),
    /// A name is not a valid host name.
    #[error(
        "`{0}` is no name of a server; expected a name such as study.example.org, without https://"
    )]
    HostName(String),
    /// The address stands for all networks, so the name that browsers use is unknown.
    #[error("the address {0} needs a name that browsers use; add --host NAME")]
    NoHostName(SocketAddr),
    /// The system refuses to listen or to start threads.
    #[error("can't listen on {address}: {error}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Error of the operating system.
        error: io::Error,
    },
}

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, ServerError>;
