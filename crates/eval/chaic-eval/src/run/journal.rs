//! The journal of a run: a line for each finished episode run, on the disk before the next begins.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};

use chaic_core::Frame;
use chaic_env::trace::Warning;
use chaic_env::{EnvError, RunKey};
use chaic_files::{open_file, open_to_append, write_whole};

use crate::error::{EvalError, Result};
use crate::metrics::RunResult;
use crate::run::items::Item;
use crate::run::unique_names;

/// Maximum length of a line, bytes: a hundred times the line of a long episode, and enough for the longest
/// error message that is recorded, with every character escaped.
const MAX_LINE_BYTES: u64 = 8 << 20;

/// A journal that is open for appending.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
    /// True if a later line replaces the finished result of an episode run.
    is_repetitive: bool,
}

/// Content of a journal.
#[derive(Debug, Default)]
pub(crate) struct JournalContents {
    /// Last result of each episode run.
    pub results: Vec<RunResult>,
    /// Warnings about incomplete records.
    pub warnings: Vec<Warning>,
    /// Episode runs whose finished result is replaced by a later line, with the number of the later line.
    pub repeated: Vec<(usize, RunKey)>,
    /// Total length of the complete lines, bytes.
    whole: u64,
}

impl Journal {
    /// Opens or begins a journal of these episode runs, and reads what is in it. A torn last record
    /// is cut off.
    ///
    /// # Errors
    /// If the file system refuses, and those of [`read_results`].
    pub fn open(path: &Path, planned: &[Item]) -> Result<(Journal, Vec<RunResult>, Vec<Warning>)> {
        let JournalContents { results, warnings, repeated, whole } = read_journal(path, planned)?;
        let file = open_to_append(path)?;
        file.set_len(whole).map_err(EvalError::io("open", path))?;
        let is_repetitive = !repeated.is_empty();
        Ok((Journal { file, path: path.to_owned(), is_repetitive }, results, warnings))
    }

    /// Appends a result, and returns when it is on the disk.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn append(&mut self, result: &RunResult) -> Result<()> {
        let line = line_of(result) + "\n";
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(EvalError::io("write", &self.path))
    }

    /// Records that a result appended next replaces a finished one.
    pub(crate) fn expect_repetition(&mut self) {
        self.is_repetitive = true;
    }

    /// Rewrites the journal with these results if later lines in it replace finished results.
    ///
    /// # Errors
    /// If the file system refuses. The journal is unchanged then.
    pub(crate) fn compact<'r>(
        &mut self,
        results: impl Iterator<Item = &'r RunResult>,
    ) -> Result<()> {
        if !self.is_repetitive {
            return Ok(());
        }
        let lines: String = results.map(|result| line_of(result) + "\n").collect();
        write_whole(&self.path, lines.as_bytes())?;
        self.file = open_to_append(&self.path)?;
        self.is_repetitive = false;
        Ok(())
    }
}

/// Returns a result as a line of the journal, without the line break.
pub(crate) fn line_of(result: &RunResult) -> String {
    serde_json::to_string(result).expect("a result has string keys")
}

/// The results in a journal, up to its last whole record; where that isn't all, a warning says so.
/// Where an episode run occurs again, its last result holds. `planned` is all that the run plays;
/// empty where nobody knows.
///
/// # Errors
/// If the file can't be read, or a record is damaged otherwise than by a crash while it was written,
/// has numbers that can't be, or is of an episode run that isn't planned.
pub fn read_results(path: &Path, planned: &[Item]) -> Result<(Vec<RunResult>, Vec<Warning>)> {
    let contents = read_journal(path, planned)?;
    Ok((contents.results, contents.warnings))
}

/// Reads a journal like [`read_results`], and reports replaced results.
///
/// # Errors
/// As [`read_results`].
pub(crate) fn read_journal(path: &Path, planned: &[Item]) -> Result<JournalContents> {
    let file = match open_file(path) {
        Err(e) if e.refusal.kind() == ErrorKind::NotFound => return Ok(JournalContents::default()),
        other => other?,
    };
    let mut reader = BufReader::new(file);
    let horizons: BTreeMap<&RunKey, Frame> = planned.iter().map(|i| (&i.key, i.horizon)).collect();
    let mut results: BTreeMap<RunKey, RunResult> = BTreeMap::new();
    let mut contents = JournalContents::default();
    for number in 1.. {
        let mut line = Vec::new();
        let read = (&mut reader).take(MAX_LINE_BYTES + 1).read_until(b'\n', &mut line);
        if read.map_err(EvalError::io("read", path))? == 0 {
            break;
        }
        let path = path.to_owned();
        if line.len() as u64 > MAX_LINE_BYTES {
            let problem = format!("is longer than {MAX_LINE_BYTES} bytes, no result is");
            return Err(EnvError::Unreadable { path, line: number, problem }.into());
        }
        let is_last = reader.fill_buf().map_err(EvalError::io("read", &path))?.is_empty();
        match parse(&line).and_then(|result| check(&result, &horizons).map(|()| result)) {
            Ok(result) => {
                contents.whole += line.len() as u64;
                let before = results.insert(result.key.clone(), result);
                if let Some(before) = before.filter(|before| before.summary().is_some()) {
                    contents.repeated.push((number, before.key));
                }
            }
            Err(problem) if is_last && is_torn(&line) => {
                contents.warnings.push(Warning::Torn { path, line: number, problem });
            }
            Err(problem) => return Err(EnvError::Unreadable { path, line: number, problem }.into()),
        }
    }
    contents.results = results.into_values().collect();
    Ok(contents)
}

fn parse(line: &[u8]) -> std::result::Result<RunResult, String> {
    let text = line.strip_suffix(b"\n").ok_or("is cut off")?;
    unique_names::check(text)?;
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
