//! Exit codes; `docs/reference/exit-codes.md` has the same table for users.

use chaic_env::EnvError;
use chaic_episodes::SplitError;
use chaic_eval::EvalError;
use chaic_llm::error::LlmError;
use chaic_subprocess::Refusal;
use chaic_training::TrainingError;

/// Success.
pub const OK: u8 = 0;
/// The command failed, or found a problem and reported it.
pub const FAILED: u8 = 1;
/// Invalid request; the parser of the command line exits with the same code.
pub const USAGE: u8 = 2;
/// Ended by Ctrl-C: 128 + 2, the number of SIGINT, as in shells.
pub const INTERRUPTED: u8 = 130;

/// End of a command that returned no error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExitStatus {
    /// The command succeeded.
    Success,
    /// The command found a problem and reported it.
    Findings,
    /// Ctrl-C ended the command.
    Interrupted,
}

impl ExitStatus {
    /// Returns [`ExitStatus::Success`], or [`ExitStatus::Findings`] if there are any.
    pub fn from_findings(has_findings: bool) -> ExitStatus {
        if has_findings { ExitStatus::Findings } else { ExitStatus::Success }
    }

    /// Returns the exit code.
    pub fn code(self) -> u8 {
        match self {
            ExitStatus::Success => OK,
            ExitStatus::Findings => FAILED,
            ExitStatus::Interrupted => INTERRUPTED,
        }
    }
}

/// Returns the error of `chaic-env` that this error is or wraps.
pub fn env_error(error: &anyhow::Error) -> Option<&EnvError> {
    match error.downcast_ref() {
        Some(EvalError::Env(inner)) => Some(inner),
        _ => error.downcast_ref(),
    }
}

/// Returns the exit code of an error.
pub fn code_of(error: &anyhow::Error) -> u8 {
    let env = env_error(error);
    let registry = match env {
        Some(EnvError::Registry(inner)) => Some(inner),
        _ => None,
    };
    let llm = registry.map_or_else(|| error.downcast_ref(), |inner| inner.downcast_ref());
    let is_usage = env.is_some_and(EnvError::is_usage)
        || llm.is_some_and(LlmError::is_usage)
        || registry.is_some_and(|inner| inner.is::<Refusal>())
        || error.downcast_ref().is_some_and(EvalError::is_usage)
        || error.downcast_ref().is_some_and(TrainingError::is_usage)
        || error.is::<Refusal>()
        || error.is::<SplitError>();
    if is_usage { USAGE } else { FAILED }
}
