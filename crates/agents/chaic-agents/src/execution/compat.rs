//! Execution as in the original: its navigation, approach and exploration.

pub mod lattice_approach;
pub mod lattice_navigation;
pub mod random_exploration;
