//! Measures of predicted probabilities.

use chaic_core::geom::math;

/// Number of equal bins of the expected calibration error.
pub const N_BINS: usize = 10;
/// Smallest probability of a log score: half of the step of recorded probabilities.
pub const PROBABILITY_FLOOR: f64 = 0.0005;

/// Prediction at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Probability of the most likely hypothesis, 0 to 1.
    pub confidence: f64,
    /// True if the most likely hypothesis is the true one.
    pub is_correct: bool,
    /// Probability of the true hypothesis, 0 to 1.
    pub true_probability: f64,
}

/// Returns the share of correct predictions; `None` without samples.
pub fn accuracy(samples: &[Sample]) -> Option<f64> {
    mean(samples.iter().map(|sample| f64::from(u8::from(sample.is_correct))))
}

/// Returns the expected calibration error (Naeini et al. 2015): the mean of
/// |accuracy − mean confidence| over [`N_BINS`] equal bins of the confidence, weighted by the number
/// of samples. A bin contains its lower end; the last one also contains 1. `None` without samples.
///
/// ```
/// use chaic_eval::calibration::{Sample, expected_calibration_error};
/// let sample = Sample { confidence: 0.75, is_correct: true, true_probability: 0.75 };
/// assert_eq!(expected_calibration_error(&[sample]), Some(0.25));
/// ```
pub fn expected_calibration_error(samples: &[Sample]) -> Option<f64> {
    let mut bins: [Vec<Sample>; N_BINS] = Default::default();
    for sample in samples {
        let bin = (sample.confidence * N_BINS as f64) as usize;
        bins[bin.min(N_BINS - 1)].push(*sample);
    }
    let error = |bin: &Vec<Sample>| {
        let confidence = mean(bin.iter().map(|sample| sample.confidence))?;
        Some(bin.len() as f64 * (accuracy(bin)? - confidence).abs())
    };
    let sum: f64 = bins.iter().filter_map(error).sum();
    (!samples.is_empty()).then(|| sum / samples.len() as f64)
}

/// Returns the mean natural logarithm of the probability of the true hypothesis, at least
/// [`PROBABILITY_FLOOR`]; `None` without samples. 0 is the best value.
///
/// ```
/// use chaic_eval::calibration::{Sample, mean_log_score};
/// let sample = Sample { confidence: 1.0, is_correct: true, true_probability: 1.0 };
/// assert_eq!(mean_log_score(&[sample]), Some(0.0));
/// ```
pub fn mean_log_score(samples: &[Sample]) -> Option<f64> {
    let floored = samples.iter().map(|sample| sample.true_probability.max(PROBABILITY_FLOOR));
    mean(floored.map(|p| f64::from(math::ln(p as f32))))
}

/// Returns the mean; `None` without values.
pub(super) fn mean(values: impl ExactSizeIterator<Item = f64>) -> Option<f64> {
    let n = values.len();
    (n > 0).then(|| values.sum::<f64>() / n as f64)
}

/// Returns the median of frames, with the mean of both middle ones for an even number. `None` counts
/// as later than all frames; the median is `None` if it is one of them.
pub(super) fn median_frame(frames: &[Option<u32>]) -> Option<f64> {
    let mut sorted = frames.to_vec();
    sorted.sort_by_key(|frame| frame.map_or(u64::MAX, u64::from));
    let n = sorted.len();
    let (low, high) = (sorted.get(n.checked_sub(1)? / 2)?, sorted.get(n / 2)?);
    Some(0.5 * (f64::from((*low)?) + f64::from((*high)?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(confidence: f64, is_correct: bool) -> Sample {
        let true_probability = if is_correct { confidence } else { 1.0 - confidence };
        Sample { confidence, is_correct, true_probability }
    }

    fn assert_near(value: Option<f64>, expected: f64) {
        assert!(value.is_some_and(|v| (v - expected).abs() < 1e-6), "{value:?}, not {expected}");
    }

    #[test]
    fn the_calibration_error_is_the_weighted_gap_of_the_bins() {
        // Bin 0.7 to 0.8: confidences 0.70 and 0.78, mean 0.74, accuracy 0.5: gap 0.24.
        // Bin 0.9 to 1: confidences 0.92 and 1, mean 0.96, accuracy 1: gap 0.04.
        // (2 x 0.24 + 2 x 0.04) / 4 = 0.14.
        let samples =
            [sample(0.7, true), sample(0.78, false), sample(0.92, true), sample(1.0, true)];
        assert_near(expected_calibration_error(&samples), 0.14);
        assert_near(accuracy(&samples), 0.75);
        // Half of the predictions with 0.5 are correct: no error.
        assert_near(expected_calibration_error(&[sample(0.5, true), sample(0.5, false)]), 0.0);
        // 0.79 and 0.8 are in different bins: (0.21 + 0.8) / 2.
        let samples = [sample(0.79, true), sample(0.8, false)];
        assert_near(expected_calibration_error(&samples), 0.505);
        assert_eq!(expected_calibration_error(&[]), None);
    }

    #[test]
    fn the_log_score_has_a_floor() {
        let with = |true_probability| Sample { true_probability, ..sample(1.0, false) };
        assert_near(mean_log_score(&[with(1.0)]), 0.0);
        // ln 0.5 = -0.693147, ln 0.0005 = -7.600902.
        assert_near(mean_log_score(&[with(0.5)]), -std::f64::consts::LN_2);
        assert_near(mean_log_score(&[with(0.0)]), -7.600_902_5);
        assert_near(mean_log_score(&[with(1.0), with(0.5)]), -0.346_573_6);
        assert_eq!(mean_log_score(&[]), None);
    }

    #[test]
    fn unidentified_runs_are_later_than_all_frames() {
        assert_eq!(median_frame(&[]), None);
        assert_eq!(median_frame(&[Some(300)]), Some(300.0));
        assert_eq!(median_frame(&[Some(500), Some(300)]), Some(400.0));
        assert_eq!(median_frame(&[None, Some(900), Some(300)]), Some(900.0));
        assert_eq!(median_frame(&[None, Some(300)]), None);
        assert_eq!(median_frame(&[None, None, Some(300)]), None);
    }
}
