//! Posture of a body: the visible state of an agent.

use chaic_core::Vec3;
use chaic_core::capability::{Gait, Impairments, Persona};
use chaic_core::geom::Pose;

/// An arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// Position of the hand in the body frame (x right, y up, -z forward, origin between the feet),
    /// meters.
    pub hand_in_body: Vec3,
    /// True if the hand is closed around an object.
    pub grips: bool,
}

/// Visible state of a body, derived from the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture {
    /// Persona: kind of person.
    pub persona: Persona,
    /// Impairments.
    pub impairments: Impairments,
    /// Fatigue: 0 rested, 1 exhausted.
    pub fatigue: f32,
    /// Mode of locomotion.
    pub gait: Gait,
    /// Height of the body, meters.
    pub height_m: f32,
    /// Appearance index: selects clothes and hair.
    pub appearance: u8,
    /// Pose of the feet or wheels.
    pub pose: Pose,
    /// True if the legs or wheels move.
    pub moving: bool,
    /// Total distance walked, meters: phase of the leg animation.
    pub walked_m: f32,
    /// Left and right arm.
    pub arms: [Arm; 2],
    /// Bend of the trunk: 0 upright, 1 down to the floor.
    pub bend: f32,
    /// Upward stretch on the toes: 0 to 1.
    pub stretch: f32,
    /// True if a failing attempt is in progress.
    pub failing: bool,
}
