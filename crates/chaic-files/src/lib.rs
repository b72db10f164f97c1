//! Files that are whole or absent, and reads that never wait for a writer.
//!
//! **What it is not**: it knows nothing of what is in the files.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};

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

/// Writes a file as a whole or not at all: to a name beside it, which then becomes its own.
///
/// # Errors
/// If the file system refuses; nothing new is left then, as far as it can be removed.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let beside = with_suffix(path, UNFINISHED);
    let write = || -> io::Result<()> {
        let mut file = File::create(&beside)?;
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

/// At most the first `limit` bytes of a regular file. Whoever opens a pipe waits for its writer, so
/// nothing but a regular file is opened.
///
/// # Errors
/// If it is no regular file, or the file system refuses.
pub fn read_bounded(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let kind = fs::metadata(path).map_err(FileError::of("open", path))?.file_type();
    if !kind.is_file() {
        let what = if kind.is_dir() { "it is a folder" } else { "it is no regular file" };
        return Err(FileError::of("read", path)(io::Error::other(what)));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(FileError::of("open", path))?;
    file.take(limit).read_to_end(&mut bytes).map_err(FileError::of("read", path))?;
    Ok(bytes)
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

    #[test]
    fn only_regular_files_are_read_and_not_beyond_the_limit() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        fs::write(&path, "0123456789").unwrap();
        assert_eq!(read_bounded(&path, 4).unwrap(), b"0123");
        let error = read_bounded(dir.path(), 4).unwrap_err().to_string();
        assert!(error.contains("it is a folder"), "{error}");
        #[cfg(unix)]
        {
            let error = read_bounded(Path::new("/dev/null"), 4).unwrap_err().to_string();
            assert!(error.contains("can't read /dev/null: it is no regular file"), "{error}");
        }
    }
}
