//! Learned perception: which things are in an image of color and depth, where, and of which classes; and
//! what a person in a film does.
//!
//! **What it is**: [`labels`] says what a pixel can be of, [`features`] what the network reads,
//! [`views`] draws random views of generated episodes with labels, [`detector`] is the network, [`loss`]
//! what it learns by, [`train`] the loop; [`instances`] makes things of what the network says, [`calibration`] tells how sure
//! each is, [`trained`] is all of it as one file, and [`average_precision`] tells how good they are and
//! [`failures`] what goes wrong; [`coco`] writes views as data sets. [`tracker`] tells which thing is which over time, and [`perception`]
//! makes all of it the eyes of a mind; [`noisy`] stands in for it. [`behavior`] tells what people do; [`sights`] has all of these by name.
//!
//! **What it is not**: it knows no goals, rules or minds.
//!
//! **Invariants**
//! - Nothing of validation, test or standard episodes is seen in training: views come from seeds of
//!   [`views::Part`]s that don't overlap.
//! - The same seed and configuration give the same weights, bit for bit, on any machine and number of
//!   threads.

pub mod labels;
mod parallel;

pub mod features;
pub mod views;

pub mod detector;
pub mod loss;

pub mod instances;

pub mod calibration;
pub mod trained;

pub mod average_precision;
pub mod coco;
pub mod evaluate;
pub mod failures;

pub mod train;

pub mod noisy;
pub mod perception;
pub mod sights;
pub mod tracker;

pub mod behavior;

#[cfg(test)]
mod tests;
