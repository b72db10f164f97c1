//! Settings of the generators.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the generators. The default is the paper's: an episode holds only the objects of its
/// task, and all streets and all yards have one layout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Indoors: every task gets the inventory of all tasks, so that the contents of a house do not
    /// reveal the task. `docs/episodes.md` lists the remaining differences.
    pub decoys: bool,
    /// Outdoors: the positions of shops, shelves, goal place, truck and furniture vary between
    /// places.
    pub varied_layout: bool,
}

impl Settings {
    /// Settings of the paper's episodes, and of the bundled ones.
    pub const PAPER: Settings = Settings { decoys: false, varied_layout: false };
    /// Settings of the standard split.
    pub const STANDARD: Settings = Settings { decoys: true, varied_layout: true };

    /// Returns whether these are the settings that an episode file omits.
    pub(crate) fn is_paper(&self) -> bool {
        *self == Settings::PAPER
    }
}
