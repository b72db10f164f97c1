//! The paper's metrics, from what was recorded.
//!
//! [`Tally`] reads the records of one episode and leaves a [`RunResult`]; [`Scores::of`] turns the
//! results of a run into scores by one of two [`Formulas`]. `docs/metrics.md` gives the formulas
//! and where they come from.

mod formulas;
mod result;
mod scores;
mod stats;
mod tally;

pub use formulas::{FormulaSet, Formulas, Spread};
pub use result::{Delivery, Ending, RunKey, RunResult, Summary};
pub use scores::{Difference, Score, Scores, differences, episode_rates};
pub use stats::{Interval, mean_interval, paired_interval, sample_sd};
pub use tally::{Tally, tally};

#[cfg(test)]
mod tests;
