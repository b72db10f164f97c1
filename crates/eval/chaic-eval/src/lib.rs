//! Runs, metrics, reports and replays.
//!
//! **What it is**: what becomes of episodes that `chaic-env` plays. [`run`] plays whole benchmarks on
//! several threads, keeps a journal and writes a [`trace_file`] of each, [`metrics`] computes the
//! paper's scores from what was recorded, [`report`] prints them, [`verify`] plays a trace's actions
//! again and compares, [`replay`] and [`frame_export`] draw what was played, [`audit`] shows that what is
//! hidden is hidden.
//!
//! **What it is not**: it holds no rules of the world, and decides for nobody.
//!
//! **Invariants**
//! - A score depends on episodes, seeds, helper and rules only: not on the number of workers, not
//!   on the clock, not on whether a run was interrupted.
//! - Metrics read records and never step a world.
//! - A run folder is readable after a crash at any moment; at most the episodes under way are
//!   lost.

/// The examples of docs/contributing/extending.md, so that they are compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../../docs/contributing/extending.md")]
struct Extending;

mod episode_file;
mod error;

pub mod trace_file;

pub mod metrics;
pub mod published;
pub mod report;
pub mod run;

pub mod frame_export;
pub mod replay;
pub mod verify;

pub mod audit;

pub mod curves;
pub mod figure;

pub use episode_file::read_episode_file;
pub use error::{EvalError, Result};
