//! Physical limits and dimensions of a body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::action::Hand;

/// Mode of locomotion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Gait {
    /// Walks on two feet.
    Walk,
    /// Rolls in a wheelchair.
    Roll,
    /// Walks beside a bicycle with one hand on it.
    WalkBike,
}

/// Physical limits and dimensions of a body. All heights are above the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Capability {
    /// Lowest and highest top of an object for a pick-up without a chance of failure, meters (paper
    /// section 3.1; facts S1.1).
    pub pick_range_m: [f32; 2],
    /// The same range for the top of the surface of a put-on, meters.
    pub put_range_m: [f32; 2],
    /// Maximum mass for a lift without a chance of failure, kilograms (facts S1.1).
    pub strength_kg: f32,
    /// Distance covered in a frame of walking, meters (facts S1.5).
    pub speed_m_per_frame: f32,
    /// Distance covered in a frame of an approach to an object or place, meters.
    pub approach_speed_m_per_frame: f32,
    /// Radius of the collision cylinder, meters. Adult: half of the mean width of the original's
    /// probe (0.64 by 0.18 m). Wheelchair: half of the occupied width of 0.7 m in ISO 7176.
    pub radius_m: f32,
    /// Height of the body, meters.
    pub height_m: f32,
    /// Height of the eyes, meters.
    pub eye_height_m: f32,
    /// Mode of locomotion.
    pub gait: Gait,
    /// Number of frames to dock a vehicle before the hands are free; 0 without a vehicle (facts
    /// S8.2).
    pub docking_frames: u32,
    /// True if fragile objects may break in these hands (facts S6).
    pub breaks_fragile: bool,
    /// True if this person can remove obstacles (paper section 3.1: a wheelchair user cannot).
    #[serde(default = "able")]
    pub removes_obstacles: bool,
    /// True if this person can carry containers, which the other hand fills.
    #[serde(default = "able", skip_serializing_if = "is_able")]
    pub carries_containers: bool,
    /// True if this person can grasp furniture, alone or with another agent.
    #[serde(default = "able", skip_serializing_if = "is_able")]
    pub lifts_furniture: bool,
    /// Usable hands.
    #[serde(default, skip_serializing_if = "UsableHands::are_both")]
    pub hands: UsableHands,
    /// Limits of vision; `None` for the range and sharpness of the camera.
    #[serde(rename = "sight", default, skip_serializing_if = "Option::is_none")]
    pub eyesight: Option<Eyesight>,
    /// Fatigue parameters; `None` for a person who does not tire.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub endurance: Option<Endurance>,
    /// Tremor parameters; `None` for a person without tremor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tremor: Option<Tremor>,
}

/// Returns the default of an ability that a file does not specify.
fn able() -> bool {
    true
}

// `skip_serializing_if` passes a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_able(able: &bool) -> bool {
    *able
}

/// Usable hands of a person.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UsableHands {
    /// The left and the right hand.
    #[default]
    Both,
    /// The right hand only.
    Right,
}

impl UsableHands {
    /// Returns the usable hands, left before right.
    pub fn all(self) -> &'static [Hand] {
        match self {
            UsableHands::Both => &Hand::BOTH,
            UsableHands::Right => &[Hand::Right],
        }
    }

    /// Returns whether this hand is usable.
    pub fn include(self, hand: Hand) -> bool {
        self.all().contains(&hand)
    }

    // `skip_serializing_if` passes a reference.
    #[allow(clippy::trivially_copy_pass_by_ref)]
    fn are_both(&self) -> bool {
        *self == UsableHands::Both
    }
}

/// Limits of vision. Hidden pixels have no color, no instance id, and depth 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Eyesight {
    /// Maximum visible distance, measured in plan, meters.
    pub range_m: f32,
    /// Standard deviation of the blur, radians of visual angle at the center of the image.
    pub blur_rad: f32,
    /// Opening angle of the cone of vision, radians.
    pub field_rad: f32,
    /// Downward pitch of the gaze, radians: people with low vision look at the ground in front of
    /// them.
    pub lowered_rad: f32,
}

/// Fatigue model. Fatigue grows by `1 / work_frames` in each frame of walking, handling or
/// following in a joint carry. It falls by `1 / rest_frames` in all other frames, and is limited to
/// 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Endurance {
    /// Number of frames of work from rested to exhausted.
    pub work_frames: f32,
    /// Number of frames of rest from exhausted to rested.
    pub rest_frames: f32,
    /// Fraction of speed and strength that remains when exhausted.
    #[serde(rename = "least")]
    pub min_fraction: f32,
}

impl Endurance {
    /// Returns the fatigue after one more frame.
    pub fn after_frame(&self, fatigue: f32, is_working: bool) -> f32 {
        let change = if is_working { 1.0 / self.work_frames } else { -1.0 / self.rest_frames };
        (fatigue + change).clamp(0.0, 1.0)
    }

    /// Returns the fraction of speed and strength that remains.
    pub fn remaining_fraction(&self, fatigue: f32) -> f32 {
        1.0 - (1.0 - self.min_fraction) * fatigue
    }
}

/// Tremor model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tremor {
    /// Chance that an otherwise successful grasp slips.
    pub slip_chance: f32,
    /// Chance of dropping a held object, per frame of walking or standing.
    pub drop_chance: f32,
}

/// Returns the distance of `value` from the interval `[low, high]`; 0 inside.
pub fn excess(value: f32, [low, high]: [f32; 2]) -> f32 {
    (low - value).max(value - high).max(0.0)
}

/// Success probability exp(-delta / alpha) / beta for exceeding one limit by `delta`, and 1 within
/// it (paper section 3.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitPenalty {
    /// Excess at which the exponential has fallen to 1/e, in the unit of the limit.
    pub alpha: f32,
    /// Divisor for any excess above 0.
    pub beta: f32,
}

impl LimitPenalty {
    /// Pick-up beyond the height range, in meters (the original's code, facts S1.3).
    pub const PICK: LimitPenalty = LimitPenalty { alpha: 1.0, beta: 2.0 };
    /// Put-on beyond the height range, in meters (the original's code, facts S1.3).
    pub const PUT: LimitPenalty = LimitPenalty { alpha: 1.0, beta: 1.0 };
    /// Lift beyond the strength, in kilograms (the original's code, facts S1.3).
    pub const LIFT: LimitPenalty = LimitPenalty { alpha: 50.0, beta: 1.0 };

    /// Returns the success probability of an action that exceeds its limit by `delta`.
    ///
    /// ```
    /// # use chaic_core::capability::LimitPenalty;
    /// let pick = LimitPenalty { alpha: 1.0, beta: 2.0 };
    /// assert_eq!(pick.chance(0.0), 1.0);
    /// assert!((pick.chance(0.25) - 0.389).abs() < 1e-3);
    /// ```
    pub fn chance(&self, delta: f32) -> f32 {
        if delta <= 0.0 { 1.0 } else { crate::geom::math::exp(-delta / self.alpha) / self.beta }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_fields_are_refused() {
        let capability = crate::capability::Persona::Adult.capability();
        let mut json = serde_json::to_value(capability).unwrap();
        assert_eq!(serde_json::from_value::<Capability>(json.clone()).unwrap(), capability);
        // A misspelled optional field.
        json["lift_furniture"] = false.into();
        let error = serde_json::from_value::<Capability>(json).unwrap_err().to_string();
        assert!(error.contains("unknown field `lift_furniture`"), "{error}");
    }

    #[test]
    fn fatigue_grows_by_work_and_falls_by_rest() {
        let endurance = Endurance { work_frames: 100.0, rest_frames: 50.0, min_fraction: 0.4 };
        let after = |frames: u32, is_working: bool, from: f32| {
            (0..frames).fold(from, |fatigue, _| endurance.after_frame(fatigue, is_working))
        };
        assert!((after(50, true, 0.0) - 0.5).abs() < 1e-5 && after(200, true, 0.0) == 1.0);
        assert!((after(25, false, 1.0) - 0.5).abs() < 1e-5 && after(80, false, 1.0) == 0.0);
        assert!(
            endurance.remaining_fraction(0.0) == 1.0
                && (endurance.remaining_fraction(1.0) - 0.4).abs() < 1e-6
        );
    }

    #[test]
    fn chances_match_hand_computed_values() {
        let (pick, put) =
            (LimitPenalty { alpha: 1.0, beta: 2.0 }, LimitPenalty { alpha: 1.0, beta: 1.0 });
        let lift = LimitPenalty { alpha: 50.0, beta: 1.0 };
        for (chance, expected) in [
            (pick.chance(0.10), 0.452),
            (pick.chance(0.80), 0.225),
            (put.chance(0.25), 0.779),
            (put.chance(0.60), 0.549),
            (lift.chance(20.0), 0.670),
            (lift.chance(100.0), 0.135),
        ] {
            assert!((chance - expected).abs() < 1e-3, "{chance} is not {expected}");
        }
        assert_eq!(excess(0.1, [0.25, 1.5]), 0.15);
        assert_eq!(excess(1.0, [0.25, 1.5]), 0.0);
    }
}
