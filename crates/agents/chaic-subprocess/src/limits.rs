//! Limits of a helper's process, and refusals of requests.

use std::time::Duration;

use chaic_env::EnvError;

/// Limits of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Time for its start, and for each briefing.
    pub start: Duration,
    /// Time for each decision.
    pub decision: Duration,
    /// Total waiting time of an episode: start, briefing and decisions.
    pub episode: Duration,
    /// Memory of all of its processes together, MiB. Without a sandbox, memory of each (Linux).
    pub memory_mib: u64,
    /// Files that its processes can write, held in memory, MiB; in a sandbox.
    pub scratch_mib: u64,
    /// Processes and threads at one time; in a sandbox.
    pub max_tasks: u32,
}

impl Default for Limits {
    /// Returns two minutes for loading a network and half a minute for each of some hundred decisions.
    fn default() -> Limits {
        Limits {
            start: Duration::from_secs(120),
            decision: Duration::from_secs(30),
            episode: Duration::from_secs(3600),
            memory_mib: 8192,
            // An eighth of the memory, for caches and logs.
            scratch_mib: 1024,
            // Sixteen workers of a numerical library with a thread for each of 32 cores.
            max_tasks: 512,
        }
    }
}

/// Refusal of a request, with what to do instead.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Refusal(pub String);

impl From<Refusal> for EnvError {
    fn from(refusal: Refusal) -> EnvError {
        EnvError::Registry(refusal.into())
    }
}
