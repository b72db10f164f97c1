//! The paper's metrics, computed from records.
//!
//! [`ResultAccumulator`] accumulates the records of one episode run into a [`RunResult`].
//! [`Scores::new`] computes scores from the results of a run by one of two [`Formulas`].
//! `docs/metrics.md` gives the formulas and their sources.

mod accumulators;
mod cluster;
mod differences;
mod formulas;
mod result;
mod robustness;
mod score;
mod scores;
mod significance;
mod stats;
mod table;
mod tally;

pub use accumulators::MetricAccumulator;
pub use cluster::{Clusters, Environments, Interval};
pub use differences::{
    Difference, HelperResults, MeanRate, Resolution, differences, mean_rate, paired_difference,
    resolution, run_differences,
};
pub use formulas::{FormulaSet, Formulas, SpreadStatistic};
pub use result::{Delivery, RunResult, RunStatus, Summary};
pub use robustness::{Estimate, HelperRobustness, PartnerGain, PartnerResults, robustness};
pub use score::{MAX_LISTED_RUNS, Score};
pub use scores::{PlayedEpisodes, Scores};
pub use significance::{holm, two_sided_p};
pub use stats::t_975;
pub use table::{METRICS, Metric, MetricSource};
pub use tally::{ResultAccumulator, result_of_trace};

#[cfg(test)]
pub(crate) mod tests;
