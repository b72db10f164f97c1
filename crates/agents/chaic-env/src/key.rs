//! Keys of episode runs.

use chaic_core::TaskId;
use serde::{Deserialize, Serialize};

/// Key of one episode run within a run. Keys are ordered as in reports.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RunKey {
    /// Task.
    pub task: TaskId,
    /// Helper name.
    pub helper: String,
    /// Episode id.
    pub episode: String,
    /// Index of the run's seed.
    pub seed: u32,
}

impl RunKey {
    /// Field names in files.
    pub const FIELDS: [&str; 4] = ["task", "helper", "episode", "seed"];
}

/// Returns the file name of an episode: its id without the task, with `-` for `/` and `:`.
///
/// ```
/// use chaic_core::TaskId;
/// assert_eq!(chaic_env::slug(TaskId::Obstacle, "obstacle/test/07"), "test-07");
/// ```
pub fn slug(task: TaskId, id: &str) -> String {
    let name = id.strip_prefix(task.name()).and_then(|r| r.strip_prefix('/')).unwrap_or(id);
    let replace = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '-' };
    // A leading dot would make a file hidden, or name `.` or `..`.
    name.trim_start_matches('.').chars().map(replace).collect()
}
