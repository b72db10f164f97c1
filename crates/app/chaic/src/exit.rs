//! Exit codes; `docs/reference/exit-codes.md` has the same table for users.

use chaic_env::EnvError;
use chaic_episodes::SplitError;
use chaic_eval::EvalError;
use chaic_llm::error::LlmError;
use chaic_subprocess::Refusal;
use chaic_training::TrainingError;

/// As intended.
pub const OK: u8 = 0;
/// It failed, or it found something wrong and said what.
pub const FAILED: u8 = 1;
/// What was asked for can't be; the parser of the command line ends with the same.
pub const USAGE: u8 = 2;
/// Ended by Ctrl-C: 128 + 2, the number of SIGINT, as shells have it.
pub const INTERRUPTED: u8 = 130;

/// How a command ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// As intended.
    Well,
    /// It found something wrong, and has said what.
    WithFindings,
    /// By Ctrl-C.
    Interrupted,
}

impl Ended {
    /// Its code.
    pub fn code(self) -> u8 {
        match self {
            Ended::Well => OK,
            Ended::WithFindings => FAILED,
            Ended::Interrupted => INTERRUPTED,
        }
    }
}

/// The code of an error.
pub fn of(error: &anyhow::Error) -> u8 {
    let of_env = match error.downcast_ref() {
        Some(EvalError::Env(inner)) => Some(inner),
        _ => error.downcast_ref(),
    };
    let of_minds = match of_env {
        Some(EnvError::Minds(inner)) => Some(inner),
        _ => None,
    };
    let of_llm = of_minds.map_or_else(|| error.downcast_ref(), |inner| inner.downcast_ref());
    let is_usage = of_env.is_some_and(EnvError::is_usage)
        || of_llm.is_some_and(LlmError::is_usage)
        || of_minds.is_some_and(|inner| inner.is::<Refusal>())
        || error.downcast_ref().is_some_and(EvalError::is_usage)
        || error.downcast_ref().is_some_and(TrainingError::is_usage)
        || error.is::<Refusal>()
        || error.is::<SplitError>();
    if is_usage { USAGE } else { FAILED }
}
