//! What an agent may do, and how it can end.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::ids::EntityId;

/// One of two hands.
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

    /// Its place in per-hand arrays: left 0, right 1.
    pub fn index(self) -> usize {
        match self {
            Hand::Left => 0,
            Hand::Right => 1,
        }
    }

    /// The other one.
    pub fn other(self) -> Hand {
        match self {
            Hand::Left => Hand::Right,
            Hand::Right => Hand::Left,
        }
    }
}

/// How an agent names the thing that an action is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// Whatever this pixel of the agent's own last image shows; column 0 is at the left, row 0 at
    /// the top. The environment resolves it against ids that the agent never gets. Without an
    /// image, outside of it, or where it shows no object, the action fails as
    /// [`FailureReason::OutOfReach`].
    Pixel {
        /// Column, 0 to width - 1.
        column: u32,
        /// Row, 0 to height - 1.
        row: u32,
    },
    /// An entity, for agents that are granted ids. Without the grant it names nothing.
    Entity(EntityId),
}

/// An action about an entity of the world: what the world runs and a trace records.
pub type ResolvedAction = Action<EntityId>;

/// What an agent decides to do next. An action takes frames; its agent is asked again when it
/// ends (paper section 3.3, "Action Space").
///
/// `T` is how its object is named: a [`Target`] by agents, an [`EntityId`] in the world, a track
/// of its own within a mind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action<T = Target> {
    /// A step of about 0.42 m ahead.
    MoveForward,
    /// 15 degrees to the left.
    TurnLeft,
    /// 15 degrees to the right.
    TurnRight,
    /// Step up to an object and take it. Heavy furniture takes both hands, and is lifted together
    /// if another agent has chosen to pick up the same piece and both stand at it.
    PickUp {
        /// What to take.
        object: T,
        /// The hand to take it with.
        hand: Hand,
    },
    /// Put the object in one hand into the container in the other.
    PutIn,
    /// Step up to a place and put on it what the hand holds.
    PutOn {
        /// Where to put it: a goal place or any other thing with a top.
        place: T,
        /// The hand to empty; a rider's basket and furniture go as a whole, whatever the hand.
        hand: Hand,
    },
    /// Step up to an obstacle, lift it and put it aside.
    RemoveObstacle {
        /// What to remove.
        obstacle: T,
        /// The hand to take it with.
        hand: Hand,
    },
    /// Stand still.
    Wait {
        /// For how many frames; at least 1.
        frames: u32,
    },
}

impl<T: Copy> Action<T> {
    /// The object or place the action is about.
    pub fn subject(&self) -> Option<T> {
        match *self {
            Action::PickUp { object, .. } => Some(object),
            Action::PutOn { place, .. } => Some(place),
            Action::RemoveObstacle { obstacle, .. } => Some(obstacle),
            _ => None,
        }
    }

    /// The same action with its object named in another way.
    pub fn map<U>(self, name: impl FnOnce(T) -> U) -> Action<U> {
        match self {
            Action::MoveForward => Action::MoveForward,
            Action::TurnLeft => Action::TurnLeft,
            Action::TurnRight => Action::TurnRight,
            Action::PickUp { object, hand } => Action::PickUp { object: name(object), hand },
            Action::PutIn => Action::PutIn,
            Action::PutOn { place, hand } => Action::PutOn { place: name(place), hand },
            Action::RemoveObstacle { obstacle, hand } => {
                Action::RemoveObstacle { obstacle: name(obstacle), hand }
            }
            Action::Wait { frames } => Action::Wait { frames },
        }
    }

    /// Whether it only changes where the agent stands or looks.
    pub fn is_locomotion(&self) -> bool {
        matches!(self, Action::MoveForward | Action::TurnLeft | Action::TurnRight)
    }
}

/// Why an action failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureReason {
    /// Something solid is in the way.
    Blocked,
    /// Nothing to do this with is within reach and sight: too far away to step up to, behind a wall,
    /// no longer there, or never there at all. One reason for all of these, so that no failure
    /// tells of what can't be seen.
    OutOfReach,
    /// Beyond the height or strength of this person, and this attempt did not succeed; or nothing
    /// that this person can do at all.
    BeyondLimits,
    /// The fragile object broke.
    Broke,
    /// The hand (or, for furniture, a hand) is full.
    HandFull,
    /// The hand is empty.
    HandEmpty,
    /// Somebody else holds the object.
    HeldByOther,
    /// The object is already delivered, or lost.
    OutOfPlay,
    /// Nobody can do this with the object, which is within reach.
    Impossible,
    /// The container or basket is full.
    Full,
    /// No container in one hand and target in the other.
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

/// How an action ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// As intended.
    Success,
    /// Not as intended.
    Failure(FailureReason),
}

impl Outcome {
    /// Whether it ended as intended.
    pub fn is_success(self) -> bool {
        self == Outcome::Success
    }
}
