//! Uncertainty of a mean over episodes that share environments: a cluster bootstrap.
//!
//! Episodes in one house, and seeds of one episode, are correlated, so they are not independent
//! samples; environments are. A resample draws environments with replacement, each with all its
//! episodes and seeds. The standard deviation of the mean over resamples is the standard error
//! (Efron and Tibshirani, "An Introduction to the Bootstrap", 1993, chapters 6 and 8).

use std::collections::BTreeMap;

use chaic_core::TaskId;
use chaic_core::rng::RngStream;
use serde::Serialize;

use crate::metrics::stats::{population_sd, t_975};

/// Number of resamples. The relative error of the standard error is 0.7 % (1 / sqrt(2 * 10,000)).
const RESAMPLES: usize = 10_000;
/// Seed of the resampling; it is fixed so that reports are reproducible.
const SEED: u64 = 0;

/// Environment of each episode, by task and episode id.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environments(BTreeMap<TaskId, BTreeMap<String, String>>);

/// A mean with its 95 % confidence interval over environments.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// The mean.
    pub mean: f64,
    /// Standard error of the mean.
    pub se: f64,
    /// Lower end; not limited to the range of the metric.
    pub low: f64,
    /// Upper end; not limited to the range of the metric.
    pub high: f64,
    /// Number of environments.
    pub environments: usize,
    /// Degrees of freedom: environments minus scene kinds.
    pub df: usize,
}

/// Values grouped by environment. Environments are resampled within each scene kind, because the
/// numbers of houses, streets and yards are fixed by the benchmark.
#[derive(Clone, Debug, Default)]
pub struct Clusters<'a> {
    /// Clusters by number of the scene kind, then by environment.
    strata: BTreeMap<u8, BTreeMap<&'a str, Cluster>>,
}

/// Sum and count of the values in one environment.
#[derive(Clone, Copy, Debug, Default)]
struct Cluster {
    sum: f64,
    n: f64,
}

impl Environments {
    /// Creates the map from triples of task, episode and environment.
    pub fn new(entries: impl IntoIterator<Item = (TaskId, String, String)>) -> Environments {
        let mut environments = Environments::default();
        for (task, episode, environment) in entries {
            environments.0.entry(task).or_default().insert(episode, environment);
        }
        environments
    }

    /// Returns the environment of an episode; the episode id if the environment is unknown.
    pub fn get<'a>(&'a self, task: TaskId, episode: &'a str) -> &'a str {
        let known = self.0.get(&task).and_then(|of_task| of_task.get(episode));
        known.map_or(episode, String::as_str)
    }
}

impl<'a> Clusters<'a> {
    /// Adds a value of an episode of this task.
    pub fn add(&mut self, task: TaskId, environment: &'a str, value: f64) {
        let stratum = self.strata.entry(task.info().scene as u8).or_default();
        let cluster = stratum.entry(environment).or_default();
        cluster.sum += value;
        cluster.n += 1.0;
    }

    /// Returns the number of environments.
    pub fn environments(&self) -> usize {
        self.strata.values().map(BTreeMap::len).sum()
    }

    /// Returns the mean of all values; `None` without values.
    pub fn mean(&self) -> Option<f64> {
        let all = || self.strata.values().flat_map(BTreeMap::values);
        let n: f64 = all().map(|c| c.n).sum();
        (n > 0.0).then(|| all().map(|c| c.sum).sum::<f64>() / n)
    }

    /// Returns the mean with its 95 % interval by Student's t; `None` if a scene kind has fewer
    /// than two environments.
    ///
    /// The degrees of freedom are the environments minus the scene kinds. Percentiles of resamples
    /// of few clusters would be too narrow (Cameron, Gelbach and Miller, "Bootstrap-Based
    /// Improvements for Inference with Clustered Errors", 2008).
    pub fn interval(&self) -> Option<Interval> {
        let (mean, se) = (self.mean()?, self.standard_error(RESAMPLES)?);
        let environments = self.environments();
        let df = environments - self.strata.len();
        let half = t_975(df) * se;
        Some(Interval { mean, se, low: mean - half, high: mean + half, environments, df })
    }

    /// Returns the standard error of the mean.
    ///
    /// Of n environments a resample draws n - 1 with weight n / (n - 1). Without that, the variance
    /// would be too small by the factor (n - 1) / n (Rao and Wu, "Resampling Inference with Complex
    /// Survey Data", 1988).
    fn standard_error(&self, resamples: usize) -> Option<f64> {
        let strata: Vec<Vec<Cluster>> =
            self.strata.values().map(|s| s.values().copied().collect()).collect();
        if strata.is_empty() || strata.iter().any(|s| s.len() < 2) {
            return None;
        }
        let mut stream = RngStream::new(SEED, "cluster bootstrap", 0);
        let means = (0..resamples).map(|_| {
            let mut drawn = Cluster::default();
            for stratum in &strata {
                let n = stratum.len();
                let weight = n as f64 / (n - 1) as f64;
                for _ in 1..n {
                    let cluster = stratum[stream.below(n)];
                    drawn.sum += weight * cluster.sum;
                    drawn.n += weight * cluster.n;
                }
            }
            drawn.sum / drawn.n
        });
        population_sd(&means.collect::<Vec<f64>>())
    }
}

impl Interval {
    /// Returns half the width: the smallest difference that the interval distinguishes from zero.
    pub fn half_width(&self) -> f64 {
        (self.high - self.low) / 2.0
    }

    /// Returns the ends of the interval, clamped to the range of the metric.
    pub fn clamped(&self, min: f64, max: f64) -> [f64; 2] {
        [self.low, self.high].map(|end| end.clamp(min, max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns clusters of one house per slice.
    fn houses(values: &[&[f64]]) -> Clusters<'static> {
        const NAMES: [&str; 6] = ["h0", "h1", "h2", "h3", "h4", "h5"];
        let mut clusters = Clusters::default();
        for (name, house) in NAMES.iter().zip(values) {
            house.iter().for_each(|v| clusters.add(TaskId::LowTarget, name, *v));
        }
        clusters
    }

    fn assert_close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance * b, "{a} is not {b}");
    }

    #[test]
    fn independent_episodes_have_the_analytical_standard_error() {
        // 0.1, 0.2, 0.3: standard deviation 0.1, divided by sqrt(3); t of 2 degrees of freedom is
        // 4.303.
        let i = houses(&[&[0.1], &[0.2], &[0.3]]).interval().unwrap();
        assert_close(i.mean, 0.2, 1e-9);
        assert_close(i.se, 0.1 / 3f64.sqrt(), 0.02);
        assert_close(i.half_width(), 4.303 * i.se, 1e-9);
        assert_eq!((i.environments, i.df), (3, 2));
        assert_eq!(Clusters::default().mean(), None);
        assert_eq!(houses(&[&[0.1, 0.5]]).interval(), None, "one house has no variance");
    }

    #[test]
    fn episodes_with_equal_values_in_a_house_do_not_narrow_the_interval() {
        let single = houses(&[&[0.1], &[0.2], &[0.6]]).interval().unwrap();
        let repeated = houses(&[&[0.1; 8], &[0.2; 8], &[0.6; 8]]).interval().unwrap();
        assert_close(repeated.se, single.se, 1e-9);
        assert_close(repeated.half_width(), single.half_width(), 1e-9);
        // The variance within each house equals the variance between episodes, so houses do not
        // matter.
        let mixed = houses(&[&[0.1, 0.6], &[0.6, 0.1]]).interval().unwrap();
        assert!(mixed.se < 1e-12, "{mixed:?}");
    }

    #[test]
    fn scene_kinds_are_resampled_separately() {
        let mut clusters = houses(&[&[0.1], &[0.3]]);
        clusters.add(TaskId::Shopping, "s0", 0.8);
        clusters.add(TaskId::Shopping, "s1", 0.8);
        let i = clusters.interval().unwrap();
        // House and street differ by 0.6; only the houses' 0.1 (of half of all values) counts.
        assert_close(i.se, 0.05, 0.02);
        assert_eq!((i.environments, i.df), (4, 2));
        clusters.add(TaskId::MovingHouse, "y0", 0.5);
        assert_eq!(clusters.interval(), None, "one yard has no variance");
    }

    #[test]
    fn intervals_over_environments_have_the_nominal_coverage() {
        const EXPERIMENTS: u64 = 400;
        let (mut clustered, mut independent) = (0, 0);
        for k in 0..EXPERIMENTS {
            // Six houses with two episodes each, as in the bundled episodes; the true mean is 0.5.
            let mut stream = RngStream::new(7, "test of coverage", k);
            let (mut right, mut wrong) = (Clusters::default(), Clusters::default());
            const EPISODES: [&str; 12] =
                ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l"];
            for pair in EPISODES.chunks(2) {
                let house = f64::from(stream.range(0.2, 0.8));
                for episode in pair {
                    let value = house + f64::from(stream.range(-0.1, 0.1));
                    right.add(TaskId::LowTarget, pair[0], value);
                    wrong.add(TaskId::LowTarget, episode, value);
                }
            }
            for (clusters, covered) in [(&right, &mut clustered), (&wrong, &mut independent)] {
                let half = t_975(clusters.environments() - 1)
                    * clusters.standard_error(300).expect("several environments");
                *covered += u64::from((clusters.mean().unwrap() - 0.5).abs() <= half);
            }
        }
        let fraction = |covered: u64| covered as f64 / EXPERIMENTS as f64;
        assert!((0.92..0.98).contains(&fraction(clustered)), "{clustered} of {EXPERIMENTS}");
        assert!(fraction(independent) < 0.9, "{independent} of {EXPERIMENTS}");
    }
}
