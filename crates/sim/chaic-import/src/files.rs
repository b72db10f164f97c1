//! JSON files of other projects.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use chaic_files::read_user_file;
use serde::de::DeserializeOwned;

use crate::ImportError;

/// Largest file that is read, bytes: four times the package's largest.
const MAX_BYTES: u64 = 64 << 20;

/// Numbers that Python writes and JSON does not have; a word comes before its parts.
const NON_FINITE: [&str; 3] = ["-Infinity", "Infinity", "NaN"];

/// Parses a JSON file as written by Python: NaN and infinity are read as `null`.
pub(crate) fn read<T: DeserializeOwned>(path: &Path) -> Result<T, ImportError> {
    let text = read_text(path)?;
    // Some editors put a byte order mark first.
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let finite = without_non_finite(text);
    let mut json = serde_json::Deserializer::from_str(&finite);
    let value = serde_path_to_error::deserialize(&mut json).map_err(|e| {
        let field = e.path().to_string();
        let problem = e.into_inner().to_string();
        let is_replaced = matches!(finite, Cow::Owned(_));
        let null = if is_replaced { "null, NaN or infinity" } else { "null" };
        ImportError::field(path, field, problem.replacen("null", null, 1))
    })?;
    json.end().map_err(|e| ImportError::field(path, ".", e.to_string()))?;
    Ok(value)
}

/// Replaces [`NON_FINITE`] numbers by `null`. Strings stay as they are.
fn without_non_finite(text: &str) -> Cow<'_, str> {
    if !NON_FINITE.iter().any(|number| text.contains(number)) {
        return Cow::Borrowed(text);
    }
    let mut finite = String::with_capacity(text.len());
    let mut rest = text;
    while !rest.is_empty() {
        let (numbers, others) = rest.split_at(rest.find('"').unwrap_or(rest.len()));
        if numbers.contains(['N', 'I']) {
            let replace = |text: String, number: &&str| text.replace(number, "null");
            finite += &NON_FINITE.iter().fold(numbers.to_owned(), replace);
        } else {
            finite += numbers;
        }
        let (string, behind) = others.split_at(string_length(others));
        finite += string;
        rest = behind;
    }
    Cow::Owned(finite)
}

/// Returns the length of the JSON string at the start of a text, with its quotes; without an end, that of the text.
fn string_length(text: &str) -> usize {
    let mut is_escaped = false;
    for (k, byte) in text.bytes().enumerate().skip(1) {
        match byte {
            b'"' if !is_escaped => return k + 1,
            b'\\' => is_escaped = !is_escaped,
            _ => is_escaped = false,
        }
    }
    text.len()
}

/// Reads a text file.
pub(crate) fn read_text(path: &Path) -> Result<String, ImportError> {
    let fail = |problem: &dyn std::fmt::Display| {
        ImportError::unreadable(path, format!("cannot be read: {problem}"))
    };
    let bytes = read_user_file(path, MAX_BYTES + 1).map_err(|e| fail(&e.error))?;
    if bytes.len() as u64 > MAX_BYTES {
        let problem = format!("has more than {MAX_BYTES} bytes");
        return Err(ImportError::unreadable(path, problem));
    }
    String::from_utf8(bytes).map_err(|e| fail(&e))
}

/// Returns the first folder that exists.
pub(crate) fn first_folder(candidates: impl IntoIterator<Item = PathBuf>) -> Option<PathBuf> {
    candidates.into_iter().find(|p| p.is_dir())
}

/// Returns whether a word from a file is safe as part of a file name: it cannot lead to another
/// folder.
pub(crate) fn is_plain(word: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    !word.is_empty() && word.len() <= 64 && word.chars().all(plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_python_are_replaced_outside_of_strings() {
        for (text, expected) in [
            ("[NaN,-Infinity, Infinity]", "[null,null, null]"),
            ("{\"a: NaN\": NaN}", "{\"a: NaN\": null}"),
            ("[\"\\\"NaN\", \"\\\\\",NaN]", "[\"\\\"NaN\", \"\\\\\",null]"),
            ("[\"Infinity", "[\"Infinity"),
            ("[\"Icy\", 1.5]", "[\"Icy\", 1.5]"),
            ("", ""),
        ] {
            assert_eq!(without_non_finite(text), expected);
        }
    }
}
