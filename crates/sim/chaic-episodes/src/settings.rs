//! What a generator is asked for besides its seeds.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the generators. The default is the paper's shape: every task holds what it needs and
/// nothing else, and all streets and all yards are laid out alike.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Indoors: every task gets the inventory of all tasks, so that what stands and lies in a house
    /// doesn't tell the task. `docs/episodes.md` lists what still differs.
    pub decoys: bool,
    /// Outdoors: shops, shelves, goal place, truck and furniture stand elsewhere in every place.
    pub varied_layout: bool,
}

impl Settings {
    /// The shape of the paper's episodes, and of the bundled ones.
    pub const PAPER: Settings = Settings { decoys: false, varied_layout: false };
    /// What the standard split has.
    pub const STANDARD: Settings = Settings { decoys: true, varied_layout: true };

    /// Whether these are the settings that an episode file leaves out.
    pub(crate) fn is_paper(&self) -> bool {
        *self == Settings::PAPER
    }
}
