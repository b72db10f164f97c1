//! How networks are trained, whatever they learn.
//!
//! **What it is**: [`learner`] has the numbers of a network while they change, and the steps that several
//! threads take together; [`run`] has the folder of a training: configuration, checkpoints, curves, weights.
//!
//! **What it is not**: it knows no data, losses, worlds or tasks, and it prints nothing.
//!
//! **Invariant**: a training that was stopped and gone on with ends with the same bits as one that wasn't.

pub mod learner;
pub mod run;

pub use learner::{Learner, rate_at};
pub use run::{
    CHECKPOINT, CONFIG, CURVES, Figures, Of, Record, Training, TrainingError, TrainingRun, figures,
    read_rules,
};
