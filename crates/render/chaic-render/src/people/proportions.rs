//! Body proportions.

use chaic_core::capability::Persona;
use chaic_world::Posture;

/// Dimensions of a body, meters.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyProportions {
    /// Heights of joints in an upright stance.
    pub hip_y: f32,
    pub shoulder_y: f32,
    pub top_y: f32,
    /// Height and width of the head.
    pub head: f32,
    pub head_width: f32,
    /// Half of the distance between the shoulders, and between the hips.
    pub shoulder_x: f32,
    pub hip_x: f32,
    pub upper_arm: f32,
    pub forearm: f32,
    pub thigh: f32,
    pub shin: f32,
    pub ankle_y: f32,
    /// Thickness of limbs relative to an adult.
    pub girth: f32,
    /// Permanent forward lean of the trunk, radians.
    pub lean_rad: f32,
}

impl BodyProportions {
    pub fn new(posture: &Posture) -> BodyProportions {
        // The body of a seated person has the proportions of the standing height.
        let h = if posture.persona == Persona::Wheelchair {
            posture.height_m * (1.72 / 1.35)
        } else {
            posture.height_m
        };
        let adult = BodyProportions {
            hip_y: 0.515 * h,
            shoulder_y: 0.828 * h,
            top_y: h,
            head: 0.145 * h,
            head_width: 0.100 * h,
            shoulder_x: 0.108 * h,
            hip_x: 0.052 * h,
            upper_arm: 0.175 * h,
            forearm: 0.150 * h,
            thigh: 0.245 * h,
            shin: 0.235 * h,
            ankle_y: 0.045 * h,
            girth: h / 1.75,
            lean_rad: 0.0,
        };
        match posture.persona {
            Persona::Child => BodyProportions {
                hip_y: 0.47 * h,
                shoulder_y: 0.775 * h,
                head: 0.20 * h,
                head_width: 0.155 * h,
                shoulder_x: 0.112 * h,
                hip_x: 0.055 * h,
                upper_arm: 0.165 * h,
                forearm: 0.145 * h,
                thigh: 0.222 * h,
                shin: 0.212 * h,
                girth: 0.82 * h / 1.2,
                ..adult
            },
            Persona::Frail => BodyProportions { lean_rad: 0.32, girth: 0.9 * h / 1.75, ..adult },
            _ => adult,
        }
    }
}
