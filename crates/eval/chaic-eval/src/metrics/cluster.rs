//! How sure a mean is whose episodes share environments: a cluster bootstrap.
//!
//! Episodes in one house, and seeds of one episode, resemble each other, so they are no independent
//! samples; environments are. A resample draws environments with replacement, each with all its
//! episodes and seeds, and the deviation of the mean over resamples is its standard error (Efron and
//! Tibshirani, "An Introduction to the Bootstrap", 1993, chapters 6 and 8).

use std::collections::BTreeMap;

use chaic_core::TaskId;
use chaic_core::rng::Stream;
use serde::Serialize;

use crate::metrics::stats::{population_sd, t_975};

/// Resamples of one standard error. The error of the error is then 0.7 % (1 / sqrt(2 * 10,000)).
const RESAMPLES: usize = 10_000;
/// The seed of all resamples, so that a report is the same whenever it is made.
const SEED: u64 = 0;

/// In which environment each episode takes place.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environments(BTreeMap<String, String>);

/// A mean with the interval that holds the true one in 95 of 100 such experiments, each with
/// environments of its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub se: f64,
    /// Lower end; may lie below all that the mean can be.
    pub low: f64,
    /// Upper end; may lie above all that the mean can be.
    pub high: f64,
    /// How many environments it rests on.
    pub environments: usize,
    /// Degrees of freedom: environments less kinds of scenes.
    pub df: usize,
}

/// Values by environment. Environments of one kind of scene are drawn among themselves: how many
/// houses, streets and yards there are is no matter of chance.
#[derive(Clone, Debug, Default)]
pub struct Clusters<'a> {
    /// By the number of the kind of scene, then by name.
    strata: BTreeMap<u8, BTreeMap<&'a str, Cluster>>,
}

/// The values of one environment.
#[derive(Clone, Copy, Debug, Default)]
struct Cluster {
    sum: f64,
    n: f64,
}

impl Environments {
    /// Of these episodes and environments.
    pub fn new(pairs: impl IntoIterator<Item = (String, String)>) -> Environments {
        Environments(pairs.into_iter().collect())
    }

    /// The environment of an episode; one of its own where nobody knows better.
    pub fn of<'a>(&'a self, episode: &'a str) -> &'a str {
        self.0.get(episode).map_or(episode, String::as_str)
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

    /// How many environments there are.
    pub fn environments(&self) -> usize {
        self.strata.values().map(BTreeMap::len).sum()
    }

    /// The mean of all values; `None` of nothing.
    pub fn mean(&self) -> Option<f64> {
        let all = || self.strata.values().flat_map(BTreeMap::values);
        let n: f64 = all().map(|c| c.n).sum();
        (n > 0.0).then(|| all().map(|c| c.sum).sum::<f64>() / n)
    }

    /// The mean with its 95 % interval, by Student's t with as many degrees of freedom as there are
    /// environments less kinds of scenes: percentiles of resamples of few clusters are too near
    /// (Cameron, Gelbach and Miller, "Bootstrap-Based Improvements for Inference with Clustered
    /// Errors", 2008). `None` where a kind of scene has fewer than two.
    pub fn interval(&self) -> Option<Interval> {
        let (mean, se) = (self.mean()?, self.standard_error(RESAMPLES)?);
        let environments = self.environments();
        let df = environments - self.strata.len();
        let half = t_975(df) * se;
        Some(Interval { mean, se, low: mean - half, high: mean + half, environments, df })
    }

    /// The standard error of the mean. Of n environments a resample draws n - 1 and weighs them as
    /// n, without which the variance would be too small by the factor (n - 1) / n (Rao and Wu,
    /// "Resampling Inference with Complex Survey Data", 1988).
    fn standard_error(&self, resamples: usize) -> Option<f64> {
        let strata: Vec<Vec<Cluster>> =
            self.strata.values().map(|s| s.values().copied().collect()).collect();
        if strata.is_empty() || strata.iter().any(|s| s.len() < 2) {
            return None;
        }
        let mut stream = Stream::new(SEED, "cluster bootstrap", 0);
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
    /// Half its width: the smallest difference that it can tell from zero.
    pub fn half(&self) -> f64 {
        (self.high - self.low) / 2.0
    }

    /// Its ends, as far as the mean can lie there at all.
    pub fn within(&self, least: f64, most: f64) -> [f64; 2] {
        [self.low, self.high].map(|end| end.clamp(least, most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of one house each.
    fn houses(values: &[&[f64]]) -> Clusters<'static> {
        const NAMES: [&str; 6] = ["h0", "h1", "h2", "h3", "h4", "h5"];
        let mut clusters = Clusters::default();
        for (name, of_house) in NAMES.iter().zip(values) {
            of_house.iter().for_each(|v| clusters.add(TaskId::LowTarget, name, *v));
        }
        clusters
    }

    fn near(a: f64, b: f64, part: f64) {
        assert!((a - b).abs() <= part * b, "{a} is not {b}");
    }

    #[test]
    fn independent_episodes_have_the_textbooks_standard_error() {
        // 0.1, 0.2, 0.3: deviation 0.1, over the root of 3; t of 2 degrees of freedom is 4.303.
        let i = houses(&[&[0.1], &[0.2], &[0.3]]).interval().unwrap();
        near(i.mean, 0.2, 1e-9);
        near(i.se, 0.1 / 3f64.sqrt(), 0.02);
        near(i.half(), 4.303 * i.se, 1e-9);
        assert_eq!((i.environments, i.df), (3, 2));
        assert_eq!(Clusters::default().mean(), None);
        assert_eq!(houses(&[&[0.1, 0.5]]).interval(), None, "one house tells nothing of others");
    }

    #[test]
    fn episodes_that_repeat_their_house_add_no_certainty() {
        let once = houses(&[&[0.1], &[0.2], &[0.6]]).interval().unwrap();
        let often = houses(&[&[0.1; 8], &[0.2; 8], &[0.6; 8]]).interval().unwrap();
        near(often.se, once.se, 1e-9);
        near(often.half(), once.half(), 1e-9);
        // As much varies within each house as between episodes elsewhere: houses don't matter.
        let mixed = houses(&[&[0.1, 0.6], &[0.6, 0.1]]).interval().unwrap();
        assert!(mixed.se < 1e-12, "{mixed:?}");
    }

    #[test]
    fn kinds_of_scenes_are_drawn_apart() {
        let mut clusters = houses(&[&[0.1], &[0.3]]);
        clusters.add(TaskId::Shopping, "s0", 0.8);
        clusters.add(TaskId::Shopping, "s1", 0.8);
        let i = clusters.interval().unwrap();
        // Between house and street there are 0.6; only the houses' 0.1 (of half of all) counts.
        near(i.se, 0.05, 0.02);
        assert_eq!((i.environments, i.df), (4, 2));
        clusters.add(TaskId::MovingHouse, "y0", 0.5);
        assert_eq!(clusters.interval(), None, "one yard tells nothing of others");
    }

    #[test]
    fn intervals_hold_what_they_promise_and_those_over_episodes_do_not() {
        const EXPERIMENTS: u64 = 400;
        let (mut clustered, mut independent) = (0, 0);
        for k in 0..EXPERIMENTS {
            // Six houses with two episodes each, as bundled; the true mean is 0.5.
            let mut stream = Stream::new(7, "test of coverage", k);
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
            for (clusters, held) in [(&right, &mut clustered), (&wrong, &mut independent)] {
                let half = t_975(clusters.environments() - 1)
                    * clusters.standard_error(300).expect("there are several");
                *held += u64::from((clusters.mean().unwrap() - 0.5).abs() <= half);
            }
        }
        let part = |held: u64| held as f64 / EXPERIMENTS as f64;
        assert!((0.92..0.98).contains(&part(clustered)), "{clustered} of {EXPERIMENTS}");
        assert!(part(independent) < 0.9, "{independent} of {EXPERIMENTS}");
    }
}
