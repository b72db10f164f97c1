//! Writing a trace: to `NAME.partial`, which becomes `NAME` when the trace is whole.

use std::fs::{self, File};
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use crate::error::{EvalError, Result};
use crate::trace::{Header, Record};

/// Appends records to a trace file.
#[derive(Debug)]
pub struct Writer {
    file: BufWriter<File>,
    partial: PathBuf,
    path: PathBuf,
}

impl Writer {
    /// Begins the trace at `path`; folders are made as needed, an older partial trace is replaced.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn create(path: &Path, header: &Header) -> Result<Writer> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(EvalError::io("make the folder", folder))?;
        }
        let partial = partial_path(path);
        let file = File::create(&partial).map_err(EvalError::io("create", &partial))?;
        let mut writer = Writer { file: BufWriter::new(file), partial, path: path.to_owned() };
        let header = serde_json::to_string(header).expect("a header has string keys");
        writer.line(&header)?;
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
