//! Overview of all episodes of a helper: a dot per episode.

use std::collections::BTreeMap;

use chaic_core::TaskId;
use chaic_env::RunKey;
use chaic_eval::examples::PairedRun;
use serde::Serialize;

/// Episodes of a task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OverviewRow {
    /// Title of the task.
    pub task: &'static str,
    /// Dots of the episodes.
    pub dots: Vec<EpisodePoint>,
    /// Number of episodes in which the helper's run has the higher transport rate, the same, and the
    /// lower one.
    pub counts: [usize; 3],
}

/// Dot of an episode. Positions are percent of the width and height of the strip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EpisodePoint {
    /// Difference of the transport rates: 0 for -1, 50 for 0, 100 for 1.
    pub x: f64,
    /// Height; dots of one place are stacked.
    pub y: f64,
    /// Episode and its transport rates.
    pub text: String,
    /// True if the report has a replay of the episode.
    pub is_example: bool,
}

/// Number of places across a strip. Dots of one place are stacked.
const N_PLACES: f64 = 50.0;
/// Height of the first dot and maximum distance between dots, percent of the height.
const BOTTOM: f64 = 90.0;
const MAX_STEP: f64 = 12.0;

/// Returns a row per task; `examples` are the episodes with a replay.
pub fn overview(runs: &[PairedRun], examples: &[&RunKey]) -> Vec<OverviewRow> {
    let mut by_task: BTreeMap<TaskId, Vec<&PairedRun>> = BTreeMap::new();
    for run in runs {
        by_task.entry(run.key.task).or_default().push(run);
    }
    by_task.into_iter().map(|(task, runs)| row(task, &runs, examples)).collect()
}

fn row(task: TaskId, runs: &[&PairedRun], examples: &[&RunKey]) -> OverviewRow {
    let difference = |run: &PairedRun| run.rate - run.baseline_rate;
    let place = |run: &PairedRun| (N_PLACES * (1.0 + difference(run)) / 2.0).round() as i32;
    let mut n_at: BTreeMap<i32, usize> = BTreeMap::new();
    for run in runs {
        *n_at.entry(place(run)).or_default() += 1;
    }
    let highest = n_at.values().copied().max().unwrap_or(1);
    let step = MAX_STEP.min((BOTTOM - 5.0) / highest as f64);
    n_at.clear();
    let dot = |run: &&PairedRun| {
        let below = n_at.entry(place(run)).or_default();
        let y = BOTTOM - step * *below as f64;
        *below += 1;
        let [rate, alone] = [run.rate, run.baseline_rate].map(|rate| (100.0 * rate).round());
        EpisodePoint {
            x: (500.0 * (1.0 + difference(run))).round() / 10.0,
            y: (10.0 * y).round() / 10.0,
            text: format!("{}, seed {}: {rate} %, alone {alone} %", run.key.episode, run.key.seed),
            is_example: examples.contains(&&run.key),
        }
    };
    let mut dots: Vec<EpisodePoint> = runs.iter().map(dot).collect();
    // Dots of examples are drawn last, so that their rings lie on top.
    dots.sort_by_key(|dot| dot.is_example);
    let count = |is: fn(f64) -> bool| runs.iter().filter(|run| is(difference(run))).count();
    OverviewRow {
        task: task.info().title,
        dots,
        counts: [count(|d| d > 0.0), count(|d| d == 0.0), count(|d| d < 0.0)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(episode: &str, rate: f64, baseline_rate: f64) -> PairedRun {
        let (helper, episode) = ("rhp".to_owned(), episode.to_owned());
        let key = RunKey { task: TaskId::LowTarget, helper, episode, seed: 0 };
        PairedRun { key, rate, baseline_rate }
    }

    #[test]
    fn dots_of_equal_differences_are_stacked() {
        let runs =
            [run("a", 1.0, 0.0), run("b", 0.5, 0.5), run("c", 0.25, 0.25), run("d", 0.0, 0.5)];
        let rows = overview(&runs, &[&runs[3].key]);
        assert_eq!((rows.len(), rows[0].counts), (1, [1, 2, 1]));
        let dots = &rows[0].dots;
        let positions: Vec<[f64; 2]> = dots.iter().map(|dot| [dot.x, dot.y]).collect();
        assert_eq!(positions, [[100.0, 90.0], [50.0, 90.0], [50.0, 78.0], [25.0, 90.0]]);
        assert_eq!(dots[0].text, "a, seed 0: 100 %, alone 0 %");
        let examples: Vec<bool> = dots.iter().map(|dot| dot.is_example).collect();
        assert_eq!(examples, [false, false, false, true]);
    }

    #[test]
    fn a_hundred_equal_episodes_stay_within_the_strip() {
        let runs: Vec<PairedRun> = (0..100).map(|k| run(&k.to_string(), 0.5, 0.5)).collect();
        let rows = overview(&runs, &[]);
        assert!(rows[0].dots.iter().all(|dot| (0.0..=100.0).contains(&dot.y)));
    }
}
