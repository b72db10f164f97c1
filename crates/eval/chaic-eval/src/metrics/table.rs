//! Table of all metrics: names, titles, and sources of values.

use chaic_core::{AgentId, TaskId};

use crate::metrics::accumulators::{FailureRate, FirstDelivery, MetricAccumulator};
use crate::metrics::score::Score;
use crate::published::PublishedScores;

/// A metric of a helper in a task.
#[derive(Clone, Copy, Debug)]
pub struct Metric {
    /// Name in files.
    pub key: &'static str,
    /// Name in tables.
    pub name: &'static str,
    /// Description.
    pub title: &'static str,
    /// Number of printed decimals.
    pub decimals: usize,
    /// Returns whether the metric is defined in a task.
    pub in_task: fn(TaskId) -> bool,
    /// Source of the values.
    pub source: MetricSource,
}

/// Source of a metric's values.
#[derive(Clone, Copy, Debug)]
pub enum MetricSource {
    /// A score that formulas compute from the results of all episode runs.
    Score {
        /// Returns the value; `None` if it is undefined.
        value: fn(&Score) -> Option<f64>,
        /// Returns the value that the paper reports.
        published: fn(&PublishedScores) -> Option<f64>,
    },
    /// A diagnostic value of each episode run, computed from its records; the score is the mean. It
    /// is in `results.jsonl`, `scores.json` and `report.md`.
    Records(fn() -> Box<dyn MetricAccumulator>),
}

const ALL_TASKS: fn(TaskId) -> bool = |_| true;

/// All metrics: the paper's in its order, then diagnostic ones in the order of reports.
///
/// A new diagnostic metric is a row with [`MetricSource::Records`] and its accumulator.
pub static METRICS: [Metric; 10] = [
    Metric {
        key: "tr",
        name: "TR",
        title: "transport rate",
        decimals: 2,
        in_task: ALL_TASKS,
        source: MetricSource::Score { value: |s| Some(s.tr), published: |p| Some(p.tr) },
    },
    Metric {
        key: "ei",
        name: "EI",
        title: "efficiency improvement",
        decimals: 2,
        in_task: ALL_TASKS,
        source: MetricSource::Score { value: |s| s.ei, published: |p| p.ei },
    },
    Metric {
        key: "ia",
        name: "IA",
        title: "goal inference accuracy",
        decimals: 2,
        in_task: ALL_TASKS,
        source: MetricSource::Score { value: |s| s.ia, published: |p| p.ia },
    },
    Metric {
        key: "cr",
        name: "CR",
        title: "completion ratio",
        decimals: 2,
        in_task: ALL_TASKS,
        source: MetricSource::Score { value: |s| s.cr, published: |p| p.cr },
    },
    Metric {
        key: "er",
        name: "ER",
        title: "emergency rate",
        decimals: 2,
        in_task: |task| task.info().has_child,
        source: MetricSource::Score { value: |s| s.er, published: |p| p.er },
    },
    Metric {
        key: "tr_se",
        name: "SE",
        title: "standard error of TR",
        decimals: 2,
        in_task: ALL_TASKS,
        source: MetricSource::Score { value: |s| s.tr_se, published: |p| p.tr_se },
    },
    Metric {
        key: "stuck",
        name: "stuck",
        title: "share of frames in which partner or helper had made no progress for 200 frames",
        decimals: 3,
        in_task: ALL_TASKS,
        source: MetricSource::Score { value: |s| s.stuck, published: |_| None },
    },
    Metric {
        key: "first_delivery",
        name: "first delivery",
        title: "Frame of the first delivery that counts",
        decimals: 0,
        in_task: ALL_TASKS,
        source: MetricSource::Records(|| Box::new(FirstDelivery::default())),
    },
    Metric {
        key: "partner_failures",
        name: "partner failures",
        title: "Share of the partner's attempts to take or put something that failed",
        decimals: 2,
        in_task: ALL_TASKS,
        source: MetricSource::Records(|| Box::new(FailureRate::new(AgentId::PARTNER))),
    },
    Metric {
        key: "helper_failures",
        name: "helper failures",
        title: "Share of the helper's attempts to take or put something that failed",
        decimals: 2,
        in_task: ALL_TASKS,
        source: MetricSource::Records(|| Box::new(FailureRate::new(AgentId::HELPER))),
    },
];

impl Metric {
    /// Returns the metric with this key.
    ///
    /// # Panics
    /// If there is none.
    pub fn from_key(key: &str) -> &'static Metric {
        METRICS.iter().find(|m| m.key == key).unwrap_or_else(|| panic!("no metric has key {key}"))
    }

    /// Returns all diagnostic metrics, in the order of reports.
    pub fn diagnostics() -> impl Iterator<Item = &'static Metric> {
        METRICS.iter().filter(|m| matches!(m.source, MetricSource::Records(_)))
    }

    /// Returns the value of the metric in a score; `None` if it is undefined.
    pub fn value(&self, score: &Score) -> Option<f64> {
        match self.source {
            MetricSource::Score { value, .. } => value(score),
            MetricSource::Records(_) => score.diagnostics.get(self.key).copied(),
        }
    }

    /// Returns the value that the paper reports, if it reports the metric.
    pub fn published(&self, scores: &PublishedScores) -> Option<f64> {
        match self.source {
            MetricSource::Score { published, .. } => published(scores),
            MetricSource::Records(_) => None,
        }
    }

    /// Creates the accumulator of a diagnostic metric; `None` for the paper's metrics.
    pub fn accumulator(&self) -> Option<Box<dyn MetricAccumulator>> {
        match self.source {
            MetricSource::Score { .. } => None,
            MetricSource::Records(new) => Some(new()),
        }
    }
}
