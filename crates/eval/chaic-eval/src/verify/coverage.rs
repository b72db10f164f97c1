//! How much of a run is there, and whether its report is what its results give.

use std::collections::BTreeSet;
use std::fmt;

use chaic_env::RunKey;

use crate::error::Result;
use crate::metrics::{Ending, FormulaSet, RunResult};
use crate::report::{Report, differing_files};
use crate::run::{Item, RunFolder, RunOptions};

/// How many of the episode runs that a run consists of have a result.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// All episode runs; 0 where the run's episodes are gone.
    pub planned: usize,
    /// Those without a line in `results.jsonl`.
    pub missing: Vec<RunKey>,
    /// Those that broke down.
    pub broken: Vec<RunKey>,
}

impl Coverage {
    pub(super) fn of(planned: &[Item], results: &[RunResult]) -> Coverage {
        let noted: BTreeSet<&RunKey> = results.iter().map(|r| &r.key).collect();
        let is_broken = |r: &&RunResult| matches!(r.ending, Ending::Error { .. });
        Coverage {
            planned: planned.len(),
            missing: planned
                .iter()
                .map(|i| &i.key)
                .filter(|k| !noted.contains(k))
                .cloned()
                .collect(),
            broken: results.iter().filter(is_broken).map(|r| r.key.clone()).collect(),
        }
    }

    /// Whether every episode run was played to its end.
    pub fn is_whole(&self) -> bool {
        self.missing.is_empty() && self.broken.is_empty()
    }
}

impl fmt::Display for Coverage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.planned - (self.missing.len() + self.broken.len()).min(self.planned);
        write!(f, "{n} of {} episode runs are finished", self.planned)?;
        for (keys, what) in [(&self.missing, "missing"), (&self.broken, "broke down")] {
            if let Some(RunKey { helper, episode, seed, .. }) = keys.first() {
                let n = keys.len();
                write!(f, "; {what}: {n}, first {episode} with {helper} and seed {seed}")?;
            }
        }
        Ok(())
    }
}

/// What comparing the report's files with the results found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ReportState {
    /// No comparison was made.
    #[default]
    Unchecked,
    /// This version of chaic began the run, so it writes another report.
    OfOtherVersion(String),
    /// The files were compared with the results.
    Compared {
        /// Names of missing files.
        missing: Vec<&'static str>,
        /// Names of files with other content, and of entries that are not regular files.
        altered: Vec<&'static str>,
    },
}

impl ReportState {
    pub(super) fn of(
        folder: &RunFolder,
        options: &RunOptions,
        planned: &[Item],
        results: &[RunResult],
    ) -> Result<ReportState> {
        if let Some(other) = folder.other_version()? {
            return Ok(ReportState::OfOtherVersion(other));
        }
        let (granted, formulas) = (folder.granted()?, FormulaSet::Paper);
        let report = Report { options, results, planned, granted: granted.as_ref(), formulas };
        let (missing, altered) = differing_files(folder, &report)?;
        Ok(ReportState::Compared { missing, altered })
    }

    /// Returns whether the report was compared and equals what the results give.
    pub fn is_good(&self) -> bool {
        matches!(self, ReportState::Compared { missing, altered } if missing.is_empty() && altered.is_empty())
    }
}
