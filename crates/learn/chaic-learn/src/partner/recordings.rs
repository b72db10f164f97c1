//! Recordings of partners in files: a trace, or a folder with traces such as a run or the export of a
//! study.

use std::path::{Path, PathBuf};

use chaic_env::EnvError;
use chaic_env::recording::Recordings;
use chaic_env::trace::MAX_TRACE_BYTES;
use chaic_files::{EntryKind, FileError, read_bounded, read_user_file, walk};

/// Maximum depth of folders below the given folder: three levels of a run (`traces/TASK/HELPER`)
/// and one more.
const MAX_DEPTH: u32 = 4;
/// Extension of traces.
const EXTENSION: &str = "jsonl";

/// Reason why recordings cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingReadError {
    /// A file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file is no recording.
    #[error(transparent)]
    Recording(#[from] EnvError),
}

/// Reads a trace, or all traces in a folder. Other files in the folder are ignored, and so are traces of
/// people who play the helper.
///
/// # Errors
/// If the path is missing, a trace is damaged, the only trace is no recording of a partner, or a folder has
/// none or too many.
pub fn read_recordings(path: &Path) -> Result<Recordings, RecordingReadError> {
    // One byte more than the limit distinguishes a file at the limit from a longer one.
    let limit = MAX_TRACE_BYTES + 1;
    if !path.is_dir() {
        let file = read_user_file(path, limit).map(|bytes| (path.to_owned(), bytes));
        return Recordings::collect(path, std::iter::once(file.map_err(RecordingReadError::from)));
    }
    let is_trace = |path: &PathBuf| path.extension().is_some_and(|e| e == EXTENSION);
    let files = walk(path, MAX_DEPTH)?.into_iter().filter(|entry| entry.kind == EntryKind::File);
    let files = files.map(|entry| entry.path).filter(is_trace);
    let read = |path: PathBuf| read_bounded(&path, limit).map(|bytes| (path, bytes));
    Recordings::collect(path, files.map(|path| read(path).map_err(RecordingReadError::from)))
}
