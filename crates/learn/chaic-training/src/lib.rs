//! How networks are trained, whatever they learn.
//!
//! **What it is**: [`learner`] has the numbers of a network while they change, and the steps that several
//! threads take together; [`run`] has the folder of a training: configuration, checkpoints, curves, weights.
//! [`checkpoint`] has the file format of checkpoints, [`bounds`] the bounds of configurations, [`conformance`]
//! the tests that every training passes.
//!
//! **What it is not**: it knows no data, losses, worlds or tasks, and it prints nothing.
//!
//! **Invariants**
//! - A training that was stopped and gone on with ends with the same bits as one that wasn't, curves included.
//! - What is read from a checkpoint has the digest with which it was written, and numbers that are finite.
//! - Nothing is written before rules, inputs and initial weights are checked.

pub mod bounds;
pub mod checkpoint;
pub mod config;
pub mod conformance;
pub mod curves;
pub mod learner;
pub mod run;

pub use checkpoint::{Checkpoint, CheckpointError};
pub use config::{parse_rules, read_rules};
pub use curves::{CURVES, Figures, Of, Record, figures};
pub use learner::{Learner, rate_at};
pub use run::{CHECKPOINT, CONFIG, INITIAL_WEIGHTS, Training, TrainingError, TrainingRun};
