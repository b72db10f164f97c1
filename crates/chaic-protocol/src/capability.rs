//! What a body can do. A constraint is a value of [`Capability`], never a piece of code.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The kinds of people of the paper (section 3.1).
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Persona {
    /// An adult without constraint.
    Adult,
    /// The helper: as able as an adult.
    Helper,
    /// A child of 1.2 m who reaches [0, 1.5] m.
    Child,
    /// Somebody in a wheelchair who reaches [0.25, 1.5] m and whom obstacles block.
    Wheelchair,
    /// Somebody walking a bicycle: slow, and docks it before picking up.
    Rider,
    /// A frail person with a sixth of the helper's strength.
    Frail,
}

/// How a body gets about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Gait {
    /// On two feet.
    Walk,
    /// In a wheelchair.
    Roll,
    /// Walking beside a bicycle, one hand on it.
    WalkBike,
}

/// Limits and measures of one body. All heights are above the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Capability {
    /// Lowest and highest top of an object that this person picks up without risk of failing,
    /// metres (paper section 3.1; facts S1.1).
    pub pick_range_m: [f32; 2],
    /// The same for the top of a surface that something is put on, metres.
    pub put_range_m: [f32; 2],
    /// Heaviest mass lifted without risk of failing, kilograms (facts S1.1).
    pub strength_kg: f32,
    /// Distance covered in a frame of walking, metres (facts S1.5).
    pub speed_m_per_frame: f32,
    /// Distance covered in a frame while stepping up to an object that is being picked up or put
    /// somewhere, metres.
    pub approach_speed_m_per_frame: f32,
    /// Radius of the upright cylinder that collides, metres. Adult: half of the original probe's
    /// mean width (0.64 by 0.18 m). Wheelchair: half of an ISO 7176 occupied width of 0.7 m.
    pub radius_m: f32,
    /// Height of the body, metres.
    pub height_m: f32,
    /// Height of the eyes, metres.
    pub eye_height_m: f32,
    /// Way of moving.
    pub gait: Gait,
    /// Frames to dock a vehicle before the hands are free, 0 without vehicle (facts S8.2).
    pub docking_frames: u32,
    /// Whether fragile things may break in these hands (facts S6).
    pub breaks_fragile: bool,
    /// Whether this person can lift obstacles out of the way (paper section 3.1: somebody in a
    /// wheelchair can't).
    #[serde(default = "able")]
    pub removes_obstacles: bool,
}

/// What an ability is where a file says nothing of it.
fn able() -> bool {
    true
}

/// Heights that everybody without a limit reaches (facts S1.1).
const FREE_RANGE_M: [f32; 2] = [0.0, 3.0];
/// Mean of the walk cycle measured on the original's recordings (facts S1.5).
const ADULT_SPEED: f32 = 0.047;
/// The original's child and rider walk at half of it (facts S1.5, measured).
const SLOW_SPEED: f32 = 0.0236;

const ADULT: Capability = Capability {
    pick_range_m: FREE_RANGE_M,
    put_range_m: FREE_RANGE_M,
    strength_kg: 600.0,
    speed_m_per_frame: ADULT_SPEED,
    approach_speed_m_per_frame: ADULT_SPEED,
    radius_m: 0.20,
    height_m: 1.75,
    eye_height_m: 1.65,
    gait: Gait::Walk,
    docking_frames: 0,
    breaks_fragile: false,
    removes_obstacles: true,
};

impl Persona {
    /// Every kind.
    pub const ALL: [Persona; 6] = [
        Persona::Adult,
        Persona::Helper,
        Persona::Child,
        Persona::Wheelchair,
        Persona::Rider,
        Persona::Frail,
    ];

    /// The limits and measures of this kind of person.
    pub const fn capability(self) -> Capability {
        match self {
            Persona::Adult | Persona::Helper => ADULT,
            Persona::Child => Capability {
                pick_range_m: [0.0, 1.5],
                put_range_m: [0.0, 1.5],
                strength_kg: 100.0,
                speed_m_per_frame: SLOW_SPEED,
                approach_speed_m_per_frame: SLOW_SPEED,
                radius_m: 0.15,
                height_m: 1.2,
                eye_height_m: 1.08,
                breaks_fragile: true,
                ..ADULT
            },
            Persona::Wheelchair => Capability {
                pick_range_m: [0.25, 1.5],
                put_range_m: [0.25, 1.5],
                strength_kg: 500.0,
                radius_m: 0.35,
                height_m: 1.35,
                eye_height_m: 1.2,
                gait: Gait::Roll,
                removes_obstacles: false,
                ..ADULT
            },
            // The original's rider lets go of the bicycle's pace to step up to an object
            // (facts S8.2): the approach is at an adult's speed.
            Persona::Rider => Capability {
                speed_m_per_frame: SLOW_SPEED,
                gait: Gait::WalkBike,
                docking_frames: 50,
                ..ADULT
            },
            Persona::Frail => {
                Capability { strength_kg: 100.0, height_m: 1.65, eye_height_m: 1.55, ..ADULT }
            }
        }
    }
}

/// How far `value` lies outside `[low, high]`; 0 inside.
pub fn excess(value: f32, [low, high]: [f32; 2]) -> f32 {
    (low - value).max(value - high).max(0.0)
}

/// Success probability exp(-delta / alpha) / beta of exceeding one limit by `delta`, 1 within it
/// (paper section 3.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitPenalty {
    /// Excess over which the chance falls to 1/e, in the unit of the limit.
    pub alpha: f32,
    /// Divisor that applies as soon as the limit is exceeded at all.
    pub beta: f32,
}

impl LimitPenalty {
    /// The chance of an action that exceeds its limit by `delta`.
    ///
    /// ```
    /// # use chaic_protocol::capability::LimitPenalty;
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
    fn the_papers_ranges_and_strengths() {
        assert_eq!(Persona::Child.capability().pick_range_m, [0.0, 1.5]);
        assert_eq!(Persona::Wheelchair.capability().pick_range_m, [0.25, 1.5]);
        let (frail, helper) = (Persona::Frail.capability(), Persona::Helper.capability());
        assert_eq!(frail.strength_kg * 6.0, helper.strength_kg);
        assert_eq!(Persona::Child.capability().height_m, 1.2);
    }

    #[test]
    fn chances_match_the_hand_worked_table() {
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
