//! Paths in archives.

use std::collections::BTreeMap;

use super::{MAX_DEPTH, MAX_PATH_BYTES};

/// Characters of names besides letters and digits. No other character is allowed, so that names mean the
/// same on every file system.
const NAME_CHARACTERS: &str = "._-+=,@()[]~ ";

/// Checks that a path is relative and consists of plain names: no `.` or `..`, no separators of other
/// systems, no characters with several encodings.
///
/// # Errors
/// The problem, as the end of a sentence that begins with the path.
pub fn check_path(path: &[u8]) -> Result<&str, String> {
    let is_allowed = |byte: &u8| {
        byte.is_ascii_alphanumeric() || *byte == b'/' || NAME_CHARACTERS.contains(char::from(*byte))
    };
    if path.is_empty() {
        return Err("has no path".to_owned());
    }
    if path.len() > MAX_PATH_BYTES {
        return Err(format!("is longer than {MAX_PATH_BYTES} bytes"));
    }
    if path[0] == b'/' {
        return Err("is an absolute path".to_owned());
    }
    if !path.iter().all(is_allowed) {
        return Err(format!(
            "has other characters than ASCII letters, digits and {NAME_CHARACTERS:?}"
        ));
    }
    let text = str::from_utf8(path).map_err(|_| "is not ASCII".to_owned())?;
    let names: Vec<&str> = text.split('/').collect();
    if names.contains(&"..") {
        return Err("leads out of the archive by `..`".to_owned());
    }
    if names.iter().any(|name| name.is_empty() || *name == ".") {
        return Err("has an empty name or `.` between slashes".to_owned());
    }
    // Windows drops these, so that two names become one.
    if names.iter().any(|name| name.ends_with(['.', ' ']) || name.starts_with(' ')) {
        return Err("has a name that begins with a space or ends with a space or dot".to_owned());
    }
    if names.len() > MAX_DEPTH {
        return Err(format!("has more than {MAX_DEPTH} names"));
    }
    Ok(text)
}

/// Paths of the entries so far. Each path occurs once, and paths differ in more than case.
#[derive(Debug, Default)]
pub(super) struct Paths {
    /// Files and folders, by the path in lower case.
    known: BTreeMap<String, Known>,
}

#[derive(Debug)]
struct Known {
    path: String,
    is_folder: bool,
    /// True if it has an entry of its own, and is not only the folder of another entry.
    has_entry: bool,
}

impl Paths {
    /// Adds the path of a file or folder.
    ///
    /// # Errors
    /// The conflict with an earlier path, as the end of a sentence that begins with the path.
    pub fn add(&mut self, path: &str, is_folder: bool) -> Result<(), String> {
        for (at, _) in path.match_indices('/') {
            let folder = &path[..at];
            let known = self.known.entry(folder.to_ascii_lowercase()).or_insert_with(|| Known {
                path: folder.to_owned(),
                is_folder: true,
                has_entry: false,
            });
            if known.path != folder {
                return Err(format!("differs from `{}` in case only", known.path));
            }
            if !known.is_folder {
                return Err(format!("lies below `{}`, which is a file", known.path));
            }
        }
        let key = path.to_ascii_lowercase();
        let Some(known) = self.known.get_mut(&key) else {
            let known = Known { path: path.to_owned(), is_folder, has_entry: true };
            self.known.insert(key, known);
            return Ok(());
        };
        if known.path != path {
            return Err(format!("differs from `{}` in case only", known.path));
        }
        if known.has_entry || !known.is_folder || !is_folder {
            return Err("occurs twice".to_owned());
        }
        known.has_entry = true;
        Ok(())
    }
}
