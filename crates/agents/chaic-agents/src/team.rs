//! Team planning: which person fetches which objects, in which order, in the remaining time.
//!
//! **What it is**: a small model of the rest of the episode ([`TeamProblem`]), a simulation of both
//! people in it ([`simulation`]), and a search for the helper's best sequence of operations
//! ([`search`]).
//! **What it is not**: it reads no observations and executes nothing. [`builder`] makes the problem
//! from the memory, and a policy turns the first operation into a plan.

pub mod builder;
pub mod problem;
pub mod search;
pub mod simulation;
pub mod travel;

pub use problem::{Operation, Place, PlaceKind, TeamMember, TeamProblem};
pub use search::{SearchSettings, search_operations};
pub use simulation::simulate;

#[cfg(test)]
mod tests;
