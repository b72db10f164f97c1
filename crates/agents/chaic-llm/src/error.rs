//! What can go wrong before or beside the asking, with what it went wrong with, and what to do.

use std::io;
use std::path::{Path, PathBuf};

use chaic_files::FileError;

/// The result of anything in this crate.
pub type Result<T> = std::result::Result<T, LlmError>;

/// What can go wrong. No message ever holds a key.
#[derive(Debug, thiserror::Error)]
pub enum LlmError {
    /// The operating system refused something.
    #[error(transparent)]
    File(#[from] FileError),
    /// A setting can't be what it is.
    #[error("{field} is {found}, expected {expected}")]
    Setting {
        /// Its name in the configuration file.
        field: &'static str,
        /// What it says.
        found: String,
        /// What it may say.
        expected: String,
    },
    /// A configuration file can't be understood.
    #[error("{path}: {problem}", path = path.display())]
    Config {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        problem: String,
    },
    /// The environment variable of the key isn't set.
    #[error(
        "the environment variable {variable} holds no key; set it, or name another one by \
         endpoint.key_env (\"\" for an endpoint that asks for none)"
    )]
    NoKey {
        /// Its name.
        variable: String,
    },
    /// The endpoint gives no answer.
    #[error("{problem}")]
    Endpoint {
        /// Why.
        problem: String,
    },
    /// A template can't be filled in.
    #[error("template {name}: {problem}")]
    Template {
        /// Its file.
        name: String,
        /// What is wrong, and in which line.
        problem: String,
    },
    /// A run is gone on with otherwise than it was begun.
    #[error(
        "{path} was begun with {field} {recorded}, not {given}; go on as it was begun, or choose \
         another --out",
        path = path.display()
    )]
    SettingDiffers {
        /// The run's folder.
        path: PathBuf,
        /// The setting.
        field: String,
        /// Its value in the run.
        recorded: String,
        /// Its value now.
        given: String,
    },
    /// A run is gone on with, and nobody but its folder says whom to ask.
    #[error(
        "{path} was begun with the endpoint {url} and {key}; a run's folder doesn't decide who is \
         sent questions and keys: name the endpoint by --endpoint{and_key}",
        path = path.display(),
        key = if key_env.is_empty() { "no key".to_owned() } else { format!("the key in {key_env}") },
        and_key = if *is_key_named { "" } else { ", and the key's variable by --llm-key-env" },
    )]
    NotNamed {
        /// The run's folder.
        path: PathBuf,
        /// The recorded address.
        url: String,
        /// The recorded environment variable of the key; empty for none.
        key_env: String,
        /// Whether the user has named a variable, or the usual one is the recorded one.
        is_key_named: bool,
    },
    /// A run has no record of a language model.
    #[error("{path} holds no record of a language model", path = path.display())]
    NoRecord {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// A record can't be understood.
    #[error("{path}: line {line}: {problem}", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
}

impl LlmError {
    /// Whether it is about what the caller asked for, rather than what came of it.
    pub fn is_usage(&self) -> bool {
        matches!(self, LlmError::Setting { .. } | LlmError::SettingDiffers { .. })
    }

    /// For `map_err` on what the operating system may refuse.
    pub fn io(what: &'static str, path: &Path) -> impl FnOnce(io::Error) -> LlmError + use<> {
        let refused = FileError::of(what, path);
        move |refusal| refused(refusal).into()
    }
}
