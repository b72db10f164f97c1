//! Errors outside of requests: what failed, on what, and what to do.

use std::io;
use std::path::{Path, PathBuf};

use chaic_files::FileError;

/// Result type of this crate.
pub type Result<T> = std::result::Result<T, LlmError>;

/// Error of this crate. No message contains a key.
#[derive(Debug, thiserror::Error)]
pub enum LlmError {
    /// The operating system refused an operation.
    #[error(transparent)]
    File(#[from] FileError),
    /// A setting is out of bounds.
    #[error("{field} is {found}, expected {expected}")]
    Setting {
        /// Name in the configuration file.
        field: &'static str,
        /// Given value.
        found: String,
        /// Expected values.
        expected: String,
    },
    /// The configuration file is invalid.
    #[error("{path}: {problem}", path = path.display())]
    Config {
        /// Path of the file.
        path: PathBuf,
        /// Cause and position.
        problem: String,
    },
    /// The environment variable of the key is unset.
    #[error(
        "the environment variable {variable} holds no key; set it, or name another one by \
         endpoint.key_env (\"\" for an endpoint that needs none)"
    )]
    NoKey {
        /// Name of the variable.
        variable: String,
    },
    /// The endpoint gives no answer.
    #[error("{problem}")]
    Endpoint {
        /// Cause.
        problem: String,
    },
    /// A template is invalid.
    #[error("template {name}: {problem}")]
    Template {
        /// File name.
        name: String,
        /// Cause and line.
        problem: String,
    },
    /// A run is resumed with other settings.
    #[error(
        "{path} was started with {field} {recorded}, not {given}; resume with the same value, or \
         choose another --out",
        path = path.display()
    )]
    SettingDiffers {
        /// Run folder.
        path: PathBuf,
        /// Name of the setting.
        field: String,
        /// Value in the run.
        recorded: String,
        /// Current value.
        given: String,
    },
    /// A run is resumed, and only its folder names the endpoint.
    #[error(
        "{path} was started with the endpoint {url} and {key}; a run folder doesn't select where \
         requests and keys are sent: name the endpoint by --endpoint{and_key}",
        path = path.display(),
        key = if key_env.is_empty() { "no key".to_owned() } else { format!("the key in {key_env}") },
        and_key = if *is_key_named { "" } else { ", and the key's variable by --llm-key-env" },
    )]
    NotNamed {
        /// Run folder.
        path: PathBuf,
        /// Recorded address.
        url: String,
        /// Recorded environment variable of the key; empty for none.
        key_env: String,
        /// True if the user named a variable, or the recorded one is the default.
        is_key_named: bool,
    },
    /// A run has no record of a language model.
    #[error("{path} holds no record of a language model", path = path.display())]
    NoRecord {
        /// Expected path.
        path: PathBuf,
    },
    /// A record would become larger than what can be read.
    #[error(
        "{path} can't grow beyond {max_mib} MiB and may have no room for the next answer, so the run \
         stopped; the record can still be read; resume with a smaller endpoint.max_answer_bytes, or start \
         another run with a smaller request.max_prompt_tokens",
        path = path.display()
    )]
    RecordFull {
        /// Path of the file.
        path: PathBuf,
        /// Maximum size, MiB.
        max_mib: u64,
    },
    /// A resumed episode can't continue its record, which may hold the only copy of paid answers.
    #[error(
        "{path} can't be continued, but it may hold paid answers, so it is kept and the run stopped; to \
         ask again, move it out of the run and resume: {problem}",
        path = path.display()
    )]
    NotContinued {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        problem: String,
    },
    /// A run with a budget has a record that can't be read.
    #[error(
        "{path} can't be read, so what the run has spent is unknown and its budget can't be kept; move the \
         file out of the run and lower the budget by what it spent, or resume without a budget: line {line}: \
         {problem}",
        path = path.display()
    )]
    UnknownSpending {
        /// Path of the file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Cause.
        problem: String,
    },
    /// A record is invalid.
    #[error("{path}: line {line}: {problem}", path = path.display())]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Cause.
        problem: String,
    },
}

impl LlmError {
    /// Returns whether the error concerns the caller's request rather than its execution.
    pub fn is_usage(&self) -> bool {
        matches!(
            self,
            LlmError::Config { .. }
                | LlmError::NoKey { .. }
                | LlmError::NotNamed { .. }
                | LlmError::Setting { .. }
                | LlmError::SettingDiffers { .. }
                | LlmError::Template { .. }
        )
    }

    /// Creates a conversion for `map_err` on file system errors.
    pub fn io(what: &'static str, path: &Path) -> impl FnOnce(io::Error) -> LlmError + use<> {
        let convert = FileError::context(what, path);
        move |refusal| convert(refusal).into()
    }
}
