//! How good an opponent model is.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use super::collect::Sample;
use super::network::{N_GOALS, OpponentModel};
use super::{Goal, LIMITS, N_LIMITS};

/// A mean with its uncertainty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Mean {
    /// The mean over windows.
    pub mean: f64,
    /// Its standard error, with the windows of an episode as one cluster.
    pub standard_error: f64,
    /// How many windows.
    pub n: usize,
}

/// What a model says of windows, beside what was true.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Share of windows whose goal is told right, each goal counting as much.
    pub goal_accuracy: Mean,
    /// Share of windows of somebody about to take something whose class is told right.
    pub target_accuracy: Mean,
    /// Mean square error of the five limits.
    pub limits_error: Mean,
    /// The same for each limit.
    pub error_of_limit: BTreeMap<&'static str, f64>,
    /// Of each goal (rows: true, in the order of [`Goal::ALL`]) how often which was told.
    pub confusion: [[usize; N_GOALS]; N_GOALS],
    /// How far the goal's probability is from how often it is right: expected calibration error over ten bins.
    pub calibration_error: f64,
}

/// Bins of probabilities.
const N_BINS: usize = 10;

impl Report {
    /// Returns that of a model; `None` if `stop` is raised meanwhile.
    pub fn of(model: &OpponentModel, samples: &[Sample], stop: &AtomicBool) -> Option<Report> {
        let mut pass = model.pass();
        let mut confusion = [[0; N_GOALS]; N_GOALS];
        let (mut goals, mut targets, mut errors) = (Vec::new(), Vec::new(), Vec::new());
        let mut of_limit = [0.0; N_LIMITS];
        let mut bins = [(0.0, 0.0, 0.0); N_BINS];
        let mut counts = [0.0; N_GOALS];
        samples.iter().for_each(|s| counts[s.goal.index()] += 1.0);
        let n_goals = counts.iter().filter(|n| **n > 0.0).count() as f64;
        for sample in samples {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let opinion = model.opinion(&sample.window, &mut pass);
            let told = best(&opinion.goals);
            let goal = sample.goal.index();
            confusion[goal][told] += 1;
            let is_right = f64::from(u8::from(told == goal));
            let weight = samples.len() as f64 / (counts[goal] * n_goals);
            goals.push((sample.episode, is_right * weight));
            let sure = f64::from(opinion.goals[told]);
            let bin = &mut bins[((sure * N_BINS as f64) as usize).min(N_BINS - 1)];
            *bin = (bin.0 + 1.0, bin.1 + sure, bin.2 + is_right);
            if let Some(target) = sample.target {
                let is_right = f64::from(u8::from(best(&opinion.targets) == target));
                targets.push((sample.episode, is_right));
            }
            let mut sum = 0.0;
            for (k, (found, truth)) in opinion.limits.iter().zip(&sample.limits).enumerate() {
                let square = f64::from((found - truth) * (found - truth));
                of_limit[k] += square / samples.len() as f64;
                sum += square / N_LIMITS as f64;
            }
            errors.push((sample.episode, sum));
        }
        let off = bins.iter().map(|(_, sure, right)| f64::abs(sure - right)).sum::<f64>();
        Some(Report {
            goal_accuracy: mean(&goals),
            target_accuracy: mean(&targets),
            limits_error: mean(&errors),
            error_of_limit: LIMITS.into_iter().zip(of_limit).collect(),
            confusion,
            calibration_error: off / samples.len().max(1) as f64,
        })
    }

    /// The report in words.
    pub fn text(&self) -> String {
        let line = |name: &str, m: &Mean| {
            format!(
                "{name:<18} {:.3} ± {:.3}  ({} windows)\n",
                m.mean,
                1.96 * m.standard_error,
                m.n
            )
        };
        let mut text = line("goal accuracy", &self.goal_accuracy)
            + &line("target accuracy", &self.target_accuracy)
            + &line("limits, mean sq.", &self.limits_error);
        text += &format!("calibration error  {:.3}\n\n{:<9}", self.calibration_error, "true");
        for goal in Goal::ALL {
            text += &format!("{:>9}", goal.name());
        }
        for goal in Goal::ALL {
            text += &format!("\n{:<9}", goal.name());
            for n in self.confusion[goal.index()] {
                text += &format!("{n:>9}");
            }
        }
        text += "\n\n";
        for (name, error) in &self.error_of_limit {
            text += &format!("{name:<15} {error:.3}\n");
        }
        text
    }
}

/// The place of the largest, of equal ones the first.
fn best(numbers: &[f32]) -> usize {
    let mut best = 0;
    for (k, x) in numbers.iter().enumerate() {
        if *x > numbers[best] {
            best = k;
        }
    }
    best
}

/// The mean of numbers that come in clusters, with the standard error of a ratio of cluster sums.
fn mean(of: &[(u32, f64)]) -> Mean {
    let n = of.len();
    if n == 0 {
        return Mean::default();
    }
    let mean = of.iter().map(|(_, x)| x).sum::<f64>() / n as f64;
    let mut clusters: BTreeMap<u32, f64> = BTreeMap::new();
    of.iter().for_each(|(cluster, x)| *clusters.entry(*cluster).or_default() += x - mean);
    let k = clusters.len() as f64;
    let square: f64 = clusters.values().map(|sum| sum * sum).sum();
    let standard_error =
        if k > 1.0 { (square * k / (k - 1.0)).sqrt() / n as f64 } else { f64::INFINITY };
    Mean { mean, standard_error, n }
}
