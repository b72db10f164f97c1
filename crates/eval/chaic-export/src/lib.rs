//! Recorded runs as data sets that other programs read.
//!
//! **What it is**: [`lerobot`] writes what an agent of recorded episodes saw and did, in version 3 of LeRobot's format;
//! [`table`] writes Parquet files.
//!
//! **What it is not**: it plays nothing but traces, and learns nothing.
//!
//! **Invariant**: what is written is a whole data set of the episodes so far, whenever it is broken off.

pub mod lerobot;
pub mod table;
