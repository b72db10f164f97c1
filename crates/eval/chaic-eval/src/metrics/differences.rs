//! How much higher one helper's transport rate is than another's, and what can be told apart.

use std::collections::BTreeMap;

use chaic_core::TaskId;
use chaic_env::minds::NONE;

use crate::metrics::cluster::{Clusters, Interval};
use crate::metrics::scores::{ByEpisode, grouped, over_played, over_seeds};
use crate::metrics::{Played, Summary};

/// How much higher one helper's transport rate is than another's on the same episodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The helper.
    pub helper: String,
    /// The one it is compared with.
    pub baseline: String,
    /// Per task, where both have episodes of at least two environments in common.
    pub tasks: BTreeMap<TaskId, Interval>,
    /// Over the episodes of all tasks.
    pub all: Option<Interval>,
}

/// The smallest difference of two helpers' transport rates that the episodes of a task can tell from
/// zero: half the 95 % interval of the paired difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// How many environments the episodes take place in.
    pub environments: usize,
    /// Of half the pairs of helpers.
    pub median: f64,
    /// Of all pairs.
    pub largest: f64,
}

/// Paired differences of the transport rate between all helpers, episode by episode (seeds
/// averaged), with 95 % intervals over environments. A run that broke down counts as zero, but where
/// the one without helper did there is nothing to compare with.
pub fn differences(played: Played<'_>, helpers: &[String]) -> Vec<Difference> {
    let groups = grouped(played.results);
    let mut found = Vec::new();
    for (k, helper) in helpers.iter().enumerate() {
        for baseline in &helpers[..k] {
            let mut tasks = BTreeMap::new();
            let mut all = Clusters::default();
            for (task, by_helper) in &groups {
                let (Some(a), Some(b)) = (rates(by_helper, helper), rates(by_helper, baseline))
                else {
                    continue;
                };
                let mut of_task = Clusters::default();
                for (episode, rate) in a {
                    let Some(other) = b.get(episode) else { continue };
                    let environment = played.environments.of(episode);
                    of_task.add(*task, environment, rate - other);
                    all.add(*task, environment, rate - other);
                }
                tasks.extend(of_task.interval().map(|interval| (*task, interval)));
            }
            let (helper, baseline) = (helper.clone(), baseline.clone());
            found.push(Difference { helper, baseline, tasks, all: all.interval() });
        }
    }
    found
}

/// A helper's transport rates by episode, seeds averaged.
fn rates<'a>(
    by_helper: &BTreeMap<&'a str, ByEpisode<'a>>,
    helper: &str,
) -> Option<BTreeMap<&'a str, f64>> {
    let rate = |runs: &[Option<&Summary>]| match helper {
        NONE => over_played(runs, Summary::rate),
        _ => Some(over_seeds(runs, Summary::rate)),
    };
    let episodes = by_helper.get(helper)?;
    Some(episodes.iter().filter_map(|(episode, runs)| Some((*episode, rate(runs)?))).collect())
}

/// What the episodes of a task can tell apart; of all tasks together where `task` is `None`. `None`
/// where no pair of helpers has an interval.
pub fn resolution(differences: &[Difference], task: Option<TaskId>) -> Option<Resolution> {
    let of = |d: &Difference| task.map_or(d.all, |t| d.tasks.get(&t).copied());
    let intervals: Vec<Interval> = differences.iter().filter_map(of).collect();
    let mut halves: Vec<f64> = intervals.iter().map(Interval::half).collect();
    halves.sort_by(f64::total_cmp);
    Some(Resolution {
        environments: intervals.iter().map(|i| i.environments).max()?,
        median: *halves.get((halves.len() - 1) / 2)?,
        largest: *halves.last()?,
    })
}
