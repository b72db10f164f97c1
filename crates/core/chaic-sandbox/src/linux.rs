//! Stages of the sandbox on Linux. Both are separate single-threaded processes.

mod filter;
mod inner;
mod landlock;
mod outer;
mod root;
mod shared;
mod usage;

use std::fmt;
use std::io;

use crate::request::{Request, SETUP_FAILED, Stage};

/// Runs a stage and returns the exit status of its process.
pub(crate) fn run(request: &Request) -> u8 {
    let status = match request.stage {
        Stage::Outer => outer::run(request),
        Stage::Inner => inner::run(request),
    };
    status.unwrap_or_else(|error| {
        print_error(&error.to_string());
        SETUP_FAILED
    })
}

/// Prints a line on the standard error, of which the caller keeps the last lines.
fn print_error(text: &str) {
    use std::io::Write as _;
    // The stream may be closed; there is no other channel.
    let _ = writeln!(io::stderr(), "chaic sandbox: {text}");
}

/// A step of the setup that failed.
#[derive(Debug)]
struct SetupError {
    step: String,
    error: io::Error,
}

impl SetupError {
    /// Returns a function for `map_err` that adds the step to an error.
    fn context<E: Into<io::Error>>(step: impl Into<String>) -> impl FnOnce(E) -> SetupError {
        let step = step.into();
        move |error| SetupError { step, error: error.into() }
    }
}

impl fmt::Display for SetupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "can't {}: {}", self.step, self.error)
    }
}

type SetupResult<T> = Result<T, SetupError>;
