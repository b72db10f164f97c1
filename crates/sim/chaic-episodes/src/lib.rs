//! Where worlds come from.
//!
//! **What it is**: generators that turn a seed into a [`Setup`](chaic_world::Setup) ([`house`],
//! [`street`], [`yard`]), the bundled benchmark and unlimited generated episodes ([`Split`],
//! [`episodes`]), the episode file ([`Episode`], [`json_schema`]), and the check that an episode
//! can be played ([`playable`], [`validate`]).
//!
//! **What it is not**: it never steps a world, keeps no scores and opens no files; bytes come in
//! and go out.
//!
//! **Invariants**
//! - An [`Episode`] is valid: it comes from [`Episode::new`] or [`Episode::parse`], which check.
//! - A generator depends on its seeds only, and gives the same bytes on every machine.
//! - The bundled episodes are data: they stay as they are when a generator changes.
//! - An episode of the standard split has the digest that is committed for it, or is an error.
//! - No surroundings (walls, furniture) of one split occur in another, but for the street and the
//!   yard of the paper's shape, which are one street and one yard.

mod format;
mod validate;

mod split;
mod standard;

mod generate;
pub mod house;
mod settings;
pub mod street;
pub mod yard;

mod free_space;
mod outdoors;
mod upright_box;

pub use format::{Episode, EpisodeError, GeneratorInfo, MAX_EPISODE_BYTES, json_schema};
pub use generate::{GenerateError, Seeds, generate, generate_with};
pub use settings::Settings;
pub use split::{
    BUNDLED_PER_TASK, Bundled, Split, SplitError, episodes, find_episode, regenerate_bundled,
};
pub use standard::{STANDARD_PER_TASK, standard_table};
pub use upright_box::{UprightBox, mm, mm3};
pub use validate::{Problem, Walker, out_of_reach, playable, validate, ways_from};
