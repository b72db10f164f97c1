//! What somebody does, by a film of it: the six behaviors that the paper's helper recognizes (section
//! 4.1), from the last seconds of the own view.
//!
//! [`crop`] cuts a person out of a film, [`clip`] is a row of such crops and what a network reads of it,
//! [`network`] that network; [`collect`] makes clips with labels by having helpers follow partners,
//! [`store`] keeps them, [`train`] learns from them and [`report`] tells how well; [`recognize`] is the mind's model of others.

pub mod clip;
pub mod collect;
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

/// What somebody did last, as an onlooker can tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Behavior {
    /// Picked something up.
    PickedUp,
    /// Tried to, in vain: beyond this person's reach or strength.
    FailedToPickUp,
    /// Put something into a container.
    PutIn,
    /// Put something on a place.
    PutOn,
    /// Tried to, in vain.
    FailedToPutOn,
    /// None of these: walks, turns, waits, or has not ended anything yet.
    Moving,
}

impl Behavior {
    /// All, in the order of the network's outputs.
    pub const ALL: [Behavior; 6] = [
        Behavior::PickedUp,
        Behavior::FailedToPickUp,
        Behavior::PutIn,
        Behavior::PutOn,
        Behavior::FailedToPutOn,
        Behavior::Moving,
    ];

    /// In words.
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

    /// Which of the network's outputs it is.
    pub fn index(self) -> usize {
        self as usize
    }

    /// What an action that has ended so is seen as; `None` for those that aren't told apart: refused at
    /// once, or about obstacles.
    pub fn of(action: &ResolvedAction, outcome: Outcome) -> Option<Behavior> {
        let in_vain = outcome == Outcome::Failure(FailureReason::BeyondLimits);
        match (action, outcome) {
            (Action::PickUp { .. }, Outcome::Success) => Some(Behavior::PickedUp),
            (Action::PickUp { .. }, _) if in_vain => Some(Behavior::FailedToPickUp),
            (Action::PutIn, Outcome::Success) => Some(Behavior::PutIn),
            (Action::PutOn { .. }, Outcome::Success) => Some(Behavior::PutOn),
            (Action::PutOn { .. }, _) if in_vain => Some(Behavior::FailedToPutOn),
            _ => None,
        }
    }
}
