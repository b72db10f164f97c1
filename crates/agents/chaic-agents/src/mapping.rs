//! What is where, by what was seen: floor and walls, things, people, and what the own hands hold.
//!
//! **What it is**: maps that take in detections and depth images one by one, on one lattice.
//! **What it is not**: it plans nothing and knows no rules; what a way costs is [`crate::planning`]'s.

pub mod bumps;
pub mod grid;
pub mod hands;
pub mod occupancy;
pub mod people;
pub mod semantic;

pub use grid::{CELL_M, Grid};
pub use occupancy::{OccupancyMap, Space};
pub use people::{People, Person};
pub use semantic::{SemanticMap, Thing};
