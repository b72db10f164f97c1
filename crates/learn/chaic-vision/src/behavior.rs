//! Action recognition: the six behaviors of the paper's helper (section 4.1), recognized from the
//! last seconds of a helper's own view.
//!
//! [`crop`] crops a person from a frame, [`clip`] is a sequence of crops and the network's input,
//! [`network`] is the classifier. [`collect`] makes labeled clips from episodes in which helpers
//! follow partners, [`store`] keeps them, [`train`] is the training loop, [`calibration`] corrects
//! its probabilities, [`report`] is the evaluation. [`recognize`] is the agent's behavior model.

pub mod calibration;
pub mod clip;
pub mod collect;
pub mod config;
pub mod crop;
pub mod network;
pub mod recognize;
pub mod report;
pub mod store;
pub mod train;

#[cfg(test)]
mod tests;

use chaic_core::{Action, FailureReason, Outcome, ResolvedAction};
use serde::{Deserialize, Serialize};

/// Last interaction of a person, as far as an observer can recognize it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Behavior {
    /// Picked up an object.
    PickedUp,
    /// Failed to pick up an object beyond the person's reach or strength.
    FailedToPickUp,
    /// Put an object into a container.
    PutIn,
    /// Put an object on a surface.
    PutOn,
    /// Failed to put an object on a surface beyond the person's reach.
    FailedToPutOn,
    /// Walks, turns, waits, or has not finished an interaction.
    Moving,
}

impl Behavior {
    /// All behaviors, in the order of the network's outputs.
    pub const ALL: [Behavior; 6] = [
        Behavior::PickedUp,
        Behavior::FailedToPickUp,
        Behavior::PutIn,
        Behavior::PutOn,
        Behavior::FailedToPutOn,
        Behavior::Moving,
    ];

    /// Returns the name in words.
    pub fn name(self) -> &'static str {
        match self {
            Behavior::PickedUp => "picked up",
            Behavior::FailedToPickUp => "failed to pick up",
            Behavior::PutIn => "put in",
            Behavior::PutOn => "put on",
            Behavior::FailedToPutOn => "failed to put on",
            Behavior::Moving => "moving",
        }
    }

    /// Returns the index of the network's output.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Returns the behavior of a finished action; `None` for actions about obstacles and for
    /// actions that are refused at once.
    pub fn from_action(action: &ResolvedAction, outcome: Outcome) -> Option<Behavior> {
        let is_beyond_limits = outcome == Outcome::Failure(FailureReason::BeyondLimits);
        match (action, outcome) {
            (Action::PickUp { .. }, Outcome::Success) => Some(Behavior::PickedUp),
            (Action::PickUp { .. }, _) if is_beyond_limits => Some(Behavior::FailedToPickUp),
            (Action::PutIn, Outcome::Success) => Some(Behavior::PutIn),
            (Action::PutOn { .. }, Outcome::Success) => Some(Behavior::PutOn),
            (Action::PutOn { .. }, _) if is_beyond_limits => Some(Behavior::FailedToPutOn),
            _ => None,
        }
    }
}
