//! The configuration file of a training.

use std::path::Path;

use chaic_files::{read_bounded, read_user_file};
use serde::de::DeserializeOwned;
use toml::Table;

use crate::bounds;
use crate::run::{Training, TrainingError};

/// Largest configuration file that is read, bytes: a thousand times what the longest one has.
const MAX_BYTES: u64 = 1 << 22;

/// Reads a configuration file that a user named; keys that it does not name have their defaults.
///
/// # Errors
/// [`TrainingError::Config`] if it names unknown keys, a value is out of bounds, or an input that it names
/// cannot be used.
pub fn read_rules<T: Training>(path: &Path) -> Result<T::Rules, TrainingError> {
    of_bytes::<T>(path, &read_user_file(path, MAX_BYTES)?)
}

/// Reads the configuration in the folder of a training.
///
/// # Errors
/// As [`read_rules`], and if the file is a link.
pub(crate) fn read_own_rules<T: Training>(path: &Path) -> Result<T::Rules, TrainingError> {
    of_bytes::<T>(path, &read_bounded(path, MAX_BYTES)?)
}

fn of_bytes<T: Training>(path: &Path, bytes: &[u8]) -> Result<T::Rules, TrainingError> {
    let wrong = |problem: String| TrainingError::Config { path: path.to_owned(), problem };
    let text = std::str::from_utf8(bytes).map_err(|e| wrong(e.to_string()))?;
    parse_rules::<T>(text).map_err(wrong)
}

/// Parses the text of a configuration file.
///
/// # Errors
/// One line that says what is wrong.
pub fn parse_rules<T: Training>(text: &str) -> Result<T::Rules, String> {
    // Bounds come first: the parser would refuse -1 without naming key and bounds.
    let table: Table = parse(text)?;
    bounds::check(&table, T::BOUNDS)?;
    let rules = parse(text)?;
    T::check(&rules)?;
    Ok(rules)
}

/// Checks a configuration that no file holds yet.
///
/// # Errors
/// One line that says what is wrong.
pub fn check_rules<T: Training>(rules: &T::Rules) -> Result<(), String> {
    let table = Table::try_from(rules).map_err(|e| e.to_string())?;
    bounds::check(&table, T::BOUNDS)?;
    T::check(rules)
}

/// Returns the text of a configuration file, with the bounds of each number as a comment.
pub fn config_text<T: Training>(rules: &T::Rules) -> String {
    let text = toml::to_string(rules).expect("a checked configuration is plain data");
    bounds::annotate(&text, T::BOUNDS)
}

fn parse<R: DeserializeOwned>(text: &str) -> Result<R, String> {
    toml::from_str(text).map_err(|error| {
        let before = error.span().and_then(|span| text.get(..span.start));
        let message = error.message().replace('\n', " ");
        match before {
            Some(before) => format!("line {}: {message}", before.matches('\n').count() + 1),
            None => message,
        }
    })
}
