//! Upright boxes in plan: overlaps and distances.

use chaic_core::geom::{Rect, math, rotate_yaw, to_xz};
use chaic_core::{Vec2, Vec3};
use chaic_world::{Block, ObjectSpec, Setup, Wall, blocks_of};
use glam::Vec3Swizzles as _;

/// A box with a vertical axis, prepared for tests in plan.
#[derive(Clone, Copy, Debug)]
pub struct UprightBox {
    pub(crate) middle: Vec2,
    /// Unit vector of the box's x axis, in plan.
    axis_x: Vec2,
    /// Unit vector of the box's z axis, in plan.
    axis_z: Vec2,
    half: Vec2,
    pub(crate) low_m: f32,
    pub(crate) high_m: f32,
}

impl UprightBox {
    fn new(center: Vec3, half: Vec3, yaw_rad: f32) -> UprightBox {
        UprightBox {
            middle: to_xz(center),
            axis_x: rotate_yaw(Vec3::X, yaw_rad).xz(),
            axis_z: rotate_yaw(Vec3::Z, yaw_rad).xz(),
            half: half.xz(),
            low_m: center.y - half.y,
            high_m: center.y + half.y,
        }
    }

    /// Returns the box of a wall: half its thickness longer at both ends, as in the world.
    pub(crate) fn from_wall(wall: &Wall) -> UprightBox {
        let along = wall.b - wall.a;
        let middle = 0.5 * (wall.a + wall.b);
        let half = Vec3::new(
            0.5 * (along.length() + wall.thickness_m),
            0.5 * (wall.top_m - wall.bottom_m),
            0.5 * wall.thickness_m,
        );
        let center = Vec3::new(middle.x, 0.5 * (wall.bottom_m + wall.top_m), middle.y);
        UprightBox::new(center, half, math::atan2(-along.y, along.x))
    }

    /// Converts a box of the world.
    pub fn from_block(b: &Block) -> UprightBox {
        UprightBox::new(b.center, b.half, b.yaw_rad)
    }

    /// Returns the colliding boxes of an object.
    pub fn from_object(object: &ObjectSpec) -> Vec<UprightBox> {
        blocks_of(object).iter().map(UprightBox::from_block).collect()
    }

    /// Returns the boxes of all walls of a setup.
    pub fn from_walls(setup: &Setup) -> Vec<UprightBox> {
        setup.walls.iter().map(UprightBox::from_wall).collect()
    }

    fn local(&self, p: Vec2) -> Vec2 {
        let d = p - self.middle;
        Vec2::new(d.dot(self.axis_x), d.dot(self.axis_z))
    }

    /// Returns the distance in plan from a point; 0 inside.
    pub fn distance(&self, p: Vec2) -> f32 {
        (self.local(p).abs() - self.half).max(Vec2::ZERO).length()
    }

    /// Returns the nearest point in plan.
    pub(crate) fn nearest(&self, p: Vec2) -> Vec2 {
        let l = self.local(p).clamp(-self.half, self.half);
        self.middle + self.axis_x * l.x + self.axis_z * l.y
    }

    /// Returns the smallest axis-aligned rectangle around the box.
    pub fn bounds(&self) -> Rect {
        let reach = self.axis_x.abs() * self.half.x + self.axis_z.abs() * self.half.y;
        Rect { min: self.middle - reach, max: self.middle + reach }
    }

    /// Returns whether the box occupies any height between `low_m` and `high_m`.
    pub fn spans(&self, [low_m, high_m]: [f32; 2]) -> bool {
        self.low_m < high_m && self.high_m > low_m
    }

    /// Returns the penetration depth of two boxes, meters; 0 or less if they are apart.
    pub fn overlap(&self, other: &UprightBox) -> f32 {
        let mut depth = (self.high_m.min(other.high_m)) - (self.low_m.max(other.low_m));
        let d = other.middle - self.middle;
        for axis in [self.axis_x, self.axis_z, other.axis_x, other.axis_z] {
            if depth <= 0.0 {
                break;
            }
            let reach = self.reach_along(axis) + other.reach_along(axis);
            depth = depth.min(reach - d.dot(axis).abs());
        }
        depth
    }

    fn reach_along(&self, axis: Vec2) -> f32 {
        self.axis_x.dot(axis).abs() * self.half.x + self.axis_z.dot(axis).abs() * self.half.y
    }

    /// Returns whether the line segment from `a` to `b` crosses the box in plan.
    pub(crate) fn cuts(&self, a: Vec2, b: Vec2) -> bool {
        let (a, b) = (self.local(a), self.local(b));
        let d = b - a;
        let (mut enter, mut leave) = (0.0f32, 1.0f32);
        for axis in 0..2 {
            if d[axis].abs() < 1e-9 {
                if a[axis].abs() > self.half[axis] {
                    return false;
                }
                continue;
            }
            let t0 = (-self.half[axis] - a[axis]) / d[axis];
            let t1 = (self.half[axis] - a[axis]) / d[axis];
            enter = enter.max(t0.min(t1));
            leave = leave.min(t0.max(t1));
        }
        enter <= leave
    }
}

/// Returns the smallest axis-aligned rectangle around the colliding parts of an object.
pub(crate) fn plan_bounds(object: &ObjectSpec) -> Rect {
    let mut rects = UprightBox::from_object(object).into_iter().map(|s| s.bounds());
    let first =
        rects.next().unwrap_or(Rect { min: to_xz(object.position), max: to_xz(object.position) });
    rects.fold(first, |a, b| Rect { min: a.min.min(b.min), max: a.max.max(b.max) })
}

/// Returns the distance in plan from a point to a rectangle; 0 inside.
pub(crate) fn rect_distance(r: &Rect, p: Vec2) -> f32 {
    (r.min - p).max(p - r.max).max(Vec2::ZERO).length()
}

/// Rounds to the millimeter, so that decimal text represents the value exactly.
pub fn mm(x: f32) -> f32 {
    // Adding zero turns -0 into 0.
    (x * 1000.0).round() / 1000.0 + 0.0
}

/// Rounds a point to the millimeter.
pub fn mm3(p: Vec3) -> Vec3 {
    Vec3::new(mm(p.x), mm(p.y), mm(p.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(x: f32, z: f32, yaw_rad: f32) -> UprightBox {
        UprightBox::new(Vec3::new(x, 0.5, z), Vec3::splat(0.5), yaw_rad)
    }

    #[test]
    fn overlap_is_the_penetration_depth() {
        for (x, yaw, expected) in
            [(0.9, 0.0, 0.1), (1.1, 0.0, -0.1), (1.1, std::f32::consts::FRAC_PI_4, 0.107)]
        {
            let depth = cube(0.0, 0.0, 0.0).overlap(&cube(x, 0.0, yaw));
            assert!((depth - expected).abs() < 1e-3, "{x} {yaw}: {depth}");
        }
    }

    #[test]
    fn lines_cross_boxes_or_miss_them() {
        let c = cube(0.0, 0.0, 0.3);
        assert!(c.cuts(Vec2::new(-2.0, 0.0), Vec2::new(2.0, 0.1)));
        assert!(!c.cuts(Vec2::new(-2.0, 0.0), Vec2::new(-0.8, 0.1)));
        assert!(!c.cuts(Vec2::new(-2.0, 1.0), Vec2::new(2.0, 1.0)));
        assert!((c.distance(Vec2::new(0.0, 3.0)) - 2.375).abs() < 0.1);
    }
}
