//! Scores of one helper in one task.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Maximum number of missing episode runs that are listed; a plan may have millions.
pub const MAX_LISTED_RUNS: usize = 20;

/// Scores of one helper in one task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Transport rate, 0 to 1: mean over episodes and seeds.
    pub tr: f64,
    /// Standard error of `tr` over environments; by the original's formulas, its standard deviation
    /// over episodes and seeds.
    pub tr_se: Option<f64>,
    /// 95 % interval of `tr` over environments, clamped to 0 to 1.
    pub tr_ci: Option<[f64; 2]>,
    /// Efficiency improvement over the same episodes without helper, -1 to 1.
    pub ei: Option<f64>,
    /// 95 % interval of `ei` over environments, clamped to -1 to 1.
    pub ei_ci: Option<[f64; 2]>,
    /// Goal inference accuracy, 0 to 1: fraction of the helper's deliveries that were part of the
    /// goal.
    pub ia: Option<f64>,
    /// Completion ratio, 0 to 1: fraction of the delivered goal that the helper delivered.
    pub cr: Option<f64>,
    /// Emergency rate, 0 to 1: fraction of frames in which the child was away.
    pub er: Option<f64>,
    /// Fraction of frames in which the partner or the helper was stuck, 0 to 1.
    pub stuck: Option<f64>,
    /// Means of the diagnostic metrics of [`METRICS`](crate::metrics::METRICS) over the completed
    /// episode runs that have them, by key.
    #[serde(default, rename = "measures", skip_serializing_if = "BTreeMap::is_empty")]
    pub diagnostics: BTreeMap<String, f64>,
    /// Number of episode runs (episodes times seeds), including failed ones.
    pub episodes: usize,
    /// Number of environments in which they take place.
    pub environments: usize,
    /// Number of these runs that failed; they count as zero.
    #[serde(rename = "broken")]
    pub failed: usize,
    /// True if episode runs are missing.
    #[serde(default)]
    pub incomplete: bool,
    /// First [`MAX_LISTED_RUNS`] missing runs, as `EPISODE seed SEED`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
}
