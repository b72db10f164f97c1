//! The journal of a run: a line for each finished episode run, on the disk before the next begins.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use chaic_env::trace::Warning;
use chaic_env::{EnvError, RunKey};
use chaic_protocol::Frame;

use crate::error::{EvalError, Result};
use crate::metrics::RunResult;
use crate::run::items::Item;

/// A journal that is open for appending.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
}

impl Journal {
    /// Opens or begins a journal of these episode runs, and reads what is in it. A torn last record
    /// is cut off.
    ///
    /// # Errors
    /// If the file system refuses, and those of [`read_results`].
    pub fn open(path: &Path, planned: &[Item]) -> Result<(Journal, Vec<RunResult>, Vec<Warning>)> {
        let refused = || EvalError::io("open", path);
        let file = File::options().create(true).append(true).open(path).map_err(refused())?;
        let (results, warnings, whole) = read(path, planned)?;
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
/// Where an episode run occurs again, its last result holds. `planned` is all that the run plays;
/// empty where nobody knows.
///
/// # Errors
/// If the file can't be read, or a record is damaged otherwise than by a crash while it was written,
/// has numbers that can't be, or is of an episode run that isn't planned.
pub fn read_results(path: &Path, planned: &[Item]) -> Result<(Vec<RunResult>, Vec<Warning>)> {
    let (results, warnings, _) = read(path, planned)?;
    Ok((results, warnings))
}

/// Also returns how many bytes are whole.
fn read(path: &Path, planned: &[Item]) -> Result<(Vec<RunResult>, Vec<Warning>, u64)> {
    let bytes = match fs::read(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => Vec::new(),
        other => other.map_err(EvalError::io("read", path))?,
    };
    let horizons: BTreeMap<&RunKey, Frame> = planned.iter().map(|i| (&i.key, i.horizon)).collect();
    let mut results: BTreeMap<RunKey, RunResult> = BTreeMap::new();
    let mut warnings = Vec::new();
    let mut whole = 0;
    for (k, line) in bytes.split_inclusive(|b| *b == b'\n').enumerate() {
        let (path, number) = (path.to_owned(), k + 1);
        match parse(line).and_then(|result| check(&result, &horizons).map(|()| result)) {
            Ok(result) => {
                whole += line.len();
                results.insert(result.key.clone(), result);
            }
            Err(problem) if whole + line.len() == bytes.len() && is_torn(line) => {
                warnings.push(Warning::Torn { path, line: number, problem });
            }
            Err(problem) => return Err(EnvError::Unreadable { path, line: number, problem }.into()),
        }
    }
    Ok((results.into_values().collect(), warnings, whole as u64))
}

fn parse(line: &[u8]) -> std::result::Result<RunResult, String> {
    let text = line.strip_suffix(b"\n").ok_or("is cut off")?;
    serde_json::from_slice(text).map_err(|e| {
        // Its own line number is always 1, and a wrong value has no column.
        let said = e.to_string();
        let what = said.split(" at line ").next().unwrap_or_default();
        if e.is_data() { what.to_owned() } else { format!("{what}, at column {}", e.column()) }
    })
}

/// Whether a crash can have left this as the last line: without its end, or with blocks that never
/// came to the disk.
fn is_torn(line: &[u8]) -> bool {
    !line.ends_with(b"\n") || line.contains(&0)
}

fn check(
    result: &RunResult,
    horizons: &BTreeMap<&RunKey, Frame>,
) -> std::result::Result<(), String> {
    result.check()?;
    let RunKey { task, helper, episode, seed } = &result.key;
    let horizon = match horizons.get(&result.key) {
        Some(horizon) => *horizon,
        None if horizons.is_empty() => return Ok(()),
        None => {
            let what = format!("{episode} ({task}) with helper {helper} and seed {seed}");
            return Err(format!("is of {what}, which this run doesn't play"));
        }
    };
    match result.summary() {
        Some(summary) if summary.frames > horizon => {
            let n = summary.frames;
            Err(format!("`frames` is {n}, expected at most {horizon}, the episode's horizon"))
        }
        _ => Ok(()),
    }
}
