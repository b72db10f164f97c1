//! Measured transport rates against published ones, and how much of a difference chance explains.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;

use chaic_eval::metrics::{Clusters, Interval, Played, RunResult, Summary, differences, t_975};
use chaic_eval::published::published;

/// Episodes of each task in the original's test split, over which published means are taken
/// (paper section 3.3.2, "Dataset Construction").
pub const PUBLISHED_EPISODES: f64 = 12.0;

/// The transport rate of one helper in one task, measured and published.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskRate {
    /// The task.
    pub task: TaskId,
    /// The mean over episodes and seeds.
    pub tr: f64,
    /// Its 95 % interval over environments; undefined for one.
    pub interval: Option<Interval>,
    /// Its standard error over environments if each episode were played once: the variance is the
    /// mean over seeds.
    pub se_once: Option<f64>,
    /// How many episodes.
    pub n: usize,
    /// What the paper reports, if it has this helper.
    pub published: Option<f64>,
}

/// The rate of a helper in a task; `None` without results. Runs that broke down count as zero.
pub fn task_rate(played: Played<'_>, task: TaskId, helper: &str) -> Option<TaskRate> {
    let is_it = |r: &&RunResult| r.key.task == task && r.key.helper == helper;
    let mut all = Clusters::default();
    let mut by_seed: BTreeMap<u32, Clusters<'_>> = BTreeMap::new();
    let mut episodes = BTreeSet::new();
    for result in played.results.iter().filter(is_it) {
        let rate = result.summary().map_or(0.0, Summary::rate);
        let environment = played.environments.of(&result.key.episode);
        all.add(task, environment, rate);
        by_seed.entry(result.key.seed).or_default().add(task, environment, rate);
        episodes.insert(&result.key.episode);
    }
    let errors: Option<Vec<f64>> =
        by_seed.values().map(|of_seed| of_seed.interval().map(|i| i.se)).collect();
    let variance = errors.map(|se| se.iter().map(|se| se * se).sum::<f64>() / se.len() as f64);
    Some(TaskRate {
        task,
        tr: all.mean()?,
        interval: all.interval(),
        se_once: variance.map(f64::sqrt),
        n: episodes.len(),
        published: published(helper).and_then(|row| Some(row.figures(task)?.tr)),
    })
}

impl TaskRate {
    /// Measured less published.
    pub fn difference(&self) -> Option<f64> {
        Some(self.tr - self.published?)
    }

    /// The standard error of the difference between these episodes' mean and that of
    /// [`PUBLISHED_EPISODES`] others, played once, with the same spread and as many in one
    /// environment, if only chance tells them apart.
    pub fn chance_se(&self) -> Option<f64> {
        let (se, once) = (self.interval?.se, self.se_once?);
        Some((se * se + once * once * self.n as f64 / PUBLISHED_EPISODES).sqrt())
    }

    /// Whether the difference is more than chance explains in 95 of 100 cases, by Student's t.
    pub fn is_beyond_chance(&self) -> bool {
        let known = self.difference().zip(self.chance_se()).zip(self.interval);
        known.is_some_and(|((d, se), i)| d.abs() > t_975(i.df) * se)
    }
}

/// How far a helper's rates are from the published ones, over the tasks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// How many tasks.
    pub tasks: usize,
    /// The mean of measured less published.
    pub bias: f64,
    /// The mean absolute difference.
    pub mad: f64,
    /// What that would be on average if only chance told both apart: the mean of
    /// `sqrt(2 / pi) * se`, the mean absolute value of a normal with that standard error.
    pub by_chance: f64,
    /// Its standard deviation then: the root of the sum of `se^2 * (1 - 2 / pi)`, over the number
    /// of tasks.
    pub chance_sd: f64,
    /// In how many tasks the difference is beyond chance.
    pub beyond: usize,
}

/// The distance over these tasks; `None` where nothing is published or nothing known of chance.
pub fn distance(rates: &[TaskRate]) -> Option<Distance> {
    let known: Option<Vec<(f64, f64)>> =
        rates.iter().map(|r| r.difference().zip(r.chance_se())).collect();
    let known = known.filter(|k| !k.is_empty())?;
    let n = known.len() as f64;
    let two_over_pi = std::f64::consts::FRAC_2_PI;
    let mean = |value: fn(&(f64, f64)) -> f64| known.iter().map(value).sum::<f64>() / n;
    let variance = known.iter().map(|(_, se)| se * se * (1.0 - two_over_pi)).sum::<f64>();
    Some(Distance {
        tasks: known.len(),
        bias: mean(|(d, _)| *d),
        mad: mean(|(d, _)| d.abs()),
        by_chance: mean(|(_, se)| *se) * two_over_pi.sqrt(),
        chance_sd: variance.sqrt() / n,
        beyond: rates.iter().filter(|r| r.is_beyond_chance()).count(),
    })
}

/// Two helpers that stand the other way round than published.
#[derive(Clone, Debug, PartialEq)]
pub struct Inversion {
    /// The one with the higher published rate.
    pub higher: String,
    /// The one with the lower.
    pub lower: String,
    /// The measured rate of the first less that of the second, episode by episode.
    pub interval: Option<Interval>,
}

/// The order of helpers in a task, pair by pair. Pairs whose published rates are equal may stand
/// either way and are not counted.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// How many pairs differ as published.
    pub pairs: usize,
    /// Those that don't stand as published. A pair that is equal here is one.
    pub inverted: Vec<Inversion>,
}

/// The order of helpers in a task; those without results or published rate are left out.
pub fn order(played: Played<'_>, task: TaskId, helpers: &[String]) -> Order {
    let rate = |h: &String| {
        let rate = task_rate(played, task, h)?;
        Some((h.clone(), rate.tr, rate.published?))
    };
    let mut rates: Vec<(String, f64, f64)> = helpers.iter().filter_map(rate).collect();
    // Highest published first; equal ones in the order of the helpers.
    rates.sort_by(|a, b| b.2.total_cmp(&a.2));
    let mut order = Order { pairs: 0, inverted: Vec::new() };
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
            order.inverted.push(Inversion { higher, lower, interval });
        }
    }
    order
}

impl Inversion {
    /// Whether chance may have turned it: its interval has zero in it, or there is none.
    pub fn is_within_interval(&self) -> bool {
        self.interval.is_none_or(|i| i.low <= 0.0 && 0.0 <= i.high)
    }
}

impl Order {
    /// Whether all pairs stand as published.
    pub fn is_preserved(&self) -> bool {
        self.inverted.is_empty()
    }

    /// Whether those that don't may do so by chance.
    pub fn is_within_intervals(&self) -> bool {
        self.inverted.iter().all(Inversion::is_within_interval)
    }
}
