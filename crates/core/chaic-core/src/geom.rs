//! Frames of reference, and the arithmetic that is the same on every machine.
//!
//! One convention holds everywhere: **right-handed, y up, metres, radians**.
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
//! A camera looks along its own -z with +x right and +y up, as in OpenGL and glTF. Images have
//! row 0 at the top and column 0 at the left. Plan views draw +x to the right and -z upwards, so
//! an agent at yaw 0 looks up the page.

use glam::{Mat3, Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// Transcendental functions from one pure-Rust library, so that every machine computes the same
/// bits. The standard library's versions call whatever the platform brings.
pub mod math {
    pub use libm::{
        acosf as acos, asinf as asin, atan2f as atan2, cosf as cos, expf as exp, hypotf as hypot,
        logf as ln, powf, sinf as sin, tanf as tan,
    };

    /// From here to twice as much, floats are the whole numbers.
    const WHOLE: f32 = 8_388_608.0;

    /// The greatest whole number not above `x`, for 0 <= `x` <= 2^22; any number for any other `x`.
    /// Without the checks of a conversion, so that it suits loops over pixels.
    #[inline]
    pub fn floor_small(x: f32) -> i32 {
        let shifted = x + WHOLE;
        let nearest = shifted.to_bits().wrapping_sub(WHOLE.to_bits()) as i32;
        nearest.wrapping_sub(i32::from(shifted - WHOLE > x))
    }
}

/// The horizontal unit vector that yaw `yaw_rad` looks along.
///
/// ```
/// use chaic_core::geom::forward;
/// assert_eq!(forward(0.0), glam::Vec3::new(-0.0, 0.0, -1.0));
/// assert!((forward(std::f32::consts::FRAC_PI_2).x + 1.0).abs() < 1e-6, "a left turn faces -x");
/// ```
pub fn forward(yaw_rad: f32) -> Vec3 {
    Vec3::new(-math::sin(yaw_rad), 0.0, -math::cos(yaw_rad))
}

/// The horizontal unit vector to the right of yaw `yaw_rad`.
pub fn right(yaw_rad: f32) -> Vec3 {
    Vec3::new(math::cos(yaw_rad), 0.0, -math::sin(yaw_rad))
}

/// The yaw that looks from `from` to `to` (heights are ignored); 0 where both coincide.
pub fn yaw_towards(from: Vec3, to: Vec3) -> f32 {
    let d = to - from;
    if d.x == 0.0 && d.z == 0.0 { 0.0 } else { math::atan2(-d.x, -d.z) }
}

/// The same angle in (-pi, pi].
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

/// The rotation that turns an upright object to `yaw_rad`.
pub fn yaw_rotation(yaw_rad: f32) -> Quat {
    let half = 0.5 * yaw_rad;
    Quat::from_xyzw(0.0, math::sin(half), 0.0, math::cos(half))
}

/// The rotation that lifts the gaze of a level eye by `pitch_rad`.
pub fn pitch_rotation(pitch_rad: f32) -> Quat {
    let half = 0.5 * pitch_rad;
    Quat::from_xyzw(math::sin(half), 0.0, 0.0, math::cos(half))
}

/// Rotates `v` about the vertical by `yaw_rad`.
pub fn rotate_yaw(v: Vec3, yaw_rad: f32) -> Vec3 {
    let (s, c) = (math::sin(yaw_rad), math::cos(yaw_rad));
    Vec3::new(c * v.x + s * v.z, v.y, -s * v.x + c * v.z)
}

/// The horizontal part (x, z) of a point.
pub fn xz(v: Vec3) -> Vec2 {
    Vec2::new(v.x, v.z)
}

/// Distance of two points in plan, heights ignored.
pub fn horizontal_distance(a: Vec3, b: Vec3) -> f32 {
    xz(a).distance(xz(b))
}

/// Where somebody stands and looks: feet on the ground at `position`, facing `yaw_rad`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Pose {
    /// Position of the feet in the world, metres.
    #[schemars(with = "[f32; 3]")]
    pub position: Vec3,
    /// Facing, radians; see the module's figure.
    pub yaw_rad: f32,
}

impl Pose {
    /// The unit vector that this pose looks along.
    pub fn forward(&self) -> Vec3 {
        forward(self.yaw_rad)
    }

    /// A point given in this pose's own frame (x right, y up, -z ahead), in the world.
    pub fn to_world(&self, point_in_body: Vec3) -> Vec3 {
        self.position + rotate_yaw(point_in_body, self.yaw_rad)
    }
}

/// An axis-aligned rectangle in plan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Rect {
    /// Smallest x and z, metres.
    #[schemars(with = "[f32; 2]")]
    pub min: Vec2,
    /// Largest x and z, metres.
    #[schemars(with = "[f32; 2]")]
    pub max: Vec2,
}

impl Rect {
    /// The rectangle that spans two corners given as `[x, z]`.
    pub fn new(min: [f32; 2], max: [f32; 2]) -> Rect {
        Rect { min: Vec2::from(min), max: Vec2::from(max) }
    }

    /// Whether the point (x, z) lies in it, borders included.
    pub fn contains(&self, p: Vec2) -> bool {
        p.x >= self.min.x && p.x <= self.max.x && p.y >= self.min.y && p.y <= self.max.y
    }

    /// The rectangle with every side moved outwards by `margin_m` (inwards if negative).
    pub fn grown(&self, margin_m: f32) -> Rect {
        Rect { min: self.min - margin_m, max: self.max + margin_m }
    }

    /// Extent along x and z, metres.
    pub fn size(&self) -> Vec2 {
        self.max - self.min
    }

    /// Its middle (x, z).
    pub fn center(&self) -> Vec2 {
        0.5 * (self.min + self.max)
    }

    /// Whether two rectangles share any point.
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
    /// Position of the eye in the world, metres.
    pub eye_in_world: Vec3,
    /// Rotates directions from camera to world.
    pub world_from_camera: Quat,
    /// Full vertical angle of view, radians; pixels are square.
    pub vertical_fov_rad: f32,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
}

impl Camera {
    /// Full angle of view of an agent's eye, 90 degrees (facts S10.3).
    pub const EYE_FOV_RAD: f32 = std::f32::consts::FRAC_PI_2;
    /// Nothing nearer than this is seen, metres (original: 0.1).
    pub const NEAR_M: f32 = 0.1;
    /// Depth of a pixel that shows nothing, and the farthest that is drawn, metres (original: 100).
    pub const FAR_M: f32 = 100.0;

    /// Focal length in pixels.
    pub fn focal_px(&self) -> f32 {
        0.5 * self.height as f32 / math::tan(0.5 * self.vertical_fov_rad)
    }

    /// The world point that pixel center (`column`, `row`) shows at `depth_m` along the camera's
    /// axis.
    pub fn unproject(&self, column: u32, row: u32, depth_m: f32) -> Vec3 {
        let f = self.focal_px();
        let x = (column as f32 + 0.5 - 0.5 * self.width as f32) / f;
        let y = -(row as f32 + 0.5 - 0.5 * self.height as f32) / f;
        self.eye_in_world + self.world_from_camera * (Vec3::new(x, y, -1.0) * depth_m)
    }

    /// Continuous pixel coordinates and depth of a world point; `None` behind the near plane.
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

    /// The rotation part as a matrix, for loops over pixels.
    pub fn rotation(&self) -> Mat3 {
        Mat3::from_quat(self.world_from_camera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_PI_2, PI};

    #[test]
    fn small_numbers_are_rounded_as_by_the_library() {
        let steps = (0..40_000).map(|k| k as f32 * 0.0625);
        let near = (1..2000).flat_map(|k| [(k as f32).next_down(), (k as f32).next_up()]);
        for x in steps.chain(near).chain([f32::MIN_POSITIVE, 0.5, 1e-7, 4_194_303.5, 4_194_304.0]) {
            assert_eq!(math::floor_small(x), x.floor() as i32, "{x}");
        }
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
    fn projecting_undoes_unprojecting() {
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
