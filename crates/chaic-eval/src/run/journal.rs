//! The journal of a run: a line for each finished episode run, on the disk before the next begins.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use crate::error::{EvalError, Result};
use crate::metrics::{RunKey, RunResult};
use crate::trace::Warning;

/// A journal that is open for appending.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
}

impl Journal {
    /// Opens or begins a journal, and reads what is in it. A torn last record is cut off.
    ///
    /// # Errors
    /// If the file system refuses, or a record that isn't the last one is damaged.
    pub fn open(path: &Path) -> Result<(Journal, Vec<RunResult>, Vec<Warning>)> {
        let refused = || EvalError::io("open", path);
        let file = File::options().create(true).append(true).open(path).map_err(refused())?;
        let (results, warnings, whole) = read(path)?;
        file.set_len(whole).map_err(refused())?;
        Ok((Journal { file, path: path.to_owned() }, results, warnings))
    }

    /// Appends a result, and returns when it is on the disk.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn append(&mut self, result: &RunResult) -> Result<()> {
        let line = serde_json::to_string(result).expect("a result has string keys") + "\n";
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(EvalError::io("write", &self.path))
    }
}

/// The results in a journal, up to its last whole record; where that isn't all, a warning says so.
/// Where an episode run occurs again, its last result holds.
///
/// # Errors
/// If the file can't be read, a record that isn't the last one is damaged, or any has numbers that
/// can't be.
pub fn read_results(path: &Path) -> Result<(Vec<RunResult>, Vec<Warning>)> {
    let (results, warnings, _) = read(path)?;
    Ok((results, warnings))
}

/// Also returns how many bytes are whole.
fn read(path: &Path) -> Result<(Vec<RunResult>, Vec<Warning>, u64)> {
    let bytes = match fs::read(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => Vec::new(),
        other => other.map_err(EvalError::io("read", path))?,
    };
    let mut results: BTreeMap<RunKey, RunResult> = BTreeMap::new();
    let mut warnings = Vec::new();
    let mut whole = 0;
    for (k, line) in bytes.split_inclusive(|b| *b == b'\n').enumerate() {
        let is_last = whole + line.len() == bytes.len();
        let parsed = match line.strip_suffix(b"\n") {
            None => Err("is cut off".to_owned()),
            Some(text) => serde_json::from_slice::<RunResult>(text).map_err(|e| e.to_string()),
        };
        match parsed {
            Ok(result) => {
                if let Err(problem) = result.check() {
                    let (path, line) = (path.to_owned(), k + 1);
                    return Err(EvalError::Unreadable { path, line, problem });
                }
                whole += line.len();
                results.insert(result.key.clone(), result);
            }
            Err(problem) if is_last => {
                warnings.push(Warning::Torn { path: path.to_owned(), line: k + 1, problem });
            }
            Err(problem) => {
                return Err(EvalError::Unreadable { path: path.to_owned(), line: k + 1, problem });
            }
        }
    }
    Ok((results.into_values().collect(), warnings, whole as u64))
}
