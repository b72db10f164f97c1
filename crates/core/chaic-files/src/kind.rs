//! Kinds of directory entries, told apart without following links.

use std::fmt;
use std::fs::{self, FileType};
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};

use crate::{FileError, Result};

/// Kind of a directory entry. A link is a kind of its own, whatever it leads to.
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
    pub(crate) fn of(file_type: FileType) -> EntryKind {
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

/// Returns the kind of an entry. Links in the folders that lead to it are followed.
///
/// # Errors
/// If the file system refuses for another reason than that there is no such entry.
pub fn kind(path: &Path) -> Result<EntryKind> {
    match fs::symlink_metadata(path) {
        Ok(metadata) => Ok(EntryKind::of(metadata.file_type())),
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            Ok(EntryKind::Missing)
        }
        Err(e) => Err(FileError::of("open", path)(e)),
    }
}

/// Returns the kind of an entry below `root`: [`EntryKind::Link`] if it is a link or a folder between
/// `root` and the entry is one. `root` itself may be a link.
///
/// # Errors
/// If `path` does not begin with `root` or goes up, or the file system refuses.
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

/// Returns whether `path` is a regular file below `root` that is reached without a link. Returns false on
/// errors.
pub fn is_file_below(root: &Path, path: &Path) -> bool {
    kind_below(root, path).is_ok_and(|kind| kind == EntryKind::File)
}

/// Returns the names that lead from `root` to `path`.
pub(crate) fn names_below<'p>(root: &Path, path: &'p Path) -> Result<Vec<&'p std::ffi::OsStr>> {
    let outside = || {
        let problem = format!("it does not lie below {}", root.display());
        FileError::of("open", path)(io::Error::new(ErrorKind::InvalidInput, problem))
    };
    let below = path.strip_prefix(root).map_err(|_| outside())?;
    let name = |component| match component {
        Component::Normal(name) => Ok(name),
        _ => Err(outside()),
    };
    below.components().map(name).collect()
}

/// Directory entry that [`walk`] found.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry {
    /// Its path, which begins with the folder that was searched.
    pub path: PathBuf,
    /// Its kind.
    pub kind: EntryKind,
}

/// Lists the entries below a folder, sorted by path. Enters folders down to `depth` levels below `folder`, and
/// lists only the deeper ones. Links are listed and not followed.
///
/// The list is empty if `folder` is missing. If `folder` is not a folder, the list holds only itself.
///
/// # Errors
/// If the file system refuses.
pub fn walk(folder: &Path, depth: u32) -> Result<Vec<Entry>> {
    let mut found = Vec::new();
    enter(folder, kind(folder)?, depth + 1, &mut found)?;
    found.sort();
    Ok(found)
}

fn enter(path: &Path, kind: EntryKind, depth: u32, found: &mut Vec<Entry>) -> Result<()> {
    if kind == EntryKind::Missing {
        return Ok(());
    }
    if kind != EntryKind::Folder || depth == 0 {
        found.push(Entry { path: path.to_owned(), kind });
        return Ok(());
    }
    let refused = || FileError::of("list", path);
    for entry in fs::read_dir(path).map_err(refused())? {
        let entry = entry.map_err(refused())?;
        let kind = EntryKind::of(entry.file_type().map_err(refused())?);
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
        let listed = |depth| {
            let found = walk(at, depth).unwrap().into_iter();
            let name =
                |e: Entry| (e.path.strip_prefix(at).unwrap().to_str().unwrap().to_owned(), e.kind);
            found.map(name).collect::<Vec<_>>()
        };
        let file = |name: &str| (name.to_owned(), EntryKind::File);
        assert_eq!(listed(0), [("a".to_owned(), EntryKind::Folder), file("x")]);
        let all = ["a/b/c/x", "a/b/x", "a/x", "x"].map(file);
        assert_eq!(listed(3), all);
        assert_eq!(walk(&at.join("nowhere"), 3).unwrap(), []);
        assert_eq!(walk(&at.join("x"), 3).unwrap().len(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_seen_on_the_way_and_at_the_end() {
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
        // The folder that a user names may be a link.
        let named = dir.path().join("whole");
        assert!(is_file_below(&named, &named.join("a/b/x")));
        assert!(kind_below(&root, &root.join("../root/a")).is_err());
        assert!(kind_below(&root, dir.path()).is_err());
    }
}
