//! Opens files without following links and without blocking.
//!
//! Files inside run and training folders are opened without following links. A file from the
//! command line may be a link to a regular file.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read as _};
use std::path::Path;

use crate::faults::{Operation, perform};
use crate::kind::names_below;
use crate::{EntryKind, FileError, OutputFile, Result, kind, kind_below};

/// Reads at most the first `limit` bytes of a regular file that is not a link.
///
/// # Errors
/// If it is a link or no regular file, or the file system refuses.
pub fn read_bounded(path: &Path, limit: u64) -> Result<Vec<u8>> {
    read(open_file(path)?, path, limit)
}

/// Reads at most the first `limit` bytes of a file from the user: a regular file, or a link to one.
///
/// # Errors
/// If it is no regular file, or the file system refuses.
pub fn read_user_file(path: &Path, limit: u64) -> Result<Vec<u8>> {
    read(open_user_file(path)?, path, limit)
}

/// Opens a file from the user for reading: a regular file, or a link to one.
///
/// # Errors
/// If it is no regular file, or the file system refuses.
pub fn open_user_file(path: &Path) -> Result<File> {
    let metadata = fs::metadata(path).map_err(FileError::context("open", path))?;
    check_regular(path, EntryKind::from_file_type(metadata.file_type()))?;
    let mut options = File::options();
    let file = without_blocking(&mut options, false).read(true).open(path);
    check_opened(file.map_err(FileError::context("open", path))?, path)
}

/// Reads at most the first `limit` bytes of a regular file below `root` without a link in between.
///
/// # Errors
/// If it, or a folder between `root` and it, is a link; if it is not a regular file; or the file
/// system refuses.
pub fn read_below(root: &Path, path: &Path, limit: u64) -> Result<Vec<u8>> {
    let names = names_below(root, path)?;
    check_regular(path, kind_below(root, path)?)?;
    let file = open_names(root, &names).map_err(FileError::context("open", path))?;
    read(check_opened(file, path)?, path, limit)
}

/// Opens a regular file that is not a link, for reading.
///
/// # Errors
/// If it is a link or no regular file, or the file system refuses.
pub fn open_file(path: &Path) -> Result<File> {
    check_regular(path, kind(path)?)?;
    let mut options = File::options();
    let file = without_blocking(&mut options, true).read(true).open(path);
    check_opened(file.map_err(FileError::context("open", path))?, path)
}

/// Opens a file for appending; creates it if there is none.
///
/// # Errors
/// If it is a link or no regular file, or the file system refuses.
pub fn open_for_append(path: &Path) -> Result<OutputFile> {
    open_to_write(path, File::options().append(true).create(true))
}

/// Opens an existing file for appending. A file that another process removes is not created again.
///
/// # Errors
/// If there is none; if it is a link or no regular file, or the file system refuses.
pub fn open_existing_for_append(path: &Path) -> Result<OutputFile> {
    open_to_write(path, File::options().append(true))
}

/// Opens a file for reading and writing without truncating it; creates it if there is none.
///
/// # Errors
/// If it is a link or no regular file, or the file system refuses.
pub fn open_or_create(path: &Path) -> Result<OutputFile> {
    open_to_write(path, File::options().read(true).write(true).truncate(false).create(true))
}

/// Opens a file for writing. The options determine whether a missing file is created.
fn open_to_write(path: &Path, options: &mut OpenOptions) -> Result<OutputFile> {
    let found = kind(path)?;
    if found != EntryKind::Missing {
        check_regular(path, found)?;
    }
    let options = without_blocking(options, true);
    let file = perform(Operation::Open, path, || options.open(path));
    let file = check_opened(file.map_err(FileError::context("open", path))?, path)?;
    Ok(OutputFile::new(file, path))
}

/// Creates an empty file and replaces an existing file or link of this name. Links are not
/// followed.
///
/// # Errors
/// If a folder has this name, or the file system refuses.
pub fn create_or_replace(path: &Path) -> io::Result<OutputFile> {
    create(path, File::options().write(true))
}

/// Creates an empty file like [`create_or_replace`], which may be executed on Unix.
///
/// # Errors
/// Those of [`create_or_replace`].
pub fn create_executable(path: &Path) -> io::Result<OutputFile> {
    create_with_mode(path, 0o755)
}

/// Creates an empty file like [`create_or_replace`], which only its owner may read on Unix.
pub(crate) fn create_private(path: &Path) -> io::Result<OutputFile> {
    create_with_mode(path, 0o600)
}

/// Creates an empty file with Unix permissions.
fn create_with_mode(path: &Path, mode: u32) -> io::Result<OutputFile> {
    let mut options = File::options();
    options.write(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode);
    #[cfg(not(unix))]
    let _ = mode;
    create(path, &mut options)
}

fn create(path: &Path, options: &mut OpenOptions) -> io::Result<OutputFile> {
    if fs::symlink_metadata(path).is_ok() {
        match perform(Operation::Remove, path, || fs::remove_file(path)) {
            Err(e) if e.kind() != ErrorKind::NotFound => return Err(e),
            _ => {}
        }
    }
    create_missing(path, options)
}

/// Creates an empty file whose name must be free.
pub(crate) fn create_new(path: &Path) -> io::Result<OutputFile> {
    create_missing(path, File::options().write(true))
}

fn create_missing(path: &Path, options: &mut OpenOptions) -> io::Result<OutputFile> {
    // `create_new` is O_EXCL, which refuses a link that was created in the meantime.
    let file = perform(Operation::Open, path, || options.create_new(true).open(path))?;
    Ok(OutputFile::new(file, path))
}

/// Opens an existing file to lock it. Links are not followed.
pub(crate) fn open_existing(path: &Path) -> io::Result<OutputFile> {
    let mut options = File::options();
    // Some file systems lock only files that are open for writing.
    let file = without_blocking(&mut options, true).read(true).write(true).open(path)?;
    Ok(OutputFile::new(file, path))
}

/// Creates the missing folders from `root` down to `folder`. `root` must exist, and may be a link.
///
/// # Errors
/// If one of them is a link or not a folder, or the file system refuses.
pub fn create_folders_below(root: &Path, folder: &Path) -> Result<()> {
    let mut at = root.to_owned();
    for name in names_below(root, folder)? {
        at.push(name);
        if kind(&at)? == EntryKind::Folder {
            continue;
        }
        match perform(Operation::CreateFolder, &at, || fs::create_dir(&at)) {
            Err(e) if e.kind() != ErrorKind::AlreadyExists => {
                return Err(FileError::context("create the folder", &at)(e));
            }
            _ => {}
        }
        let problem = match kind(&at)? {
            EntryKind::Folder => continue,
            EntryKind::Link => "it is a link; put the folder itself there",
            _ => "it is no folder",
        };
        return Err(FileError::context("write into", &at)(io::Error::other(problem)));
    }
    Ok(())
}

/// Adds the flags for opening without blocking and, if `refuses_links`, without following a final
/// link.
#[cfg(unix)]
fn without_blocking(options: &mut OpenOptions, refuses_links: bool) -> &mut OpenOptions {
    use rustix::fs::OFlags;
    use std::os::unix::fs::OpenOptionsExt as _;
    let no_link = if refuses_links { OFlags::NOFOLLOW } else { OFlags::empty() };
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY | no_link;
    options.custom_flags(flags.bits().cast_signed())
}

/// Other systems have no such flags; only the checks before and after opening remain.
#[cfg(not(unix))]
fn without_blocking(options: &mut OpenOptions, _refuses_links: bool) -> &mut OpenOptions {
    options
}

/// Opens a file below a folder component by component without following links, including links
/// created after an earlier check.
#[cfg(unix)]
fn open_names(root: &Path, names: &[&std::ffi::OsStr]) -> io::Result<File> {
    use rustix::fs::{Mode, OFlags, open, openat};
    let folder = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
    let file = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY;
    let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
    let Some((name, folders)) = names.split_last() else {
        return Err(io::Error::from(ErrorKind::IsADirectory));
    };
    let mut at = open(root, folder, Mode::empty())?;
    for name in folders {
        at = openat(&at, *name, folder | OFlags::NOFOLLOW, Mode::empty())?;
    }
    Ok(File::from(openat(&at, *name, file | OFlags::CLOEXEC, Mode::empty())?))
}

#[cfg(not(unix))]
fn open_names(root: &Path, names: &[&std::ffi::OsStr]) -> io::Result<File> {
    File::open(names.iter().fold(root.to_owned(), |at, name| at.join(name)))
}

fn check_regular(path: &Path, found: EntryKind) -> Result<()> {
    match found {
        EntryKind::File => Ok(()),
        EntryKind::Missing => {
            let error = fs::symlink_metadata(path).err();
            let error = error.unwrap_or_else(|| io::Error::from(ErrorKind::NotFound));
            Err(FileError::context("open", path)(error))
        }
        other => Err(FileError::context("read", path)(io::Error::other(other.to_string()))),
    }
}

/// Checks the opened file, because it may differ from the one checked before opening.
fn check_opened(file: File, path: &Path) -> Result<File> {
    let metadata = file.metadata().map_err(FileError::context("open", path))?;
    check_regular(path, EntryKind::from_file_type(metadata.file_type()))?;
    Ok(file)
}

fn read(file: File, path: &Path, limit: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(limit).read_to_end(&mut bytes).map_err(FileError::context("read", path))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests;
