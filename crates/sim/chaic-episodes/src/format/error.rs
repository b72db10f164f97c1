//! Errors of episode files.

use crate::Problem;

/// Maximum number of problems in a message; a file from elsewhere may have thousands.
const MAX_LISTED: usize = 8;

/// Error when an episode file is parsed or checked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EpisodeError {
    /// The file is larger than any episode.
    #[error("{source_name}: has {bytes} bytes, an episode file has at most {limit}")]
    TooLong {
        /// Name of the source, as the caller passed it.
        source_name: String,
        /// Size of the file.
        bytes: usize,
        /// Largest size that is read.
        limit: usize,
    },
    /// The JSON ends prematurely.
    #[error(
        "{source_name}: ends prematurely at line {line} column {column}; is the file truncated?"
    )]
    Truncated {
        /// Name of the source, as the caller passed it.
        source_name: String,
        /// Last line.
        line: usize,
        /// Last column.
        column: usize,
    },
    /// The content is not JSON.
    #[error("{source_name}: {field}: is not JSON: {problem}")]
    NotJson {
        /// Name of the source, as the caller passed it.
        source_name: String,
        /// Path of the field at the error; `top level` outside all fields.
        field: String,
        /// Message of the JSON parser, with line and column.
        problem: String,
    },
    /// The content is JSON of another format.
    #[error("{source_name}: format: is {found}, expected \"{expected}\"")]
    WrongFormat {
        /// Name of the source, as the caller passed it.
        source_name: String,
        /// Value of the field.
        found: String,
        /// Expected value.
        expected: &'static str,
    },
    /// The file is an episode of another version.
    #[error("{source_name}: version: is {found}, this program reads version {expected}")]
    WrongVersion {
        /// Name of the source, as the caller passed it.
        source_name: String,
        /// Value of the field.
        found: String,
        /// Expected value.
        expected: u32,
    },
    /// A field is missing, unknown, or has the wrong type.
    #[error("{source_name}: {field}: {problem}")]
    Field {
        /// Name of the source, as the caller passed it.
        source_name: String,
        /// Path of the field, for example `setup.things[3].position[1]`.
        field: String,
        /// Problem and expected value.
        problem: String,
    },
    /// All fields parse, but the episode cannot be played.
    #[error("{source_name}: {}", join_problems(problems))]
    Invalid {
        /// Name of the source, as the caller passed it.
        source_name: String,
        /// All problems; at least one.
        problems: Vec<Problem>,
    },
}

impl EpisodeError {
    /// Converts an error of the JSON parser; `field_of` returns the field at the error.
    pub(super) fn from_syntax(
        source_name: &str,
        error: &serde_json::Error,
        field_of: impl Fn() -> String,
    ) -> EpisodeError {
        let source_name = source_name.to_owned();
        match error.classify() {
            serde_json::error::Category::Eof => {
                EpisodeError::Truncated { source_name, line: error.line(), column: error.column() }
            }
            // JSON that is no object, or repeats a field.
            serde_json::error::Category::Data => EpisodeError::Field {
                source_name,
                field: super::TOP_LEVEL.to_owned(),
                problem: error.to_string(),
            },
            _ => {
                let (field, problem) = (field_of(), error.to_string());
                EpisodeError::NotJson { source_name, field, problem }
            }
        }
    }
}

fn join_problems(problems: &[Problem]) -> String {
    let mut lines: Vec<String> = problems.iter().take(MAX_LISTED).map(|p| p.to_string()).collect();
    if problems.len() > MAX_LISTED {
        lines.push(format!("and {} more", problems.len() - MAX_LISTED));
    }
    lines.join("; ")
}

/// Returns at most 60 characters of an untrusted value.
pub(super) fn truncated(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
