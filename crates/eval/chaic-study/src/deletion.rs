//! Deletion of one participant from a folder of collected or exported data.

use std::fs;
use std::path::{Path, PathBuf};

use chaic_files::{
    EntryKind, FileError, read_user_file, remove_empty_folder, remove_file, walk, write_atomically,
};

use crate::data::is_code;
use crate::error::{Result, StudyError};

/// Levels of folders that are searched.
const DEPTH: u32 = 8;
/// Start of the names of folders with data sets that hold episodes without codes: a deletion requires another
/// export.
pub const DERIVED: &str = "lerobot-";
/// Maximum size of a file that is searched, bytes.
const MAX_BYTES: u64 = 256 << 20;

/// Result of a deletion.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeletionReport {
    /// Removed files.
    pub files: Vec<PathBuf>,
    /// Number of rows that were removed from tables.
    pub rows: usize,
    /// Entries that may still hold data: links, files that cannot be searched, data sets without codes
    /// ([`DERIVED`]), and folders that are too deep.
    pub unsearched: Vec<PathBuf>,
}

/// Removes the files of a participant and the rows of tables (`.csv`) that begin with the code, in a folder
/// and the folders below it. Links are not followed.
///
/// # Errors
/// If the text is no code, or the file system refuses. Repeat the deletion then.
pub fn delete(code: &str, folder: &Path) -> Result<DeletionReport> {
    if !is_code(code) {
        return Err(StudyError::Code(code.to_owned()));
    }
    let mut deleted = DeletionReport::default();
    // A folder that does not exist is a mistake, not a success.
    fs::metadata(folder).map_err(FileError::context("open", folder))?;
    for entry in walk(folder, DEPTH)? {
        if let Some(derived) = derived_from(folder, &entry.path) {
            if !deleted.unsearched.contains(&derived) {
                deleted.unsearched.push(derived);
            }
            continue;
        }
        if entry.kind != EntryKind::File {
            deleted.unsearched.push(entry.path);
            continue;
        }
        let is_named = entry.path.strip_prefix(folder).is_ok_and(|below| {
            below.components().any(|part| part.as_os_str().to_string_lossy().contains(code))
        });
        let bytes = if is_named { Vec::new() } else { read_user_file(&entry.path, MAX_BYTES + 1)? };
        if bytes.len() as u64 > MAX_BYTES {
            deleted.unsearched.push(entry.path);
        } else if is_named || is_file_of(code, &entry.path, &bytes) {
            remove_file(&entry.path)?;
            // A folder with other files stays.
            let _ = entry.path.parent().filter(|p| p.ends_with(code)).map(remove_empty_folder);
            deleted.files.push(entry.path);
        } else if contains(&bytes, code.as_bytes()) {
            deleted.rows += remove_rows(code, &entry.path, &bytes)?;
            let left = read_user_file(&entry.path, MAX_BYTES)?;
            if contains(&left, code.as_bytes()) {
                deleted.unsearched.push(entry.path);
            }
        }
    }
    Ok(deleted)
}

/// Returns the data set without codes to which an entry belongs.
fn derived_from(folder: &Path, entry: &Path) -> Option<PathBuf> {
    let is_derived = |path: &&Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        path.starts_with(folder) && *path != folder && name.starts_with(DERIVED)
    };
    entry.ancestors().find(is_derived).map(Path::to_owned)
}

/// Returns whether a file holds the data of a participant.
fn is_file_of(code: &str, path: &Path, bytes: &[u8]) -> bool {
    let first = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
    path.extension().is_some_and(|ending| ending == "jsonl") && contains(first, code.as_bytes())
}

/// Removes the rows of a participant from a table; returns their number.
fn remove_rows(code: &str, path: &Path, bytes: &[u8]) -> Result<usize> {
    if path.extension().is_none_or(|ending| ending != "csv") {
        return Ok(0);
    }
    let start = format!("{code},");
    let (removed, kept): (Vec<&[u8]>, Vec<&[u8]>) = bytes
        .split_inclusive(|byte| *byte == b'\n')
        .partition(|row| row.starts_with(start.as_bytes()));
    write_atomically(path, &kept.concat())?;
    Ok(removed.len())
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}
