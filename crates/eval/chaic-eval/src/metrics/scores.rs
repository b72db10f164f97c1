//! From the results of a run to scores.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;
use chaic_env::RunKey;
use chaic_env::minds::NONE;
use serde::{Deserialize, Serialize};

use crate::metrics::cluster::{Clusters, Environments};
use crate::metrics::stats::{mean, population_sd};
use crate::metrics::{Formulas, MEASURES, RunResult, Spread, Summary};

/// How many missing episode runs are named: more help nobody, and a plan may have millions.
pub const MAX_NAMED: usize = 20;

/// What scores are made from.
#[derive(Clone, Copy, Debug)]
pub struct Played<'a> {
    /// What came out.
    pub results: &'a [RunResult],
    /// All that was to be played; empty where nobody knows.
    pub planned: &'a [RunKey],
    /// Where the episodes take place.
    pub environments: &'a Environments,
}

/// The scores of one helper in one task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Transport rate, 0 to 1: mean over episodes and seeds.
    pub tr: f64,
    /// Its standard error over environments (or, by the original's formulas, its standard
    /// deviation over episodes and seeds).
    pub tr_se: Option<f64>,
    /// Its 95 % interval over environments, within 0 and 1.
    pub tr_ci: Option<[f64; 2]>,
    /// Efficiency improvement over the same episodes without helper, -1 to 1.
    pub ei: Option<f64>,
    /// Its 95 % interval over environments, within -1 and 1.
    pub ei_ci: Option<[f64; 2]>,
    /// Goal inference accuracy, 0 to 1: how much of what the helper delivered was wanted.
    pub ia: Option<f64>,
    /// Completion ratio, 0 to 1: how much of what was wanted and delivered the helper delivered.
    pub cr: Option<f64>,
    /// Emergency rate, 0 to 1: in how many frames the child was away.
    pub er: Option<f64>,
    /// In how many frames the partner or the helper was stuck, 0 to 1.
    pub stuck: Option<f64>,
    /// The mean of each of the [`MEASURES`](crate::metrics::MEASURES) over the episode runs that were
    /// played and have it, by its key.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub measures: BTreeMap<String, f64>,
    /// How many episode runs (episodes times seeds) it rests on, with those that broke down.
    pub episodes: usize,
    /// In how many environments these take place.
    pub environments: usize,
    /// How many of these runs broke down, and so count as zero.
    pub broken: usize,
    /// Whether episode runs are missing.
    #[serde(default)]
    pub incomplete: bool,
    /// The first [`MAX_NAMED`] of them, as `EPISODE seed SEED`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
}

/// All scores of a run, as `scores.json` has them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// By task and helper. A task or helper without any result is absent.
    pub tasks: BTreeMap<TaskId, BTreeMap<String, Score>>,
    /// The rows that were to be played and have no result at all.
    #[serde(skip)]
    unplayed: BTreeSet<(TaskId, String)>,
}

/// The runs of one helper in one task, by episode; `None` for one that broke down.
pub(super) type ByEpisode<'a> = BTreeMap<&'a str, Vec<Option<&'a Summary>>>;
/// The same by task and helper.
pub(super) type Groups<'a> = BTreeMap<TaskId, BTreeMap<&'a str, ByEpisode<'a>>>;

impl Scores {
    /// The scores of these results. Runs that broke down count as zero.
    pub fn of(played: Played<'_>, formulas: &Formulas) -> Scores {
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

    fn mark_missing(&mut self, played: Played<'_>) {
        for key in played.missing() {
            let score = self.tasks.get_mut(&key.task).and_then(|row| row.get_mut(&key.helper));
            let Some(score) = score else {
                self.unplayed.insert((key.task, key.helper.clone()));
                continue;
            };
            score.incomplete = true;
            if score.missing.len() < MAX_NAMED {
                score.missing.push(format!("{} seed {}", key.episode, key.seed));
            }
        }
    }

    /// The scores of one helper in one task.
    pub fn get(&self, task: TaskId, helper: &str) -> Option<&Score> {
        self.tasks.get(&task)?.get(helper)
    }

    /// Whether a row was to be played and has no result at all.
    pub fn is_unplayed(&self, task: TaskId, helper: &str) -> bool {
        self.unplayed.iter().any(|(t, h)| *t == task && h == helper)
    }

    /// The tasks that were played or were to be, in the paper's order.
    pub fn tasks(&self) -> Vec<TaskId> {
        let is_there =
            |t: &TaskId| self.tasks.contains_key(t) || self.unplayed.iter().any(|(u, _)| u == t);
        TaskId::all().filter(is_there).collect()
    }

    /// The helpers that played or were to play: none and the built-in ones in the paper's order,
    /// then others by name.
    pub fn helpers(&self) -> Vec<String> {
        let played = self.tasks.values().flat_map(|h| h.keys());
        let present: BTreeSet<&String> =
            played.chain(self.unplayed.iter().map(|(_, helper)| helper)).collect();
        let known =
            std::iter::once(NONE).chain(chaic_agents::HELPERS.iter().map(|helper| helper.name));
        let mut order: Vec<&str> = known.filter(|n| present.iter().any(|p| p == n)).collect();
        // The oracle isn't compared with but looked up to: the paper's tables have it last.
        order.sort_by_key(|name| *name == "oracle");
        let others = present.iter().map(|n| n.as_str()).filter(|n| !order.contains(n));
        let others: Vec<&str> = others.collect();
        let at = order.iter().position(|n| *n == "oracle").unwrap_or(order.len());
        order.splice(at..at, others);
        order.into_iter().map(str::to_owned).collect()
    }
}

impl<'a> Played<'a> {
    /// What was to be played and has no result, in the order of reports.
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
    // Sums have one order, whatever the order in which workers finished.
    let mut sorted: Vec<&RunResult> = results.iter().collect();
    sorted.sort_by(|a, b| a.key.cmp(&b.key));
    for result in sorted {
        let helpers = groups.entry(result.key.task).or_default();
        let episodes = helpers.entry(&result.key.helper).or_default();
        episodes.entry(&result.key.episode).or_default().push(result.summary());
    }
    groups
}

/// What one score is made of.
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
                by_environment.add(self.task, self.environments.of(episode), rate);
            }
        }
        let interval = by_environment.interval();
        let played = self.played().count();
        let scored = Share { played: played as f64, broken: (rates.len() - played) as f64 };
        let (accuracy, completion) = self.deliveries(formulas);
        let improvement = self.improvements(formulas);
        let ei_ci = improvement.interval().map(|i| i.within(-1.0, 1.0));
        let has_child = self.task.info().has_child && self.has_helper;
        Score {
            tr: mean(&rates).unwrap_or(0.0),
            tr_se: match formulas.spread {
                Spread::PopulationDeviation => population_sd(&rates),
                Spread::StandardError => interval.map(|i| i.se),
            },
            tr_ci: interval.map(|i| i.within(0.0, 1.0)),
            ei: improvement.mean(),
            ei_ci,
            ia: scored.with_broken(accuracy, self.has_helper.then_some(0.0)),
            cr: scored.with_broken(completion, self.has_helper.then_some(0.0)),
            er: scored.with_broken(
                self.part_of_frames(|s| formulas.away_frames(s)),
                has_child.then_some(1.0),
            ),
            stuck: self.part_of_frames(|s| s.stuck_frames),
            measures: self.measures(),
            episodes: rates.len(),
            environments: by_environment.environments(),
            broken: rates.len() - played,
            incomplete: false,
            missing: Vec::new(),
        }
    }

    /// The runs that were played to their end.
    fn played(&self) -> impl Iterator<Item = &Summary> {
        self.episodes.values().flatten().copied().flatten()
    }

    /// Goal inference accuracy and completion ratio of what was played, pooled.
    fn deliveries(&self, formulas: &Formulas) -> (Option<f64>, Option<f64>) {
        let Group { task, has_helper, .. } = *self;
        let (mut helpers, mut counted) = (0.0, 0.0);
        let (mut useful, mut goods) = (0u32, 0u32);
        for delivery in self.played().flat_map(|s| &s.deliveries) {
            let is_helpers = delivery.is_helpers();
            if delivery.counted {
                counted += delivery.worth(task);
                if is_helpers || (formulas.credits_handing_over && delivery.handed) {
                    helpers += delivery.worth(task);
                }
            }
            if is_helpers && delivery.is_goods() {
                goods += 1;
                useful += u32::from(delivery.counted);
            }
        }
        let accuracy = (goods > 0).then(|| f64::from(useful) / f64::from(goods));
        (accuracy, (has_helper && counted > 0.0).then(|| helpers / counted))
    }

    fn measures(&self) -> BTreeMap<String, f64> {
        let of = |key: &str| {
            let values: Vec<f64> =
                self.played().filter_map(|s| s.measures.get(key).copied()).collect();
            mean(&values)
        };
        MEASURES.iter().filter_map(|m| Some((m.key.to_owned(), of(m.key)?))).collect()
    }

    /// Frames that count over all frames, pooled over the runs that know; `None` if none does.
    fn part_of_frames(&self, counted: impl Fn(&Summary) -> Option<u32>) -> Option<f64> {
        let known: Vec<(f64, f64)> = self
            .played()
            .filter_map(|s| Some((f64::from(counted(s)?), f64::from(s.frames))))
            .collect();
        let (part, all) = known.iter().fold((0.0, 0.0), |sum, k| (sum.0 + k.0, sum.1 + k.1));
        (all > 0.0).then(|| part / all)
    }

    /// (team - alone) / max(team, alone) of the episodes that both have. Where everything without
    /// helper broke down there is nothing to compare with.
    fn improvements(&self, formulas: &Formulas) -> Clusters<'_> {
        let amount = |s: &Summary| if formulas.ei_on_amounts { s.done } else { s.rate() };
        let mut clusters = Clusters::default();
        for (episode, with) in self.episodes {
            let without = self.alone.and_then(|alone| alone.get(episode));
            let Some(m0) = without.and_then(|runs| over_played(runs, amount)) else { continue };
            let m = over_seeds(with, amount);
            let improvement = (m - m0) / m.max(m0).max(formulas.ei_floor);
            clusters.add(self.task, self.environments.of(episode), improvement);
        }
        clusters
    }
}

/// How many runs were played, and how many broke down.
#[derive(Clone, Copy)]
struct Share {
    played: f64,
    broken: f64,
}

impl Share {
    /// A value of the runs that were played, with those that broke down at `worst`, each run alike.
    /// `None` where the metric isn't defined at all.
    fn with_broken(self, value: Option<f64>, worst: Option<f64>) -> Option<f64> {
        let Share { played, broken } = self;
        let Some(worst) = worst.filter(|_| broken > 0.0) else { return value };
        Some((played * value.unwrap_or(worst) + broken * worst) / (played + broken))
    }
}

/// The mean over seeds; runs that broke down count as zero.
pub(super) fn over_seeds(runs: &[Option<&Summary>], value: impl Fn(&Summary) -> f64) -> f64 {
    let values: Vec<f64> = runs.iter().map(|run| run.map_or(0.0, &value)).collect();
    mean(&values).unwrap_or(0.0)
}

/// The mean over the seeds that were played to their end; `None` if none was.
pub(super) fn over_played(
    runs: &[Option<&Summary>],
    value: impl Fn(&Summary) -> f64,
) -> Option<f64> {
    mean(&runs.iter().flatten().map(|s| value(s)).collect::<Vec<f64>>())
}
