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
    EntryKind, FileError, TEMPORARY_SUFFIX, create_executable, create_folders,
    create_folders_below, create_or_replace, kind, remove_file, remove_folder, rename, with_suffix,
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

/// Folder in which Python keeps bytecode. Its files depend on times and on the version of Python, and
/// appear when a program starts without a sandbox, so archives and digests leave them out.
const BYTECODE: &str = "__pycache__";

/// End of the names of folders in which pip describes packages.
const PACKAGE_DESCRIPTION: &str = ".dist-info";
/// File in such a folder with the place that a package was installed from, such as a path of the author.
const PACKAGE_ORIGIN: &str = "direct_url.json";

/// Extracts an archive into a new folder. The folder appears complete or not at all, also after a power
/// failure.
///
/// Of the recorded attributes only the owner's permission to execute is kept. The content is first written
/// to a folder with the suffix [`TEMPORARY_SUFFIX`], which replaces that of an interrupted extraction. Two
/// processes must not extract into the same folder at the same time.
///
/// # Errors
/// [`ArenaError::Archive`] or [`ArenaError::Entry`] if the archive violates a rule of this module;
/// [`ArenaError::File`] if `target` exists or cannot be written.
pub fn extract(archive: &Path, target: &Path) -> Result<()> {
    check_new(archive, target)?;
    let temporary = with_suffix(target, TEMPORARY_SUFFIX);
    match kind(&temporary)? {
        EntryKind::Missing => {}
        EntryKind::Folder => remove_folder(&temporary)?,
        _ => remove_file(&temporary)?,
    }
    let folder = Folder { root: &temporary, is_flushed: true };
    let extracted = folder.fill(archive).and_then(|()| Ok(rename(&temporary, target)?));
    if extracted.is_err() {
        // If the removal fails too, the suffix marks the folder as temporary.
        let _ = remove_folder(&temporary);
    }
    extracted
}

/// Extracts an archive into a new folder whose files do not outlive this process. They are not flushed to
/// the device, and a failure leaves a part of them.
///
/// # Errors
/// Those of [`extract`].
pub(crate) fn extract_temporarily(archive: &Path, target: &Path) -> Result<()> {
    check_new(archive, target)?;
    Folder { root: target, is_flushed: false }.fill(archive)
}

/// Checks that `target` does not exist, and reads the whole archive.
fn check_new(archive: &Path, target: &Path) -> Result<()> {
    if kind(target)? != EntryKind::Missing {
        let error = io::Error::from(io::ErrorKind::AlreadyExists);
        return Err(FileError::context("extract into", target)(error).into());
    }
    Scan::open(archive)?.run(&mut NullDestination)
}

/// Destination that discards all content.
struct NullDestination;

impl Destination for NullDestination {
    fn folder(&mut self, _: &str) -> Result<()> {
        Ok(())
    }

    fn file(
        &mut self,
        _: &str,
        _: bool,
        copy: &mut dyn FnMut(&mut dyn Write) -> Result<()>,
    ) -> Result<()> {
        copy(&mut io::sink())
    }
}

/// Destination that creates files below a folder, which is empty at first.
struct Folder<'a> {
    root: &'a Path,
    /// True to flush each file to the device.
    is_flushed: bool,
}

impl Folder<'_> {
    /// Creates the folder with the content of an archive.
    fn fill(mut self, archive: &Path) -> Result<()> {
        create_folders(self.root)?;
        Scan::open(archive)?.run(&mut self)
    }
}

impl Destination for Folder<'_> {
    fn folder(&mut self, path: &str) -> Result<()> {
        Ok(create_folders_below(self.root, &self.root.join(path))?)
    }

    fn file(
        &mut self,
        path: &str,
        is_executable: bool,
        copy: &mut dyn FnMut(&mut dyn Write) -> Result<()>,
    ) -> Result<()> {
        let path = self.root.join(path);
        create_folders_below(self.root, path.parent().unwrap_or(self.root))?;
        let file = if is_executable { create_executable(&path) } else { create_or_replace(&path) };
        let mut file = file.map_err(FileError::context("create", &path))?;
        copy(&mut file)?;
        if self.is_flushed {
            file.sync_all().map_err(FileError::context("write", &path))?;
        }
        Ok(())
    }
}

/// Returns the error of an archive that is not as this module requires.
fn refused(archive: &Path, problem: impl Into<String>) -> ArenaError {
    ArenaError::Archive { path: archive.to_owned(), problem: problem.into() }
}
