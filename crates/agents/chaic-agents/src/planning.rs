//! Path planning: cell costs, and shortest paths to a goal or to all cells.
//!
//! **What it is**: cost maps and searches over the maps of [`crate::mapping`].
//! **What it is not**: it executes nothing, and keeps no state but cached results and working
//! memory. [`crate::execution`] follows the paths.

pub mod cost_map;
pub mod cost_model;

pub mod careful_costs;

mod bucket_queue;
pub mod path;
mod search_nodes;

pub mod compat;
