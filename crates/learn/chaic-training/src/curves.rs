//! Learning curves: the file of training and validation metrics.

use std::collections::BTreeMap;
use std::io::{self, Write as _};
use std::path::Path;

use chaic_files::{FileError, open_for_append, read_bounded, write_atomically};
use serde::{Deserialize, Deserializer, Serialize};

/// Name of the file of learning curves: one JSON object per line.
pub const CURVES: &str = "curves.jsonl";
/// Maximum size of a curves file that is truncated on resume, bytes: about three million lines.
const MAX_BYTES: u64 = 1 << 30;

/// Metric names of earlier versions with their current names. Files with the old names are still
/// read.
const RENAMED_METRICS: [(&str, &str); 9] = [
    ("objective", "policy_loss"),
    ("divergence", "approx_kl"),
    ("clipped", "clip_fraction"),
    ("lessons", "demonstrations"),
    ("tr_likeliest", "tr_greedy"),
    ("labels", "label_loss"),
    ("offsets", "offset_loss"),
    ("right", "accuracy"),
    ("right_of_things", "object_accuracy"),
];

/// Values of metrics by name.
pub type Metrics = BTreeMap<String, f64>;

/// Line of the curves file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurveRecord {
    /// Phase in which the metrics were measured.
    #[serde(alias = "of")]
    pub phase: Phase,
    /// Number of steps taken before this record.
    pub step: u64,
    /// Means over the steps since the last training record, or results of a validation.
    #[serde(flatten, deserialize_with = "read_metrics")]
    pub metrics: Metrics,
}

/// Phase of a training in which metrics are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Optimizer steps on training data.
    #[serde(alias = "loss")]
    Train,
    /// Evaluation on validation data.
    Validation,
}

/// Position of a line in the curves. Lines are written in increasing order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
pub(crate) struct Position {
    pub(crate) step: u64,
    #[serde(alias = "of")]
    pub(crate) phase: Phase,
}

fn read_metrics<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Metrics, D::Error> {
    let metrics = Metrics::deserialize(deserializer)?;
    Ok(metrics.into_iter().map(|(name, x)| (current_name(&name).to_owned(), x)).collect())
}

/// Returns the current name of a metric that may have the name of an earlier version.
pub(crate) fn current_name(name: &str) -> &str {
    let renamed = RENAMED_METRICS.iter().find(|(old, _)| *old == name);
    renamed.map_or(name, |(_, current)| *current)
}

/// Returns metrics from pairs of name and value.
pub fn metrics<const N: usize>(named: [(&str, f64); N]) -> Metrics {
    named.into_iter().map(|(name, x)| (name.to_owned(), x)).collect()
}

/// Returns metrics from pairs of name and value, without the undefined ones.
pub fn defined_metrics<const N: usize>(named: [(&str, Option<f64>); N]) -> Metrics {
    named.into_iter().filter_map(|(name, x)| Some((name.to_owned(), x?))).collect()
}

/// Returns the mean of each metric over the steps that have it.
pub(crate) fn mean(steps: &[Metrics]) -> Metrics {
    let n_steps = |name: &str| steps.iter().filter(|step| step.contains_key(name)).count();
    let mut means = Metrics::new();
    for (name, x) in steps.iter().flatten() {
        *means.entry(name.clone()).or_default() += x / n_steps(name) as f64;
    }
    means
}

/// Appends a line.
pub(crate) fn append(folder: &Path, record: &CurveRecord) -> Result<(), FileError> {
    let path = folder.join(CURVES);
    let line = serde_json::to_string(record).expect("a record serializes to JSON") + "\n";
    let mut file = open_for_append(&path)?;
    // The line must be on disk before the checkpoint that counts it as written.
    let written = file.write_all(line.as_bytes()).and_then(|()| file.sync_data());
    written.map_err(FileError::context("write", &path))
}

/// Returns whether a training has written curves.
pub(crate) fn has_lines(folder: &Path) -> bool {
    folder.join(CURVES).symlink_metadata().is_ok_and(|metadata| metadata.len() > 0)
}

/// Removes the lines after `last`, and lines that are incomplete or repeated. Returns the position of
/// the last line that is left.
///
/// A killed training may have written lines after its last checkpoint; it writes them again.
pub(crate) fn truncate_after(
    folder: &Path,
    last: Option<Position>,
) -> Result<Option<Position>, FileError> {
    let path = folder.join(CURVES);
    if !path.exists() {
        return Ok(None);
    }
    let bytes = read_bounded(&path, MAX_BYTES)?;
    if bytes.len() as u64 == MAX_BYTES {
        let error = io::Error::other(format!("it has more than {MAX_BYTES} bytes"));
        return Err(FileError::context("read", &path)(error));
    }
    let mut kept = Vec::new();
    let mut previous = None;
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let position: Option<Position> = serde_json::from_slice(line).ok();
        let is_next = |at: &Position| Some(*at) > previous && Some(*at) <= last;
        if let Some(at) = position.filter(|at| line.ends_with(b"\n") && is_next(at)) {
            kept.extend_from_slice(line);
            previous = Some(at);
        }
    }
    if kept != bytes {
        write_atomically(&path, &kept)?;
    }
    Ok(previous)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn lines_after_the_checkpoint_and_incomplete_lines_are_removed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(CURVES);
        let line = |phase: Phase, step| {
            let record = CurveRecord { phase, step, metrics: metrics([("loss", 0.5)]) };
            serde_json::to_string(&record).unwrap() + "\n"
        };
        let kept =
            [line(Phase::Train, 20), line(Phase::Train, 40), line(Phase::Validation, 40)].concat();
        let after = [line(Phase::Train, 60), line(Phase::Validation, 60)].concat();
        let truncated = |text: &str, last| {
            fs::write(&path, text).unwrap();
            truncate_after(dir.path(), last).unwrap();
            fs::read_to_string(&path).unwrap()
        };
        let last = Some(Position { step: 40, phase: Phase::Validation });
        for tail in ["", &after, &after[..30], &kept, "{\"phase\":\"train\",\"st", "\n\u{0}"] {
            assert_eq!(truncated(&format!("{kept}{tail}"), last), kept, "{tail}");
        }
        let before_validation = Some(Position { step: 40, phase: Phase::Train });
        let without = [line(Phase::Train, 20), line(Phase::Train, 40)].concat();
        assert_eq!(truncated(&kept, before_validation), without);
        assert_eq!(truncated(&kept, None), "");
        fs::remove_file(&path).unwrap();
        truncate_after(dir.path(), last).unwrap();
        assert!(!path.exists());
    }

    #[test]
    fn lines_of_earlier_versions_are_read_under_current_names() {
        let old =
            r#"{"of":"loss","step":7,"clipped":0.25,"divergence":0.5,"objective":-1.0,"tr":0.75}"#;
        let new = r#"{"phase":"train","step":7,"approx_kl":0.5,"clip_fraction":0.25,"policy_loss":-1.0,"tr":0.75}"#;
        let record: CurveRecord = serde_json::from_str(old).unwrap();
        assert_eq!(record, serde_json::from_str(new).unwrap());
        assert_eq!(serde_json::to_string(&record).unwrap(), new);
        let validation: CurveRecord =
            serde_json::from_str(r#"{"of":"validation","step":8,"tr":0.5}"#).unwrap();
        assert_eq!(validation.phase, Phase::Validation);
        // Resumed trainings keep lines of both versions.
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(CURVES);
        let text = format!("{old}\n{}\n", new.replace("\"step\":7", "\"step\":8"));
        fs::write(&path, &text).unwrap();
        truncate_after(dir.path(), Some(Position { step: 8, phase: Phase::Train })).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }
}
