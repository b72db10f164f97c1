//! Access within the file system that a command without namespaces shares with the caller.

use std::fs;
use std::path::{Path, PathBuf};

use super::landlock::Access;
use crate::policy::{DEVICES, Policy, SYSTEM_FILES, SYSTEM_FOLDERS};

/// Maximum number of readable entries of a folder that contains a masked one.
const MAX_ENTRIES: usize = 10_000;

/// Returns the access to the readable paths of a policy and to a private folder.
///
/// Landlock cannot exclude a path below a readable folder. In a folder that contains a masked path,
/// each other entry is therefore readable by itself. The command cannot list such a folder.
pub(super) fn access(policy: &Policy, scratch: PathBuf) -> Access {
    let masked: Vec<PathBuf> = policy.masked.iter().map(|path| resolve(path)).collect();
    let system = SYSTEM_FOLDERS.iter().chain(SYSTEM_FILES).map(Path::new);
    let readable = system.chain(policy.readable.iter().map(PathBuf::as_path));
    let mut read = Vec::new();
    for path in readable {
        add_unmasked(resolve(path), &masked, &mut read);
    }
    let devices = DEVICES.iter().map(PathBuf::from).collect();
    Access { read, write: vec![scratch], devices }
}

/// Resolves the links in a path; returns a path that does not exist as it is.
fn resolve(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// Adds a path without links. If it contains a masked one, adds its other entries instead.
fn add_unmasked(path: PathBuf, masked: &[PathBuf], read: &mut Vec<PathBuf>) {
    if masked.iter().any(|folder| path.starts_with(folder)) {
        return;
    }
    if !masked.iter().any(|folder| folder.starts_with(&path)) {
        read.push(path);
        return;
    }
    let Ok(entries) = fs::read_dir(&path) else { return };
    for entry in entries.flatten().take(MAX_ENTRIES) {
        // A rule for a link would open its target, which may be anywhere.
        if entry.file_type().is_ok_and(|kind| !kind.is_symlink()) {
            add_unmasked(entry.path(), masked, read);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    /// Creates folders with files, the link `alias` to `data`, and two links inside `data`.
    fn folders() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let top = dir.path().canonicalize().unwrap();
        for folder in ["data/run", "data/runs", "other"] {
            fs::create_dir_all(top.join(folder)).unwrap();
        }
        for file in ["data/weights", "data/run/run.json", "other/secret"] {
            fs::write(top.join(file), "x").unwrap();
        }
        symlink(top.join("data"), top.join("alias")).unwrap();
        symlink(top.join("other"), top.join("data/out")).unwrap();
        symlink(top.join("data/run"), top.join("data/again")).unwrap();
        (dir, top)
    }

    fn readable(top: &Path, readable: &str, masked: &str) -> Vec<PathBuf> {
        let policy = Policy {
            start_folder: top.to_owned(),
            readable: vec![top.join(readable)],
            masked: vec![top.join(masked)],
            memory_mib: 1,
            scratch_mib: 1,
            max_tasks: 1,
        };
        let access = access(&policy, top.join("scratch"));
        assert_eq!(access.write, [top.join("scratch")]);
        assert!(access.read.contains(&resolve(Path::new("/usr"))), "{:?}", access.read);
        let below = |path: &PathBuf| path.strip_prefix(top).ok().map(Path::to_owned);
        let mut found: Vec<PathBuf> = access.read.iter().filter_map(below).collect();
        found.sort();
        found
    }

    #[test]
    fn a_masked_folder_is_not_readable_by_any_of_its_names() {
        let (_dir, top) = folders();
        let entries = [Path::new("data/runs"), Path::new("data/weights")];
        for (folder, masked) in [
            ("data", "data/run"),
            ("alias", "data/run"),
            ("data", "alias/run"),
            ("alias", "alias/run"),
        ] {
            assert_eq!(readable(&top, folder, masked), entries, "{folder}, {masked}");
        }
        let others = [Path::new("data/run"), Path::new("data/runs")];
        assert_eq!(readable(&top, "data", "data/weights"), others, "a file is masked too");
        let above = readable(&top, ".", "data/run");
        assert_eq!(above, [entries[0], entries[1], Path::new("other")]);
    }

    #[test]
    fn a_path_inside_a_masked_folder_is_not_readable() {
        let (_dir, top) = folders();
        for inside in ["data", "data/weights", "data/again", "alias/run/run.json"] {
            assert!(readable(&top, inside, "data").is_empty(), "{inside}");
        }
        assert_eq!(readable(&top, "data/runs", "data/run"), [Path::new("data/runs")]);
        assert_eq!(readable(&top, "other", "missing"), [Path::new("other")]);
        // A folder that does not exist yet is masked too.
        assert_eq!(readable(&top, "other", "other/missing"), [Path::new("other/secret")]);
    }
}
