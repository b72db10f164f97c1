//! Journal of a run: one line per finished episode run, synced to disk before the run counts as
//! finished.

use std::collections::BTreeMap;
use std::io::{self, BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};

use chaic_core::Frame;
use chaic_env::trace::TraceWarning;
use chaic_env::{EnvError, RunKey};
use chaic_files::{OutputFile, open_file, open_for_append, write_atomically};

use crate::error::{EvalError, Result};
use crate::metrics::RunResult;
use crate::run::plan::EpisodeJob;
use crate::run::unique_names;

/// Maximum length of a line, bytes: a hundred times the line of a long episode, and enough for the
/// longest recorded error message with every character escaped.
const MAX_LINE_BYTES: u64 = 8 << 20;

/// A journal that is open for appending.
#[derive(Debug)]
pub struct Journal {
    file: OutputFile,
    path: PathBuf,
    /// Total length of the complete lines, bytes.
    complete_len: u64,
    /// True if a failed write may have left a part of a line after the complete ones.
    has_fragment: bool,
    /// True if a later line replaces the finished result of an episode run.
    has_duplicates: bool,
}

/// Content of a journal.
#[derive(Debug, Default)]
pub(crate) struct JournalContents {
    /// Last result of each episode run.
    pub results: Vec<RunResult>,
    /// Warnings about incomplete records.
    pub warnings: Vec<TraceWarning>,
    /// Episode runs whose finished result is replaced by a later line, with its number.
    pub repeated: Vec<(usize, RunKey)>,
    /// Total length of the complete lines, bytes.
    complete_len: u64,
}

impl Journal {
    /// Opens or creates a journal and reads its results. Removes an incomplete last record.
    ///
    /// # Errors
    /// If an I/O operation fails, and those of [`read_results`].
    pub fn open(
        path: &Path,
        planned: &[EpisodeJob],
    ) -> Result<(Journal, Vec<RunResult>, Vec<TraceWarning>)> {
        let JournalContents { results, warnings, repeated, complete_len } =
            read_journal(path, planned)?;
        let file = open_for_append(path)?;
        file.set_len(complete_len).map_err(EvalError::io("open", path))?;
        let (path, has_duplicates) = (path.to_owned(), !repeated.is_empty());
        let journal = Journal { file, path, complete_len, has_fragment: false, has_duplicates };
        Ok((journal, results, warnings))
    }

    /// Appends a result and syncs it to disk.
    ///
    /// # Errors
    /// If the file can't be written. The result is then not in the journal, and others can be
    /// appended.
    pub fn append(&mut self, result: &RunResult) -> Result<()> {
        self.remove_fragment().map_err(EvalError::io("write", &self.path))?;
        let line = to_line(result) + "\n";
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.sync_data());
        self.finish_append(line.len() as u64, written)
    }

    /// Counts a written line, or removes what a failed write has left of it.
    fn finish_append(&mut self, line_len: u64, written: io::Result<()>) -> Result<()> {
        match written {
            Ok(()) => self.complete_len += line_len,
            Err(_) => {
                self.has_fragment = true;
                // If this fails as well, the next append tries it again.
                let _ = self.remove_fragment();
            }
        }
        written.map_err(EvalError::io("write", &self.path))
    }

    /// Truncates the file to its complete lines if a write has failed.
    fn remove_fragment(&mut self) -> io::Result<()> {
        if self.has_fragment {
            self.file.set_len(self.complete_len)?;
            self.has_fragment = false;
        }
        Ok(())
    }

    /// Records that a result appended next replaces a finished one.
    pub(crate) fn mark_duplicate(&mut self) {
        self.has_duplicates = true;
    }

    /// Rewrites the journal with these results if later lines in it replace finished results.
    ///
    /// # Errors
    /// If an I/O operation fails. The journal is then unchanged.
    pub(crate) fn compact(&mut self, results: &[RunResult]) -> Result<()> {
        if !self.has_duplicates {
            return Ok(());
        }
        let lines: String = results.iter().map(|result| to_line(result) + "\n").collect();
        write_atomically(&self.path, lines.as_bytes())?;
        self.file = open_for_append(&self.path)?;
        self.complete_len = lines.len() as u64;
        (self.has_fragment, self.has_duplicates) = (false, false);
        Ok(())
    }
}

/// Returns a result as a line of the journal, without the line break.
pub(crate) fn to_line(result: &RunResult) -> String {
    serde_json::to_string(result).expect("a result has string keys")
}

/// Reads the results of a journal up to its last complete record; a warning reports an incomplete
/// one. The last result of an episode run replaces earlier ones. An empty `planned` means that the
/// plan is unknown.
///
/// # Errors
/// If the file can't be read, or a record has invalid values or an unplanned episode run. A damaged
/// record is an error unless a crash during a write explains it.
pub fn read_results(
    path: &Path,
    planned: &[EpisodeJob],
) -> Result<(Vec<RunResult>, Vec<TraceWarning>)> {
    let contents = read_journal(path, planned)?;
    Ok((contents.results, contents.warnings))
}

/// Reads a journal like [`read_results`], and reports replaced results.
///
/// # Errors
/// As [`read_results`].
pub(crate) fn read_journal(path: &Path, planned: &[EpisodeJob]) -> Result<JournalContents> {
    let file = match open_file(path) {
        Err(e) if e.error.kind() == ErrorKind::NotFound => return Ok(JournalContents::default()),
        other => other?,
    };
    let mut reader = BufReader::new(file);
    let horizons: BTreeMap<&RunKey, Frame> =
        planned.iter().map(|job| (&job.key, job.horizon)).collect();
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
            let problem = format!("is longer than {MAX_LINE_BYTES} bytes, the limit of a result");
            return Err(EnvError::Unreadable { path, line: number, problem }.into());
        }
        let is_last = reader.fill_buf().map_err(EvalError::io("read", &path))?.is_empty();
        match parse(&line).and_then(|result| check(&result, &horizons).map(|()| result)) {
            Ok(result) => {
                contents.complete_len += line.len() as u64;
                let replaced = results.insert(result.key.clone(), result);
                if let Some(replaced) = replaced.filter(|r| r.summary().is_some()) {
                    contents.repeated.push((number, replaced.key));
                }
            }
            Err(problem) if is_last && is_torn(&line) => {
                contents.warnings.push(TraceWarning::Torn { path, line: number, problem });
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
        // The line number in the message is always 1, and a wrong value has no column.
        let text = e.to_string();
        let problem = text.split(" at line ").next().unwrap_or_default();
        if e.is_data() {
            problem.to_owned()
        } else {
            format!("{problem}, at column {}", e.column())
        }
    })
}

/// Returns whether a crash can have caused this last line: it is cut off, or has blocks that were
/// not written.
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

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::metrics::tests::{case, result};

    #[test]
    fn a_failed_append_leaves_no_fragment_before_the_next_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("results.jsonl");
        let results = ["e0", "e1", "e2"].map(|episode| result(case("rhp", episode, 1.0, 10.0)));
        let (mut journal, _, _) = Journal::open(&path, &[]).unwrap();
        journal.append(&results[0]).unwrap();
        let complete = fs::read(&path).unwrap();
        // The disk is full in the middle of a line.
        journal.file.write_all(b"{\"task\":\"low_t").unwrap();
        let full = io::Error::from(ErrorKind::StorageFull);
        assert!(journal.finish_append(200, Err(full)).is_err());
        assert_eq!(fs::read(&path).unwrap(), complete);
        // The fragment could not be removed at once.
        journal.file.write_all(b"{\"task\":").unwrap();
        journal.has_fragment = true;
        for result in &results[1..] {
            journal.append(result).unwrap();
        }
        assert_eq!(read_results(&path, &[]).unwrap(), (results.to_vec(), vec![]));
    }
}
