//! Runs, traces, metrics, reports and replays.
//!
//! **What it is**: the place where both sides meet. [`play`] turns the crank of one episode,
//! [`trace`] records all that happened, [`run`] plays whole benchmarks on several threads and
//! keeps a journal, [`metrics`] computes the paper's scores from what was recorded, [`report`]
//! prints them, [`verify`] plays a trace's actions again and compares, [`replay`] and [`still`]
//! draw what was played, [`audit`] shows that what is hidden is hidden, [`scene_file`] writes what there is to draw, [`bench`](mod@bench) measures
//! how fast this machine draws and steps.
//!
//! **What it is not**: it holds no rules of the world, and decides for nobody.
//!
//! **Invariants**
//! - What an agent gets is its briefing and its observations, made here and nowhere else, and what
//!   it is granted stands in the trace.
//! - A score depends on episodes, seeds, helper and rules only: not on the number of workers, not
//!   on the clock, not on whether a run was interrupted.
//! - Metrics read records and never step a world.
//! - A run folder is readable after a crash at any moment; at most the episodes under way are
//!   lost.

mod error;

mod digest;
pub mod files;
pub mod helpers;
pub mod play;
pub mod rules;

pub mod trace;

pub mod metrics;
pub mod published;
pub mod report;
pub mod run;

pub mod fidelity;

pub mod replay;
pub mod scene_file;
pub mod still;
pub mod verify;

pub mod audit;

pub mod bench;

pub mod figure;
pub mod video;

pub use chaic_render::Appearance;
pub use digest::Digest;
pub use error::{EvalError, Result};

/// The version of the program, as it stands in run folders and traces.
pub const CHAIC_VERSION: &str = env!("CARGO_PKG_VERSION");
