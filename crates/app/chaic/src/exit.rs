//! Exit codes; `docs/reference/exit-codes.md` has the same table for users.

use anyhow::anyhow;
use chaic_arena::ArenaError;
use chaic_env::EnvError;
use chaic_episodes::SplitError;
use chaic_eval::EvalError;
use chaic_export::ExportError;
use chaic_llm::error::LlmError;
use chaic_study::StudyError;
use chaic_subprocess::Refusal;
use chaic_training::TrainingError;
use chaic_vision::behavior::store::StoreError;

/// Success.
pub const OK: u8 = 0;
/// The command failed, or found a problem and reported it.
pub const FAILED: u8 = 1;
/// Invalid request; the parser of the command line exits with the same code.
pub const USAGE: u8 = 2;
/// The command was stopped by Ctrl-C: 128 plus 2, the number of SIGINT, as in shells.
pub const INTERRUPTED: u8 = 130;

/// Exit status of a command that returned no error.
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

/// Returns the error of `chaic-eval` that this error is or wraps.
fn eval_error(error: &anyhow::Error) -> Option<&EvalError> {
    match error.downcast_ref() {
        Some(ArenaError::Eval(inner)) => Some(inner),
        _ => error.downcast_ref(),
    }
}

/// Returns the error of `chaic-env` that this error is or wraps.
pub fn env_error(error: &anyhow::Error) -> Option<&EnvError> {
    match eval_error(error) {
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
        || eval_error(error).is_some_and(EvalError::is_usage)
        || error.downcast_ref().is_some_and(ExportError::is_usage)
        || error.downcast_ref().is_some_and(StoreError::is_usage)
        || error.downcast_ref().is_some_and(StudyError::is_usage)
        || error.downcast_ref().is_some_and(TrainingError::is_usage)
        || error.downcast_ref().is_some_and(SplitError::is_usage)
        || error.is::<Refusal>();
    if is_usage { USAGE } else { FAILED }
}

/// Adds a line to an error that describes how to continue. Errors of invalid requests are not changed,
/// because a repetition would fail again.
pub fn with_hint(error: anyhow::Error, hint: &str) -> anyhow::Error {
    if code_of(&error) == USAGE { error } else { anyhow!("{error:#}\n{hint}") }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn invalid_requests_have_their_own_code_and_no_hint() {
        let folder = || PathBuf::from("out");
        let no_key = || LlmError::NoKey { variable: "KEY".to_owned() };
        let not_named = LlmError::NotNamed {
            path: folder(),
            url: "http://h/v1".to_owned(),
            key_env: String::new(),
            is_key_named: true,
        };
        let unknown_helper = || EnvError::UnknownHelper { name: "x".to_owned(), known: Vec::new() };
        let (name, problem) = ("map.txt".to_owned(), "line 2".to_owned());
        let no_episode = || SplitError::NoSuchEpisode { id: "obstacle/test/99".to_owned() };
        let of_other_generators = || {
            let (expected, found) = ("1".to_owned(), "2".to_owned());
            SplitError::NotStandard { id: "obstacle/standard/000".to_owned(), expected, found }
        };
        let of_study = |problem| StudyError::Episode { path: folder(), problem };
        let cases: [(anyhow::Error, u8); 22] = [
            (no_episode().into(), USAGE),
            (of_other_generators().into(), FAILED),
            (EvalError::from(no_episode()).into(), USAGE),
            (EvalError::from(of_other_generators()).into(), FAILED),
            (of_study(no_episode()).into(), USAGE),
            (of_study(of_other_generators()).into(), FAILED),
            (no_key().into(), USAGE),
            (EnvError::Registry(no_key().into()).into(), USAGE),
            (not_named.into(), USAGE),
            (LlmError::Template { name, problem }.into(), USAGE),
            (LlmError::Endpoint { problem: "no answer".to_owned() }.into(), FAILED),
            (EvalError::Options("no".to_owned()).into(), USAGE),
            (EvalError::NotEmpty { path: folder() }.into(), FAILED),
            (ArenaError::from(EvalError::Options("no".to_owned())).into(), USAGE),
            (ArenaError::from(EvalError::from(unknown_helper())).into(), USAGE),
            (ArenaError::from(EvalError::NotARun { path: folder() }).into(), FAILED),
            (ArenaError::Score { path: folder(), problem: "missing".to_owned() }.into(), FAILED),
            (ExportError::Size(33).into(), USAGE),
            (ExportError::Rate { every: 7, frames_per_s: 30 }.into(), USAGE),
            (ExportError::NotEmpty(folder()).into(), FAILED),
            (StoreError::Config(folder()).into(), USAGE),
            (StudyError::Code("..".to_owned()).into(), USAGE),
        ];
        for (error, code) in cases {
            let text = error.to_string();
            assert_eq!(code_of(&error), code, "{text}");
            let error = with_hint(error, "the same command continues");
            assert_eq!(code_of(&error), code, "{text}");
            let has_hint = error.to_string().ends_with("\nthe same command continues");
            assert_eq!(has_hint, code == FAILED, "{error}");
        }
    }
}
