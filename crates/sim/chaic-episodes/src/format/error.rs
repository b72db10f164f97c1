//! What can be wrong with an episode file.

use crate::Problem;

/// Most problems that a message lists; a file from elsewhere may have thousands.
const MAX_LISTED: usize = 8;

/// Why something isn't an episode.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EpisodeError {
    /// More bytes than any episode has.
    #[error("{source_name}: has {bytes} bytes, an episode file has at most {limit}")]
    TooLong {
        /// What the caller called the bytes.
        source_name: String,
        /// How many there are.
        bytes: usize,
        /// How many are read.
        limit: usize,
    },
    /// The bytes end in the middle.
    #[error(
        "{source_name}: ends too early, at line {line} column {column}; is the file truncated?"
    )]
    Truncated {
        /// What the caller called the bytes.
        source_name: String,
        /// Last line.
        line: usize,
        /// Last column.
        column: usize,
    },
    /// The bytes aren't JSON.
    #[error("{source_name}: {field}: isn't JSON: {problem}")]
    NotJson {
        /// What the caller called the bytes.
        source_name: String,
        /// Path of the field that is read there, `top level` outside all fields.
        field: String,
        /// What the JSON reader says, with line and column.
        problem: String,
    },
    /// It is JSON, but of something else.
    #[error("{source_name}: format: is {found}, expected \"{expected}\"")]
    WrongFormat {
        /// What the caller called the bytes.
        source_name: String,
        /// What the field says.
        found: String,
        /// What it should say.
        expected: &'static str,
    },
    /// It is an episode of another version.
    #[error("{source_name}: version: is {found}, this program reads version {expected}")]
    WrongVersion {
        /// What the caller called the bytes.
        source_name: String,
        /// What the field says.
        found: String,
        /// What it should say.
        expected: u32,
    },
    /// A field is missing, unknown, or of the wrong kind.
    #[error("{source_name}: {field}: {problem}")]
    Field {
        /// What the caller called the bytes.
        source_name: String,
        /// Path of the field, for example `setup.things[3].position[1]`.
        field: String,
        /// What is wrong, and what was expected.
        problem: String,
    },
    /// Every field fits, but the episode can't be played.
    #[error("{source_name}: {}", listed(problems))]
    Invalid {
        /// What the caller called the bytes.
        source_name: String,
        /// Everything that is wrong; at least one.
        problems: Vec<Problem>,
    },
}

impl EpisodeError {
    /// What the JSON reader says; `field_of` finds the field that it was about to read.
    pub(super) fn of_syntax(
        source_name: &str,
        error: &serde_json::Error,
        field_of: impl Fn() -> String,
    ) -> EpisodeError {
        let source_name = source_name.to_owned();
        match error.classify() {
            serde_json::error::Category::Eof => {
                EpisodeError::Truncated { source_name, line: error.line(), column: error.column() }
            }
            _ => {
                let (field, problem) = (field_of(), error.to_string());
                EpisodeError::NotJson { source_name, field, problem }
            }
        }
    }
}

fn listed(problems: &[Problem]) -> String {
    let mut lines: Vec<String> = problems.iter().take(MAX_LISTED).map(|p| p.to_string()).collect();
    if problems.len() > MAX_LISTED {
        lines.push(format!("and {} more", problems.len() - MAX_LISTED));
    }
    lines.join("; ")
}

/// At most 60 characters of what a stranger's file says.
pub(super) fn shortened(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
