//! Walls of a floor plan, cut at doorways.

use chaic_core::Vec2;
use chaic_world::Wall;

use super::layout::{DOOR_M, Door, Plan, WALL_M};
use crate::upright_box::mm;

/// Height of rooms, meters.
pub(super) const CEILING_M: f32 = 2.9;
/// Height of doorways, meters.
const LINTEL_M: f32 = 2.1;

impl Plan {
    /// Returns all walls, cut at doorways, with lintels. A wall's box extends half the thickness
    /// beyond its ends, so the ends are moved in by that: boxes do not overlap, and doorways keep
    /// their width.
    pub fn walls(&self, outer_color: [u8; 3], inner_color: [u8; 3]) -> Vec<Wall> {
        let (o, t) = (self.outer, 0.5 * WALL_M);
        let mut walls = Vec::new();
        for (axis, at, from, to) in [
            (1, o.min.y, o.min.x - t, o.max.x + t),
            (1, o.max.y, o.min.x - t, o.max.x + t),
            (0, o.min.x, o.min.y + t, o.max.y - t),
            (0, o.max.x, o.min.y + t, o.max.y - t),
        ] {
            walls.push(wall(axis, at, [from, to], [0.0, CEILING_M], outer_color));
        }
        for c in &self.cuts {
            let on_it = |d: &&Door| {
                d.axis == c.axis && d.at == c.at && d.middle > c.from && d.middle < c.to
            };
            let mut middles: Vec<f32> = self.doors.iter().filter(on_it).map(|d| d.middle).collect();
            middles.sort_by(f32::total_cmp);
            let mut from = c.from + t;
            for middle in middles {
                let (a, b) = (middle - 0.5 * DOOR_M, middle + 0.5 * DOOR_M);
                walls.push(wall(c.axis, c.at, [from, a], [0.0, CEILING_M], inner_color));
                walls.push(wall(c.axis, c.at, [a, b], [LINTEL_M, CEILING_M], inner_color));
                from = b;
            }
            walls.push(wall(c.axis, c.at, [from, c.to - t], [0.0, CEILING_M], inner_color));
        }
        walls
    }
}

fn wall(axis: usize, at: f32, span: [f32; 2], height_m: [f32; 2], color: [u8; 3]) -> Wall {
    let end = |v: f32| {
        let v = mm(v);
        if axis == 0 { Vec2::new(at, v) } else { Vec2::new(v, at) }
    };
    Wall {
        a: end(span[0] + 0.5 * WALL_M),
        b: end(span[1] - 0.5 * WALL_M),
        thickness_m: WALL_M,
        bottom_m: height_m[0],
        top_m: height_m[1],
        color,
    }
}
