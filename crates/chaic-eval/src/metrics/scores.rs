//! From the results of a run to scores.

use std::collections::{BTreeMap, BTreeSet};

use chaic_protocol::TaskId;
use serde::{Deserialize, Serialize};

use crate::helpers::NONE;
use crate::metrics::stats::{Interval, mean, paired_interval, population_sd, sample_sd};
use crate::metrics::{Formulas, RunResult, Spread, Summary};

/// The scores of one helper in one task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Transport rate, 0 to 1: mean over episodes and seeds.
    pub tr: f64,
    /// Its standard error over episodes (or, by the original's formulas, standard deviation).
    pub tr_se: Option<f64>,
    /// Efficiency improvement over the same episodes without helper, -1 to 1.
    pub ei: Option<f64>,
    /// Goal inference accuracy, 0 to 1: how much of what the helper delivered was wanted.
    pub ia: Option<f64>,
    /// Completion ratio, 0 to 1: how much of what was wanted and delivered the helper delivered.
    pub cr: Option<f64>,
    /// Emergency rate, 0 to 1: in how many frames the child was away.
    pub er: Option<f64>,
    /// How many episode runs (episodes times seeds) it rests on.
    pub episodes: usize,
}

/// All scores of a run, as `scores.json` has them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// By task and helper. A task or helper without any finished episode is absent.
    pub tasks: BTreeMap<TaskId, BTreeMap<String, Score>>,
}

/// How much higher one helper's transport rate is than another's on the same episodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The helper.
    pub helper: String,
    /// The one it is compared with.
    pub baseline: String,
    /// Per task, where both have at least two episodes in common.
    pub tasks: BTreeMap<TaskId, Interval>,
    /// Over the episodes of all tasks.
    pub all: Option<Interval>,
}

/// The runs of one helper in one task, by episode.
type ByEpisode<'a> = BTreeMap<&'a str, Vec<&'a Summary>>;

impl Scores {
    /// The scores of these results. Runs that broke down are left out.
    pub fn of(results: &[RunResult], formulas: &Formulas) -> Scores {
        let groups = grouped(results);
        let mut scores = Scores::default();
        for (task, helpers) in &groups {
            let alone = helpers.get(NONE);
            for (helper, episodes) in helpers {
                let has_helper = *helper != NONE;
                let alone = alone.filter(|_| has_helper);
                let group = Group { task: *task, episodes, alone, has_helper };
                let score = group.score(formulas);
                scores.tasks.entry(*task).or_default().insert((*helper).to_owned(), score);
            }
        }
        scores
    }

    /// The scores of one helper in one task.
    pub fn get(&self, task: TaskId, helper: &str) -> Option<&Score> {
        self.tasks.get(&task)?.get(helper)
    }

    /// The tasks that have scores, in the paper's order.
    pub fn tasks(&self) -> Vec<TaskId> {
        TaskId::all().filter(|t| self.tasks.contains_key(t)).collect()
    }

    /// The helpers that have scores: none and the built-in ones in the paper's order, then others
    /// by name.
    pub fn helpers(&self) -> Vec<String> {
        let present: BTreeSet<&String> = self.tasks.values().flat_map(|h| h.keys()).collect();
        let known = std::iter::once(NONE).chain(chaic_agents::HELPERS.iter().copied());
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

fn grouped(results: &[RunResult]) -> BTreeMap<TaskId, BTreeMap<&str, ByEpisode<'_>>> {
    let mut groups: BTreeMap<TaskId, BTreeMap<&str, ByEpisode<'_>>> = BTreeMap::new();
    // Sums have one order, whatever the order in which workers finished.
    let mut sorted: Vec<&RunResult> = results.iter().collect();
    sorted.sort_by(|a, b| a.key.cmp(&b.key));
    for result in sorted {
        let Some(summary) = result.summary() else { continue };
        let helpers = groups.entry(result.key.task).or_default();
        let episodes = helpers.entry(&result.key.helper).or_default();
        episodes.entry(&result.key.episode).or_default().push(summary);
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
}

impl Group<'_> {
    fn score(&self, formulas: &Formulas) -> Score {
        let Group { task, episodes, alone, has_helper } = *self;
        let runs: Vec<&Summary> = episodes.values().flatten().copied().collect();
        let rates: Vec<f64> = runs.iter().map(|s| s.rate()).collect();
        let (mut helpers, mut counted) = (0.0, 0.0);
        let (mut useful, mut goods) = (0u32, 0u32);
        for delivery in runs.iter().flat_map(|s| &s.deliveries) {
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
        let child: Vec<(f64, f64)> = runs
            .iter()
            .filter_map(|s| Some((f64::from(formulas.away_frames(s)?), f64::from(s.frames))))
            .collect();
        let (away, frames) = child.iter().fold((0.0, 0.0), |(a, f), c| (a + c.0, f + c.1));
        Score {
            tr: mean(&rates).unwrap_or(0.0),
            tr_se: spread(episodes, &rates, formulas.spread),
            ei: alone.and_then(|alone| improvement(episodes, alone, formulas)),
            ia: (goods > 0).then(|| f64::from(useful) / f64::from(goods)),
            cr: (has_helper && counted > 0.0).then(|| helpers / counted),
            er: (frames > 0.0).then(|| away / frames),
            episodes: runs.len(),
        }
    }
}

fn spread(episodes: &ByEpisode<'_>, rates: &[f64], spread: Spread) -> Option<f64> {
    match spread {
        Spread::PopulationDeviation => population_sd(rates),
        Spread::StandardError => {
            let means: Vec<f64> =
                episodes.values().map(|runs| over_seeds(runs, Summary::rate)).collect();
            sample_sd(&means).map(|sd| sd / (means.len() as f64).sqrt())
        }
    }
}

/// Mean over the episodes that both have, of (team - alone) / max(team, alone).
fn improvement(team: &ByEpisode<'_>, alone: &ByEpisode<'_>, formulas: &Formulas) -> Option<f64> {
    let amount = |s: &Summary| if formulas.ei_on_amounts { s.done } else { s.rate() };
    let of_episode = |(episode, with): (&&str, &Vec<&Summary>)| {
        let without = alone.get(episode)?;
        let (m, m0) = (over_seeds(with, amount), over_seeds(without, amount));
        Some((m - m0) / m.max(m0).max(formulas.ei_floor))
    };
    mean(&team.iter().filter_map(of_episode).collect::<Vec<f64>>())
}

fn over_seeds(runs: &[&Summary], value: impl Fn(&Summary) -> f64) -> f64 {
    mean(&runs.iter().map(|s| value(s)).collect::<Vec<f64>>()).unwrap_or(0.0)
}

/// The transport rate of one helper in one task by episode, seeds averaged.
pub fn episode_rates(results: &[RunResult], task: TaskId, helper: &str) -> BTreeMap<String, f64> {
    let groups = grouped(results);
    let episodes = groups.get(&task).and_then(|helpers| helpers.get(helper));
    let rate =
        |(id, runs): (&&str, &Vec<&Summary>)| ((*id).to_owned(), over_seeds(runs, Summary::rate));
    episodes.into_iter().flatten().map(rate).collect()
}

/// Paired differences of the transport rate between all helpers, episode by episode (seeds
/// averaged), with 95 % intervals by Student's t.
pub fn differences(results: &[RunResult], helpers: &[String]) -> Vec<Difference> {
    let groups = grouped(results);
    let mut found = Vec::new();
    for (k, helper) in helpers.iter().enumerate() {
        for baseline in &helpers[..k] {
            let mut tasks = BTreeMap::new();
            let mut all = Vec::new();
            for (task, by_helper) in &groups {
                let pair = (by_helper.get(helper.as_str()), by_helper.get(baseline.as_str()));
                let (Some(a), Some(b)) = pair else { continue };
                let rate = |runs: &Vec<&Summary>| over_seeds(runs, Summary::rate);
                let paired = a.iter().filter_map(|(e, runs)| Some(rate(runs) - rate(b.get(e)?)));
                let paired: Vec<f64> = paired.collect();
                tasks.extend(paired_interval(&paired).map(|interval| (*task, interval)));
                all.extend(paired);
            }
            let (helper, baseline) = (helper.clone(), baseline.clone());
            found.push(Difference { helper, baseline, tasks, all: paired_interval(&all) });
        }
    }
    found
}
