//! Learned perception: instance segmentation of RGB-D images, tracking, and recognition of people's
//! actions.
//!
//! **What it is**, in reading order:
//! - Data: [`labels`] (classes of pixels), [`features`] (network input), [`views`] (random labeled
//!   views of generated episodes), [`coco`] (export of views as COCO data sets).
//! - Detector, first stage: [`detector`] (network), [`loss`], [`instances`] (grouping of pixels),
//!   [`proposals`] (several groupings).
//! - Detector, second stage: [`roi`] (input), [`roi_network`], [`roi_loss`], [`second_stage`]
//!   (inference).
//! - Both stages: [`train`] (training loop), [`calibration`] (scores), [`trained`] (weights file).
//! - Evaluation: [`average_precision`], [`error_breakdown`] (errors by cause), [`evaluate`].
//! - Perception for agents: [`tracker`], [`perception`] (detector, keyframes and
//!   tracker), [`noisy`] (ground truth with simulated errors), [`behavior`] (action recognition),
//!   [`perception_registry`] (all of them by name), [`track_evaluation`] (accuracy of tracks over
//!   whole episodes).
//!
//! **What it is not**: it knows no goals, rules or policies.
//!
//! **Invariants**
//! - Training uses no data of validation, test or standard episodes: the seeds of a
//!   [`views::DatasetSplit`] do not overlap those of another.
//! - The same seed and configuration give the same weights, bit for bit, on any machine and number
//!   of threads.

mod keyframe;
pub mod labels;
mod parallel;
mod structures;

pub mod features;
pub mod views;

pub mod detector;
pub mod loss;

pub mod instances;
pub mod proposals;

pub mod roi;
pub mod roi_loss;
pub mod roi_network;
pub mod second_stage;

pub mod calibration;
pub mod trained;

pub mod average_precision;
pub mod coco;
pub mod error_breakdown;
pub mod evaluate;

mod roi_train;
pub mod train;

pub mod noisy;
pub mod perception;
pub mod perception_registry;
pub mod tracker;

pub mod track_evaluation;

pub mod behavior;

#[cfg(test)]
mod tests;
