//! Measured transport rates compared with published ones, and the part of the difference that
//! chance explains.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;

use chaic_eval::metrics::{
    Clusters, Interval, PlayedEpisodes, RunResult, Summary, differences, t_975,
};
use chaic_eval::published::published;

/// Number of episodes of each task in the original's test split, over which published means are
/// computed (paper section 3.3.2, "Dataset Construction").
pub const PUBLISHED_EPISODES: f64 = 12.0;

/// Measured and published transport rate of one helper in one task.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskRate {
    /// Task.
    pub task: TaskId,
    /// Mean over episodes and seeds.
    pub tr: f64,
    /// 95 % interval of the mean over environments; undefined for a single environment.
    pub interval: Option<Interval>,
    /// Standard error of the mean over environments if each episode were played once. Its square is
    /// the mean variance over seeds.
    pub se_once: Option<f64>,
    /// Number of episodes.
    pub n: usize,
    /// Published rate, if the paper has this helper.
    pub published: Option<f64>,
}

/// Returns the rate of a helper in a task; `None` without results. Failed runs count as zero.
pub fn task_rate(played: PlayedEpisodes<'_>, task: TaskId, helper: &str) -> Option<TaskRate> {
    let is_selected = |r: &&RunResult| r.key.task == task && r.key.helper == helper;
    let mut all = Clusters::default();
    let mut by_seed: BTreeMap<u32, Clusters<'_>> = BTreeMap::new();
    let mut episodes = BTreeSet::new();
    for result in played.results.iter().filter(is_selected) {
        let rate = result.summary().map_or(0.0, Summary::rate);
        let environment = played.environments.get(task, &result.key.episode);
        all.add(task, environment, rate);
        by_seed.entry(result.key.seed).or_default().add(task, environment, rate);
        episodes.insert(&result.key.episode);
    }
    let errors: Option<Vec<f64>> =
        by_seed.values().map(|clusters| clusters.interval().map(|i| i.se)).collect();
    let variance = errors.map(|se| se.iter().map(|se| se * se).sum::<f64>() / se.len() as f64);
    Some(TaskRate {
        task,
        tr: all.mean()?,
        interval: all.interval(),
        se_once: variance.map(f64::sqrt),
        n: episodes.len(),
        published: published(helper).and_then(|row| Some(row.scores(task)?.tr)),
    })
}

impl TaskRate {
    /// Returns the measured rate minus the published rate.
    pub fn difference(&self) -> Option<f64> {
        Some(self.tr - self.published?)
    }

    /// Returns the standard error of the difference under the hypothesis that only chance separates
    /// the two means. The other mean is over [`PUBLISHED_EPISODES`] episodes played once, with the
    /// same variance and as many episodes per environment.
    pub fn chance_se(&self) -> Option<f64> {
        let (se, once) = (self.interval?.se, self.se_once?);
        Some((se * se + once * once * self.n as f64 / PUBLISHED_EPISODES).sqrt())
    }

    /// Returns whether the difference exceeds the 95 % limit of chance, by Student's t.
    pub fn is_beyond_chance(&self) -> bool {
        let known = self.difference().zip(self.chance_se()).zip(self.interval);
        known.is_some_and(|((d, se), i)| d.abs() > t_975(i.df) * se)
    }
}

/// Difference between a helper's rates and the published ones, over all tasks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedDifference {
    /// Number of tasks.
    pub tasks: usize,
    /// Mean of measured minus published.
    pub bias: f64,
    /// Mean absolute difference.
    pub mad: f64,
    /// Expected mean absolute difference under chance alone: the mean of `sqrt(2 / pi) * se`, the
    /// mean absolute value of a normal distribution with that standard error.
    pub by_chance: f64,
    /// Standard deviation of the mean absolute difference under chance alone: the root of the sum
    /// of `se^2 * (1 - 2 / pi)`, divided by the number of tasks.
    pub chance_sd: f64,
    /// Number of tasks whose difference is beyond chance.
    pub significant: usize,
}

/// Returns the difference over these tasks; `None` if nothing is published or a standard error is
/// unknown.
pub fn published_difference(rates: &[TaskRate]) -> Option<PublishedDifference> {
    let known: Option<Vec<(f64, f64)>> =
        rates.iter().map(|r| r.difference().zip(r.chance_se())).collect();
    let known = known.filter(|k| !k.is_empty())?;
    let n = known.len() as f64;
    let two_over_pi = std::f64::consts::FRAC_2_PI;
    let mean = |value: fn(&(f64, f64)) -> f64| known.iter().map(value).sum::<f64>() / n;
    let variance = known.iter().map(|(_, se)| se * se * (1.0 - two_over_pi)).sum::<f64>();
    Some(PublishedDifference {
        tasks: known.len(),
        bias: mean(|(d, _)| *d),
        mad: mean(|(d, _)| d.abs()),
        by_chance: mean(|(_, se)| *se) * two_over_pi.sqrt(),
        chance_sd: variance.sqrt() / n,
        significant: rates.iter().filter(|r| r.is_beyond_chance()).count(),
    })
}

/// Two helpers whose measured order differs from the published one.
#[derive(Clone, Debug, PartialEq)]
pub struct RankInversion {
    /// Helper with the higher published rate.
    pub higher: String,
    /// Helper with the lower published rate.
    pub lower: String,
    /// Measured rate of `higher` minus that of `lower`, paired by episode.
    pub interval: Option<Interval>,
}

/// Pairwise order of helpers in a task. Pairs with equal published rates are not counted.
#[derive(Clone, Debug, PartialEq)]
pub struct PairwiseOrder {
    /// Number of pairs with different published rates.
    pub pairs: usize,
    /// Pairs in another order than published. A pair with equal measured rates is included.
    pub inverted: Vec<RankInversion>,
}

/// Compares the order of helpers in a task; helpers without results or without a published rate are
/// left out.
pub fn pairwise_order(
    played: PlayedEpisodes<'_>,
    task: TaskId,
    helpers: &[String],
) -> PairwiseOrder {
    let rate = |h: &String| {
        let rate = task_rate(played, task, h)?;
        Some((h.clone(), rate.tr, rate.published?))
    };
    let mut rates: Vec<(String, f64, f64)> = helpers.iter().filter_map(rate).collect();
    // Highest published rate first; equal rates in the order of the helpers.
    rates.sort_by(|a, b| b.2.total_cmp(&a.2));
    let mut order = PairwiseOrder { pairs: 0, inverted: Vec::new() };
    for (k, (lower, low_tr, low_published)) in rates.iter().enumerate() {
        for (higher, high_tr, high_published) in &rates[..k] {
            if high_published <= low_published {
                continue;
            }
            order.pairs += 1;
            if high_tr > low_tr {
                continue;
            }
            let pair = [lower.clone(), higher.clone()];
            let interval =
                differences(played, &pair).pop().and_then(|d| d.tasks.get(&task).copied());
            let (higher, lower) = (higher.clone(), lower.clone());
            order.inverted.push(RankInversion { higher, lower, interval });
        }
    }
    order
}

impl RankInversion {
    /// Returns whether chance may have caused the inversion: the interval contains zero, or there
    /// is none.
    pub fn is_within_interval(&self) -> bool {
        self.interval.is_none_or(|i| i.low <= 0.0 && 0.0 <= i.high)
    }
}

impl PairwiseOrder {
    /// Returns whether all pairs are in the published order.
    pub fn is_preserved(&self) -> bool {
        self.inverted.is_empty()
    }

    /// Returns whether chance may have caused all inversions.
    pub fn is_within_intervals(&self) -> bool {
        self.inverted.iter().all(RankInversion::is_within_interval)
    }
}
