//! Folders of data sets.

use std::fs;
use std::path::{Path, PathBuf};

use chaic_files::{
    EntryKind, create_folders, kind, remove_empty_folder, remove_file, remove_folder,
    write_atomically,
};

use crate::card::DatasetDescription;
use crate::croissant;
use crate::error::ExportError;

/// Entries of the folders of data sets.
const ENTRIES: [&str; 6] = ["data", "episodes", "meta", "videos", "README.md", "croissant.json"];

/// Folder of a data set that is being written. If the data set is not finished, its content is removed.
#[derive(Debug)]
pub(crate) struct NewFolder {
    path: PathBuf,
    /// True if the folder did not exist before.
    is_new: bool,
    is_finished: bool,
}

impl NewFolder {
    /// Creates a folder, or accepts an empty one.
    pub(crate) fn create(path: &Path) -> Result<NewFolder, ExportError> {
        if fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some()) {
            return Err(ExportError::NotEmpty(path.to_owned()));
        }
        let is_new = !path.exists();
        create_folders(path)?;
        Ok(NewFolder { path: path.to_owned(), is_new, is_finished: false })
    }

    /// Returns the path of the folder.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Keeps the content: the data set is complete.
    pub(crate) fn finish(mut self) {
        self.is_finished = true;
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        if self.is_finished {
            return;
        }
        // If a removal fails too, the error before it is reported, and a repetition refuses the folder.
        for path in ENTRIES.map(|name| self.path.join(name)) {
            let _ = match kind(&path) {
                Ok(EntryKind::Folder) => remove_folder(&path),
                Ok(EntryKind::File) => remove_file(&path),
                _ => Ok(()),
            };
        }
        if self.is_new {
            let _ = remove_empty_folder(&self.path);
        }
    }
}

/// Writes the card `README.md` and the metadata `croissant.json`.
pub(crate) fn write_description(
    folder: &Path,
    id: &str,
    description: &DatasetDescription,
) -> Result<(), ExportError> {
    write_atomically(&folder.join("README.md"), description.to_markdown().as_bytes())?;
    let metadata = croissant::metadata(id, description);
    let text = serde_json::to_string_pretty(&metadata).expect("all keys are strings") + "\n";
    Ok(write_atomically(&folder.join("croissant.json"), text.as_bytes())?)
}
