//! Coordinate frames, and arithmetic that is bit-identical on every machine.
//!
//! One convention holds everywhere: **right-handed, y up, meters, radians**.
//!
//! ```text
//!            +y (up)
//!             |
//!             |        yaw 0 looks along -z; a positive yaw turns left
//!             |        (counter-clockwise seen from above).
//!             o------- +x (right at yaw 0)
//!            /
//!          +z (behind at yaw 0)
//! ```
//!
//! A camera looks along its own -z with +x right and +y up, as in OpenGL and glTF. Images have row
//! 0 at the top and column 0 at the left. Plan views draw +x to the right and -z upwards, so an
//! agent at yaw 0 faces the top of the page.

use glam::{Mat3, Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// Transcendental functions from one pure-Rust library, so that every machine computes the same
/// bits. The functions of the standard library depend on the platform.
pub mod math {
    pub use libm::{
        acosf as acos, asinf as asin, atan2f as atan2, cosf as cos, expf as exp, hypotf as hypot,
        logf as ln, powf, sinf as sin, tanf as tan,
    };

    /// From this value to twice this value, the representable f32 are exactly the integers.
    const INTEGERS_FROM: f32 = 8_388_608.0;

    /// Returns the floor of `x` for 0 <= `x` <= 2^22, and an unspecified number for any other `x`.
    /// It omits the range checks of a conversion, for loops over pixels.
    #[inline]
    pub fn floor_small(x: f32) -> i32 {
        let shifted = x + INTEGERS_FROM;
        let nearest = shifted.to_bits().wrapping_sub(INTEGERS_FROM.to_bits()) as i32;
        nearest.wrapping_sub(i32::from(shifted - INTEGERS_FROM > x))
    }
}

/// Returns the horizontal unit vector in the direction of yaw `yaw_rad`.
///
/// ```
/// use chaic_core::geom::forward;
/// assert_eq!(forward(0.0), glam::Vec3::new(-0.0, 0.0, -1.0));
/// assert!((forward(std::f32::consts::FRAC_PI_2).x + 1.0).abs() < 1e-6, "a left turn faces -x");
/// ```
pub fn forward(yaw_rad: f32) -> Vec3 {
    Vec3::new(-math::sin(yaw_rad), 0.0, -math::cos(yaw_rad))
}

/// Returns the horizontal unit vector to the right of yaw `yaw_rad`.
pub fn right(yaw_rad: f32) -> Vec3 {
    Vec3::new(math::cos(yaw_rad), 0.0, -math::sin(yaw_rad))
}

/// Returns the yaw that looks from `from` to `to` (heights are ignored); 0 if both coincide.
pub fn yaw_towards(from: Vec3, to: Vec3) -> f32 {
    let d = to - from;
    if d.x == 0.0 && d.z == 0.0 { 0.0 } else { math::atan2(-d.x, -d.z) }
}

/// Returns the equivalent angle in (-pi, pi].
pub fn wrap_angle(rad: f32) -> f32 {
    use std::f32::consts::{PI, TAU};
    let mut a = rad % TAU;
    if a > PI {
        a -= TAU;
    } else if a <= -PI {
        a += TAU;
    }
    a
}

/// Returns the rotation of an upright object by `yaw_rad`.
pub fn yaw_rotation(yaw_rad: f32) -> Quat {
    let half = 0.5 * yaw_rad;
    Quat::from_xyzw(0.0, math::sin(half), 0.0, math::cos(half))
}

/// Returns the rotation that raises a level gaze by `pitch_rad`.
pub fn pitch_rotation(pitch_rad: f32) -> Quat {
    let half = 0.5 * pitch_rad;
    Quat::from_xyzw(math::sin(half), 0.0, 0.0, math::cos(half))
}

/// Rotates `v` about the vertical axis by `yaw_rad`.
pub fn rotate_yaw(v: Vec3, yaw_rad: f32) -> Vec3 {
    let (s, c) = (math::sin(yaw_rad), math::cos(yaw_rad));
    Vec3::new(c * v.x + s * v.z, v.y, -s * v.x + c * v.z)
}

/// Returns the horizontal components (x, z) of a point.
pub fn to_xz(v: Vec3) -> Vec2 {
    Vec2::new(v.x, v.z)
}

/// Returns the distance of two points in plan.
pub fn horizontal_distance(a: Vec3, b: Vec3) -> f32 {
    to_xz(a).distance(to_xz(b))
}

/// Pose of an agent: feet on the ground at `position`, facing `yaw_rad`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Position of the feet in the world, meters.
    #[schemars(with = "[f32; 3]")]
    pub position: Vec3,
    /// Yaw, radians; see the figure of the module.
    pub yaw_rad: f32,
}

impl Pose {
    /// Returns the unit vector in the direction of this pose.
    pub fn forward(&self) -> Vec3 {
        forward(self.yaw_rad)
    }

    /// Converts a point from the frame of this pose (x right, y up, -z forward) to the world.
    pub fn to_world(&self, point_in_body: Vec3) -> Vec3 {
        self.position + rotate_yaw(point_in_body, self.yaw_rad)
    }
}

/// An axis-aligned rectangle in plan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rect {
    /// Smallest x and z, meters.
    #[schemars(with = "[f32; 2]")]
    pub min: Vec2,
    /// Largest x and z, meters.
    #[schemars(with = "[f32; 2]")]
    pub max: Vec2,
}

impl Rect {
    /// Creates the rectangle between two corners given as `[x, z]`.
    pub fn new(min: [f32; 2], max: [f32; 2]) -> Rect {
        Rect { min: Vec2::from(min), max: Vec2::from(max) }
    }

    /// Returns whether the point (x, z) is inside, borders included.
    pub fn contains(&self, p: Vec2) -> bool {
        p.x >= self.min.x && p.x <= self.max.x && p.y >= self.min.y && p.y <= self.max.y
    }

    /// Returns the rectangle with every side moved outwards by `margin_m` (inwards if negative).
    pub fn expanded(&self, margin_m: f32) -> Rect {
        Rect { min: self.min - margin_m, max: self.max + margin_m }
    }

    /// Returns the extent along x and z, meters.
    pub fn size(&self) -> Vec2 {
        self.max - self.min
    }

    /// Returns the center (x, z).
    pub fn center(&self) -> Vec2 {
        0.5 * (self.min + self.max)
    }

    /// Returns whether two rectangles have a common point.
    pub fn overlaps(&self, other: &Rect) -> bool {
        self.min.x <= other.max.x
            && other.min.x <= self.max.x
            && self.min.y <= other.max.y
            && other.min.y <= self.max.y
    }
}

/// A pinhole camera at a pose in the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Position of the camera in the world, meters.
    pub eye_in_world: Vec3,
    /// Rotation from camera to world.
    pub world_from_camera: Quat,
    /// Full vertical field of view, radians; pixels are square.
    pub vertical_fov_rad: f32,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
}

impl Camera {
    /// Full field of view of an agent's camera, 90 degrees (facts S10.3).
    pub const EYE_FOV_RAD: f32 = std::f32::consts::FRAC_PI_2;
    /// Distance of the near plane, meters (original: 0.1).
    pub const NEAR_M: f32 = 0.1;
    /// Distance of the far plane and depth of empty pixels, meters (original: 100).
    pub const FAR_M: f32 = 100.0;

    /// Returns the focal length, pixels.
    pub fn focal_px(&self) -> f32 {
        0.5 * self.height as f32 / math::tan(0.5 * self.vertical_fov_rad)
    }

    /// Returns the world point at pixel center (`column`, `row`) and depth `depth_m` along the
    /// camera's axis.
    pub fn unproject(&self, column: u32, row: u32, depth_m: f32) -> Vec3 {
        let f = self.focal_px();
        let x = (column as f32 + 0.5 - 0.5 * self.width as f32) / f;
        let y = -(row as f32 + 0.5 - 0.5 * self.height as f32) / f;
        self.eye_in_world + self.world_from_camera * (Vec3::new(x, y, -1.0) * depth_m)
    }

    /// Returns the continuous pixel coordinates and the depth of a world point; `None` for points
    /// closer than the near plane.
    pub fn project(&self, p_in_world: Vec3) -> Option<(Vec2, f32)> {
        let p = self.world_from_camera.inverse() * (p_in_world - self.eye_in_world);
        let depth = -p.z;
        if depth < Camera::NEAR_M {
            return None;
        }
        let f = self.focal_px();
        let u = 0.5 * self.width as f32 + f * p.x / depth;
        let v = 0.5 * self.height as f32 - f * p.y / depth;
        Some((Vec2::new(u, v), depth))
    }

    /// Returns the rotation as a matrix, for loops over pixels.
    pub fn rotation(&self) -> Mat3 {
        Mat3::from_quat(self.world_from_camera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_PI_2, PI};

    #[test]
    fn floor_small_matches_the_library() {
        let steps = (0..40_000).map(|k| k as f32 * 0.0625);
        let near = (1..2000).flat_map(|k| [(k as f32).next_down(), (k as f32).next_up()]);
        for x in steps.chain(near).chain([f32::MIN_POSITIVE, 0.5, 1e-7, 4_194_303.5, 4_194_304.0]) {
            assert_eq!(math::floor_small(x), x.floor() as i32, "{x}");
        }
    }

    #[test]
    fn unknown_fields_are_refused() {
        let pose = r#"{"position": [0.0, 0.0, 0.0], "yaw_rad": 0.0, "yaw_deg": 90.0}"#;
        let error = serde_json::from_str::<Pose>(pose).unwrap_err().to_string();
        assert!(error.contains("unknown field `yaw_deg`"), "{error}");
        let rect = r#"{"min": [0.0, 0.0], "max": [1.0, 1.0], "size": [1.0, 1.0]}"#;
        let error = serde_json::from_str::<Rect>(rect).unwrap_err().to_string();
        assert!(error.contains("unknown field `size`"), "{error}");
    }

    #[test]
    fn axes_are_right_handed_and_a_positive_yaw_turns_left() {
        let (f, r) = (forward(0.3), right(0.3));
        assert!((r.cross(f) - Vec3::Y).length() < 1e-6, "right x forward is up");
        assert!((yaw_rotation(0.3) * Vec3::NEG_Z - f).length() < 1e-6);
        assert!((rotate_yaw(Vec3::NEG_Z, 0.3) - f).length() < 1e-6);
        assert!((forward(FRAC_PI_2) - Vec3::NEG_X).length() < 1e-6);
    }

    #[test]
    fn yaw_towards_inverts_forward() {
        for yaw in [-3.0, -1.0, 0.0, 0.5, 2.0] {
            let to = Vec3::new(1.0, 5.0, 2.0) + 3.0 * forward(yaw);
            assert!((yaw_towards(Vec3::new(1.0, 0.0, 2.0), to) - yaw).abs() < 1e-5);
        }
        assert!((wrap_angle(3.0 * PI) - PI).abs() < 1e-5);
    }

    #[test]
    fn project_inverts_unproject() {
        let camera = Camera {
            eye_in_world: Vec3::new(1.0, 1.6, -2.0),
            world_from_camera: yaw_rotation(0.7),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: 512,
            height: 512,
        };
        let p = camera.unproject(100, 300, 4.0);
        let (px, depth) = camera.project(p).expect("the point is ahead");
        assert!((px - Vec2::new(100.5, 300.5)).length() < 1e-2 && (depth - 4.0).abs() < 1e-4);
        assert!(camera.project(camera.unproject(0, 0, -1.0)).is_none());
    }
}
