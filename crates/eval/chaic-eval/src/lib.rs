//! Evaluation: runs, metrics, reports, verification and replays.
//!
//! **What it is**: everything around the episodes that `chaic-env` plays. [`run`] plays whole
//! benchmarks on several threads, keeps a journal and writes a [`trace_file`] per episode run.
//! [`metrics`] computes the paper's scores from the records, and [`report`] prints them. [`verify`]
//! re-simulates traces and compares the records. [`replay`] and [`frame_export`] render episodes.
//! [`explain`] describes a helper's belief in sentences, and [`calibration`] measures its quality.
//! [`suite`] joins runs with several partners and measures robustness.
//! [`losses`] splits the difference between a helper and the upper bound by cause. [`activity`] sums how
//! agents spend their time, and [`examples`] selects episodes for a report.
//! [`audit`] tests that hidden state does not influence agents.
//!
//! **What it is not**: it holds no rules of the world and makes no decisions for agents.
//!
//! **Invariants**
//! - A score depends on episodes, seeds, helper and rules only. It does not depend on the number of
//!   workers, the clock, or interruptions of the run.
//! - Metrics read records and never step a world.
//! - A run folder is readable after a crash at any moment. A crash loses at most the episodes that
//!   were being played.

/// Examples of docs/contributing/extending.md, compiled and run as documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../../../docs/contributing/extending.md")]
struct Extending;

mod episode_file;
mod error;

pub mod trace_file;

pub mod metrics;
pub mod published;
pub mod recorded_belief;
pub mod report;
pub mod run;

pub mod activity;
pub mod calibration;
pub mod examples;
pub mod explain;
pub mod frame_export;
pub mod losses;
pub mod replay;
pub mod verify;

pub mod suite;

pub mod audit;

pub mod curves;
pub mod figure;

pub use episode_file::{read_episode_file, read_episode_files};
pub use error::{EvalError, Result};
