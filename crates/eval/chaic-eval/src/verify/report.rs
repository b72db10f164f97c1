//! Result of verifying a run.

use chaic_env::trace::TraceWarning;

use super::mismatch::Mismatch;
use super::{Coverage, Finding, ReportState};

/// Result of verifying a run.
#[derive(Clone, Debug, Default)]
pub struct VerificationReport {
    /// Number of traces without a difference.
    pub agreeing: usize,
    /// Number of decisions in all traces.
    pub decisions: usize,
    /// First difference of each differing trace, by path.
    pub mismatches: Vec<Mismatch>,
    /// Other problems in the run's folder.
    pub findings: Vec<Finding>,
    /// Files that could only be read in part.
    pub warnings: Vec<TraceWarning>,
    /// Numbers of planned, missing and failed episode runs.
    pub coverage: Coverage,
    /// Comparison of the report with the results.
    pub report: ReportState,
}

impl VerificationReport {
    /// Returns whether every episode run was played to its end, and every check was made and passed.
    pub fn has_passed(&self) -> bool {
        self.is_consistent() && self.coverage.failed.is_empty()
    }

    /// Returns whether no episode run is missing, and every check was made and passed. Failed episode
    /// runs, which score zero, are allowed.
    pub fn is_consistent(&self) -> bool {
        self.mismatches.is_empty()
            && self.findings.is_empty()
            && self.warnings.is_empty()
            && self.coverage.missing.is_empty()
            && self.report.has_passed()
    }
}
