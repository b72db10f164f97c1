//! The stages of the sandbox on Linux. Both are single-threaded processes of their own.

mod filter;
mod inner;
mod landlock;
mod outer;
mod root;
mod usage;

use std::fmt;
use std::io;

use crate::launcher::{Request, SETUP_FAILED, Stage};

/// Runs a stage and returns the exit status of its process.
pub(crate) fn run(request: &Request) -> u8 {
    let status = match request.stage {
        Stage::Outer => outer::run(request),
        Stage::Inner => inner::run(request),
    };
    status.unwrap_or_else(|failed| {
        complain(&failed.to_string());
        SETUP_FAILED
    })
}

/// Prints a line on the standard error, where the caller keeps the last lines of the command.
fn complain(text: &str) {
    use std::io::Write as _;
    // The stream may be closed; nobody else is left to tell.
    let _ = writeln!(io::stderr(), "chaic sandbox: {text}");
}

/// A step of the set-up that the system refused.
#[derive(Debug)]
struct SetupError {
    step: String,
    refusal: io::Error,
}

impl SetupError {
    /// For `map_err` on a step that the system may refuse.
    fn of<E: Into<io::Error>>(step: impl Into<String>) -> impl FnOnce(E) -> SetupError {
        let step = step.into();
        move |refusal| SetupError { step, refusal: refusal.into() }
    }
}

impl fmt::Display for SetupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "can't {}: {}", self.step, self.refusal)
    }
}

type Setup<T> = Result<T, SetupError>;
