//! Means, standard deviations and Student's t.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Returns the mean; `None` without values.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Returns the population standard deviation (divided by n); `None` without values.
pub fn population_sd(values: &[f64]) -> Option<f64> {
    let m = mean(values)?;
    let squares: Vec<f64> = values.iter().map(|v| (v - m) * (v - m)).collect();
    mean(&squares).map(f64::sqrt)
}

/// Returns the 97.5 % quantile of Student's t for `df` degrees of freedom. It is rounded to three
/// decimals, as in printed tables, so that it is the same number on every machine.
pub fn t_975(df: usize) -> f64 {
    let Ok(t) = StudentsT::new(0.0, 1.0, df as f64) else { return f64::INFINITY };
    (1e3 * t.inverse_cdf(0.975)).round() / 1e3
}

/// Returns the two-sided p-value of Student's t for `df` degrees of freedom, rounded to six decimals, so
/// that it is the same number on every machine.
pub fn two_sided_t(t: f64, df: usize) -> f64 {
    let Ok(distribution) = StudentsT::new(0.0, 1.0, df as f64) else { return 1.0 };
    (1e6 * 2.0 * distribution.cdf(-t.abs())).round() / 1e6
}
