//! Learning curves: the file of losses and validations.

use std::collections::BTreeMap;
use std::io::{self, Write as _};
use std::path::Path;

use chaic_files::{FileError, open_to_append, read_bounded, write_whole};
use serde::{Deserialize, Serialize};

/// Losses and validations, a JSON object a line.
pub const CURVES: &str = "curves.jsonl";
/// Largest file of curves that is cut back, bytes: some three million lines.
const MAX_BYTES: u64 = 1 << 30;

/// Numbers with their names.
pub type Figures = BTreeMap<String, f64>;

/// A line of the curves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// What the figures are of.
    pub of: Of,
    /// After so many steps.
    pub step: u64,
    /// The figures: means over the steps since the last record, or those of a validation.
    #[serde(flatten)]
    pub figures: Figures,
}

/// What figures are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Of {
    /// What is learned from.
    Loss,
    /// What nothing is learned from.
    Validation,
}

/// Position of a line in the curves. Lines are written in increasing order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
pub(crate) struct Position {
    pub(crate) step: u64,
    pub(crate) of: Of,
}

/// Returns figures of these names.
pub fn figures<const N: usize>(named: [(&str, f64); N]) -> Figures {
    named.into_iter().map(|(name, x)| (name.to_owned(), x)).collect()
}

/// Returns the mean of each figure.
pub(crate) fn mean(steps: &[Figures]) -> Figures {
    let mut sums = Figures::new();
    for (name, x) in steps.iter().flatten() {
        *sums.entry(name.clone()).or_default() += x / steps.len() as f64;
    }
    sums
}

/// Appends a line.
pub(crate) fn append(folder: &Path, record: &Record) -> Result<(), FileError> {
    let path = folder.join(CURVES);
    let line = serde_json::to_string(record).expect("a record is plain data") + "\n";
    let mut file = open_to_append(&path)?;
    // On the disk before the checkpoint that counts on it.
    let written = file.write_all(line.as_bytes()).and_then(|()| file.sync_data());
    written.map_err(FileError::of("can't write", &path))
}

/// Returns whether a training has left curves.
pub(crate) fn is_begun(folder: &Path) -> bool {
    folder.join(CURVES).symlink_metadata().is_ok_and(|found| found.len() > 0)
}

/// Removes the lines behind `last`, and lines that are cut off or repeated.
///
/// A training that was killed may have written lines after its last checkpoint; it writes them again.
pub(crate) fn cut_back(folder: &Path, last: Option<Position>) -> Result<(), FileError> {
    let path = folder.join(CURVES);
    if !path.exists() {
        return Ok(());
    }
    let bytes = read_bounded(&path, MAX_BYTES)?;
    if bytes.len() as u64 == MAX_BYTES {
        let refusal = io::Error::other(format!("it has more than {MAX_BYTES} bytes"));
        return Err(FileError::of("read", &path)(refusal));
    }
    let mut kept = Vec::new();
    let mut before = None;
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let position: Option<Position> = serde_json::from_slice(line).ok();
        let is_next = |at: &Position| Some(*at) > before && Some(*at) <= last;
        if let Some(at) = position.filter(|at| line.ends_with(b"\n") && is_next(at)) {
            kept.extend_from_slice(line);
            before = Some(at);
        }
    }
    if kept == bytes { Ok(()) } else { write_whole(&path, &kept) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn lines_behind_the_checkpoint_and_halves_of_lines_are_removed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(CURVES);
        let line = |of: Of, step| {
            let record = Record { of, step, figures: figures([("loss", 0.5)]) };
            serde_json::to_string(&record).unwrap() + "\n"
        };
        let kept = [line(Of::Loss, 20), line(Of::Loss, 40), line(Of::Validation, 40)].concat();
        let behind = [line(Of::Loss, 60), line(Of::Validation, 60)].concat();
        let cut = |text: &str, last| {
            fs::write(&path, text).unwrap();
            cut_back(dir.path(), last).unwrap();
            fs::read_to_string(&path).unwrap()
        };
        let last = Some(Position { step: 40, of: Of::Validation });
        for tail in ["", &behind, &behind[..30], &kept, "{\"of\":\"loss\",\"step\":1", "\n\u{0}"] {
            assert_eq!(cut(&format!("{kept}{tail}"), last), kept, "{tail}");
        }
        let before_validation = Some(Position { step: 40, of: Of::Loss });
        let without = [line(Of::Loss, 20), line(Of::Loss, 40)].concat();
        assert_eq!(cut(&kept, before_validation), without);
        assert_eq!(cut(&kept, None), "");
        fs::remove_file(&path).unwrap();
        cut_back(dir.path(), last).unwrap();
        assert!(!path.exists());
    }
}
