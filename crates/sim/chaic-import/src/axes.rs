//! Conversion from Unity's axes to ours.
//!
//! Unity's frame is left-handed with y up. A yaw turns clockwise seen from above; 0 faces +z and 90
//! degrees faces +x. Ours ([`chaic_core::geom`]) is right-handed; a yaw turns counter-clockwise,
//! and 0 faces -z. Negating z converts between the two: Unity's heading (sin a, cos a) in x and z
//! becomes (sin a, -cos a), which is ours for the yaw -a.
//!
//! Shapes are mirrored with their frame: the front of a model (+z) becomes the front of ours (-z).

use chaic_core::geom::{Rect, math, wrap_angle};
use chaic_core::{Vec2, Vec3};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// A point, direction, size or triple of angles in the original's format.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
pub(crate) struct Triple {
    #[serde(deserialize_with = "bounded_number")]
    pub x: f32,
    #[serde(deserialize_with = "bounded_number")]
    pub y: f32,
    #[serde(deserialize_with = "bounded_number")]
    pub z: f32,
}

/// Maximum magnitude of meters, degrees or factors; larger values are errors.
const MAX_NUMBER: f64 = 1e4;

/// Deserializes a number that can be a length, an angle or a factor.
pub(crate) fn bounded_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    let x = f64::deserialize(deserializer)?;
    if x.abs() <= MAX_NUMBER {
        return Ok(x as f32);
    }
    Err(D::Error::custom(format!("{x} is too large, expected at most {MAX_NUMBER}")))
}

/// Deserializes a list of such numbers.
pub(crate) fn bounded_numbers<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<f32>, D::Error> {
    #[derive(Deserialize)]
    struct Number(#[serde(deserialize_with = "bounded_number")] f32);
    Ok(Vec::<Number>::deserialize(d)?.into_iter().map(|n| n.0).collect())
}

impl From<Triple> for Vec3 {
    fn from(t: Triple) -> Vec3 {
        Vec3::new(t.x, t.y, t.z)
    }
}

/// Converts a point from Unity's frame, meters.
pub(crate) fn point(in_unity: Vec3) -> Vec3 {
    Vec3::new(in_unity.x, in_unity.y, -in_unity.z)
}

/// Converts a point in plan (x, z).
pub(crate) fn plan([x, z]: [f32; 2]) -> Vec2 {
    Vec2::new(x, -z)
}

/// Converts a rectangle `[x_min, z_min, x_max, z_max]`.
pub(crate) fn rect([x_min, z_min, x_max, z_max]: [f32; 4]) -> Rect {
    Rect::new([x_min, -z_max], [x_max, -z_min])
}

/// Converts a yaw from degrees in Unity's frame to radians in ours.
pub(crate) fn yaw_rad(in_unity_deg: f32) -> f32 {
    wrap_angle(-in_unity_deg.to_radians())
}

/// Returns `v` rotated by Unity's Euler angles (degrees): about z, then x, then y.
pub(crate) fn rotated(v: Vec3, euler_deg: Vec3) -> Vec3 {
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
    fn headings_equal_handmade_examples() {
        // Unity: 0 north (+z), 90 east (+x), 180 south, 270 west. In our frame north is -z.
        near(forward(yaw_rad(0.0)), Vec3::NEG_Z);
        near(forward(yaw_rad(90.0)), Vec3::X);
        near(forward(yaw_rad(180.0)), Vec3::Z);
        near(forward(yaw_rad(270.0)), Vec3::NEG_X);
        assert!((yaw_rad(270.0) - FRAC_PI_2).abs() < 1e-6, "the rider's yaw");
        // The child of the shopping task faces south-west.
        near(forward(yaw_rad(225.0)), Vec3::new(-0.5f32.sqrt(), 0.0, 0.5f32.sqrt()));
    }

    #[test]
    fn yaws_are_equivalent_in_both_frames() {
        for deg in [-200.0, -30.0, 0.0, 45.0, 90.0, 300.0] {
            let ahead = rotated(Vec3::Z, Vec3::new(0.0, deg, 0.0));
            near(point(ahead), forward(yaw_rad(deg)));
        }
    }

    #[test]
    fn euler_angles_rotate_as_in_unity() {
        // Positive x tilts the front down, positive z lifts the right side.
        near(rotated(Vec3::Z, Vec3::new(90.0, 0.0, 0.0)), Vec3::NEG_Y);
        near(rotated(Vec3::X, Vec3::new(0.0, 0.0, 90.0)), Vec3::Y);
        // z first, y last: the right side goes up and stays there.
        near(rotated(Vec3::X, Vec3::new(0.0, 90.0, 90.0)), Vec3::Y);
    }

    #[test]
    fn converted_rectangles_have_min_below_max() {
        let r = rect([-1.0, 2.0, 3.0, 5.0]);
        assert_eq!((r.min, r.max), (Vec2::new(-1.0, -5.0), Vec2::new(3.0, -2.0)));
    }
}
