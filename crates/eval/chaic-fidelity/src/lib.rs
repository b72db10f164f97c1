//! How near one comes to the paper's published results, and what moves them.
//!
//! A [`Experiment`] says which runs are played below one folder: both rule sets with all helpers, then
//! the original's rules with one rule at a time set as the paper has it (a *switch*). Each is an
//! ordinary run folder. [`parts()`] reads them all, [`document()`] writes what they say as Markdown
//! with figures; nothing in it comes from anywhere but those folders and
//! [`published`](chaic_eval::published::published).

mod compare;
mod document;
mod experiment;
mod matrix;
mod sections;
mod switches;

pub use compare::{
    Distance, Inversion, Order, PUBLISHED_EPISODES, TaskRate, distance, order, task_rate,
};
pub use document::{CAUSES_BEGIN, CAUSES_END, Sheet, check_document, document, write_document};
pub use experiment::{Experiment, ExperimentRequest, Part};
pub use matrix::{Matrix, PartState, parts};
pub use switches::{Change, change};

#[cfg(test)]
mod tests;
