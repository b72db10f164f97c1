//! A slow interpreter of the world's rules, and a comparison with the world.
//!
//! **What it is**: the reference predicts actions, failures, durations, hands, containers,
//! deliveries, the child and the end of an episode from the text of the rules. [`play`] runs a
//! world and the reference with the same random actions, and compares them after every frame.
//!
//! **What it is not**: a second world. Poses of people, falls and resting places of objects, and
//! the contacts of a probe are taken from the world.
//!
//! **Invariants**
//! - The reference has its own copy of all numbers and conditions. It shares data types with
//!   `chaic-core` and `chaic-world`, but calls no rule of theirs.
//! - Every difference is an error with the frame, the actions in progress, and both values.

mod numbers;
mod verdict;

mod scene;
mod state;

mod turn;

mod begin;
mod frame;
mod goal;
mod handling;

mod compare;
mod coverage;
mod driver;
mod episode;

pub use coverage::Coverage;
pub use episode::{Difference, play, play_actions, play_many};
pub use numbers::RuleSet;
