//! What is linear on the image: rays, and quantities over a triangle.
//!
//! A quantity that is linear over a triangle, at the point seen at depth w in the pixel with
//! middle (u, v), is `base + w * (at + u * du + v * dv)`: the point is the eye plus w times a ray
//! that is linear in (u, v). Nothing is divided, and corners behind the eye do no harm.

use chaic_core::Vec3;
use glam::Vec4;

use crate::frame::Instance;
use crate::lens::Lens;

/// Quantities that are linear over a triangle, one in each lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Plane {
    pub base: Vec4,
    pub at: Vec4,
    pub du: Vec4,
    pub dv: Vec4,
}

impl Plane {
    /// The quantities along a row of pixels whose middles lie at `v`, from the pixel `first`.
    #[inline(always)]
    pub fn from(&self, first: usize, v: f32) -> RowPlane {
        let at = self.at + self.dv * v + self.du * (first as f32 + 0.5);
        RowPlane { base: self.base, at, du: self.du }
    }

    /// `start` where `s` and `t` are 0, growing by `ds` with s and `dt` with t; `s` and `t` are
    /// planes of one quantity each: (base, at, du, dv).
    pub fn mixed(start: Vec4, (ds, s): (Vec4, Vec4), (dt, t): (Vec4, Vec4)) -> Plane {
        Plane {
            base: start + ds * s.x + dt * t.x,
            at: ds * s.y + dt * t.y,
            du: ds * s.z + dt * t.z,
            dv: ds * s.w + dt * t.w,
        }
    }
}

/// A [`Plane`] on one row: `base + w * (at + k * du)` k pixels after the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowPlane {
    pub base: Vec4,
    pub at: Vec4,
    pub du: Vec4,
}

/// The rays of a view in some frame: from `eye + u * eye_u + v * eye_v` along
/// `ray + u * ray_u + v * ray_v`, one metre deep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rays {
    pub eye: [Vec3; 3],
    pub ray: [Vec3; 3],
}

impl Rays {
    /// In the world.
    pub fn of(lens: &Lens) -> Rays {
        let (mu, mv) = lens.middle();
        let per_px = 1.0 / lens.focal;
        let (u, v) = (lens.right * per_px, -lens.up * per_px);
        let corner = -(u * mu) - v * mv;
        if lens.is_plan {
            Rays { eye: [lens.eye + corner, u, v], ray: [lens.ahead, Vec3::ZERO, Vec3::ZERO] }
        } else {
            Rays { eye: [lens.eye, Vec3::ZERO, Vec3::ZERO], ray: [lens.ahead + corner, u, v] }
        }
    }

    /// The point seen in the pixel with middle (u, v) at a depth, and the ray there.
    #[inline(always)]
    pub fn point(&self, u: f32, v: f32, depth_m: f32) -> (Vec3, Vec3) {
        let ray = self.ray[0] + self.ray[1] * u + self.ray[2] * v;
        (self.eye[0] + self.eye[1] * u + self.eye[2] * v + ray * depth_m, ray)
    }

    /// The same in the frame of an instance.
    pub fn within(&self, instance: &Instance) -> Rays {
        let r = &instance.rotation;
        let turn = |p: Vec3| Vec3::new(r.x_axis.dot(p), r.y_axis.dot(p), r.z_axis.dot(p));
        let [eye, u, v] = self.eye;
        Rays { eye: [turn(eye - instance.origin), turn(u), turn(v)], ray: self.ray.map(turn) }
    }
}
