//! Ways over the maps: what each cell costs, and the cheapest way to a goal or to everywhere.
//!
//! **What it is**: cost maps and searches over what [`crate::mapping`] knows.
//! **What it is not**: it walks nowhere and remembers nothing but its working space; how a way is
//! followed is [`crate::execution`]'s.

mod bucket_queue;
pub mod cost_model;
pub mod costs;
pub mod lattice_costs;
pub mod path;
