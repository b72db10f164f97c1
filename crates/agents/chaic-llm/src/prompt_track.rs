//! Tracks of prompts.

use serde::Serialize;

/// Track of a prompt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PromptTrack {
    /// Helper without a grant of goal and constraint.
    Hidden,
    /// Helper with the grants of the original.
    KnownTask,
    /// Partner.
    Partner,
}
