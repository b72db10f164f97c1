//! JSON files of other projects.

use std::path::{Path, PathBuf};

use chaic_files::read_user_file;
use serde::de::DeserializeOwned;

use crate::ImportError;

/// Largest file that is read, bytes: four times the package's largest.
const MAX_BYTES: u64 = 64 << 20;

/// Parses a JSON file as written by Python: NaN and infinity are read as `null`.
pub(crate) fn read<T: DeserializeOwned>(path: &Path) -> Result<T, ImportError> {
    let text = read_text(path)?.replace(": NaN", ": null").replace(": Infinity", ": null");
    // Some editors put a byte order mark first.
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut json = serde_json::Deserializer::from_str(text);
    let value = serde_path_to_error::deserialize(&mut json).map_err(|e| {
        let field = e.path().to_string();
        ImportError::field(path, field, e.into_inner().to_string())
    })?;
    json.end().map_err(|e| ImportError::field(path, ".", e.to_string()))?;
    Ok(value)
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
