//! Episodes: initial states of worlds.
//!
//! **What it is**: generators that turn a seed into a [`Setup`](chaic_world::Setup) ([`house`],
//! [`street`], [`yard`]), and the sets of bundled and generated episodes ([`Split`], [`episodes`]).
//! It also holds the seed ranges of all data sets ([`SEED_RANGES`]) and the episode file
//! ([`Episode`], [`json_schema`]). [`playable`] and [`validate`] check episodes.
//!
//! **What it is not**: it does not step worlds, compute scores or open files; it reads and returns
//! bytes.
//!
//! **Invariants**
//! - An [`Episode`] is valid: [`Episode::new`] and [`Episode::parse`] check it.
//! - A generator depends on its seeds only, and returns the same bytes on every machine.
//! - The bundled episodes are data: they stay the same when a generator changes.
//! - An episode of the standard split has the committed digest, or looking it up is an error.
//! - Surroundings (walls, furniture) of one split do not occur in another. Exception: with the
//!   paper's settings there is one street and one yard.

mod format;
mod validate;

mod seeds;
mod split;

mod bundled;
mod lookup;
mod standard;

mod attempts;
mod generate;
pub mod house;
mod settings;
pub mod street;
pub mod yard;

mod free_space;
mod outdoors;
mod upright_box;

pub use attempts::GenerateError;
pub use bundled::{Bundled, regenerate_bundled};
pub use format::{Episode, EpisodeError, GeneratorInfo, MAX_EPISODE_BYTES, json_schema};
pub use generate::{generate, generate_episode, generate_with};
pub use lookup::{environment_of_changed, episodes, find_episode};
pub use seeds::{
    BUNDLED_PER_TASK, DatasetSplit, GeneratorSeeds, SEED_RANGES, STANDARD_PER_TASK, SeedPurpose,
    SeedRange,
};
pub use settings::Settings;
pub use split::{Split, SplitError};
pub use standard::standard_table;
pub use upright_box::{UprightBox, mm, mm3};
pub use validate::{
    Problem, ReachabilityParams, path_lengths_from, playable, unreachable_objects, validate,
};
