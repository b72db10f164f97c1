//! The scores by name: what tables call them, where they are read, and what the paper has of them.

use chaic_core::TaskId;

use crate::metrics::Score;
use crate::published::Figures;

/// A score of a helper in a task.
#[derive(Clone, Copy, Debug)]
pub struct Metric {
    /// Its name in files.
    pub key: &'static str,
    /// Its name in tables.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// Decimals that are shown: a share of 1 % is much of some.
    pub decimals: usize,
    /// Whether a task has it.
    pub in_task: fn(TaskId) -> bool,
    /// Where it stands; `None` where there is nothing to say.
    pub value: fn(&Score) -> Option<f64>,
    /// The paper's figure.
    pub published: fn(&Figures) -> Option<f64>,
}

const EVERYWHERE: fn(TaskId) -> bool = |_| true;

/// All of them.
pub static METRICS: [Metric; 7] = [
    Metric {
        key: "tr",
        name: "TR",
        title: "transport rate",
        decimals: 2,
        in_task: EVERYWHERE,
        value: |s| Some(s.tr),
        published: |f| Some(f.tr),
    },
    Metric {
        key: "ei",
        name: "EI",
        title: "efficiency improvement",
        decimals: 2,
        in_task: EVERYWHERE,
        value: |s| s.ei,
        published: |f| f.ei,
    },
    Metric {
        key: "ia",
        name: "IA",
        title: "goal inference accuracy",
        decimals: 2,
        in_task: EVERYWHERE,
        value: |s| s.ia,
        published: |f| f.ia,
    },
    Metric {
        key: "cr",
        name: "CR",
        title: "completion ratio",
        decimals: 2,
        in_task: EVERYWHERE,
        value: |s| s.cr,
        published: |f| f.cr,
    },
    Metric {
        key: "er",
        name: "ER",
        title: "emergency rate",
        decimals: 2,
        in_task: |task| task.info().has_child,
        value: |s| s.er,
        published: |f| f.er,
    },
    Metric {
        key: "tr_se",
        name: "SE",
        title: "standard error of TR",
        decimals: 2,
        in_task: EVERYWHERE,
        value: |s| s.tr_se,
        published: |f| f.tr_se,
    },
    Metric {
        key: "stuck",
        name: "stuck",
        title: "share of frames in which partner or helper had made no progress for 200 frames",
        decimals: 3,
        in_task: EVERYWHERE,
        value: |s| s.stuck,
        published: |_| None,
    },
];

impl Metric {
    /// The metric of this key.
    ///
    /// # Panics
    /// If there is none; keys are written by hand.
    pub fn of(key: &str) -> &'static Metric {
        METRICS.iter().find(|m| m.key == key).unwrap_or_else(|| panic!("no metric is called {key}"))
    }
}
