//! Computation of scores from the results of a run.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;
use chaic_env::RunKey;
use chaic_env::helper_registry::NONE;
use serde::{Deserialize, Serialize};

use crate::metrics::cluster::{Clusters, Environments};
use crate::metrics::score::{MAX_LISTED_RUNS, Score};
use crate::metrics::stats::{mean, population_sd};
use crate::metrics::table::Metric;
use crate::metrics::{Formulas, RunResult, SpreadStatistic, Summary};

/// Input of the scores.
#[derive(Clone, Copy, Debug)]
pub struct PlayedEpisodes<'a> {
    /// Results of the episode runs.
    pub results: &'a [RunResult],
    /// All planned episode runs; empty if the plan is unknown.
    pub planned: &'a [RunKey],
    /// Environments of the episodes.
    pub environments: &'a Environments,
}

/// All scores of a run, as in `scores.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Scores by task and helper; a pair without results is absent.
    pub tasks: BTreeMap<TaskId, BTreeMap<String, Score>>,
    /// Planned pairs of task and helper without any result.
    #[serde(skip)]
    unplayed: BTreeSet<(TaskId, String)>,
}

/// Runs of one helper in one task, by episode; `None` for a failed run.
pub(super) type ByEpisode<'a> = BTreeMap<&'a str, Vec<Option<&'a Summary>>>;
/// Runs by task and helper.
pub(super) type Groups<'a> = BTreeMap<TaskId, BTreeMap<&'a str, ByEpisode<'a>>>;

impl Scores {
    /// Computes the scores. Failed runs count as zero.
    pub fn new(played: PlayedEpisodes<'_>, formulas: &Formulas) -> Scores {
        let groups = grouped(played.results);
        let mut scores = Scores::default();
        for (task, helpers) in &groups {
            let alone = helpers.get(NONE);
            for (helper, episodes) in helpers {
                let has_helper = *helper != NONE;
                let alone = alone.filter(|_| has_helper);
                let environments = played.environments;
                let group = Group { task: *task, episodes, alone, has_helper, environments };
                let score = group.score(formulas);
                scores.tasks.entry(*task).or_default().insert((*helper).to_owned(), score);
            }
        }
        scores.mark_missing(played);
        scores
    }

    fn mark_missing(&mut self, played: PlayedEpisodes<'_>) {
        for key in played.missing() {
            let score = self.tasks.get_mut(&key.task).and_then(|row| row.get_mut(&key.helper));
            let Some(score) = score else {
                self.unplayed.insert((key.task, key.helper.clone()));
                continue;
            };
            score.incomplete = true;
            if score.missing.len() < MAX_LISTED_RUNS {
                score.missing.push(format!("{} seed {}", key.episode, key.seed));
            }
        }
    }

    /// Returns the scores of one helper in one task.
    pub fn get(&self, task: TaskId, helper: &str) -> Option<&Score> {
        self.tasks.get(&task)?.get(helper)
    }

    /// Returns whether a pair of task and helper was planned but has no result.
    pub fn is_unplayed(&self, task: TaskId, helper: &str) -> bool {
        self.unplayed.iter().any(|(t, h)| *t == task && h == helper)
    }

    /// Returns the tasks that were played or planned, in the paper's order.
    pub fn tasks(&self) -> Vec<TaskId> {
        let is_known =
            |t: &TaskId| self.tasks.contains_key(t) || self.unplayed.iter().any(|(u, _)| u == t);
        TaskId::all().filter(is_known).collect()
    }

    /// Returns the helpers that were played or planned: `none` and the built-in ones in the paper's
    /// order, then others by name, and `oracle` last.
    pub fn helpers(&self) -> Vec<String> {
        let played = self.tasks.values().flat_map(|h| h.keys());
        let present: BTreeSet<&String> =
            played.chain(self.unplayed.iter().map(|(_, helper)| helper)).collect();
        let known =
            std::iter::once(NONE).chain(chaic_agents::HELPERS.iter().map(|helper| helper.name));
        let mut order: Vec<&str> = known.filter(|n| present.iter().any(|p| p == n)).collect();
        // The paper's tables have the oracle, an upper bound, in the last row.
        order.sort_by_key(|name| *name == "oracle");
        let external = present.iter().map(|n| n.as_str()).filter(|n| !order.contains(n));
        let external: Vec<&str> = external.collect();
        let at = order.iter().position(|n| *n == "oracle").unwrap_or(order.len());
        order.splice(at..at, external);
        order.into_iter().map(str::to_owned).collect()
    }
}

impl<'a> PlayedEpisodes<'a> {
    /// Returns the planned episode runs without result, in the order of reports.
    pub fn missing(&self) -> Vec<&'a RunKey> {
        let played: BTreeSet<&RunKey> = self.results.iter().map(|r| &r.key).collect();
        let mut missing: Vec<&RunKey> =
            self.planned.iter().filter(|k| !played.contains(k)).collect();
        missing.sort();
        missing
    }
}

pub(super) fn grouped(results: &[RunResult]) -> Groups<'_> {
    let mut groups = Groups::new();
    // Sums have a fixed order, independent of the order in which workers finished.
    let mut sorted: Vec<&RunResult> = results.iter().collect();
    sorted.sort_by(|a, b| a.key.cmp(&b.key));
    for result in sorted {
        let helpers = groups.entry(result.key.task).or_default();
        let episodes = helpers.entry(&result.key.helper).or_default();
        episodes.entry(&result.key.episode).or_default().push(result.summary());
    }
    groups
}

/// Input of one score.
struct Group<'a> {
    task: TaskId,
    episodes: &'a ByEpisode<'a>,
    /// The same task without helper.
    alone: Option<&'a ByEpisode<'a>>,
    has_helper: bool,
    environments: &'a Environments,
}

impl Group<'_> {
    fn score(&self, formulas: &Formulas) -> Score {
        let mut rates = Vec::new();
        let mut by_environment = Clusters::default();
        for (episode, runs) in self.episodes {
            for run in runs {
                let rate = run.map_or(0.0, Summary::rate);
                rates.push(rate);
                by_environment.add(self.task, self.environments.get(self.task, episode), rate);
            }
        }
        let interval = by_environment.interval();
        let played = self.played().count();
        let counts = RunCounts { played: played as f64, failed: (rates.len() - played) as f64 };
        let (accuracy, completion) = self.deliveries(formulas);
        let improvement = self.improvements(formulas);
        let ei_ci = improvement.interval().map(|i| i.clamped(-1.0, 1.0));
        let has_child = self.task.info().has_child && self.has_helper;
        Score {
            tr: mean(&rates).unwrap_or(0.0),
            tr_se: match formulas.spread {
                SpreadStatistic::PopulationDeviation => population_sd(&rates),
                SpreadStatistic::StandardError => interval.map(|i| i.se),
            },
            tr_ci: interval.map(|i| i.clamped(0.0, 1.0)),
            ei: improvement.mean(),
            ei_ci,
            ia: counts.with_failed(accuracy, self.has_helper.then_some(0.0)),
            cr: counts.with_failed(completion, self.has_helper.then_some(0.0)),
            er: counts.with_failed(
                self.fraction_of_frames(|s| formulas.away_frames(s)),
                has_child.then_some(1.0),
            ),
            stuck: self.fraction_of_frames(|s| s.stuck_frames),
            diagnostics: self.diagnostics(),
            episodes: rates.len(),
            environments: by_environment.environments(),
            failed: rates.len() - played,
            incomplete: false,
            missing: Vec::new(),
        }
    }

    /// Returns the summaries of completed runs.
    fn played(&self) -> impl Iterator<Item = &Summary> {
        self.episodes.values().flatten().copied().flatten()
    }

    /// Returns goal inference accuracy and completion ratio, pooled over completed runs.
    fn deliveries(&self, formulas: &Formulas) -> (Option<f64>, Option<f64>) {
        let Group { task, has_helper, .. } = *self;
        let (mut by_helper, mut counted) = (0.0, 0.0);
        let (mut n_counted, mut n_targets) = (0u32, 0u32);
        for delivery in self.played().flat_map(|s| &s.deliveries) {
            let is_by_helper = delivery.is_by_helper();
            if delivery.counted {
                counted += delivery.value(task);
                if is_by_helper || (formulas.credits_handovers && delivery.handed) {
                    by_helper += delivery.value(task);
                }
            }
            if is_by_helper && delivery.is_target_class() {
                n_targets += 1;
                n_counted += u32::from(delivery.counted);
            }
        }
        let accuracy = (n_targets > 0).then(|| f64::from(n_counted) / f64::from(n_targets));
        (accuracy, (has_helper && counted > 0.0).then(|| by_helper / counted))
    }

    /// Returns the means of the diagnostic metrics over the completed runs that have them.
    fn diagnostics(&self) -> BTreeMap<String, f64> {
        let score = |metric: &Metric| {
            let values: Vec<f64> =
                self.played().filter_map(|s| s.diagnostics.get(metric.key).copied()).collect();
            Some((metric.key.to_owned(), mean(&values)?))
        };
        Metric::diagnostics().filter_map(score).collect()
    }

    /// Returns the counted frames divided by all frames, pooled over the runs that have the count;
    /// `None` if none has it.
    fn fraction_of_frames(&self, counted: impl Fn(&Summary) -> Option<u32>) -> Option<f64> {
        let known: Vec<(f64, f64)> = self
            .played()
            .filter_map(|s| Some((f64::from(counted(s)?), f64::from(s.frames))))
            .collect();
        let (counted, all) = known.iter().fold((0.0, 0.0), |sum, k| (sum.0 + k.0, sum.1 + k.1));
        (all > 0.0).then(|| counted / all)
    }

    /// Returns (team - alone) / max(team, alone) by episode. Episodes without a completed run
    /// without helper are left out.
    fn improvements(&self, formulas: &Formulas) -> Clusters<'_> {
        let amount = |s: &Summary| if formulas.ei_on_amounts { s.done } else { s.rate() };
        let mut clusters = Clusters::default();
        for (episode, with) in self.episodes {
            let without = self.alone.and_then(|alone| alone.get(episode));
            let Some(m0) = without.and_then(|runs| over_played(runs, amount)) else { continue };
            let m = over_seeds(with, amount);
            let improvement = (m - m0) / m.max(m0).max(formulas.ei_floor);
            clusters.add(self.task, self.environments.get(self.task, episode), improvement);
        }
        clusters
    }
}

/// Numbers of completed and failed runs.
#[derive(Clone, Copy)]
struct RunCounts {
    played: f64,
    failed: f64,
}

impl RunCounts {
    /// Combines the value of the completed runs with the value `worst` for each failed run. Returns
    /// `None` if the metric is undefined.
    fn with_failed(self, value: Option<f64>, worst: Option<f64>) -> Option<f64> {
        let RunCounts { played, failed } = self;
        let Some(worst) = worst.filter(|_| failed > 0.0) else { return value };
        Some((played * value.unwrap_or(worst) + failed * worst) / (played + failed))
    }
}

/// Returns the mean over seeds; failed runs count as zero.
pub(super) fn over_seeds(runs: &[Option<&Summary>], value: impl Fn(&Summary) -> f64) -> f64 {
    let values: Vec<f64> = runs.iter().map(|run| run.map_or(0.0, &value)).collect();
    mean(&values).unwrap_or(0.0)
}

/// Returns the mean over the completed runs; `None` without completed runs.
pub(super) fn over_played(
    runs: &[Option<&Summary>],
    value: impl Fn(&Summary) -> f64,
) -> Option<f64> {
    mean(&runs.iter().flatten().map(|s| value(s)).collect::<Vec<f64>>())
}
