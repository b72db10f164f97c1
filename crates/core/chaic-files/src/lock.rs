//! Exclusive locks on folders.

use std::fs::TryLockError;
use std::path::{Path, PathBuf};

use crate::{FileError, OutputFile, open_or_create};

/// Name of the lock file in a locked folder.
pub const LOCK: &str = ".lock";

/// Maximum number of attempts while others remove the lock file; then the folder counts as in use.
const MAX_ATTEMPTS: usize = 8;

/// Exclusive lock on a folder, held until it is dropped or the process ends.
///
/// The operating system holds the lock on the file [`LOCK`], so a killed process leaves no lock
/// behind.
#[derive(Debug)]
pub struct FolderLock {
    _file: OutputFile,
}

/// A folder that cannot be locked.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process, or another part of this process, holds the lock.
    #[error("{path} is in use by another process; wait until it ends, or choose another folder", path = .0.display())]
    Held(PathBuf),
    /// The operating system refused the access.
    #[error(transparent)]
    File(#[from] FileError),
}

impl FolderLock {
    /// Locks an existing folder; creates its lock file if it is missing.
    ///
    /// # Errors
    /// [`LockError::Held`] if the lock is taken; [`LockError::File`] if the lock file cannot be
    /// opened or is no regular file.
    pub fn acquire(folder: &Path) -> Result<FolderLock, LockError> {
        let path = folder.join(LOCK);
        for _ in 0..MAX_ATTEMPTS {
            let file = open_or_create(&path)?;
            if lock(&file, folder, &path)? {
                return Ok(FolderLock { _file: file });
            }
        }
        Err(LockError::Held(folder.to_owned()))
    }
}

/// Locks an opened lock file. Returns false if the holder of the lock removed the file after it was
/// opened: another process may hold a lock on a new file.
fn lock(file: &OutputFile, folder: &Path, path: &Path) -> Result<bool, LockError> {
    let refused = |error| LockError::File(FileError::context("lock", path)(error));
    match file.as_file().try_lock() {
        Ok(()) => file.has_its_name().map_err(refused),
        Err(TryLockError::WouldBlock) => Err(LockError::Held(folder.to_owned())),
        Err(TryLockError::Error(error)) => Err(refused(error)),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_folder_is_locked_once_until_the_lock_is_dropped() {
        let dir = tempfile::tempdir().unwrap();
        let lock = FolderLock::acquire(dir.path()).unwrap();
        let error = FolderLock::acquire(dir.path()).unwrap_err();
        assert!(matches!(error, LockError::Held(_)) && error.to_string().contains("in use"));
        drop(lock);
        FolderLock::acquire(dir.path()).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_removed_lock_file_gives_no_lock() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(LOCK);
        let opened = open_or_create(&path).unwrap();
        fs::remove_file(&path).unwrap();
        assert!(!lock(&opened, dir.path(), &path).unwrap());
        // A new lock file of another process does not change that.
        let _held = FolderLock::acquire(dir.path()).unwrap();
        assert!(!lock(&opened, dir.path(), &path).unwrap());
    }

    #[test]
    fn a_lock_file_that_is_a_link_or_a_folder_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join(LOCK)).unwrap();
        assert!(matches!(FolderLock::acquire(dir.path()), Err(LockError::File(_))));
        fs::remove_dir(dir.path().join(LOCK)).unwrap();
        #[cfg(unix)]
        {
            let target = dir.path().join("target");
            fs::write(&target, "kept").unwrap();
            std::os::unix::fs::symlink(&target, dir.path().join(LOCK)).unwrap();
            assert!(matches!(FolderLock::acquire(dir.path()), Err(LockError::File(_))));
            assert_eq!(fs::read(&target).unwrap(), b"kept");
        }
    }
}
