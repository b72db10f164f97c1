//! Means, deviations and intervals.

use serde::Serialize;

/// A mean with the interval that holds the true one in 95 of 100 such experiments.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// The mean.
    pub mean: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// How many values it rests on.
    pub n: usize,
}

/// The mean; `None` of nothing.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The standard deviation of a sample, with n - 1; `None` of fewer than two values.
pub fn sample_sd(values: &[f64]) -> Option<f64> {
    let n = values.len();
    (n >= 2).then(|| (squares(values) / (n - 1) as f64).sqrt())
}

/// The standard deviation of a population, with n; `None` of nothing.
pub fn population_sd(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| (squares(values) / values.len() as f64).sqrt())
}

fn squares(values: &[f64]) -> f64 {
    let m = mean(values).unwrap_or(0.0);
    values.iter().map(|v| (v - m) * (v - m)).sum()
}

/// The interval of the mean of paired differences by Student's t; `None` of fewer than two.
pub fn paired_interval(differences: &[f64]) -> Option<Interval> {
    mean_interval(differences)
}

/// The interval of the mean of independent values by Student's t; `None` of fewer than two.
pub fn mean_interval(values: &[f64]) -> Option<Interval> {
    let (m, sd) = (mean(values)?, sample_sd(values)?);
    let n = values.len();
    let half = t_975(n - 1) * sd / (n as f64).sqrt();
    Some(Interval { mean: m, low: m - half, high: m + half, n })
}

/// The 97.5 % quantile of Student's t for `df` degrees of freedom, from the usual table; between
/// its rows the row of fewer degrees, which makes intervals a little wider.
fn t_975(df: usize) -> f64 {
    const UP_TO_30: [f64; 30] = [
        12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160,
        2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056,
        2.052, 2.048, 2.045, 2.042,
    ];
    match df {
        0 => f64::INFINITY,
        1..=30 => UP_TO_30[df - 1],
        31..=39 => 2.042,
        40..=59 => 2.021,
        60..=119 => 2.000,
        _ => 1.980,
    }
}
