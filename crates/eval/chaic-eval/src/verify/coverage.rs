//! Completeness of a run, and comparison of its report with its results.

use std::collections::BTreeSet;
use std::fmt;

use chaic_env::{CHAIC_VERSION, RunKey};

use crate::error::Result;
use crate::metrics::{FormulaSet, RunResult, RunStatus};
use crate::report::{Report, differing_files};
use crate::run::{EpisodeJob, RunFolder, RunOptions};

/// Numbers of planned, missing and failed episode runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// Number of planned episode runs; 0 if the episodes can't be read.
    pub planned: usize,
    /// Episode runs without a line in `results.jsonl`.
    pub missing: Vec<RunKey>,
    /// Failed episode runs.
    pub failed: Vec<RunKey>,
}

impl Coverage {
    pub(super) fn new(planned: &[EpisodeJob], results: &[RunResult]) -> Coverage {
        let recorded: BTreeSet<&RunKey> = results.iter().map(|r| &r.key).collect();
        let is_failed = |r: &&RunResult| matches!(r.status, RunStatus::Error { .. });
        Coverage {
            planned: planned.len(),
            missing: planned
                .iter()
                .map(|job| &job.key)
                .filter(|k| !recorded.contains(k))
                .cloned()
                .collect(),
            failed: results.iter().filter(is_failed).map(|r| r.key.clone()).collect(),
        }
    }

    /// Returns whether every episode run was played to its end.
    pub fn is_complete(&self) -> bool {
        self.missing.is_empty() && self.failed.is_empty()
    }
}

impl fmt::Display for Coverage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.planned - (self.missing.len() + self.failed.len()).min(self.planned);
        write!(f, "{n} of {} episode runs are finished", self.planned)?;
        for (keys, state) in [(&self.missing, "missing"), (&self.failed, "failed")] {
            if let Some(RunKey { helper, episode, seed, .. }) = keys.first() {
                let n = keys.len();
                write!(f, "; {state}: {n}, first {episode} with {helper} and seed {seed}")?;
            }
        }
        Ok(())
    }
}

/// Result of comparing the report's files with the results.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ReportState {
    /// The files were not compared.
    #[default]
    Unchecked,
    /// This other version of chaic started the run, so its report may differ.
    OtherVersion(String),
    /// The files were compared with the results.
    Compared {
        /// Names of missing files.
        missing: Vec<&'static str>,
        /// Names of files with other content, and of entries that are not regular files.
        altered: Vec<&'static str>,
    },
}

impl ReportState {
    pub(super) fn compare(
        folder: &RunFolder,
        options: &RunOptions,
        planned: &[EpisodeJob],
        results: &[RunResult],
    ) -> Result<ReportState> {
        if let Some(other) = folder.other_version()? {
            return Ok(ReportState::OtherVersion(other));
        }
        let (granted, formulas) = (folder.granted()?, FormulaSet::Paper);
        let (version, granted) = (CHAIC_VERSION, granted.as_ref());
        let report = Report { version, options, results, planned, granted, formulas };
        let (missing, altered) = differing_files(folder, &report)?;
        Ok(ReportState::Compared { missing, altered })
    }

    /// Returns whether the report was compared and has no differences.
    pub fn has_passed(&self) -> bool {
        matches!(self, ReportState::Compared { missing, altered } if missing.is_empty() && altered.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use chaic_core::TaskId;

    use super::*;

    #[test]
    fn missing_and_failed_runs_are_incomplete() {
        let key = || RunKey {
            task: TaskId::Obstacle,
            helper: "rhp".to_owned(),
            episode: "obstacle/test/00".to_owned(),
            seed: 0,
        };
        let all = Coverage { planned: 2, ..Coverage::default() };
        assert!(all.is_complete());
        assert!(!Coverage { missing: vec![key()], ..all.clone() }.is_complete());
        assert!(!Coverage { failed: vec![key()], ..all }.is_complete());
    }
}
