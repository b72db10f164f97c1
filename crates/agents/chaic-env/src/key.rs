//! What one episode run is called.

use chaic_core::TaskId;
use serde::{Deserialize, Serialize};

/// Names one episode run within a run of many. Their order is that of reports.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RunKey {
    /// The task.
    pub task: TaskId,
    /// The helper.
    pub helper: String,
    /// The episode's id.
    pub episode: String,
    /// Which of the run's seeds.
    pub seed: u32,
}

impl RunKey {
    /// The names of its fields, as they are written.
    pub const FIELDS: [&str; 4] = ["task", "helper", "episode", "seed"];
}

/// A name for files that belong to an episode: its id without the task, `/` and `:` as `-`.
///
/// ```
/// use chaic_core::TaskId;
/// assert_eq!(chaic_env::slug(TaskId::Obstacle, "obstacle/test/07"), "test-07");
/// ```
pub fn slug(task: TaskId, id: &str) -> String {
    let rest = id.strip_prefix(task.name()).and_then(|r| r.strip_prefix('/')).unwrap_or(id);
    let safe = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '-' };
    // No name becomes hidden, or one of the two special ones.
    rest.trim_start_matches('.').chars().map(safe).collect()
}
