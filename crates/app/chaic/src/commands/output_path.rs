//! Checks of the paths of results before a command starts its work.

use std::io::{Error, ErrorKind};
use std::path::{Path, is_separator};

use chaic_files::{EntryKind, FileError, Result, kind};

/// Checks that a file can be written later: its folder exists, and no folder has its name.
///
/// # Errors
/// If it cannot be written.
pub fn check_output_file(path: Option<&Path>) -> Result<()> {
    let Some(path) = path else { return Ok(()) };
    let refused = |error_kind, problem: String| {
        Err(FileError::context("write", path)(Error::new(error_kind, problem)))
    };
    let is_folder = path.to_string_lossy().ends_with(is_separator) || path.file_name().is_none();
    if is_folder || kind(path)? == EntryKind::Folder {
        return refused(ErrorKind::IsADirectory, EntryKind::Folder.to_string());
    }
    // The path of a file in the current folder has an empty parent.
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder.filter(|folder| !folder.is_dir()) {
        Some(folder) => {
            let problem = format!("there is no folder {}", folder.display());
            refused(ErrorKind::NotFound, problem)
        }
        None => Ok(()),
    }
}

/// Checks that a folder exists or can be made later: no part of its path is a file.
///
/// # Errors
/// If it cannot be made.
pub fn check_output_folder(folder: Option<&Path>) -> Result<()> {
    let Some(folder) = folder else { return Ok(()) };
    for part in folder.ancestors().filter(|part| !part.as_os_str().is_empty()) {
        if part.is_dir() {
            break;
        }
        if kind(part)? != EntryKind::Missing {
            let problem = format!("{} is no folder", part.display());
            let error = Error::new(ErrorKind::NotADirectory, problem);
            return Err(FileError::context("make the folder", folder)(error));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_path_is_refused_if_its_file_could_not_be_written() {
        let dir = tempfile::tempdir().expect("the disk has space");
        let at = dir.path();
        fs::create_dir(at.join("folder")).expect("the disk has space");
        fs::write(at.join("file"), "").expect("the disk has space");
        let check = |name: &str| check_output_file(Some(&at.join(name)));
        for name in ["new", "file", "folder/new"] {
            assert!(check(name).is_ok(), "{name}");
        }
        assert!(check_output_file(None).is_ok() && check_output_file(Some(Path::new("x"))).is_ok());
        for (name, problem) in [
            ("folder", "it is a folder"),
            ("new/", "it is a folder"),
            ("folder/..", "it is a folder"),
            ("nodir/new", "there is no folder "),
            ("file/new", "there is no folder "),
        ] {
            let refused = check(name).expect_err(name).to_string();
            assert!(refused.contains("can't write ") && refused.contains(problem), "{refused}");
        }
    }

    #[test]
    fn a_folder_is_refused_if_a_part_of_its_path_is_a_file() {
        let dir = tempfile::tempdir().expect("the disk has space");
        let at = dir.path();
        fs::create_dir(at.join("folder")).expect("the disk has space");
        fs::write(at.join("file"), "").expect("the disk has space");
        let check = |name: &str| check_output_folder(Some(&at.join(name)));
        for name in ["new", "new/inner", "folder", "folder/new"] {
            assert!(check(name).is_ok(), "{name}");
        }
        assert!(check_output_folder(None).is_ok());
        for name in ["file", "file/new", "file/new/inner"] {
            let refused = check(name).expect_err(name).to_string();
            assert!(refused.contains("file is no folder"), "{refused}");
        }
        assert!(!at.join("new").exists());
    }
}
