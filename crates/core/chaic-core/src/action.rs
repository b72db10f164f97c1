//! Actions of agents and their outcomes.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::ids::EntityId;

/// Left or right hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hand {
    /// The left hand.
    Left,
    /// The right hand.
    Right,
}

impl Hand {
    /// Left, then right.
    pub const BOTH: [Hand; 2] = [Hand::Left, Hand::Right];

    /// Returns the index in per-hand arrays: left 0, right 1.
    pub fn index(self) -> usize {
        match self {
            Hand::Left => 0,
            Hand::Right => 1,
        }
    }

    /// Returns the opposite hand.
    pub fn other(self) -> Hand {
        match self {
            Hand::Left => Hand::Right,
            Hand::Right => Hand::Left,
        }
    }
}

/// Reference of an agent to the object of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// Object at this pixel of the agent's last image; column 0 is at the left, row 0 at the top.
    /// The environment resolves the pixel with an id image that the agent never receives. The
    /// action fails with [`FailureReason::OutOfReach`] if there is no image, or if the pixel is
    /// outside the image or shows no object.
    Pixel {
        /// Column, 0 to width - 1.
        column: u32,
        /// Row, 0 to height - 1.
        row: u32,
    },
    /// Entity id, for agents with granted ids. Without the grant, it refers to no object.
    Entity(EntityId),
}

/// An action with entity ids, as the world runs it and a trace records it.
pub type ResolvedAction = Action<EntityId>;

/// Action of an agent. It takes one or more frames. The agent decides again when the action ends
/// (paper section 3.3, "Action Space").
///
/// `T` is the type of the object reference: a [`Target`] for agents, an [`EntityId`] in the world,
/// and a track id inside an agent with its own tracker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action<T = Target> {
    /// Moves about 0.42 m forward.
    MoveForward,
    /// Turns 15 degrees to the left.
    TurnLeft,
    /// Turns 15 degrees to the right.
    TurnRight,
    /// Approaches an object and picks it up. Heavy furniture requires both hands. Two agents lift
    /// it together if both have chosen to pick it up and stand at it.
    PickUp {
        /// Object to pick up.
        object: T,
        /// Hand to use.
        hand: Hand,
    },
    /// Puts the object in one hand into the container in the other.
    PutIn,
    /// Approaches a place and puts the held object on it.
    PutOn {
        /// Goal place, or any other object with a supporting surface.
        place: T,
        /// Hand to empty. The contents of a rider's basket, or furniture, are put down with either
        /// hand.
        hand: Hand,
    },
    /// Approaches an obstacle, lifts it and sets it aside.
    RemoveObstacle {
        /// Obstacle to remove.
        obstacle: T,
        /// Hand to use.
        hand: Hand,
    },
    /// Stands still.
    Wait {
        /// Number of frames; at least 1.
        frames: u32,
    },
}

impl<T: Copy> Action<T> {
    /// Returns the object or place of the action.
    pub fn subject(&self) -> Option<T> {
        match *self {
            Action::PickUp { object, .. } => Some(object),
            Action::PutOn { place, .. } => Some(place),
            Action::RemoveObstacle { obstacle, .. } => Some(obstacle),
            _ => None,
        }
    }

    /// Returns the same action with a converted object reference.
    pub fn map<U>(self, convert: impl FnOnce(T) -> U) -> Action<U> {
        match self {
            Action::MoveForward => Action::MoveForward,
            Action::TurnLeft => Action::TurnLeft,
            Action::TurnRight => Action::TurnRight,
            Action::PickUp { object, hand } => Action::PickUp { object: convert(object), hand },
            Action::PutIn => Action::PutIn,
            Action::PutOn { place, hand } => Action::PutOn { place: convert(place), hand },
            Action::RemoveObstacle { obstacle, hand } => {
                Action::RemoveObstacle { obstacle: convert(obstacle), hand }
            }
            Action::Wait { frames } => Action::Wait { frames },
        }
    }

    /// Returns whether the action only moves or turns the agent.
    pub fn is_locomotion(&self) -> bool {
        matches!(self, Action::MoveForward | Action::TurnLeft | Action::TurnRight)
    }

    /// Returns whether the action is more than moving, turning or waiting.
    pub fn is_interaction(&self) -> bool {
        !self.is_locomotion() && !matches!(self, Action::Wait { .. })
    }
}

/// Reason of a failed action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureReason {
    /// A solid object blocks the way.
    Blocked,
    /// The object is not accessible: too far for an approach, behind a wall, no longer present, or
    /// nonexistent. All these cases have one reason, so that a failure reveals nothing hidden.
    OutOfReach,
    /// Beyond the height range or strength of this person, and the attempt did not succeed; or an
    /// action that this person cannot perform.
    BeyondLimits,
    /// The fragile object broke.
    Broke,
    /// The hand is full; for furniture, either hand.
    HandFull,
    /// The hand is empty.
    HandEmpty,
    /// Another agent holds the object.
    HeldByOther,
    /// The object is already delivered, or lost.
    OutOfPlay,
    /// The object is within reach, but does not permit this action.
    Impossible,
    /// The container or basket is full.
    Full,
    /// The hands do not hold a container and a target.
    NotContainerAndTarget,
}

impl fmt::Display for FailureReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            FailureReason::Blocked => "blocked",
            FailureReason::OutOfReach => "nothing like it within reach",
            FailureReason::BeyondLimits => "beyond this person's limits",
            FailureReason::Broke => "it broke",
            FailureReason::HandFull => "hand full",
            FailureReason::HandEmpty => "hand empty",
            FailureReason::HeldByOther => "held by somebody else",
            FailureReason::OutOfPlay => "already delivered or lost",
            FailureReason::Impossible => "impossible",
            FailureReason::Full => "full",
            FailureReason::NotContainerAndTarget => "needs a container and a target in hand",
        })
    }
}

/// Outcome of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The action succeeded.
    Success,
    /// The action failed.
    Failure(FailureReason),
}

impl Outcome {
    /// Returns whether the action succeeded.
    pub fn is_success(self) -> bool {
        self == Outcome::Success
    }
}
