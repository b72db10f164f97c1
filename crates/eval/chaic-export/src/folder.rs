//! Folders of data sets.

use std::fs;
use std::path::Path;

use chaic_files::{create_folders, write_atomically};

use crate::card::DatasetDescription;
use crate::croissant;
use crate::error::ExportError;

/// Creates a folder, or accepts an empty one.
pub(crate) fn create_empty(folder: &Path) -> Result<(), ExportError> {
    if fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(ExportError::NotEmpty(folder.to_owned()));
    }
    Ok(create_folders(folder)?)
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
