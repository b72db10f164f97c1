//! Contents of folders, to copy and compare them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result};

/// Locks have no content.
const LOCK: &str = ".lock";
/// The order of the lines of a journal is not specified.
const JOURNAL: &str = "results.jsonl";

/// Files by path below the folder.
pub type Contents = BTreeMap<String, Vec<u8>>;

/// Reads all files at a path below a folder, which may be a file or be missing. Omits locks, and
/// sorts the lines of journals.
///
/// # Errors
/// If the file system refuses.
pub fn contents(folder: &Path, names: &[&str]) -> Result<Contents> {
    let mut found = Contents::new();
    for name in names {
        read(&folder.join(name), name, &mut found)
            .with_context(|| format!("can't read {name} in {}", folder.display()))?;
    }
    Ok(found)
}

fn read(path: &Path, name: &str, found: &mut Contents) -> std::io::Result<()> {
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            let entry = entry?;
            let inner = format!("{name}/{}", entry.file_name().to_string_lossy());
            read(&entry.path(), &inner, found)?;
        }
    } else if path.exists() && !name.ends_with(LOCK) {
        let mut bytes = fs::read(path)?;
        if name.ends_with(JOURNAL) {
            let mut lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
            lines.sort_unstable();
            bytes = lines.concat();
        }
        found.insert(name.to_owned(), bytes);
    }
    Ok(())
}

/// Returns the names of files that differ or are missing on one side.
pub fn differences(a: &Contents, b: &Contents) -> Vec<String> {
    let names = a.keys().chain(b.keys().filter(|name| !a.contains_key(*name)));
    names.filter(|name| a.get(*name) != b.get(*name)).cloned().collect()
}

/// Copies a folder with its content.
///
/// # Errors
/// If the file system refuses.
pub fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), &target)?;
        }
    }
    Ok(())
}
