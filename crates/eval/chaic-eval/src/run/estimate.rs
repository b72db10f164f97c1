//! Unfinished episode runs, and an estimate of their time from the times of finished ones.

use std::collections::BTreeMap;
use std::time::Duration;

use chaic_core::TaskId;
use chaic_env::RunKey;

/// Times of finished episode runs, and the numbers of unfinished ones.
#[derive(Clone, Debug, Default)]
pub(super) struct Estimate {
    unfinished: BTreeMap<(TaskId, String), u32>,
    by_task_and_helper: BTreeMap<(TaskId, String), TimeSum>,
    by_helper: BTreeMap<String, TimeSum>,
    all: TimeSum,
}

#[derive(Clone, Copy, Debug, Default)]
struct TimeSum {
    n: u32,
    sum: Duration,
}

impl TimeSum {
    fn add(&mut self, time: Duration) {
        self.n += 1;
        self.sum += time;
    }

    fn mean(&self) -> Option<Duration> {
        (self.n > 0).then(|| self.sum / self.n)
    }
}

impl Estimate {
    /// Returns an estimate for these episode runs, none of which is finished.
    pub fn new<'a>(planned: impl Iterator<Item = &'a RunKey>) -> Estimate {
        let mut estimate = Estimate::default();
        for key in planned {
            *estimate.unfinished.entry((key.task, key.helper.clone())).or_default() += 1;
        }
        estimate
    }

    /// Returns whether all episode runs are finished.
    pub fn is_finished(&self) -> bool {
        self.unfinished.values().all(|n| *n == 0)
    }

    /// Adds the time of a finished episode run.
    pub fn finish(&mut self, key: &RunKey, time: Duration) {
        if let Some(n) = self.unfinished.get_mut(&(key.task, key.helper.clone())) {
            *n = n.saturating_sub(1);
        }
        self.by_task_and_helper.entry((key.task, key.helper.clone())).or_default().add(time);
        self.by_helper.entry(key.helper.clone()).or_default().add(time);
        self.all.add(time);
    }

    /// Returns the remaining time for `jobs` workers; `None` before the first result.
    ///
    /// The estimate of an episode run is the mean time of its task and helper, otherwise of its
    /// helper, otherwise of all.
    pub fn remaining(&self, jobs: usize) -> Option<Duration> {
        let all = self.all.mean()?;
        let (mut sum, mut longest) = (Duration::ZERO, Duration::ZERO);
        for (group, n) in self.unfinished.iter().filter(|(_, n)| **n > 0) {
            let known = self.by_task_and_helper.get(group).or_else(|| self.by_helper.get(&group.1));
            let one = known.and_then(TimeSum::mean).unwrap_or(all);
            sum += one * *n;
            longest = longest.max(one);
        }
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
        let first = [key(a, "rhp"), key(b, "none")];
        assert_eq!(Estimate::new(first.iter()).remaining(1), None);
        let secs = |unfinished: &[RunKey], jobs| {
            let mut estimate = Estimate::new(first.iter().chain(unfinished));
            estimate.finish(&first[0], Duration::from_secs(10));
            estimate.finish(&first[1], Duration::from_secs(2));
            assert_eq!(estimate.is_finished(), unfinished.is_empty());
            estimate.remaining(jobs).unwrap().as_secs_f64()
        };
        assert_eq!(secs(&[key(a, "rhp"), key(b, "none")], 1), 12.0);
        assert_eq!(secs(&[key(b, "rhp"), key(a, "none"), key(a, "random")], 1), 10.0 + 2.0 + 6.0);
        assert_eq!(secs(&[key(a, "rhp"), key(b, "none")], 2), 10.0, "at least the longest");
        assert_eq!(secs(&[], 1), 0.0);
    }
}
