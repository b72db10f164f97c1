//! Maps built from observations: occupancy, objects, people, and the agent's own hands.
//!
//! **What it is**: maps on one shared grid that integrate detections and depth images.
//! **What it is not**: it plans nothing and knows no rules; path costs belong to
//! [`crate::planning`].

pub mod collision_memory;
pub mod grid;
pub mod held_objects;
pub mod occupancy;
pub mod passage;
pub mod people;
pub mod semantic;

pub use grid::{CELL_M, Grid};
pub use occupancy::{CellOccupancy, OccupancyMap};
pub use people::{PersonMap, TrackedPerson};
pub use semantic::{MappedObject, SemanticMap};
