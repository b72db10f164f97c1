//! Path planning of the original: its cell costs, and its searches over straight neighbors.

pub mod lattice_costs;
pub mod straight_path;
