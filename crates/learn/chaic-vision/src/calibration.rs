//! How likely a detection is right: a logistic regression on what the network says of it, fitted on views
//! as a helper has them. The probabilities of labels alone are too high, since small things weigh much
//! in the loss.

use serde::{Deserialize, Serialize};

use crate::instances::Instance;
use crate::loss::{exp, ln};

/// What is known of a detection: 1, the logarithm of the odds of its mean probability, of its pixels,
/// and of its distance in metres.
pub const N_PREDICTORS: usize = 4;

/// What a score is made by.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// By predictor.
    pub factors: [f32; N_PREDICTORS],
}

impl Default for Calibration {
    /// The mean probability as it is.
    fn default() -> Calibration {
        Calibration { factors: [0.0, 1.0, 0.0, 0.0] }
    }
}

/// A detection in a view with known labels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// What is known of it.
    pub predictors: [f32; N_PREDICTORS],
    /// Whether it overlaps a thing of its label by half or more.
    pub is_right: bool,
}

/// What is known of a detection before it is calibrated.
pub fn predictors(instance: &Instance) -> [f32; N_PREDICTORS] {
    let p = instance.score.clamp(0.01, 0.99);
    let [x, y, z] = instance.middle;
    let distance_m = (x * x + y * y + z * z).sqrt().max(0.1);
    [1.0, ln(p / (1.0 - p)), ln(instance.pixels.len().max(1) as f32), ln(distance_m)]
}

impl Calibration {
    /// The probability that a detection with these predictors is right.
    pub fn probability(&self, predictors: &[f32; N_PREDICTORS]) -> f32 {
        let odds: f32 = self.factors.iter().zip(predictors).map(|(f, x)| f * x).sum();
        let e = exp(-odds.abs());
        if odds < 0.0 { e / (1.0 + e) } else { 1.0 / (1.0 + e) }
    }

    /// Fitted to samples by Newton's method, with a little pull towards 0.
    pub fn fit(samples: &[Sample]) -> Calibration {
        const STEPS: usize = 20;
        const PULL: f64 = 1e-3;
        let mut factors = [0.0f64; N_PREDICTORS];
        for _ in 0..STEPS {
            let mut slope = factors.map(|f| -PULL * f);
            let mut curve = [[0.0f64; N_PREDICTORS]; N_PREDICTORS];
            (0..N_PREDICTORS).for_each(|i| curve[i][i] = PULL);
            for sample in samples {
                let now = Calibration { factors: factors.map(|f| f as f32) };
                let p = f64::from(now.probability(&sample.predictors));
                let x = sample.predictors.map(f64::from);
                let off = f64::from(u8::from(sample.is_right)) - p;
                for i in 0..N_PREDICTORS {
                    slope[i] += off * x[i];
                    for j in 0..N_PREDICTORS {
                        curve[i][j] += p * (1.0 - p) * x[i] * x[j];
                    }
                }
            }
            let step = solve(curve, slope);
            (0..N_PREDICTORS).for_each(|i| factors[i] += step[i]);
        }
        Calibration { factors: factors.map(|f| f as f32) }
    }
}

/// The solution of a small symmetric system, by elimination.
fn solve(
    mut a: [[f64; N_PREDICTORS]; N_PREDICTORS],
    mut b: [f64; N_PREDICTORS],
) -> [f64; N_PREDICTORS] {
    for i in 0..N_PREDICTORS {
        for j in i + 1..N_PREDICTORS {
            let (share, row) = (a[j][i] / a[i][i], a[i]);
            a[j].iter_mut().zip(row).for_each(|(x, y)| *x -= share * y);
            b[j] -= share * b[i];
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

/// How far probabilities are from the share that is right, in ten bins, weighted by how many fall into
/// each (expected calibration error).
pub fn calibration_error(said: &[(f32, bool)]) -> f64 {
    const BINS: usize = 10;
    let mut bins = [(0.0f64, 0.0f64, 0u32); BINS];
    for (p, is_right) in said {
        let bin = &mut bins[((p * BINS as f32) as usize).min(BINS - 1)];
        bin.0 += f64::from(*p);
        bin.1 += f64::from(u8::from(*is_right));
        bin.2 += 1;
    }
    let off: f64 = bins.iter().map(|(p, right, _)| (p - right).abs()).sum();
    off / said.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::rng::Stream;

    #[test]
    fn a_fit_finds_what_samples_were_drawn_by() {
        let truth = Calibration { factors: [-1.0, 0.7, 0.4, -0.5] };
        let mut rng = Stream::new(1, "samples", 0);
        let mut draw = || {
            let predictors = [1.0, rng.range(-3.0, 3.0), rng.range(2.0, 8.0), rng.range(-1.0, 2.0)];
            Sample { predictors, is_right: rng.chance(truth.probability(&predictors)) }
        };
        let samples: Vec<Sample> = (0..20_000).map(|_| draw()).collect();
        let found = Calibration::fit(&samples);
        for (a, b) in found.factors.iter().zip(truth.factors) {
            assert!((a - b).abs() < 0.1, "{found:?}");
        }
        let said: Vec<(f32, bool)> =
            samples.iter().map(|s| (found.probability(&s.predictors), s.is_right)).collect();
        assert!(calibration_error(&said) < 0.02);
        let sure: Vec<(f32, bool)> = said.iter().map(|(_, is_right)| (0.99, *is_right)).collect();
        assert!(calibration_error(&sure) > 0.1);
    }
}
