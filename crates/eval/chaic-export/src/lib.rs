//! Export of recorded runs and of episodes as data sets for other programs.
//!
//! **What it is**: [`lerobot`] exports the observations and actions of an agent from recorded
//! episodes, in version 3 of the LeRobot format. [`episodes`] exports the initial states of a split
//! or of generated episode files. Each data set has a [`card`] for people and [`croissant`] metadata for
//! programs. [`table`] writes Parquet files.
//!
//! **What it is not**: it plays no episodes other than traces, and trains no models.
//!
//! **Invariants**
//! - After an interruption, the data set is complete for the episodes exported so far.
//! - After an error, or an interruption of the first episode, nothing of the data set is left.

pub mod card;
pub mod croissant;
pub mod episodes;
mod error;
mod folder;
pub mod lerobot;
pub mod table;

pub use error::ExportError;
