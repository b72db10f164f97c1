//! Kinds of directory entries, determined without following links.

use std::fmt;
use std::fs::{self, FileType};
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};

use crate::{FileError, Result};

/// Kind of a directory entry. A link is a separate kind, independent of its target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EntryKind {
    /// There is no entry of this name.
    Missing,
    /// A regular file.
    File,
    /// A folder.
    Folder,
    /// A symbolic link.
    Link,
    /// A pipe, a socket or a device.
    Special,
}

impl EntryKind {
    pub(crate) fn from_file_type(file_type: FileType) -> EntryKind {
        match file_type {
            t if t.is_symlink() => EntryKind::Link,
            t if t.is_file() => EntryKind::File,
            t if t.is_dir() => EntryKind::Folder,
            _ => EntryKind::Special,
        }
    }
}

impl fmt::Display for EntryKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            EntryKind::Missing => "it is missing",
            EntryKind::File => "it is a regular file",
            EntryKind::Folder => "it is a folder",
            EntryKind::Link => "it is a link or lies in a linked folder; put the file itself there",
            EntryKind::Special => "it is no regular file",
        })
    }
}

/// Returns the kind of an entry. Links in its parent folders are followed.
///
/// # Errors
/// If the file system refuses for another reason than a missing entry.
pub fn kind(path: &Path) -> Result<EntryKind> {
    match fs::symlink_metadata(path) {
        Ok(metadata) => Ok(EntryKind::from_file_type(metadata.file_type())),
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            Ok(EntryKind::Missing)
        }
        Err(e) => Err(FileError::context("open", path)(e)),
    }
}

/// Returns the kind of an entry below `root`. It is [`EntryKind::Link`] if the entry, or a folder
/// between `root` and the entry, is a link. `root` itself may be a link.
///
/// # Errors
/// If `path` does not begin with `root` or contains `..`, or the file system refuses.
pub fn kind_below(root: &Path, path: &Path) -> Result<EntryKind> {
    let mut at = root.to_owned();
    let mut found = EntryKind::Folder;
    for name in names_below(root, path)? {
        match found {
            EntryKind::Folder => {}
            EntryKind::Link => return Ok(EntryKind::Link),
            _ => return Ok(EntryKind::Missing),
        }
        at.push(name);
        found = kind(&at)?;
    }
    Ok(found)
}

/// Returns whether `path` is a regular file below `root` without a link in between. Returns false
/// on errors.
pub fn is_file_below(root: &Path, path: &Path) -> bool {
    kind_below(root, path).is_ok_and(|kind| kind == EntryKind::File)
}

/// Returns the path components from `root` to `path`.
pub(crate) fn names_below<'p>(root: &Path, path: &'p Path) -> Result<Vec<&'p std::ffi::OsStr>> {
    let outside = || {
        let problem = format!("it does not lie below {}", root.display());
        FileError::context("open", path)(io::Error::new(ErrorKind::InvalidInput, problem))
    };
    let below = path.strip_prefix(root).map_err(|_| outside())?;
    let name = |component| match component {
        Component::Normal(name) => Ok(name),
        _ => Err(outside()),
    };
    below.components().map(name).collect()
}

/// Directory entry found by [`walk`].
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct DirectoryEntry {
    /// Path, which begins with the searched folder.
    pub path: PathBuf,
    /// Kind of the entry.
    pub kind: EntryKind,
}

/// Lists the entries below a folder, sorted by path. Enters folders down to `depth` levels below
/// `folder`, and lists deeper ones without entering them. Links are listed and not followed.
///
/// The list is empty if `folder` is missing. If `folder` is not a folder, the list contains only
/// `folder`.
///
/// # Errors
/// If the file system refuses.
pub fn walk(folder: &Path, depth: u32) -> Result<Vec<DirectoryEntry>> {
    let mut found = Vec::new();
    enter(folder, kind(folder)?, depth + 1, &mut found)?;
    found.sort();
    Ok(found)
}

fn enter(path: &Path, kind: EntryKind, depth: u32, found: &mut Vec<DirectoryEntry>) -> Result<()> {
    if kind == EntryKind::Missing {
        return Ok(());
    }
    if kind != EntryKind::Folder || depth == 0 {
        found.push(DirectoryEntry { path: path.to_owned(), kind });
        return Ok(());
    }
    let error = || FileError::context("list", path);
    for entry in fs::read_dir(path).map_err(error())? {
        let entry = entry.map_err(error())?;
        let kind = EntryKind::from_file_type(entry.file_type().map_err(error())?);
        enter(&entry.path(), kind, depth - 1, found)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_lists_files_and_folders_that_are_too_deep() {
        let dir = tempfile::tempdir().unwrap();
        let at = dir.path();
        fs::create_dir_all(at.join("a/b/c")).unwrap();
        for file in ["x", "a/x", "a/b/x", "a/b/c/x"] {
            fs::write(at.join(file), "").unwrap();
        }
        let list = |depth| {
            let found = walk(at, depth).unwrap().into_iter();
            let name = |e: DirectoryEntry| {
                (e.path.strip_prefix(at).unwrap().to_str().unwrap().to_owned(), e.kind)
            };
            found.map(name).collect::<Vec<_>>()
        };
        let file = |name: &str| (name.to_owned(), EntryKind::File);
        assert_eq!(list(0), [("a".to_owned(), EntryKind::Folder), file("x")]);
        let all = ["a/b/c/x", "a/b/x", "a/x", "x"].map(file);
        assert_eq!(list(3), all);
        assert_eq!(walk(&at.join("nowhere"), 3).unwrap(), []);
        assert_eq!(walk(&at.join("x"), 3).unwrap().len(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_found_in_parent_folders_and_at_the_end() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("root");
        fs::create_dir_all(root.join("a/b")).unwrap();
        fs::write(root.join("a/b/x"), "").unwrap();
        symlink(root.join("a"), root.join("linked")).unwrap();
        symlink(root.join("a/b/x"), root.join("a/y")).unwrap();
        symlink(&root, dir.path().join("whole")).unwrap();
        let below = |name: &str| kind_below(&root, &root.join(name)).unwrap();
        assert_eq!(below("a/b/x"), EntryKind::File);
        assert_eq!(below("a/b"), EntryKind::Folder);
        assert_eq!(below("a/b/z"), EntryKind::Missing);
        assert_eq!(below("a/b/x/z"), EntryKind::Missing);
        assert_eq!(below("a/y"), EntryKind::Link);
        assert_eq!(below("linked/b/x"), EntryKind::Link);
        // The root folder itself may be a link.
        let named = dir.path().join("whole");
        assert!(is_file_below(&named, &named.join("a/b/x")));
        assert!(kind_below(&root, &root.join("../root/a")).is_err());
        assert!(kind_below(&root, dir.path()).is_err());
    }
}
