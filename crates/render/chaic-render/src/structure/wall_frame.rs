//! Frames and intervals of walls.

use chaic_core::{Vec2, Vec3};
use chaic_world::Wall;
use glam::Mat3;

use crate::mesh::OrientedBox;

/// Frame of a wall: x along it, y up, z perpendicular to it.
#[derive(Clone, Copy)]
pub(crate) struct WallFrame {
    pub center: Vec2,
    pub axis: Vec2,
    /// Half of its length and of its thickness, meters.
    pub half: Vec2,
}

impl WallFrame {
    /// Collision box of a wall, which overlaps its neighbors by half of its thickness.
    pub fn new(wall: &Wall) -> WallFrame {
        let along = wall.b - wall.a;
        let length = (along.x * along.x + along.y * along.y).sqrt();
        let axis = if length > 1e-6 { along / length } else { Vec2::X };
        let half = 0.5 * Vec2::new(length + wall.thickness_m, wall.thickness_m);
        WallFrame { center: 0.5 * (wall.a + wall.b), axis, half }
    }

    /// Returns the point `x` along the wall and `z` off its center line.
    pub fn point(&self, x: f32, z: f32) -> Vec2 {
        self.center + self.axis * x + Vec2::new(-self.axis.y, self.axis.x) * z
    }

    pub fn axes(&self) -> Mat3 {
        let a = self.axis;
        Mat3::from_cols(Vec3::new(a.x, 0.0, a.y), Vec3::Y, Vec3::new(-a.y, 0.0, a.x))
    }

    /// Returns a box with its center at (x, y, z) in the wall frame.
    pub fn obb(&self, center: [f32; 3], extent: [f32; 3]) -> OrientedBox {
        let p = self.point(center[0], center[2]);
        let center = Vec3::new(p.x, center[1], p.y);
        OrientedBox { center, axes: self.axes(), extent: Vec3::from(extent) }
    }
}

/// Interval on one side of a wall that belongs to one room or to none.
#[derive(Clone, Copy)]
pub(super) struct WallInterval {
    pub from: f32,
    pub to: f32,
    /// 1 for the side toward +z of the wall, -1 for the other side.
    pub side: f32,
    pub room: Option<usize>,
}
