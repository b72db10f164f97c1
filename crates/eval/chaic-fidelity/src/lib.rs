//! Comparison with the paper's published results, and the effect of single rules.
//!
//! An [`Experiment`] defines runs below one folder: both rule sets with all helpers, then the
//! original's rules with one rule at a time set to the paper's value (a *switch*). Each is an
//! ordinary run folder. [`parts()`] reads them all. [`document()`] reports them as Markdown with
//! figures. Its only sources are those folders and [`published`](chaic_eval::published::published).

mod compare;
mod document;
mod experiment;
mod experiment_folder;
mod sections;
mod switches;

pub use compare::{
    PUBLISHED_EPISODES, PairwiseOrder, PublishedDifference, RankInversion, TaskRate,
    pairwise_order, published_difference, task_rate,
};
pub use document::{
    CAUSES_BEGIN, CAUSES_END, ReportInputs, check_document, document, write_document,
};
pub use experiment::{Experiment, ExperimentPart, ExperimentRequest};
pub use experiment_folder::{ExperimentFolder, PartState, parts};
pub use switches::{SwitchEffect, switch_effect};

#[cfg(test)]
mod tests;
