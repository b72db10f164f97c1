//! Files that are whole or absent, reads that never wait for a writer, and locks on folders.
//!
//! **What it is not**: it knows nothing of what is in the files.
//!
//! **Invariant**: only regular files are read, and each read has a limit. Links are followed only in paths
//! that a user named, never inside a folder of chaic, for reading as for writing.

mod kind;
mod open;

pub use kind::{Entry, EntryKind, is_file_below, kind, kind_below, walk};
pub use open::{
    create_fresh, make_folders_below, open_file, open_or_create, open_to_append, read_below,
    read_bounded, read_user_file,
};

mod lock;

use std::ffi::OsString;
use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

pub use lock::{FolderLock, LOCK, LockError};

/// The operating system refused something.
#[derive(Debug, thiserror::Error)]
#[error("can't {what} {path}: {refusal}", path = path.display())]
pub struct FileError {
    /// What was tried, for example `write`.
    pub what: &'static str,
    /// With which file or folder.
    pub path: PathBuf,
    /// The refusal.
    pub refusal: io::Error,
}

impl FileError {
    /// For `map_err` on what the operating system may refuse.
    pub fn of(what: &'static str, path: &Path) -> impl FnOnce(io::Error) -> FileError + use<> {
        let path = path.to_owned();
        move |refusal| FileError { what, path, refusal }
    }
}

/// The result of anything in this crate.
pub type Result<T> = std::result::Result<T, FileError>;

/// What [`write_whole`] appends to the name of a file that is not whole yet.
pub const UNFINISHED: &str = ".tmp";

/// Writes a file as a whole or not at all: to a name beside it, which then becomes its own. A link of either
/// name is replaced, not followed.
///
/// # Errors
/// If the file system refuses; nothing new is left then, as far as it can be removed.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let beside = with_suffix(path, UNFINISHED);
    let write = || -> io::Result<()> {
        let mut file = create_fresh(&beside)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&beside, path)
    };
    write().map_err(|refusal| {
        // Its name says what it is where it cannot be removed.
        let _ = fs::remove_file(&beside);
        FileError::of("write", path)(refusal)
    })
}

/// What lies in a folder, in the order of names.
///
/// # Errors
/// If the file system refuses.
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let list = fs::read_dir(folder).and_then(|d| d.map(|e| e.map(|e| e.path())).collect());
    let mut entries: Vec<PathBuf> = list.map_err(FileError::of("list", folder))?;
    entries.sort();
    Ok(entries)
}

/// The path with its file name made longer.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name: OsString = path.file_name().unwrap_or_default().to_owned();
    name.push(suffix);
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_as_a_whole_or_stays() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_whole(&path, b"first").unwrap();
        write_whole(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        // A folder in its place refuses the last step.
        let taken = dir.path().join("taken");
        fs::create_dir_all(taken.join("inside")).unwrap();
        let error = write_whole(&taken, b"third").unwrap_err().to_string();
        assert!(error.contains("can't write") && error.contains("taken"), "{error}");
        assert_eq!(entries(dir.path()).unwrap(), [path, taken]);
    }
}
