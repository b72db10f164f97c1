//! Result of a step of exploration, for all strategies.

use crate::track::Intent;

/// Result of one exploration step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExplorationStep {
    /// Take this action next.
    Act(Intent),
    /// The target is reached or given up; the plan to explore is done.
    Resolved,
}
