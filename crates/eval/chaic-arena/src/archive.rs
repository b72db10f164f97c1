//! Archives of submissions: strict extraction, and packing with the same bytes for the same content.
//!
//! An archive is a tar file in the ustar or GNU header format, compressed by gzip or not. Extraction
//! accepts regular files and folders with relative paths of plain names, and nothing else. It reads the
//! whole archive once before it writes anything.

mod entry_path;
mod pack;
mod scan;

pub use entry_path::check_path;
pub use pack::{PackedArchive, content_sha256, pack};

use std::io::{self, Write};
use std::path::Path;

use chaic_files::{
    EntryKind, FileError, create_executable, create_folders, create_folders_below,
    create_or_replace, kind, remove_folder, rename,
};

use crate::error::{ArenaError, Result};
use scan::{Destination, Scan};

/// Maximum number of files and folders: 10 times those of a run on the standard split with two helpers.
pub const MAX_ENTRIES: usize = 20_000;
/// Maximum size of a file, bytes: weights of a large network.
pub const MAX_FILE_BYTES: u64 = 1 << 30;
/// Maximum size of all files together, bytes.
pub const MAX_TOTAL_BYTES: u64 = 4 << 30;
/// Maximum length of a path, bytes. The ustar header holds it without an extension.
pub const MAX_PATH_BYTES: usize = 200;
/// Maximum number of names in a path.
pub const MAX_DEPTH: usize = 8;

/// Extracts an archive into a new folder. The folder appears complete or not at all.
///
/// Of the recorded attributes only the owner's permission to execute is kept.
///
/// # Errors
/// [`ArenaError::Archive`] or [`ArenaError::Entry`] if the archive violates a rule of this module;
/// [`ArenaError::File`] if `target` exists or cannot be written.
pub fn extract(archive: &Path, target: &Path) -> Result<()> {
    if kind(target)? != EntryKind::Missing {
        let error = io::Error::from(io::ErrorKind::AlreadyExists);
        return Err(FileError::context("extract into", target)(error).into());
    }
    Scan::open(archive)?.run(&mut NullDestination)?;
    let parent = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    create_folders(parent)?;
    let temporary = tempfile::Builder::new().prefix(".chaic-extract-").tempdir_in(parent);
    let temporary = temporary.map_err(FileError::context("make a folder in", parent))?;
    Scan::open(archive)?.run(&mut Folder { root: temporary.path() })?;
    make_readable(temporary.path())?;
    let path = temporary.keep();
    rename(&path, target).map_err(|error| {
        // If the removal fails too, the prefix marks the folder as temporary.
        let _ = remove_folder(&path);
        error.into()
    })
}

/// Destination that discards all content.
struct NullDestination;

impl Destination for NullDestination {
    fn folder(&mut self, _: &str) -> Result<()> {
        Ok(())
    }

    fn file(&mut self, _: &str, _: bool) -> Result<Box<dyn Write>> {
        Ok(Box::new(io::sink()))
    }
}

/// Destination that creates files below a folder, which is empty at first.
struct Folder<'a> {
    root: &'a Path,
}

impl Destination for Folder<'_> {
    fn folder(&mut self, path: &str) -> Result<()> {
        Ok(create_folders_below(self.root, &self.root.join(path))?)
    }

    fn file(&mut self, path: &str, is_executable: bool) -> Result<Box<dyn Write>> {
        let path = self.root.join(path);
        create_folders_below(self.root, path.parent().unwrap_or(self.root))?;
        let file = if is_executable { create_executable(&path) } else { create_or_replace(&path) };
        let file = file.map_err(FileError::context("create", &path))?;
        Ok(Box::new(io::BufWriter::new(file)))
    }
}

/// Gives a temporary folder, which only its owner may enter, the permissions of other folders.
fn make_readable(folder: &Path) -> Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let permissions = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(folder, permissions)
            .map_err(FileError::context("set the permissions of", folder))?;
    }
    #[cfg(not(unix))]
    let _ = folder;
    Ok(())
}

/// Returns the error of an archive that is not as this module requires.
fn refused(archive: &Path, problem: impl Into<String>) -> ArenaError {
    ArenaError::Archive { path: archive.to_owned(), problem: problem.into() }
}
