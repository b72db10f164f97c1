//! Files of traces: written to `NAME.partial`, which becomes `NAME` when the trace is whole.

use std::fs::{self, File};
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use chaic_env::trace::{Header, MAX_TRACE_BYTES, Record, Trace, Warning, parse};
use chaic_files::{create_fresh, make_folders_below, read_below, read_bounded};

use crate::error::{EvalError, Result};

/// Reads a trace up to its last whole record, and says so where that isn't all.
///
/// # Errors
/// If the file is a link or no regular file, can't be read at all, has no whole header, or is of another
/// format or version.
pub fn read(path: &Path) -> Result<(Trace, Vec<Warning>)> {
    // One byte more than the limit tells a file at the limit from a longer one.
    let bytes = read_bounded(path, MAX_TRACE_BYTES + 1)?;
    Ok(parse(&bytes, path)?)
}

/// Returns the bytes of a trace below the folder of its run, to be [parsed](parse).
///
/// # Errors
/// If the file can't be read, is no regular file, or is reached through a link inside the run.
pub(crate) fn bytes(run: &Path, path: &Path) -> Result<Vec<u8>> {
    Ok(read_below(run, path, MAX_TRACE_BYTES + 1)?)
}

/// Compares a file with the output of [`Writer`] for the trace that was parsed from it. Returns the number of
/// the first line that differs, from 1; `None` if all bytes are equal.
pub(crate) fn first_foreign_line(trace: &Trace, bytes: &[u8]) -> Option<usize> {
    let mut lines = bytes.split_inclusive(|b| *b == b'\n');
    let header = std::iter::once(trace.header.to_line());
    let written = header.chain(trace.records.iter().map(Record::to_line));
    let mut n = 0;
    for line in written {
        n += 1;
        if lines.next().and_then(|l| l.strip_suffix(b"\n")) != Some(line.as_bytes()) {
            return Some(n);
        }
    }
    lines.next().map(|_| n + 1)
}

/// Appends records to a trace file.
#[derive(Debug)]
pub struct Writer {
    file: BufWriter<File>,
    partial: PathBuf,
    path: PathBuf,
}

impl Writer {
    /// Begins the trace at `path` below the folder `run`. Creates missing folders, and replaces an older
    /// partial trace.
    ///
    /// # Errors
    /// If a folder between `run` and the trace is a link, or the file system refuses.
    pub fn create(run: &Path, path: &Path, header: &Header) -> Result<Writer> {
        make_folders_below(run, path.parent().unwrap_or(run))?;
        let partial = partial_path(path);
        let file = create_fresh(&partial).map_err(EvalError::io("create", &partial))?;
        let mut writer = Writer { file: BufWriter::new(file), partial, path: path.to_owned() };
        writer.line(&header.to_line())?;
        Ok(writer)
    }

    /// Appends a record.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write(&mut self, record: &Record) -> Result<()> {
        self.line(&record.to_line())
    }

    /// Ends the trace, makes sure that it is on the disk, and gives it its name.
    ///
    /// # Errors
    /// If the file system refuses; what was written stays under the partial name.
    pub fn finish(self) -> Result<()> {
        let refused = EvalError::io("write", &self.partial);
        let file = self.file.into_inner().map_err(|e| e.into_error());
        file.and_then(|f| f.sync_all()).map_err(refused)?;
        fs::rename(&self.partial, &self.path).map_err(EvalError::io("rename", &self.partial))
    }

    /// Gives the trace up and removes what was written.
    pub fn discard(self) {
        // A leftover is harmless: the next writer replaces it, and readers ignore the name.
        let _ = fs::remove_file(&self.partial);
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
    use chaic_env::rules::RuleSet;
    use chaic_env::{Appearance, EpisodeConfig, header_of};
    use chaic_episodes::find_episode;

    use super::*;

    #[test]
    fn a_trace_has_its_name_only_when_it_is_whole() {
        let episode = find_episode("shopping/test/01").unwrap();
        let config = EpisodeConfig {
            episode: &episode,
            seed: 0,
            rules: RuleSet::PAPER,
            helper: "none",
            partner: None,
            image_size: None,
            appearance: Appearance::Canonical,
        };
        let header = header_of(config, None).unwrap();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a/b/t.jsonl");
        let writer = Writer::create(dir.path(), &path, &header).unwrap();
        assert!(!path.exists());
        writer.finish().unwrap();
        let (trace, warnings) = read(&path).unwrap();
        assert_eq!((trace.header, trace.records.len()), (header, 0));
        assert_eq!(warnings, [Warning::NoEnd { path, records: 0 }]);
    }
}
