//! Estimate of a run's remaining time from the times of finished episode runs.

use std::collections::BTreeMap;
use std::time::Duration;

use chaic_core::TaskId;
use chaic_env::RunKey;

/// Times of finished episode runs.
#[derive(Clone, Debug, Default)]
pub(super) struct Estimate {
    by_task_and_helper: BTreeMap<(TaskId, String), Times>,
    by_helper: BTreeMap<String, Times>,
    all: Times,
}

#[derive(Clone, Copy, Debug, Default)]
struct Times {
    n: u32,
    sum: Duration,
}

impl Times {
    fn add(&mut self, time: Duration) {
        self.n += 1;
        self.sum += time;
    }

    fn mean(&self) -> Option<Duration> {
        (self.n > 0).then(|| self.sum / self.n)
    }
}

impl Estimate {
    /// Adds the time of a finished episode run.
    pub fn add(&mut self, key: &RunKey, time: Duration) {
        self.by_task_and_helper.entry((key.task, key.helper.clone())).or_default().add(time);
        self.by_helper.entry(key.helper.clone()).or_default().add(time);
        self.all.add(time);
    }

    /// Returns the remaining time for `jobs` workers; `None` before the first result.
    ///
    /// The estimate of an episode run is the mean time of its task and helper, otherwise of its
    /// helper, otherwise of all.
    pub fn remaining<'a>(
        &self,
        unfinished: impl Iterator<Item = &'a RunKey>,
        jobs: usize,
    ) -> Option<Duration> {
        let all = self.all.mean()?;
        let one = |key: &RunKey| {
            let specific = self.by_task_and_helper.get(&(key.task, key.helper.clone()));
            let known = specific.or_else(|| self.by_helper.get(&key.helper));
            known.and_then(Times::mean).unwrap_or(all)
        };
        let (sum, longest) = unfinished
            .map(one)
            .fold((Duration::ZERO, Duration::ZERO), |(sum, max), t| (sum + t, max.max(t)));
        Some((sum / jobs.max(1) as u32).max(longest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_specific_mean_is_used() {
        let key = |task, helper: &str| RunKey {
            task,
            helper: helper.to_owned(),
            episode: "e".to_owned(),
            seed: 0,
        };
        let (a, b) = (TaskId::Obstacle, TaskId::Shopping);
        let mut estimate = Estimate::default();
        assert_eq!(estimate.remaining([key(a, "rhp")].iter(), 1), None);
        estimate.add(&key(a, "rhp"), Duration::from_secs(10));
        estimate.add(&key(b, "none"), Duration::from_secs(2));
        let secs =
            |keys: &[RunKey], jobs| estimate.remaining(keys.iter(), jobs).unwrap().as_secs_f64();
        assert_eq!(secs(&[key(a, "rhp"), key(b, "none")], 1), 12.0);
        assert_eq!(secs(&[key(b, "rhp"), key(a, "none"), key(a, "random")], 1), 10.0 + 2.0 + 6.0);
        assert_eq!(secs(&[key(a, "rhp"), key(b, "none")], 2), 10.0, "at least the longest");
    }
}
