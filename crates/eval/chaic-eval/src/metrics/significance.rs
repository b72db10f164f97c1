//! Tests of differences, and their correction for multiple comparisons.

use crate::metrics::Interval;
use crate::metrics::stats::two_sided_t;

/// Returns the two-sided p-value of a mean difference of zero, 0 to 1, rounded to six decimals.
///
/// The statistic is the mean divided by its standard error over environments, compared with Student's t
/// of the interval's degrees of freedom. The p-value is therefore below 0.05 if and only if the 95 %
/// interval excludes zero, apart from rounding.
pub fn two_sided_p(difference: &Interval) -> f64 {
    if difference.mean == 0.0 {
        return 1.0;
    }
    if difference.se == 0.0 {
        return 0.0;
    }
    two_sided_t(difference.mean / difference.se, difference.df)
}

/// Returns p-values adjusted by the method of Holm ("A Simple Sequentially Rejective Multiple Test
/// Procedure", 1979), in the order of the given ones.
///
/// Rejecting adjusted values below alpha bounds the probability of any false rejection by alpha, for
/// any dependence between the tests.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let n = p_values.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut adjusted = vec![1.0; n];
    let mut largest: f64 = 0.0;
    for (rank, k) in order.into_iter().enumerate() {
        largest = largest.max(p_values[k] * (n - rank) as f64).min(1.0);
        adjusted[k] = largest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::t_975;

    fn interval(mean: f64, se: f64, df: usize) -> Interval {
        let half = t_975(df) * se;
        Interval { mean, se, low: mean - half, high: mean + half, environments: df + 1, df }
    }

    #[test]
    fn adjusted_values_are_those_of_other_programs() {
        // p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm") in R.
        let adjusted = holm(&[0.01, 0.04, 0.03, 0.005]);
        for (found, expected) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - expected).abs() < 1e-12, "{adjusted:?}");
        }
        assert_eq!(holm(&[0.2]), [0.2], "one test needs no correction");
        assert_eq!(holm(&[0.7, 0.6]), [1.0, 1.0], "no value exceeds 1");
        assert_eq!(holm(&[0.0, 0.5, 0.0]), [0.0, 0.5, 0.0]);
        assert!(holm(&[]).is_empty());
    }

    #[test]
    fn a_difference_is_significant_if_its_interval_excludes_zero() {
        // 2 * pt(-2, 10) in R.
        assert_eq!(two_sided_p(&interval(0.2, 0.1, 10)), 0.073_388);
        assert_eq!(two_sided_p(&interval(-0.2, 0.1, 10)), 0.073_388);
        for (mean, is_significant) in [(0.1, false), (0.2227, false), (0.2229, true), (0.4, true)] {
            let difference = interval(mean, 0.1, 10);
            assert_eq!(difference.low > 0.0, is_significant, "{difference:?}");
            assert_eq!(two_sided_p(&difference) < 0.05, is_significant, "{difference:?}");
        }
        assert_eq!(two_sided_p(&interval(0.0, 0.0, 3)), 1.0, "equal on every episode");
        assert_eq!(two_sided_p(&interval(0.1, 0.0, 3)), 0.0, "the same difference everywhere");
    }
}
