//! Quality of the beliefs in traces: accuracy, speed of identification and calibration.
//!
//! `docs/metrics.md` defines the measures. [`read_scores`] computes them from the traces of a run,
//! and [`BeliefScores::text`] formats them.

mod episode;
mod measures;
mod report;
mod scores;

pub use episode::{EpisodeBelief, PROBABILITY_FRAMES, SAMPLE_EVERY_FRAMES};
pub use measures::{
    N_BINS, PROBABILITY_FLOOR, Sample, accuracy, expected_calibration_error, mean_log_score,
};
pub use scores::{BeliefScore, BeliefScores, HelperScores, HypothesisScore, read_scores};

#[cfg(test)]
mod tests;
