//! Changes to folders: new folders, renames and removals.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use crate::faults::{Operation, perform, perform_rename};
use crate::{FileError, Result};

/// Creates a folder and its missing parents. Links in its path are followed.
///
/// # Errors
/// If a part of the path is no folder, or the file system refuses.
pub fn create_folders(folder: &Path) -> Result<()> {
    let mut missing: Vec<PathBuf> = Vec::new();
    for part in folder.ancestors().filter(|part| !part.as_os_str().is_empty()) {
        if part.is_dir() {
            break;
        }
        missing.push(part.to_owned());
    }
    for part in missing.iter().rev() {
        match perform(Operation::CreateFolder, part, || fs::create_dir(part)) {
            // Another process may have created it.
            Err(_) if part.is_dir() => {}
            other => other.map_err(FileError::context("make the folder", folder))?,
        }
    }
    Ok(())
}

/// Renames a file or folder, and replaces a file of the new name.
///
/// # Errors
/// If the file system refuses.
pub fn rename(from: &Path, to: &Path) -> Result<()> {
    perform_rename(from, to, || fs::rename(from, to)).map_err(FileError::context("rename", from))
}

/// Renames a file to a name that must be free.
pub(crate) fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        use rustix::io::Errno;
        match renameat_with(CWD, from, CWD, to, RenameFlags::NOREPLACE) {
            // Not every file system has this kind of rename.
            Err(Errno::INVAL | Errno::NOSYS | Errno::NOTSUP) => {}
            other => return Ok(other?),
        }
    }
    if fs::symlink_metadata(to).is_ok() {
        return Err(io::Error::from(ErrorKind::AlreadyExists));
    }
    fs::rename(from, to)
}

/// Removes a file or a link.
///
/// # Errors
/// If it is missing or a folder, or the file system refuses.
pub fn remove_file(path: &Path) -> Result<()> {
    let removed = perform(Operation::Remove, path, || fs::remove_file(path));
    removed.map_err(FileError::context("remove", path))
}

/// Removes an empty folder.
///
/// # Errors
/// If it is missing or not empty, or the file system refuses.
pub fn remove_empty_folder(path: &Path) -> Result<()> {
    let removed = perform(Operation::Remove, path, || fs::remove_dir(path));
    removed.map_err(FileError::context("remove", path))
}

/// Removes a folder with its content. Links inside are removed, not followed.
///
/// # Errors
/// If it is missing or no folder, or the file system refuses. A part of the content may then be
/// removed.
pub fn remove_folder(path: &Path) -> Result<()> {
    let removed = perform(Operation::Remove, path, || fs::remove_dir_all(path));
    removed.map_err(FileError::context("remove", path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_created_with_their_parents_and_may_exist() {
        let dir = tempfile::tempdir().unwrap();
        let inner = dir.path().join("a/b");
        create_folders(&inner).unwrap();
        create_folders(&inner).unwrap();
        assert!(inner.is_dir());
        let file = inner.join("file");
        fs::write(&file, "").unwrap();
        let error = create_folders(&file.join("c")).unwrap_err().to_string();
        assert!(error.contains("can't make the folder"), "{error}");
    }

    #[test]
    fn only_an_empty_folder_is_removed_without_its_content() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("a");
        create_folders(&folder.join("b")).unwrap();
        assert!(remove_empty_folder(&folder).is_err());
        remove_folder(&folder).unwrap();
        assert!(remove_file(&folder).is_err());
    }
}
