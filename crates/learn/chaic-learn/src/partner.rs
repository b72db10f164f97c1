//! Partners that learn from demonstrations to choose their plans.
//!
//! [`features`] encodes a partner's choice, [`policy`] lets a network choose, [`demonstrator`] records the
//! choices of other partners, and [`train`] has the trainer. [`recordings`] reads recorded people.

pub mod demonstrator;
pub mod features;
pub mod policy;
pub mod recordings;
pub mod train;
