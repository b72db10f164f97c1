//! Atomic file writes, reads that never block on a writer, and locks on folders.
//!
//! **What it is not**: it parses no file formats. [`toml_message`] words the errors of a parser of TOML.
//!
//! **Invariant**: only regular files are read, and each read has a limit. Links are followed only
//! in paths from a user, never inside a folder of chaic. This holds for reads and writes.

mod kind;
mod open;
mod output_file;

pub use kind::{DirectoryEntry, EntryKind, is_file_below, kind, kind_below, walk};
pub use open::{
    create_executable, create_folders_below, create_or_replace, open_existing_for_append,
    open_file, open_for_append, open_or_create, open_user_file, read_below, read_bounded,
    read_user_file,
};
pub use output_file::OutputFile;

mod change;
pub mod faults;
mod lock;
mod temporary_file;
mod toml_message;

use std::ffi::OsString;
use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

pub use change::{create_folders, remove_empty_folder, remove_file, remove_folder, rename};
pub use lock::{FolderLock, LOCK, LockError};
pub use temporary_file::{TEMPORARY_SUFFIX, TemporaryFile};
pub use toml_message::{large_integer, toml_message, toml_problem};

use crate::faults::perform_rename;

/// A file operation that the operating system refused.
#[derive(Debug, thiserror::Error)]
#[error("can't {operation} {path}: {error}", path = path.display())]
pub struct FileError {
    /// The operation, for example `write`.
    pub operation: &'static str,
    /// The file or folder.
    pub path: PathBuf,
    /// Error of the operating system.
    pub error: io::Error,
}

impl FileError {
    /// Returns a function for `map_err` that adds the operation and the path to an error.
    pub fn context(
        operation: &'static str,
        path: &Path,
    ) -> impl FnOnce(io::Error) -> FileError + use<> {
        let path = path.to_owned();
        move |error| FileError { operation, path, error }
    }
}

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, FileError>;

/// Writes a file atomically: to a [`TemporaryFile`], which is then renamed. A link with either name is
/// replaced, not followed. Other processes may write the same file; the last rename wins.
///
/// # Errors
/// If the file system refuses. The temporary file is then removed if possible.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let write = || -> io::Result<()> {
        let mut file = TemporaryFile::beside(path)?;
        file.write_all(bytes)?;
        file.commit()
    };
    write().map_err(FileError::context("write", path))
}

/// Writes a new file that only its owner may read, atomically, even if another process writes it too:
/// each process has a temporary file of its own. Other systems than Unix apply the
/// permissions of the folder.
///
/// # Errors
/// If a file or link of this name exists, or the file system refuses. The temporary file is then
/// removed if possible.
pub fn write_new_private(path: &Path, bytes: &[u8]) -> Result<()> {
    let temporary = with_suffix(path, &format!(".{}{TEMPORARY_SUFFIX}", std::process::id()));
    let write = || -> io::Result<()> {
        let mut file = open::create_private(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        perform_rename(&temporary, path, || change::rename_new(&temporary, path))
    };
    write().map_err(|error| {
        // If the removal fails too, the suffix marks the file as temporary.
        let _ = remove_file(&temporary);
        FileError::context("create", path)(error)
    })
}

/// Returns the entries of a folder, sorted by name.
///
/// # Errors
/// If the file system refuses.
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let list = fs::read_dir(folder).and_then(|d| d.map(|e| e.map(|e| e.path())).collect());
    let mut entries: Vec<PathBuf> = list.map_err(FileError::context("list", folder))?;
    entries.sort();
    Ok(entries)
}

/// Returns the path with a suffix added to its file name.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name: OsString = path.file_name().unwrap_or_default().to_owned();
    name.push(suffix);
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_atomically_or_unchanged() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_atomically(&path, b"first").unwrap();
        write_atomically(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        // A folder in its place makes the rename fail.
        let folder = dir.path().join("folder");
        fs::create_dir_all(folder.join("inside")).unwrap();
        let error = write_atomically(&folder, b"third").unwrap_err().to_string();
        assert!(error.contains("can't write") && error.contains("folder"), "{error}");
        assert_eq!(entries(dir.path()).unwrap(), [path, folder]);
    }

    #[test]
    fn a_private_file_is_new_and_complete() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("secret");
        // The temporary file of another process is neither replaced nor removed.
        let other_temporary = dir.path().join("secret.0.tmp");
        fs::write(&other_temporary, b"other").unwrap();
        write_new_private(&path, b"first").unwrap();
        let error = write_new_private(&path, b"second").unwrap_err();
        assert_eq!(error.error.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(fs::read(&other_temporary).unwrap(), b"other");
        assert_eq!(entries(dir.path()).unwrap(), [path.clone(), other_temporary]);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
    }
}
