//! Selection of episode runs that a report shows as examples, by a stated rule.

use std::collections::BTreeMap;

use chaic_core::{Frame, TaskId};
use chaic_env::RunKey;

use crate::metrics::{RunResult, Summary};

/// Reason why an episode run is an example.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExampleRole {
    /// Its value is nearest to the mean.
    Typical,
    /// It has the highest value.
    Best,
    /// It has the lowest value.
    Worst,
}

/// Episode run that is shown as an example.
#[derive(Clone, Debug, PartialEq)]
pub struct Example {
    /// Reason why it is shown.
    pub role: ExampleRole,
    /// The episode run.
    pub key: RunKey,
    /// Its transport rate.
    pub rate: f64,
    /// Transport rate of the baseline on the same episode and seed; `None` without baseline.
    pub baseline_rate: Option<f64>,
    /// Turning point. With a baseline, the first frame with the largest difference between the
    /// delivered fractions of both runs; without one, the first delivery that counts. 0 if there is
    /// neither.
    pub frame: Frame,
}

/// Selects the best, the worst and a typical episode run of a helper among its completed runs. The
/// value of a run is the difference of its transport rate to that of `baseline` on the same episode
/// and seed, or its transport rate without baseline. Of equal values, the first key is selected, and no
/// run is selected twice.
pub fn examples(results: &[RunResult], helper: &str, baseline: Option<&str>) -> Vec<Example> {
    let mut candidates = candidates(results, helper, baseline);
    let n = candidates.len().max(1) as f64;
    let mean = candidates.iter().map(Candidate::value).sum::<f64>() / n;
    let mut selected = Vec::new();
    for role in [ExampleRole::Best, ExampleRole::Worst, ExampleRole::Typical] {
        let cost = |candidate: &Candidate| match role {
            ExampleRole::Best => -candidate.value(),
            ExampleRole::Worst => candidate.value(),
            ExampleRole::Typical => (candidate.value() - mean).abs(),
        };
        let costs = candidates.iter().map(cost).enumerate();
        let Some((k, _)) = costs.min_by(|(_, a), (_, b)| a.total_cmp(b)) else { break };
        selected.push(candidates.remove(k).example(role));
    }
    // The typical one is shown first.
    let n_first = usize::from(selected.len() == 3);
    selected.rotate_right(n_first);
    selected
}

/// Completed run of a helper beside that of a baseline on the same episode and seed.
#[derive(Clone, Debug, PartialEq)]
pub struct PairedRun {
    /// The helper's episode run.
    pub key: RunKey,
    /// Its transport rate.
    pub rate: f64,
    /// Transport rate of the baseline.
    pub baseline_rate: f64,
}

/// Returns the completed runs of a helper that the baseline completed as well, ordered by task, episode
/// and seed.
pub fn paired_runs(results: &[RunResult], helper: &str, baseline: &str) -> Vec<PairedRun> {
    let pair = |candidate: Candidate| {
        let (rate, baseline_rate) = (candidate.summary.rate(), candidate.other?.rate());
        Some(PairedRun { key: candidate.key, rate, baseline_rate })
    };
    candidates(results, helper, Some(baseline)).into_iter().filter_map(pair).collect()
}

/// Returns the completed runs of a helper, each with the baseline's if there is a baseline. Without
/// the baseline's run on its episode and seed, a run is left out.
fn candidates(results: &[RunResult], helper: &str, baseline: Option<&str>) -> Vec<Candidate> {
    let completed = |name: &str| -> BTreeMap<(TaskId, &str, u32), (&RunKey, &Summary)> {
        let of_helper = results.iter().filter(|result| result.key.helper == name);
        let runs = of_helper.filter_map(|result| Some((&result.key, result.summary()?)));
        runs.map(|(key, summary)| ((key.task, &*key.episode, key.seed), (key, summary))).collect()
    };
    let baseline_runs = baseline.map(completed);
    let candidate = |(place, (key, summary)): (_, (&RunKey, &Summary))| {
        let other = match &baseline_runs {
            Some(runs) => Some(runs.get(&place)?.1),
            None => None,
        };
        Some(Candidate { key: key.clone(), summary: summary.clone(), other: other.cloned() })
    };
    completed(helper).into_iter().filter_map(candidate).collect()
}

/// Completed run with the baseline's run on the same episode and seed.
struct Candidate {
    key: RunKey,
    summary: Summary,
    other: Option<Summary>,
}

impl Candidate {
    fn value(&self) -> f64 {
        self.summary.rate() - self.other.as_ref().map_or(0.0, Summary::rate)
    }

    fn example(self, role: ExampleRole) -> Example {
        let task = self.key.task;
        let frame = match &self.other {
            Some(other) => largest_difference(task, &self.summary, other),
            None => progress(task, &self.summary).first().map(|(frame, _)| *frame),
        };
        Example {
            role,
            rate: self.summary.rate(),
            baseline_rate: self.other.as_ref().map(Summary::rate),
            frame: frame.unwrap_or(0),
            key: self.key,
        }
    }
}

/// Returns the frames of the deliveries that count, each with the delivered fraction after it.
fn progress(task: TaskId, summary: &Summary) -> Vec<(Frame, f64)> {
    let mut done = 0.0;
    let counted = summary.deliveries.iter().filter(|delivery| delivery.counted);
    let fraction = |delivery: &crate::metrics::Delivery| {
        done += delivery.value(task);
        (delivery.frame, if summary.total > 0.0 { done / summary.total } else { 0.0 })
    };
    counted.map(fraction).collect()
}

/// Returns the first frame with the largest difference between the delivered fractions; `None` if they
/// never differ.
fn largest_difference(task: TaskId, a: &Summary, b: &Summary) -> Option<Frame> {
    let (a, b) = (progress(task, a), progress(task, b));
    let at = |curve: &[(Frame, f64)], frame: Frame| {
        curve.iter().rev().find(|(start, _)| *start <= frame).map_or(0.0, |(_, done)| *done)
    };
    let mut frames: Vec<Frame> = a.iter().chain(&b).map(|(frame, _)| *frame).collect();
    frames.sort_unstable();
    let mut largest: Option<(Frame, f64)> = None;
    for frame in frames {
        let difference = (at(&a, frame) - at(&b, frame)).abs();
        if difference > largest.map_or(0.0, |(_, other)| other) {
            largest = Some((frame, difference));
        }
    }
    largest.map(|(frame, _)| frame)
}

#[cfg(test)]
mod tests;
