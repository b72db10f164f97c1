//! Trace files. A trace is written to `NAME.partial` and renamed to `NAME` when it is complete.

use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use chaic_env::trace::{Header, MAX_TRACE_BYTES, Record, Trace, TraceWarning, parse};
use chaic_files::{
    OutputFile, create_folders_below, create_or_replace, read_below, read_bounded, remove_file,
    rename,
};

use crate::error::{EvalError, Result};

/// Reads a trace up to its last complete record. Warnings describe what is left out.
///
/// # Errors
/// If the file is a link or no regular file, can't be read, has no complete header, or has another
/// format or version.
pub fn read(path: &Path) -> Result<(Trace, Vec<TraceWarning>)> {
    // One byte more than the limit distinguishes a file at the limit from a longer one.
    let bytes = read_bounded(path, MAX_TRACE_BYTES + 1)?;
    Ok(parse(&bytes, path)?)
}

/// Returns the bytes of a trace below the folder of its run; [`parse`] parses them.
///
/// # Errors
/// If the file can't be read, is no regular file, or is reached through a link inside the run.
pub(crate) fn bytes(run: &Path, path: &Path) -> Result<Vec<u8>> {
    Ok(read_below(run, path, MAX_TRACE_BYTES + 1)?)
}

/// Compares a file with the output of [`TraceWriter`], in the trace's version of the format, for the
/// trace that was parsed from it.
/// Returns the number of the first line that differs, from 1; `None` if all bytes are equal.
pub(crate) fn first_differing_line(trace: &Trace, bytes: &[u8]) -> Option<usize> {
    let mut lines = bytes.split_inclusive(|b| *b == b'\n');
    let mut n = 0;
    for line in trace.lines() {
        n += 1;
        if lines.next().and_then(|l| l.strip_suffix(b"\n")) != Some(line.as_bytes()) {
            return Some(n);
        }
    }
    lines.next().map(|_| n + 1)
}

/// Writer of a trace file.
#[derive(Debug)]
pub struct TraceWriter {
    file: BufWriter<OutputFile>,
    partial: PathBuf,
    path: PathBuf,
}

impl TraceWriter {
    /// Creates the trace at `path` below the folder `run` and writes the header. Creates missing
    /// folders, and replaces an older partial trace.
    ///
    /// # Errors
    /// If a folder between `run` and the trace is a link, or an I/O operation fails.
    pub fn create(run: &Path, path: &Path, header: &Header) -> Result<TraceWriter> {
        create_folders_below(run, path.parent().unwrap_or(run))?;
        let partial = partial_path(path);
        let file = create_or_replace(&partial).map_err(EvalError::io("create", &partial))?;
        let mut writer = TraceWriter { file: BufWriter::new(file), partial, path: path.to_owned() };
        writer.line(&header.to_line())?;
        Ok(writer)
    }

    /// Appends a record.
    ///
    /// # Errors
    /// If the file can't be written.
    pub fn write(&mut self, record: &Record) -> Result<()> {
        self.line(&record.to_line())
    }

    /// Syncs the trace to disk and renames it to its final name.
    ///
    /// # Errors
    /// If an I/O operation fails; the records stay in the partial file.
    pub fn finish(self) -> Result<()> {
        let convert = EvalError::io("write", &self.partial);
        let file = self.file.into_inner().map_err(|e| e.into_error());
        file.and_then(|f| f.sync_all()).map_err(convert)?;
        Ok(rename(&self.partial, &self.path)?)
    }

    /// Removes the partial trace.
    pub fn discard(self) {
        // A file that remains is harmless: the next writer replaces it, and readers ignore its
        // name.
        let _ = remove_file(&self.partial);
    }

    fn line(&mut self, line: &str) -> Result<()> {
        let written =
            self.file.write_all(line.as_bytes()).and_then(|()| self.file.write_all(b"\n"));
        written.map_err(EvalError::io("write", &self.partial))
    }
}

fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use chaic_env::{EpisodeConfig, trace_header};
    use chaic_episodes::find_episode;

    use super::*;

    #[test]
    fn a_trace_has_its_final_name_only_when_it_is_complete() {
        let episode = find_episode("shopping/test/01").unwrap();
        let config = EpisodeConfig::new(&episode, "none");
        let header = trace_header(config, None).unwrap();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a/b/t.jsonl");
        let writer = TraceWriter::create(dir.path(), &path, &header).unwrap();
        assert!(!path.exists());
        writer.finish().unwrap();
        let (trace, warnings) = read(&path).unwrap();
        assert_eq!((trace.header, trace.records.len()), (header, 0));
        assert_eq!(warnings, [TraceWarning::NoEnd { path, records: 0 }]);
    }
}
