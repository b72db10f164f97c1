//! Paired differences of transport rates between helpers, and the resolution of a set of episodes.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;
use chaic_env::helper_registry::NONE;

use crate::metrics::cluster::{Clusters, Interval};
use crate::metrics::scores::{ByEpisode, Groups, grouped, over_played, over_seeds};
use crate::metrics::{Environments, PlayedEpisodes, RunResult, Summary};

/// Difference of the transport rates of two helpers on the same episodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The helper.
    pub helper: String,
    /// Helper that it is compared with.
    pub baseline: String,
    /// Per task; tasks with fewer than two common environments are absent.
    pub tasks: BTreeMap<TaskId, Interval>,
    /// Over the episodes of all tasks.
    pub all: Option<Interval>,
}

/// Smallest difference of two helpers' transport rates that the episodes of a task distinguish from
/// zero: half the 95 % interval of the paired difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Number of environments in which the episodes take place.
    pub environments: usize,
    /// Median over pairs of helpers; the mean of the two middle values of an even number of pairs.
    pub median: f64,
    /// Maximum over pairs of helpers.
    pub largest: f64,
}

/// Mean transport rate of a helper over the episodes of all tasks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanRate {
    /// The mean.
    pub mean: f64,
    /// Its 95 % interval over environments, if there are enough of them.
    pub interval: Option<Interval>,
    /// Number of environments in which the episodes take place.
    pub environments: usize,
}

/// Computes paired differences of the transport rate between all helpers, by episode (seeds
/// averaged), with 95 % intervals over environments.
///
/// A failed run counts as zero. If all runs of an episode without helper failed, that episode is
/// not compared with `none`.
pub fn differences(played: PlayedEpisodes<'_>, helpers: &[String]) -> Vec<Difference> {
    let groups = grouped(played.results);
    let mut found = Vec::new();
    for (k, helper) in helpers.iter().enumerate() {
        for baseline in &helpers[..k] {
            found.push(difference((&groups, helper), (&groups, baseline), played.environments).0);
        }
    }
    found
}

/// Computes paired differences between two runs for each helper that both have, as
/// [`differences`] does.
pub fn run_differences(played: PlayedEpisodes<'_>, baseline: &[RunResult]) -> Vec<Difference> {
    let (groups, baseline_groups) = (grouped(played.results), grouped(baseline));
    let helpers: BTreeSet<&str> = groups.values().flat_map(|row| row.keys().copied()).collect();
    let pairs = helpers.into_iter().map(|helper| {
        difference((&groups, helper), (&baseline_groups, helper), played.environments)
    });
    pairs.filter(|(_, n_episodes)| *n_episodes > 0).map(|(difference, _)| difference).collect()
}

/// Results of one helper, which may come from a run of its own.
#[derive(Clone, Copy, Debug)]
pub struct HelperResults<'a> {
    /// Results of the run.
    pub results: &'a [RunResult],
    /// Name of the helper in the run.
    pub helper: &'a str,
}

/// Computes the paired difference between two helpers of any runs, as [`differences`] does.
pub fn paired_difference(
    a: HelperResults<'_>,
    b: HelperResults<'_>,
    environments: &Environments,
) -> Difference {
    let (groups, baseline_groups) = (grouped(a.results), grouped(b.results));
    difference((&groups, a.helper), (&baseline_groups, b.helper), environments).0
}

/// Returns the mean transport rate of a helper; `None` without results. Seeds are averaged, and failed
/// runs count as zero.
pub fn mean_rate(
    HelperResults { results, helper }: HelperResults<'_>,
    environments: &Environments,
) -> Option<MeanRate> {
    let groups = grouped(results);
    let mut all = Clusters::default();
    for (task, by_helper) in &groups {
        let Some(episodes) = by_helper.get(helper) else { continue };
        for (episode, runs) in episodes {
            all.add(*task, environments.get(*task, episode), over_seeds(runs, Summary::rate));
        }
    }
    let (interval, environments) = (all.interval(), all.environments());
    Some(MeanRate { mean: all.mean()?, interval, environments })
}

/// Compares two helpers, each with the results of its run, on the episodes that both have; also
/// returns the number of these episodes.
fn difference(
    (groups, helper): (&Groups<'_>, &str),
    (baseline_groups, baseline): (&Groups<'_>, &str),
    environments: &Environments,
) -> (Difference, usize) {
    let (mut tasks, mut n_episodes) = (BTreeMap::new(), 0);
    let mut all = Clusters::default();
    for (task, by_helper) in groups {
        let baseline_rates = baseline_groups.get(task).and_then(|row| rates(row, baseline));
        let Some((a, b)) = rates(by_helper, helper).zip(baseline_rates) else { continue };
        let mut in_task = Clusters::default();
        for (episode, rate) in a {
            let Some(baseline_rate) = b.get(episode) else { continue };
            let environment = environments.get(*task, episode);
            n_episodes += 1;
            in_task.add(*task, environment, rate - baseline_rate);
            all.add(*task, environment, rate - baseline_rate);
        }
        tasks.extend(in_task.interval().map(|interval| (*task, interval)));
    }
    let (helper, baseline) = (helper.to_owned(), baseline.to_owned());
    (Difference { helper, baseline, tasks, all: all.interval() }, n_episodes)
}

/// Returns a helper's transport rates by episode, averaged over seeds.
pub(super) fn rates<'a>(
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

/// Returns the resolution of a task's episodes, or of all tasks if `task` is `None`. Returns `None`
/// if no pair of helpers has an interval.
pub fn resolution(differences: &[Difference], task: Option<TaskId>) -> Option<Resolution> {
    let interval = |d: &Difference| task.map_or(d.all, |t| d.tasks.get(&t).copied());
    let intervals: Vec<Interval> = differences.iter().filter_map(interval).collect();
    let mut halves: Vec<f64> = intervals.iter().map(Interval::half_width).collect();
    halves.sort_by(f64::total_cmp);
    Some(Resolution {
        environments: intervals.iter().map(|i| i.environments).max()?,
        median: (*halves.get((halves.len() - 1) / 2)? + halves[halves.len() / 2]) / 2.0,
        largest: *halves.last()?,
    })
}
