//! Files that are open for writing.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::faults::{Operation, perform, perform_write};

/// File that is open for writing.
#[derive(Debug)]
pub struct OutputFile {
    file: File,
    path: PathBuf,
}

impl OutputFile {
    pub(crate) fn new(file: File, path: &Path) -> OutputFile {
        OutputFile { file, path: path.to_owned() }
    }

    /// Returns the file of the operating system.
    pub(crate) fn as_file(&self) -> &File {
        &self.file
    }

    /// Returns whether the path still refers to this file. Another process may have removed or
    /// renamed the file, or created another file of this name.
    #[cfg(unix)]
    pub(crate) fn has_its_name(&self) -> io::Result<bool> {
        use std::io::ErrorKind;
        use std::os::unix::fs::MetadataExt as _;
        let own = self.file.metadata()?;
        match std::fs::symlink_metadata(&self.path) {
            Ok(found) => Ok((found.dev(), found.ino()) == (own.dev(), own.ino())),
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(false),
            Err(e) => Err(e),
        }
    }

    /// Other systems have no portable identity of files.
    #[cfg(not(unix))]
    pub(crate) fn has_its_name(&self) -> io::Result<bool> {
        Ok(true)
    }

    /// Truncates or extends the file to a length in bytes.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn set_len(&self, len: u64) -> io::Result<()> {
        perform(Operation::SetLength, &self.path, || self.file.set_len(len))
    }

    /// Flushes content and metadata to the device.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn sync_all(&self) -> io::Result<()> {
        perform(Operation::Sync, &self.path, || self.file.sync_all())
    }

    /// Flushes the content to the device, with the metadata that is required to read it.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn sync_data(&self) -> io::Result<()> {
        perform(Operation::Sync, &self.path, || self.file.sync_data())
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut file = &self.file;
        perform_write(&self.path, &self.file, bytes, |bytes| file.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for OutputFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.file.seek(position)
    }
}
