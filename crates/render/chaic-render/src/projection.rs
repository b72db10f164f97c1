//! Camera projection: validation, basis vectors, and the transform from object space to pixels.

use chaic_core::Vec3;
use chaic_core::geom::{Camera, math};
use glam::Mat3;

use crate::mesh::unit;

/// Depth range of plan views, meters. The plan camera is above everything.
pub(crate) const PLAN_RANGE_M: f32 = 100.0;

/// Clamps a depth to the maximum depth of a camera, meters.
#[inline(always)]
pub(crate) fn clamp_depth_m(depth_m: f32) -> f32 {
    if depth_m < Camera::FAR_M { depth_m } else { Camera::FAR_M }
}

/// Approximates 1 / x for x from 1e-3 to 1e3, with a relative error of about 1e-7. It uses
/// multiplications only, takes a third of the time of a division, and gives the same bits on every
/// machine.
#[inline(always)]
pub(crate) fn reciprocal(x: f32) -> f32 {
    // The bit pattern of a float approximates its logarithm. Each Newton step doubles the number of
    // correct digits.
    let y = f32::from_bits(0x7ef3_11c7u32.wrapping_sub(x.to_bits()));
    let y = y * (2.0 - x * y);
    let y = y * (2.0 - x * y);
    y * (2.0 - x * y)
}

/// Projection of a valid camera.
///
/// The depth buffer stores inverse depth. For a perspective camera, it is 1 / depth, which is
/// linear in image space. For a plan view, it falls linearly from 1 at the camera to 0 at
/// [`PLAN_RANGE_M`].
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// Image width, pixels.
    pub width: usize,
    /// Image height, pixels.
    pub height: usize,
    /// Eye position in the world, meters.
    pub eye: Vec3,
    /// Unit vector in the world to the right of the image.
    pub right: Vec3,
    /// Unit vector in the world to the top of the image.
    pub up: Vec3,
    /// Unit vector in the world along the viewing direction.
    pub forward: Vec3,
    /// Focal length, pixels; pixels per meter in a plan view.
    pub focal: f32,
    /// True if the camera looks straight down with an orthographic projection.
    pub is_plan: bool,
}

impl Projection {
    /// Projection of a camera; `None` if the camera is invalid (not finite, or without pixels or
    /// field of view).
    pub fn from_camera(camera: &Camera) -> Option<Projection> {
        let q = camera.world_from_camera;
        let norm_squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
        let is_fov_valid = camera.vertical_fov_rad > 0.01 && camera.vertical_fov_rad < 3.1;
        let is_rotation = norm_squared > 1e-6 && norm_squared < 1e6;
        let is_near_origin = camera.eye_in_world.abs().max_element() < 1e6;
        if !(is_rotation && is_fov_valid && is_near_origin && camera.eye_in_world.is_finite()) {
            return None;
        }
        // A quaternion that is not exactly normalized would scale the image.
        let m = Mat3::from_quat(q);
        let (right, up) = (unit(m.x_axis), unit(m.y_axis));
        let focal = 0.5 * camera.height as f32 / math::tan(0.5 * camera.vertical_fov_rad);
        Some(Projection {
            width: camera.width as usize,
            height: camera.height as usize,
            eye: camera.eye_in_world,
            right,
            up,
            forward: up.cross(right),
            focal,
            is_plan: false,
        })
    }

    /// Orthographic projection that looks straight down on `eye`, with -z at the top of the image.
    pub fn plan(eye: Vec3, px_per_m: f32, width: usize, height: usize) -> Projection {
        let (right, up) = (Vec3::X, Vec3::NEG_Z);
        Projection {
            width,
            height,
            eye,
            right,
            up,
            forward: Vec3::NEG_Y,
            focal: px_per_m,
            is_plan: true,
        }
    }

    /// Image center, pixels.
    pub fn center(&self) -> (f32, f32) {
        (0.5 * self.width as f32, 0.5 * self.height as f32)
    }

    /// Depth of the near plane, meters.
    pub fn near_m(&self) -> f32 {
        if self.is_plan { 0.0 } else { Camera::NEAR_M }
    }

    /// Depth of the far plane, meters.
    pub fn far_m(&self) -> f32 {
        if self.is_plan { PLAN_RANGE_M } else { Camera::FAR_M }
    }

    /// Converts a depth to an inverse depth.
    pub fn inverse_depth(&self, depth_m: f32) -> f32 {
        if self.is_plan { 1.0 - depth_m / PLAN_RANGE_M } else { 1.0 / depth_m }
    }

    /// Converts an inverse depth to a depth.
    pub fn depth(&self, inverse_depth: f32) -> f32 {
        if self.is_plan { (1.0 - inverse_depth) * PLAN_RANGE_M } else { 1.0 / inverse_depth }
    }

    /// Transform from an object frame into this camera. The object frame is given by a rotation and
    /// an origin.
    pub(crate) fn camera_from(&self, rotation: &Mat3, origin: Vec3) -> CameraTransform {
        let d = origin - self.eye;
        let row = |axis: Vec3| {
            Vec3::new(
                axis.dot(rotation.x_axis),
                axis.dot(rotation.y_axis),
                axis.dot(rotation.z_axis),
            )
        };
        CameraTransform {
            x: row(self.right) * self.focal,
            y: row(-self.up) * self.focal,
            w: row(self.forward),
            offset: Vec3::new(
                self.right.dot(d) * self.focal,
                -self.up.dot(d) * self.focal,
                self.forward.dot(d),
            ),
        }
    }
}

/// Maps object points to (x, y, w). w is the depth, and (x / w, y / w) is the offset in pixels from
/// the image center, right and down. In a plan view, (x, y) is the offset itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraTransform {
    x: Vec3,
    y: Vec3,
    w: Vec3,
    offset: Vec3,
}

impl CameraTransform {
    #[inline]
    pub fn map(&self, p: Vec3) -> Vec3 {
        let dot = |r: Vec3| r.x * p.x + r.y * p.y + r.z * p.z;
        Vec3::new(
            dot(self.x) + self.offset.x,
            dot(self.y) + self.offset.y,
            dot(self.w) + self.offset.z,
        )
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
