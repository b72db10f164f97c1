//! Temporary files of atomic writes.

use std::fs::{self, TryLockError};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::faults::perform_rename;
use crate::{EntryKind, OutputFile, kind, open, remove_file, with_suffix};

/// Suffix of temporary files.
pub const TEMPORARY_SUFFIX: &str = ".tmp";

/// Maximum number of writers of one file at the same time: more than the cores of most machines.
const MAX_WRITERS: usize = 256;

/// Temporary file that replaces another file of its folder when it is complete. If it is dropped
/// before, it is removed.
///
/// Its name is `NAME.tmp`, or `NAME.K.tmp` while other writers replace the same file. Each writer
/// holds a lock on its temporary file. The file of a killed writer has no lock, and the next writer
/// replaces it.
#[derive(Debug)]
pub struct TemporaryFile {
    file: OutputFile,
    path: PathBuf,
    target: PathBuf,
    is_renamed: bool,
}

impl TemporaryFile {
    /// Creates an empty temporary file beside `target`. A link of its name is replaced, not followed.
    ///
    /// # Errors
    /// If a folder has its name, too many processes write `target`, or the file system refuses.
    pub fn beside(target: &Path) -> io::Result<TemporaryFile> {
        TemporaryFile::with_suffix(target, TEMPORARY_SUFFIX)
    }

    /// Creates an empty temporary file like [`TemporaryFile::beside`], with another suffix than
    /// [`TEMPORARY_SUFFIX`].
    ///
    /// # Errors
    /// Those of [`TemporaryFile::beside`].
    pub fn with_suffix(target: &Path, suffix: &str) -> io::Result<TemporaryFile> {
        for k in 0..MAX_WRITERS {
            let number = if k == 0 { String::new() } else { format!(".{k}") };
            let path = with_suffix(target, &format!("{number}{suffix}"));
            if let Some(file) = claim(&path)? {
                return Ok(TemporaryFile {
                    file,
                    path,
                    target: target.to_owned(),
                    is_renamed: false,
                });
            }
        }
        Err(io::Error::other("too many processes write it at the same time"))
    }

    /// Flushes the content to the device, and replaces the target.
    ///
    /// # Errors
    /// If the file system refuses. The target is then unchanged.
    pub fn commit(mut self) -> io::Result<()> {
        self.file.sync_all()?;
        perform_rename(&self.path, &self.target, || fs::rename(&self.path, &self.target))?;
        self.is_renamed = true;
        Ok(())
    }
}

impl Write for TemporaryFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for TemporaryFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.file.seek(position)
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        if !self.is_renamed {
            // If the removal fails, the suffix marks the file as temporary.
            let _ = remove_file(&self.path);
        }
    }
}

/// Creates and locks a temporary file; `None` if another writer has it.
fn claim(path: &Path) -> io::Result<Option<OutputFile>> {
    let created = match kind(path).map_err(|error| error.error)? {
        EntryKind::Missing => open::create_new(path),
        EntryKind::File => {
            let abandoned = match open::open_existing(path) {
                Ok(file) => file,
                Err(e) if is_taken(&e) => return Ok(None),
                Err(e) => return Err(e),
            };
            if !try_own(&abandoned)? {
                return Ok(None);
            }
            // The lock on the abandoned file is held until another file has its name.
            open::create_or_replace(path)
        }
        _ => open::create_or_replace(path),
    };
    match created {
        Ok(file) => Ok(try_own(&file)?.then_some(file)),
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(None),
        Err(e) => Err(e),
    }
}

/// Returns whether a file cannot be opened because another writer renamed it or another user owns it.
fn is_taken(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::NotFound | ErrorKind::PermissionDenied)
}

/// Locks a file; returns whether it is locked now and still has its name. A file system without locks
/// permits one writer only.
fn try_own(file: &OutputFile) -> io::Result<bool> {
    match file.as_file().try_lock() {
        Err(TryLockError::WouldBlock) => Ok(false),
        Ok(()) | Err(TryLockError::Error(_)) => file.has_its_name(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{entries, write_atomically};

    #[test]
    fn writers_of_the_same_file_have_different_temporary_files() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        let mut first = TemporaryFile::beside(&path).unwrap();
        first.write_all(b"first").unwrap();
        let mut second = TemporaryFile::beside(&path).unwrap();
        second.write_all(b"second").unwrap();
        let dropped = TemporaryFile::beside(&path).unwrap();
        let names = ["a.txt.1.tmp", "a.txt.2.tmp", "a.txt.tmp"];
        assert_eq!(entries(dir.path()).unwrap(), names.map(|name| dir.path().join(name)));
        drop(dropped);
        second.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        first.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(entries(dir.path()).unwrap(), [path]);
    }

    #[test]
    fn the_temporary_file_of_a_killed_writer_is_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        let temporary = dir.path().join("a.txt.tmp");
        fs::write(&temporary, "half of a longer content").unwrap();
        // A second name shows that the abandoned file is not written.
        let other_name = dir.path().join("other");
        fs::hard_link(&temporary, &other_name).unwrap();
        write_atomically(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read(&other_name).unwrap(), b"half of a longer content");
        assert_eq!(entries(dir.path()).unwrap(), [path, other_name]);
    }

    #[test]
    fn writes_of_many_threads_are_complete() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        std::thread::scope(|scope| {
            for thread in 0..4u8 {
                let path = &path;
                scope.spawn(move || {
                    for _ in 0..50 {
                        write_atomically(path, &[thread; 5000]).unwrap();
                        let content = fs::read(path).unwrap();
                        assert!(content.len() == 5000 && content.iter().all(|b| *b == content[0]));
                    }
                });
            }
        });
        assert_eq!(entries(dir.path()).unwrap(), [path]);
    }
}
