//! Evaluation of an opponent model.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use super::collect::LabeledWindow;
use super::network::{N_GOALS, OpponentModel};
use super::{LIMITS, N_BODY_LIMITS, OpponentGoal};

/// Mean with its uncertainty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeanEstimate {
    /// Mean over windows; `None` without windows.
    pub mean: Option<f64>,
    /// Standard error, with the windows of an episode as one cluster; `None` for fewer than two
    /// episodes.
    pub standard_error: Option<f64>,
    /// Number of windows.
    pub n: usize,
}

/// Predictions of a model compared with the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OpponentReport {
    /// Mean over goals of the fraction of their windows that are classified correctly.
    pub goal_accuracy: MeanEstimate,
    /// Fraction of windows with the goal to pick up whose class is predicted correctly.
    pub target_accuracy: MeanEstimate,
    /// Mean squared error of the five limits.
    pub limits_error: MeanEstimate,
    /// Mean squared error of each limit; `None` without windows.
    #[serde(rename = "error_of_limit")]
    pub error_by_limit: BTreeMap<&'static str, Option<f64>>,
    /// Confusion matrix (rows: true goal, columns: predicted goal), in the order of
    /// [`OpponentGoal::ALL`].
    pub confusion: [[usize; N_GOALS]; N_GOALS],
    /// Expected calibration error of the goal probabilities over ten bins; `None` without windows.
    pub calibration_error: Option<f64>,
}

/// Number of bins of probabilities.
const N_BINS: usize = 10;

impl OpponentReport {
    /// Evaluates a model; `None` if `stop` is raised.
    pub fn new(
        model: &OpponentModel,
        samples: &[LabeledWindow],
        stop: &AtomicBool,
    ) -> Option<OpponentReport> {
        let mut pass = model.pass();
        let mut confusion = [[0; N_GOALS]; N_GOALS];
        let (mut goals, mut targets, mut errors) = (Vec::new(), Vec::new(), Vec::new());
        let mut limit_errors = [0.0; N_BODY_LIMITS];
        let mut bins = [(0.0, 0.0, 0.0); N_BINS];
        for sample in samples {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let prediction = model.predict(&sample.window, &mut pass);
            let predicted = argmax(&prediction.goals);
            let goal = sample.goal.index();
            confusion[goal][predicted] += 1;
            let is_correct = f64::from(u8::from(predicted == goal));
            goals.push((sample.episode, goal, is_correct));
            let confidence = f64::from(prediction.goals[predicted]);
            let bin = &mut bins[((confidence * N_BINS as f64) as usize).min(N_BINS - 1)];
            *bin = (bin.0 + 1.0, bin.1 + confidence, bin.2 + is_correct);
            if let Some(target) = sample.target {
                let is_correct = f64::from(u8::from(argmax(&prediction.targets) == target));
                targets.push((sample.episode, is_correct));
            }
            let mut sum = 0.0;
            for (k, (predicted_limit, truth)) in
                prediction.limits.iter().zip(&sample.limits).enumerate()
            {
                let square = f64::from((predicted_limit - truth) * (predicted_limit - truth));
                limit_errors[k] += square / samples.len() as f64;
                sum += square / N_BODY_LIMITS as f64;
            }
            errors.push((sample.episode, sum));
        }
        let gap =
            bins.iter().map(|(_, confidence, correct)| f64::abs(confidence - correct)).sum::<f64>();
        let if_any = |x: f64| (!samples.is_empty()).then_some(x);
        Some(OpponentReport {
            goal_accuracy: balanced_accuracy(&goals),
            target_accuracy: clustered_mean(&targets),
            limits_error: clustered_mean(&errors),
            error_by_limit: LIMITS.into_iter().zip(limit_errors.map(if_any)).collect(),
            confusion,
            calibration_error: if_any(gap / samples.len() as f64),
        })
    }

    /// Returns the report as text; undefined values are `/`.
    pub fn text(&self) -> String {
        let number = |x: Option<f64>| x.map_or_else(|| "/".to_owned(), |x| format!("{x:.3}"));
        let line = |name: &str, m: &MeanEstimate| {
            let interval = number(m.standard_error.map(|error| 1.96 * error));
            format!("{name:<18} {} ± {interval}  ({} windows)\n", number(m.mean), m.n)
        };
        let mut text = line("goal accuracy", &self.goal_accuracy)
            + &line("target accuracy", &self.target_accuracy)
            + &line("limits, mean sq.", &self.limits_error);
        text += &format!("calibration error  {}\n\n{:<9}", number(self.calibration_error), "true");
        for goal in OpponentGoal::ALL {
            text += &format!("{:>9}", goal.name());
        }
        for goal in OpponentGoal::ALL {
            text += &format!("\n{:<9}", goal.name());
            for n in self.confusion[goal.index()] {
                text += &format!("{n:>9}");
            }
        }
        text += "\n\n";
        for (name, error) in &self.error_by_limit {
            text += &format!("{name:<15} {}\n", number(*error));
        }
        text
    }
}

/// Returns the index of the maximum; the lowest index wins ties.
fn argmax(values: &[f32]) -> usize {
    let mut best = 0;
    for (k, x) in values.iter().enumerate() {
        if *x > values[best] {
            best = k;
        }
    }
    best
}

/// Returns the mean over goals of the fraction of their windows that are correct, from rows of
/// episode, goal and correctness (0 or 1).
fn balanced_accuracy(windows: &[(u32, usize, f64)]) -> MeanEstimate {
    let mut by_goal: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
    for (_, goal, is_correct) in windows {
        let (n, n_correct) = by_goal.entry(*goal).or_default();
        (*n, *n_correct) = (*n + 1.0, *n_correct + is_correct);
    }
    if by_goal.is_empty() {
        return MeanEstimate::default();
    }
    let n_goals = by_goal.len() as f64;
    let mean = by_goal.values().map(|(n, n_correct)| n_correct / n).sum::<f64>() / n_goals;
    let residuals = windows.iter().map(|(episode, goal, is_correct)| {
        let (n, n_correct) = by_goal[goal];
        (*episode, (is_correct - n_correct / n) / (n * n_goals))
    });
    let standard_error = clustered_error(residuals);
    MeanEstimate { mean: Some(mean), standard_error, n: windows.len() }
}

/// Returns the mean of clustered values, with the standard error of a ratio of cluster sums.
fn clustered_mean(samples: &[(u32, f64)]) -> MeanEstimate {
    let n = samples.len();
    if n == 0 {
        return MeanEstimate::default();
    }
    let mean = samples.iter().map(|(_, x)| x).sum::<f64>() / n as f64;
    let residuals = samples.iter().map(|(episode, x)| (*episode, (x - mean) / n as f64));
    MeanEstimate { mean: Some(mean), standard_error: clustered_error(residuals), n }
}

/// Returns the standard error of an estimate from the influence of each window on it, with the windows
/// of an episode as one cluster; `None` for fewer than two episodes.
fn clustered_error(residuals: impl Iterator<Item = (u32, f64)>) -> Option<f64> {
    let mut clusters: BTreeMap<u32, f64> = BTreeMap::new();
    residuals.for_each(|(episode, x)| *clusters.entry(episode).or_default() += x);
    let k = clusters.len() as f64;
    let square: f64 = clusters.values().map(|sum| sum * sum).sum();
    (k > 1.0).then(|| (square * k / (k - 1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_the_balanced_accuracy_is_that_of_its_goals() {
        // All correct: no error, although the goals have different numbers of windows.
        let mut windows: Vec<_> = (0..9).map(|episode| (episode, 0, 1.0)).collect();
        windows.push((9, 1, 1.0));
        let perfect = balanced_accuracy(&windows);
        let expected = MeanEstimate { mean: Some(1.0), standard_error: Some(0.0), n: 10 };
        assert_eq!(perfect, expected);
        // One goal with half of four windows correct, each in an episode of its own, and one with all.
        let half: Vec<_> =
            (0..8).map(|k| (k, k as usize / 4, f64::from(u8::from(k > 1)))).collect();
        let half = balanced_accuracy(&half);
        assert_eq!(half.mean, Some(0.75));
        let expected = (4.0f64 * (0.5 / 8.0) * (0.5 / 8.0) * 8.0 / 7.0).sqrt();
        assert!((half.standard_error.unwrap() - expected).abs() < 1e-12);
        assert_eq!(balanced_accuracy(&[]), MeanEstimate::default());
        assert_eq!(balanced_accuracy(&[(0, 0, 1.0), (0, 1, 0.0)]).standard_error, None);
    }
}
