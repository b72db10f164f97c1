//! Means over the episode runs of each helper and task.

use std::collections::BTreeMap;

use chaic_core::TaskId;
use serde::Serialize;

use super::episode::{EpisodeBelief, PROBABILITY_FRAMES};
use super::measures::{
    Sample, accuracy, expected_calibration_error, mean, mean_log_score, median_frame,
};
use crate::error::Result;
use crate::recorded_belief::beliefs;
use crate::run::{EpisodeJob, RunFolder, RunOptions, visit_planned_traces};

/// Quality of the beliefs of all helpers that record one.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BeliefScores {
    /// Scores by helper.
    pub helpers: BTreeMap<String, HelperScores>,
}

/// Quality of the beliefs of one helper.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HelperScores {
    /// Over all tasks.
    pub all: BeliefScore,
    /// By task.
    pub tasks: BTreeMap<TaskId, BeliefScore>,
}

/// Quality of the beliefs over some episode runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BeliefScore {
    /// Number of episode runs.
    pub runs: usize,
    /// Mean probability of the true target set at [`PROBABILITY_FRAMES`].
    pub true_set_probability: [f64; PROBABILITY_FRAMES.len()],
    /// Share of the runs that identify the true target set.
    pub identified: f64,
    /// Median frame of the identification; `None` if it is after the end of the episode.
    pub identified_frame: Option<f64>,
    /// Target set.
    pub goal: HypothesisScore,
    /// Kind of person.
    pub person: HypothesisScore,
}

/// Quality of one distribution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HypothesisScore {
    /// Share of the runs whose last belief has the true hypothesis as the most likely one.
    pub accuracy: Option<f64>,
    /// Expected calibration error over all samples.
    pub ece: Option<f64>,
    /// Mean log score over all samples.
    pub log_score: Option<f64>,
}

impl BeliefScores {
    /// Computes the scores of these episode runs.
    pub fn new(episodes: &[EpisodeBelief]) -> BeliefScores {
        let mut by_helper: BTreeMap<&str, Vec<&EpisodeBelief>> = BTreeMap::new();
        for episode in episodes {
            by_helper.entry(&episode.key.helper).or_default().push(episode);
        }
        let each = by_helper.into_iter();
        BeliefScores {
            helpers: each.map(|(name, runs)| (name.to_owned(), HelperScores::new(&runs))).collect(),
        }
    }
}

impl HelperScores {
    fn new(runs: &[&EpisodeBelief]) -> HelperScores {
        let mut by_task: BTreeMap<TaskId, Vec<&EpisodeBelief>> = BTreeMap::new();
        for run in runs {
            by_task.entry(run.key.task).or_default().push(run);
        }
        let tasks = by_task.into_iter().map(|(task, runs)| (task, BeliefScore::new(&runs)));
        HelperScores { all: BeliefScore::new(runs), tasks: tasks.collect() }
    }
}

impl BeliefScore {
    fn new(runs: &[&EpisodeBelief]) -> BeliefScore {
        let frames: Vec<Option<u32>> = runs.iter().map(|run| run.identified).collect();
        let n_identified = frames.iter().flatten().count();
        BeliefScore {
            runs: runs.len(),
            true_set_probability: std::array::from_fn(|k| {
                mean(runs.iter().map(|run| run.true_set_probability[k])).unwrap_or_default()
            }),
            identified: n_identified as f64 / runs.len().max(1) as f64,
            identified_frame: median_frame(&frames),
            goal: HypothesisScore::new(runs, |run| (run.last_goal, &run.goal_samples)),
            person: HypothesisScore::new(runs, |run| (run.last_person, &run.person_samples)),
        }
    }
}

impl HypothesisScore {
    fn new(
        runs: &[&EpisodeBelief],
        select: impl Fn(&EpisodeBelief) -> (Sample, &[Sample]),
    ) -> HypothesisScore {
        let last: Vec<Sample> = runs.iter().map(|run| select(run).0).collect();
        let samples: Vec<Sample> = runs.iter().flat_map(|run| select(run).1).copied().collect();
        HypothesisScore {
            accuracy: accuracy(&last),
            ece: expected_calibration_error(&samples),
            log_score: mean_log_score(&samples),
        }
    }
}

/// Computes the scores of the whole traces of planned episode runs; an empty plan is unknown. Also returns
/// warnings about traces that are damaged or left out.
///
/// # Errors
/// If a trace or the episode of a trace with a belief can't be read.
pub fn read_scores(
    folder: &RunFolder,
    options: &RunOptions,
    planned: &[EpisodeJob],
) -> Result<(BeliefScores, Vec<String>)> {
    let mut episodes = Vec::new();
    let warnings = visit_planned_traces(folder, planned, &mut |trace| {
        if beliefs(trace).next().is_some() {
            let episode = folder.episode(options, &trace.header.key())?;
            episodes.extend(EpisodeBelief::new(trace, &episode.setup().goal));
        }
        Ok(())
    })?;
    Ok((BeliefScores::new(&episodes), warnings))
}
