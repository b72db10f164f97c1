//! What a camera does to points, for cameras of any kind and any numbers.

use chaic_core::Vec3;
use chaic_core::geom::{Camera, math};
use glam::Mat3;

use crate::mesh::unit;

/// Depth range of plan views, metres: they look down from above everything.
pub(crate) const PLAN_RANGE_M: f32 = 100.0;

/// The depth that an eye sees of a depth: what is farther than it can see is as far as that, metres.
#[inline(always)]
pub(crate) fn seen_depth_m(depth_m: f32) -> f32 {
    if depth_m < Camera::FAR_M { depth_m } else { Camera::FAR_M }
}

/// 1 / x for x from 1e-3 to 1e3, to about one part in 10^7: by multiplications only, which take a
/// third of the time of a division, and alike on every machine.
#[inline(always)]
pub(crate) fn reciprocal(x: f32) -> f32 {
    // A number's bits are nearly its logarithm; each step doubles the digits that are right.
    let y = f32::from_bits(0x7ef3_11c7u32.wrapping_sub(x.to_bits()));
    let y = y * (2.0 - x * y);
    let y = y * (2.0 - x * y);
    y * (2.0 - x * y)
}

/// A camera that is fit for use.
///
/// Inverse depth is what the depth buffer holds: 1 / depth for an eye, which is linear on the image as
/// depth is not; for a plan view, 1 at the camera falling linearly to 0 at [`PLAN_RANGE_M`].
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    /// Width of the image, pixels.
    pub width: usize,
    /// Height of the image, pixels.
    pub height: usize,
    /// Where the eye is in the world, metres.
    pub eye: Vec3,
    /// Unit vector in the world to the right of the image.
    pub right: Vec3,
    /// Unit vector in the world to its top.
    pub up: Vec3,
    /// Unit vector in the world into it.
    pub ahead: Vec3,
    /// Pixels per unit of slope; pixels per metre of a plan view.
    pub focal: f32,
    /// Whether it looks straight down without perspective.
    pub is_plan: bool,
}

impl Lens {
    /// The lens of a camera; `None` if its numbers make no picture (not finite, no pixels, no
    /// angle of view).
    pub fn of(camera: &Camera) -> Option<Lens> {
        let q = camera.world_from_camera;
        let norm2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
        let fov_works = camera.vertical_fov_rad > 0.01 && camera.vertical_fov_rad < 3.1;
        let is_turn = norm2 > 1e-6 && norm2 < 1e6;
        let near = camera.eye_in_world.abs().max_element() < 1e6;
        if !(is_turn && fov_works && near && camera.eye_in_world.is_finite()) {
            return None;
        }
        // A quaternion that isn't quite of length 1 would scale the picture.
        let m = Mat3::from_quat(q);
        let (right, up) = (unit(m.x_axis), unit(m.y_axis));
        let focal = 0.5 * camera.height as f32 / math::tan(0.5 * camera.vertical_fov_rad);
        Some(Lens {
            width: camera.width as usize,
            height: camera.height as usize,
            eye: camera.eye_in_world,
            right,
            up,
            ahead: up.cross(right),
            focal,
            is_plan: false,
        })
    }

    /// A view straight down onto the middle of the image at `eye`, -z up the page.
    pub fn plan(eye: Vec3, px_per_m: f32, width: usize, height: usize) -> Lens {
        let (right, up) = (Vec3::X, Vec3::NEG_Z);
        Lens { width, height, eye, right, up, ahead: Vec3::NEG_Y, focal: px_per_m, is_plan: true }
    }

    /// Middle of the image, pixels.
    pub fn middle(&self) -> (f32, f32) {
        (0.5 * self.width as f32, 0.5 * self.height as f32)
    }

    /// Nearest depth that is drawn.
    pub fn near_m(&self) -> f32 {
        if self.is_plan { 0.0 } else { Camera::NEAR_M }
    }

    /// Farthest depth that is drawn.
    pub fn far_m(&self) -> f32 {
        if self.is_plan { PLAN_RANGE_M } else { Camera::FAR_M }
    }

    /// Inverse depth of a depth.
    pub fn inverse_depth(&self, depth_m: f32) -> f32 {
        if self.is_plan { 1.0 - depth_m / PLAN_RANGE_M } else { 1.0 / depth_m }
    }

    /// Depth of a inverse depth.
    pub fn depth(&self, inverse_depth: f32) -> f32 {
        if self.is_plan { (1.0 - inverse_depth) * PLAN_RANGE_M } else { 1.0 / inverse_depth }
    }

    /// The way from an object's frame, given by the columns of a rotation and an origin, into
    /// this camera.
    pub(crate) fn camera_from(&self, rotation: &Mat3, origin: Vec3) -> IntoCamera {
        let d = origin - self.eye;
        let row = |axis: Vec3| {
            Vec3::new(
                axis.dot(rotation.x_axis),
                axis.dot(rotation.y_axis),
                axis.dot(rotation.z_axis),
            )
        };
        IntoCamera {
            x: row(self.right) * self.focal,
            y: row(-self.up) * self.focal,
            w: row(self.ahead),
            at: Vec3::new(
                self.right.dot(d) * self.focal,
                -self.up.dot(d) * self.focal,
                self.ahead.dot(d),
            ),
        }
    }
}

/// Maps object points to (x, y, w): w is the depth, (x / w, y / w) the offset in pixels from the
/// middle of the image, right and down ((x, y) itself in a plan view).
#[derive(Clone, Copy, Debug)]
pub(crate) struct IntoCamera {
    x: Vec3,
    y: Vec3,
    w: Vec3,
    at: Vec3,
}

impl IntoCamera {
    #[inline]
    pub fn map(&self, p: Vec3) -> Vec3 {
        let dot = |r: Vec3| r.x * p.x + r.y * p.y + r.z * p.z;
        Vec3::new(dot(self.x) + self.at.x, dot(self.y) + self.at.y, dot(self.w) + self.at.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reciprocal_is_one_to_seven_digits() {
        let mut x = 1e-3f32;
        while x < 1e3 {
            let error = f64::from(reciprocal(x)) * f64::from(x) - 1.0;
            assert!(error.abs() < 2.5e-7, "{x}: {error}");
            x *= 1.000_37;
        }
    }
}
