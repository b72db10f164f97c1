//! Export of recorded runs to data set formats of other programs.
//!
//! **What it is**: [`lerobot`] exports the observations and actions of an agent from recorded
//! episodes, in version 3 of the LeRobot format. [`table`] writes Parquet files.
//!
//! **What it is not**: it plays no episodes other than traces, and trains no models.
//!
//! **Invariant**: after an interruption, the data set is complete for the episodes exported so far.

pub mod lerobot;
pub mod table;
