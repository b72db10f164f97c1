//! Score calibration: logistic regression of the probability that a detection is correct, fitted on
//! views of helpers. Uncalibrated probabilities are too high, because pixels of small objects have
//! large weights in the loss.

use serde::{Deserialize, Serialize};

use crate::loss::{ln, sigmoid};

/// Number of predictors: the constant 1, log odds of the mean probability, log of the number of
/// pixels, log of the distance in meters.
pub const N_PREDICTORS: usize = 4;

/// Coefficients of the regression.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Coefficient of each predictor.
    pub coefficients: [f32; N_PREDICTORS],
}

impl Default for Calibration {
    /// Returns the identity: the mean probability stays as it is.
    fn default() -> Calibration {
        Calibration { coefficients: [0.0, 1.0, 0.0, 0.0] }
    }
}

/// Detection in a view with known labels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationSample {
    /// Predictors of the detection.
    pub predictors: [f32; N_PREDICTORS],
    /// True if its IoU with an instance of its label is 0.5 or more.
    pub is_correct: bool,
}

/// Returns the predictors of a detection with this uncalibrated score, number of pixels, and center
/// in the camera's frame, meters.
pub fn predictors(score: f32, n_pixels: usize, center: [f32; 3]) -> [f32; N_PREDICTORS] {
    let p = score.clamp(0.01, 0.99);
    let [x, y, z] = center;
    let distance_m = (x * x + y * y + z * z).sqrt().max(0.1);
    [1.0, ln(p / (1.0 - p)), ln(n_pixels.max(1) as f32), ln(distance_m)]
}

impl Calibration {
    /// Returns the probability that a detection with these predictors is correct.
    pub fn probability(&self, predictors: &[f32; N_PREDICTORS]) -> f32 {
        let log_odds: f32 = self.coefficients.iter().zip(predictors).map(|(f, x)| f * x).sum();
        sigmoid(log_odds)
    }

    /// Fits the coefficients by Newton's method with weak L2 regularization.
    pub fn fit(samples: &[CalibrationSample]) -> Calibration {
        const STEPS: usize = 20;
        const L2: f64 = 1e-3;
        let mut coefficients = [0.0f64; N_PREDICTORS];
        for _ in 0..STEPS {
            let mut gradient = coefficients.map(|f| -L2 * f);
            let mut hessian = [[0.0f64; N_PREDICTORS]; N_PREDICTORS];
            (0..N_PREDICTORS).for_each(|i| hessian[i][i] = L2);
            for sample in samples {
                let current = Calibration { coefficients: coefficients.map(|f| f as f32) };
                let p = f64::from(current.probability(&sample.predictors));
                let x = sample.predictors.map(f64::from);
                let error = f64::from(u8::from(sample.is_correct)) - p;
                for i in 0..N_PREDICTORS {
                    gradient[i] += error * x[i];
                    for j in 0..N_PREDICTORS {
                        hessian[i][j] += p * (1.0 - p) * x[i] * x[j];
                    }
                }
            }
            let step = solve(hessian, gradient);
            (0..N_PREDICTORS).for_each(|i| coefficients[i] += step[i]);
        }
        Calibration { coefficients: coefficients.map(|f| f as f32) }
    }
}

/// Solves a small symmetric linear system by elimination.
fn solve(
    mut a: [[f64; N_PREDICTORS]; N_PREDICTORS],
    mut b: [f64; N_PREDICTORS],
) -> [f64; N_PREDICTORS] {
    for i in 0..N_PREDICTORS {
        for j in i + 1..N_PREDICTORS {
            let (factor, row) = (a[j][i] / a[i][i], a[i]);
            a[j].iter_mut().zip(row).for_each(|(x, y)| *x -= factor * y);
            b[j] -= factor * b[i];
        }
    }
    for i in (0..N_PREDICTORS).rev() {
        for k in i + 1..N_PREDICTORS {
            b[i] -= a[i][k] * b[k];
        }
        b[i] /= a[i][i];
    }
    b
}

/// Returns the expected calibration error over ten bins: the mean absolute difference between
/// probability and accuracy, weighted by the number of samples of each bin.
pub fn calibration_error(scored: &[(f32, bool)]) -> f64 {
    let weighted = scored.iter().map(|(p, is_correct)| (*p, *is_correct, 1.0));
    weighted_calibration_error(&weighted.collect::<Vec<_>>())
}

/// Returns the expected calibration error of weighted samples; 0 without samples.
pub fn weighted_calibration_error(scored: &[(f32, bool, f64)]) -> f64 {
    const BINS: usize = 10;
    let mut bins = [(0.0f64, 0.0f64); BINS];
    let mut total = 0.0;
    for (p, is_correct, weight) in scored {
        let bin = &mut bins[((p * BINS as f32) as usize).min(BINS - 1)];
        bin.0 += weight * f64::from(*p);
        bin.1 += weight * f64::from(u8::from(*is_correct));
        total += weight;
    }
    let error: f64 = bins.iter().map(|(p, correct)| (p - correct).abs()).sum();
    if total > 0.0 { error / total } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::rng::RngStream;

    #[test]
    fn fit_recovers_the_coefficients_of_samples() {
        let truth = Calibration { coefficients: [-1.0, 0.7, 0.4, -0.5] };
        let mut rng = RngStream::new(1, "samples", 0);
        let mut draw = || {
            let predictors = [1.0, rng.range(-3.0, 3.0), rng.range(2.0, 8.0), rng.range(-1.0, 2.0)];
            CalibrationSample { predictors, is_correct: rng.chance(truth.probability(&predictors)) }
        };
        let samples: Vec<CalibrationSample> = (0..20_000).map(|_| draw()).collect();
        let found = Calibration::fit(&samples);
        for (a, b) in found.coefficients.iter().zip(truth.coefficients) {
            assert!((a - b).abs() < 0.1, "{found:?}");
        }
        let scored: Vec<(f32, bool)> =
            samples.iter().map(|s| (found.probability(&s.predictors), s.is_correct)).collect();
        assert!(calibration_error(&scored) < 0.02);
        let overconfident: Vec<(f32, bool)> =
            scored.iter().map(|(_, is_correct)| (0.99, *is_correct)).collect();
        assert!(calibration_error(&overconfident) > 0.1);
        assert_eq!(calibration_error(&[]), 0.0);
        let weighted = weighted_calibration_error(&[(0.75, true, 3.0), (0.75, false, 1.0)]);
        assert!(weighted < 1e-9, "{weighted}");
    }
}
