//! From Unity's axes to ours.
//!
//! Unity's frame is left-handed with y up; a yaw turns clockwise seen from above, 0 looks along +z
//! and 90 degrees along +x. Ours ([`chaic_core::geom`]) is right-handed; a yaw turns
//! counter-clockwise, 0 looks along -z. Negating z makes one of the other: Unity's heading
//! (sin a, cos a) in x and z becomes (sin a, -cos a), which is ours for the yaw -a.
//!
//! Shapes are mirrored with their frame: what is in front of a model (+z) is in front of ours (-z).

use chaic_core::geom::{Rect, math, wrap_angle};
use chaic_core::{Vec2, Vec3};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// A point, direction, size or triple of angles as the original writes it.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
pub(crate) struct Triple {
    #[serde(deserialize_with = "sane")]
    pub x: f32,
    #[serde(deserialize_with = "sane")]
    pub y: f32,
    #[serde(deserialize_with = "sane")]
    pub z: f32,
}

/// Larger numbers of metres, degrees or factors are mistakes.
const MAX_NUMBER: f64 = 1e4;

/// A number that can be a length, an angle or a factor.
pub(crate) fn sane<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    let x = f64::deserialize(deserializer)?;
    if x.abs() <= MAX_NUMBER {
        return Ok(x as f32);
    }
    Err(D::Error::custom(format!("{x} is too large, expected at most {MAX_NUMBER}")))
}

/// A list of such numbers.
pub(crate) fn sane_list<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<f32>, D::Error> {
    #[derive(Deserialize)]
    struct Number(#[serde(deserialize_with = "sane")] f32);
    Ok(Vec::<Number>::deserialize(d)?.into_iter().map(|n| n.0).collect())
}

impl From<Triple> for Vec3 {
    fn from(t: Triple) -> Vec3 {
        Vec3::new(t.x, t.y, t.z)
    }
}

/// Our point for one of Unity's, metres.
pub(crate) fn point(in_unity: Vec3) -> Vec3 {
    Vec3::new(in_unity.x, in_unity.y, -in_unity.z)
}

/// The same in plan (x, z).
pub(crate) fn plan([x, z]: [f32; 2]) -> Vec2 {
    Vec2::new(x, -z)
}

/// Our rectangle for `[x_min, z_min, x_max, z_max]` of Unity.
pub(crate) fn rect([x_min, z_min, x_max, z_max]: [f32; 4]) -> Rect {
    Rect::new([x_min, -z_max], [x_max, -z_min])
}

/// Our yaw, radians, for one of Unity's, degrees.
pub(crate) fn yaw_rad(in_unity_deg: f32) -> f32 {
    wrap_angle(-in_unity_deg.to_radians())
}

/// `v` turned as Unity turns by Euler angles (degrees): about z, then x, then y.
pub(crate) fn turned(v: Vec3, euler_deg: Vec3) -> Vec3 {
    let [x, y, z] =
        euler_deg.to_array().map(|deg| (math::sin(deg.to_radians()), math::cos(deg.to_radians())));
    let v = Vec3::new(v.x * z.1 - v.y * z.0, v.x * z.0 + v.y * z.1, v.z);
    let v = Vec3::new(v.x, v.y * x.1 - v.z * x.0, v.y * x.0 + v.z * x.1);
    Vec3::new(v.x * y.1 + v.z * y.0, v.y, -v.x * y.0 + v.z * y.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::geom::forward;
    use std::f32::consts::FRAC_PI_2;

    fn near(a: Vec3, b: Vec3) {
        assert!((a - b).length() < 1e-5, "{a} {b}");
    }

    #[test]
    fn headings_worked_by_hand() {
        // Unity: 0 north (+z), 90 east (+x), 180 south, 270 west. On our page north is -z.
        near(forward(yaw_rad(0.0)), Vec3::NEG_Z);
        near(forward(yaw_rad(90.0)), Vec3::X);
        near(forward(yaw_rad(180.0)), Vec3::Z);
        near(forward(yaw_rad(270.0)), Vec3::NEG_X);
        assert!((yaw_rad(270.0) - FRAC_PI_2).abs() < 1e-6, "the rider's yaw");
        // The child of the shopping task looks south-west.
        near(forward(yaw_rad(225.0)), Vec3::new(-0.5f32.sqrt(), 0.0, 0.5f32.sqrt()));
    }

    #[test]
    fn turning_in_unity_and_in_our_frame_is_the_same_turn() {
        for deg in [-200.0, -30.0, 0.0, 45.0, 90.0, 300.0] {
            let ahead = turned(Vec3::Z, Vec3::new(0.0, deg, 0.0));
            near(point(ahead), forward(yaw_rad(deg)));
        }
    }

    #[test]
    fn a_model_tips_as_unity_tips_it() {
        // Positive x turns the front down, positive z lifts the right side.
        near(turned(Vec3::Z, Vec3::new(90.0, 0.0, 0.0)), Vec3::NEG_Y);
        near(turned(Vec3::X, Vec3::new(0.0, 0.0, 90.0)), Vec3::Y);
        // z first, y last: the right side goes up and stays there.
        near(turned(Vec3::X, Vec3::new(0.0, 90.0, 90.0)), Vec3::Y);
    }

    #[test]
    fn rectangles_keep_their_order() {
        let r = rect([-1.0, 2.0, 3.0, 5.0]);
        assert_eq!((r.min, r.max), (Vec2::new(-1.0, -5.0), Vec2::new(3.0, -2.0)));
    }
}
