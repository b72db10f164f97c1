//! The paper's metrics, from what was recorded.
//!
//! [`Tally`] reads the records of one episode and leaves a [`RunResult`]; [`Scores::of`] turns the
//! results of a run into scores by one of two [`Formulas`]. `docs/metrics.md` gives the formulas
//! and where they come from.

mod cluster;
mod differences;
mod formulas;
mod measures;
mod result;
mod scores;
mod stats;
mod table;
mod tally;

pub use cluster::{Clusters, Environments, Interval};
pub use differences::{Difference, Resolution, differences, resolution};
pub use formulas::{FormulaSet, Formulas, Spread};
pub use measures::{Fold, MEASURES, Measure};
pub use result::{Delivery, Ending, RunResult, Summary};
pub use scores::{MAX_NAMED, Played, Score, Scores};
pub use stats::t_975;
pub use table::{METRICS, Metric};
pub use tally::{Tally, tally};

#[cfg(test)]
mod tests;
