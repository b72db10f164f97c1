//! View rays, and quantities that are linear over a triangle.
//!
//! Such a quantity has the value `base + w * (at + u * du + v * dv)`. Here, w is the depth and (u, v)
//! is the pixel center. The surface point is the eye plus w times a ray that is linear in (u, v). No
//! division is needed, and vertices behind the eye cause no problem.

use chaic_core::Vec3;
use glam::Vec4;

use crate::projection::Projection;
use crate::scene_frame::Instance;

/// Quantities that are linear over a triangle, one in each lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Plane {
    pub base: Vec4,
    pub at: Vec4,
    pub du: Vec4,
    pub dv: Vec4,
}

impl Plane {
    /// Restricts the quantities to a row of pixels with centers at `v`, from pixel `first`.
    #[inline(always)]
    pub fn at_row(&self, first: usize, v: f32) -> RowPlane {
        let at = self.at + self.dv * v + self.du * (first as f32 + 0.5);
        RowPlane { base: self.base, at, du: self.du }
    }

    /// Plane of `start + ds * s + dt * t`, where `s` and `t` are planes of one quantity each:
    /// (base, at, du, dv).
    pub fn combine(start: Vec4, ds: Vec4, s: Vec4, dt: Vec4, t: Vec4) -> Plane {
        Plane {
            base: start + ds * s.x + dt * t.x,
            at: ds * s.y + dt * t.y,
            du: ds * s.z + dt * t.z,
            dv: ds * s.w + dt * t.w,
        }
    }
}

/// A [`Plane`] on one row: `base + w * (at + k * du)`, k pixels after the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowPlane {
    pub base: Vec4,
    pub at: Vec4,
    pub du: Vec4,
}

/// View rays in some frame: from `eye + u * eye_u + v * eye_v` along `ray + u * ray_u + v * ray_v`.
/// A ray has a depth of one meter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rays {
    pub eye: [Vec3; 3],
    pub ray: [Vec3; 3],
}

impl Rays {
    /// Rays in the world frame.
    pub fn from_projection(projection: &Projection) -> Rays {
        let (mu, mv) = projection.center();
        let per_px = 1.0 / projection.focal;
        let (u, v) = (projection.right * per_px, -projection.up * per_px);
        let corner = -(u * mu) - v * mv;
        if projection.is_plan {
            Rays {
                eye: [projection.eye + corner, u, v],
                ray: [projection.forward, Vec3::ZERO, Vec3::ZERO],
            }
        } else {
            Rays {
                eye: [projection.eye, Vec3::ZERO, Vec3::ZERO],
                ray: [projection.forward + corner, u, v],
            }
        }
    }

    /// Returns the point at pixel center (u, v) at a depth, and the ray there.
    #[inline(always)]
    pub fn point(&self, u: f32, v: f32, depth_m: f32) -> (Vec3, Vec3) {
        let ray = self.ray[0] + self.ray[1] * u + self.ray[2] * v;
        (self.eye[0] + self.eye[1] * u + self.eye[2] * v + ray * depth_m, ray)
    }

    /// Transforms the rays into the frame of an instance.
    pub fn in_object_frame(&self, instance: &Instance) -> Rays {
        let r = &instance.rotation;
        let rotate = |p: Vec3| Vec3::new(r.x_axis.dot(p), r.y_axis.dot(p), r.z_axis.dot(p));
        let [eye, u, v] = self.eye;
        Rays {
            eye: [rotate(eye - instance.origin), rotate(u), rotate(v)],
            ray: self.ray.map(rotate),
        }
    }
}
