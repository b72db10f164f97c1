//! Configuration file of a training.

use std::path::Path;

use chaic_files::{read_bounded, read_user_file};
use serde::de::DeserializeOwned;
use toml::Table;

use crate::bounds;
use crate::trainer::{Trainer, TrainingError};

/// Maximum size of a configuration file, bytes: a thousand times that of the longest one.
const MAX_BYTES: u64 = 1 << 22;

/// Reads a configuration file that a user named; missing keys get their defaults.
///
/// # Errors
/// [`TrainingError::Config`] if a key is unknown, a value is out of bounds, or an input file that it
/// names cannot be used.
pub fn read_config<T: Trainer>(path: &Path) -> Result<T::Config, TrainingError> {
    parse_bytes::<T>(path, &read_user_file(path, MAX_BYTES)?)
}

/// Reads the configuration in a training folder.
///
/// # Errors
/// As [`read_config`], and if the file is a link.
pub(crate) fn read_written_config<T: Trainer>(path: &Path) -> Result<T::Config, TrainingError> {
    parse_bytes::<T>(path, &read_bounded(path, MAX_BYTES)?)
}

fn parse_bytes<T: Trainer>(path: &Path, bytes: &[u8]) -> Result<T::Config, TrainingError> {
    let invalid = |problem: String| TrainingError::Config { path: path.to_owned(), problem };
    let text = std::str::from_utf8(bytes).map_err(|e| invalid(e.to_string()))?;
    parse_config::<T>(text).map_err(invalid)
}

/// Parses the text of a configuration file.
///
/// # Errors
/// One line that describes the problem.
pub fn parse_config<T: Trainer>(text: &str) -> Result<T::Config, String> {
    // Bounds come first: the parser would refuse -1 without naming key and bounds.
    let table: Table = parse(text)?;
    bounds::check(&table, T::BOUNDS)?;
    let config = parse(text)?;
    // The table may hold aliases, which have no bounds; the parsed configuration holds current keys.
    check_config::<T>(&config)?;
    Ok(config)
}

/// Checks a configuration that was not read from a file.
///
/// # Errors
/// One line that describes the problem.
pub fn check_config<T: Trainer>(config: &T::Config) -> Result<(), String> {
    let table = Table::try_from(config).map_err(|e| e.to_string())?;
    bounds::check(&table, T::BOUNDS)?;
    T::check(config)
}

/// Returns the text of a configuration file, with the bounds of each number as a comment.
pub fn config_text<T: Trainer>(config: &T::Config) -> String {
    let text = toml::to_string(config).expect("a checked configuration serializes to TOML");
    bounds::annotate(&text, T::BOUNDS)
}

fn parse<R: DeserializeOwned>(text: &str) -> Result<R, String> {
    toml::from_str(text).map_err(|error| {
        let before = error.span().and_then(|span| text.get(..span.start));
        let mut message = error.message().replace('\n', " ");
        // A key that occurs twice under one name is called a duplicate key.
        if message.starts_with("duplicate field") {
            message += ": it is set under its current and under its old name; remove one";
        }
        match before {
            Some(before) => format!("line {}: {message}", before.matches('\n').count() + 1),
            None => message,
        }
    })
}
