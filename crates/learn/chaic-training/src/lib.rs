//! Training of networks, independent of data and losses.
//!
//! **What it is**: [`learner`] has the parameters of a network during training and data-parallel
//! optimizer steps. [`trainer`] is the interface of trainings. [`run`] has the training folder:
//! configuration, checkpoints, curves and weights. [`checkpoint`] has the checkpoint format,
//! [`settings`] the settings that a resumed training may not change, [`bounds`] the bounds of
//! configurations, [`conformance`] the tests that every trainer passes.
//!
//! **What it is not**: it knows no data, losses, worlds or tasks, and it prints nothing.
//!
//! **Invariants**
//! - A training that was stopped and resumed ends with the same bits as an uninterrupted one,
//!   curves included.
//! - A checkpoint is decoded only if its digest matches, and its values are finite.
//! - Nothing is written before configuration, inputs and initial weights are checked.

pub mod bounds;
pub mod checkpoint;
pub mod config;
pub mod conformance;
pub mod curves;
pub mod learner;
pub mod run;
pub mod settings;
pub mod trainer;

pub use checkpoint::{Checkpoint, CheckpointError};
pub use config::{parse_config, read_config, read_config_with};
pub use curves::{CURVES, CurveRecord, Metrics, Phase, defined_metrics, metrics};
pub use learner::{Learner, learning_rate_at};
pub use run::{CHECKPOINT, CONFIG, INITIAL_WEIGHTS, TrainingRun};
pub use settings::{Settings, changed_setting};
pub use trainer::{Trainer, TrainingError};
