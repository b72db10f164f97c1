//! Result of exploration, for both strategies.

use crate::track::Intent;

/// Result of one exploration step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExplorationStep {
    /// Take this action next.
    Act(Intent),
    /// The current frontier is resolved; call again for the next one.
    Resolved,
}
