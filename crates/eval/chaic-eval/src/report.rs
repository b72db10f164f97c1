//! Reports of scores for people and programs.

mod coverage;
mod figure;
mod labels;
mod tables;
mod text_table;
mod write;

pub use coverage::{coverage, untraced_failures, untraced_note};
pub use figure::{drawn_interval, write_figure};
pub use labels::{Labels, RecordedGrants, title};
pub use tables::{MIN_ENVIRONMENTS, capitalized, interval, number, rounded, shown_interval};
pub use tables::{
    additional, counts, diagnostics, intervals, main_result, pairs, resolutions, run_pairs, stuck,
};
pub use text_table::TextTable;
pub(crate) use write::UNKNOWN_ENVIRONMENTS;
pub use write::{Report, csv_text, differing_files, write_files};

use std::fmt;
use std::str::FromStr;

/// Output format of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Tables for a terminal.
    Table,
    /// Markdown.
    Markdown,
    /// One line per task and helper.
    Csv,
    /// Content of `scores.json`.
    Json,
}

impl Format {
    /// Names of all formats.
    pub const NAMES: [&str; 4] = ["table", "md", "csv", "json"];
}

impl FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Format, String> {
        match text {
            "table" => Ok(Format::Table),
            "md" => Ok(Format::Markdown),
            "csv" => Ok(Format::Csv),
            "json" => Ok(Format::Json),
            _ => Err(format!("unknown format `{text}`; they are {}", Format::NAMES.join(", "))),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(Format::NAMES[*self as usize])
    }
}

#[cfg(test)]
mod tests;
