//! How a body holds itself: what an onlooker can see of what it does.

use chaic_core::Vec3;
use chaic_core::capability::{Gait, Impairments, Persona};
use chaic_core::geom::Pose;

/// One arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// Where the hand is, in the body's frame (x right, y up, -z ahead, origin between the feet),
    /// metres.
    pub hand_in_body: Vec3,
    /// Whether the hand is closed around something.
    pub grips: bool,
}

/// All that can be seen of a body, worked out from the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture {
    /// What kind of person.
    pub persona: Persona,
    /// What impairs it.
    pub impairments: Impairments,
    /// How tired it is: 0 rested, 1 exhausted.
    pub fatigue: f32,
    /// How this person gets about.
    pub gait: Gait,
    /// Height of the body, metres.
    pub height_m: f32,
    /// Which clothes and hair.
    pub look: u8,
    /// Where the feet (or wheels) are.
    pub pose: Pose,
    /// Whether the legs (or wheels) move.
    pub moving: bool,
    /// Distance walked so far, metres: the legs' phase.
    pub walked_m: f32,
    /// The arms, left and right.
    pub arms: [Arm; 2],
    /// How far the trunk is bent: 0 upright, 1 down to the floor.
    pub bend: f32,
    /// How far the body stretches upwards on its toes: 0 to 1.
    pub stretch: f32,
    /// Whether an attempt is failing right now: the hands come back empty.
    pub failing: bool,
}
