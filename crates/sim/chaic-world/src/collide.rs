//! Collision of upright bodies with each other and with the surroundings.
//!
//! A body is an upright cylinder, and everything else an upright box or another cylinder, so the
//! problem is two-dimensional. A step of one frame is at most as long as the radius of the body.
//! The body is moved and then pushed out of all overlaps, so it slides along obstacles at an angle
//! and stops at frontal contact.

use chaic_core::geom::{Rect, to_xz};
use chaic_core::{Vec2, Vec3};

use crate::shape::Block;

/// Fixed boxes in a uniform grid.
#[derive(Clone, Debug)]
pub(crate) struct BlockIndex {
    blocks: Vec<Block>,
    bounds: Rect,
    columns: usize,
    rows: usize,
    /// Range of `members` for each cell.
    cells: Vec<(u32, u32)>,
    members: Vec<u32>,
}

/// Circle that another agent occupies in plan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disc {
    pub center: Vec2,
    pub radius_m: f32,
}

/// A moving upright cylinder.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    pub radius_m: f32,
    /// Obstacles below this height are stepped over, meters.
    pub low_m: f32,
    pub high_m: f32,
}

impl Body {
    /// Returns whether this body touches a box while it stands at `p`.
    pub fn touches(&self, block: &Block, p: Vec2) -> bool {
        let [low, high] = block.y_range();
        let (nearest, inside) = block.nearest_in_plan(Vec3::new(p.x, 0.0, p.y));
        high > self.low_m
            && low < self.high_m
            && (inside || p.distance(to_xz(nearest)) < self.radius_m)
    }
}

/// Side length of a grid cell, meters: a body and its step touch at most four cells.
const CELL_M: f32 = 1.0;
/// Maximum radius of a body for which each cell lists its boxes, meters: that of a person
/// (`Setup::check`). Larger bodies, which are scaled objects, are compared with all boxes.
const MAX_LISTED_RADIUS_M: f32 = 1.0;
/// Maximum number of push-out iterations; a corner needs two, a narrow gap a few more.
const MAX_ITERATIONS: usize = 4;
/// Overlap that is ignored, meters.
const TOLERANCE_M: f32 = 1e-3;

impl BlockIndex {
    pub fn new(blocks: Vec<Block>, bounds: Rect) -> BlockIndex {
        let bounds = bounds.expanded(CELL_M);
        let size = bounds.size();
        let columns = (size.x / CELL_M).ceil().max(1.0) as usize;
        let rows = (size.y / CELL_M).ceil().max(1.0) as usize;
        let mut lists = vec![Vec::new(); columns * rows];
        let margin = MAX_LISTED_RADIUS_M;
        for (i, block) in blocks.iter().enumerate() {
            let (c, r) = (to_xz(block.center), block.plan_radius() + margin);
            let cell = |v: f32, low: f32, n: usize| {
                (((v - low) / CELL_M).floor().max(0.0) as usize).min(n - 1)
            };
            let columns_touched =
                cell(c.x - r, bounds.min.x, columns)..=cell(c.x + r, bounds.min.x, columns);
            let rows_touched =
                cell(c.y - r, bounds.min.y, rows)..=cell(c.y + r, bounds.min.y, rows);
            for row in rows_touched {
                for column in columns_touched.clone() {
                    let middle =
                        bounds.min + Vec2::new(column as f32 + 0.5, row as f32 + 0.5) * CELL_M;
                    let (nearest, _) = block.nearest_in_plan(Vec3::new(middle.x, 0.0, middle.y));
                    if to_xz(nearest).distance(middle) <= 0.71 * CELL_M + margin {
                        lists[row * columns + column].push(i as u32);
                    }
                }
            }
        }
        let mut cells = Vec::with_capacity(lists.len());
        let mut members = Vec::new();
        for list in lists {
            let start = members.len() as u32;
            members.extend(list);
            cells.push((start, members.len() as u32));
        }
        BlockIndex { blocks, bounds, columns, rows, cells, members }
    }

    /// Returns the boxes that a body of this radius at `p` could touch.
    pub fn near(&self, p: Vec2, radius_m: f32) -> impl Iterator<Item = &Block> {
        let cell = ((p - self.bounds.min) / CELL_M).floor();
        let column = (cell.x.max(0.0) as usize).min(self.columns - 1);
        let row = (cell.y.max(0.0) as usize).min(self.rows - 1);
        let is_listed = radius_m <= MAX_LISTED_RADIUS_M;
        let (start, end) = if is_listed { self.cells[row * self.columns + column] } else { (0, 0) };
        let all: &[Block] = if is_listed { &[] } else { &self.blocks };
        let listed = &self.members[start as usize..end as usize];
        listed.iter().map(|i| &self.blocks[*i as usize]).chain(all)
    }

    /// Returns all boxes.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Returns the final position of a body that moves from `from` toward `to`, less than its
    /// radius away.
    pub fn slide(
        &self,
        body: Body,
        from: Vec2,
        to: Vec2,
        movable: &[Block],
        people: &[Disc],
    ) -> Vec2 {
        let inner = self.bounds.expanded(-CELL_M);
        let mut p = to.clamp(inner.min, inner.max);
        for _ in 0..MAX_ITERATIONS {
            let (pushed, overlap) = self.push_out(body, p, movable, people);
            if overlap <= TOLERANCE_M {
                return p;
            }
            p = pushed.clamp(inner.min, inner.max);
        }
        let remaining = self.push_out(body, p, movable, people).1;
        // No free position was found: stay, unless `from` has the larger overlap.
        if remaining <= TOLERANCE_M || remaining < self.push_out(body, from, movable, people).1 {
            p
        } else {
            from
        }
    }

    /// Returns the maximum overlap of a body at `p`, meters.
    pub fn overlap(&self, body: Body, p: Vec2, movable: &[Block], people: &[Disc]) -> f32 {
        self.push_out(body, p, movable, people).1
    }

    /// Pushes a position out of all obstacles in turn. Returns it with the maximum overlap on the
    /// way.
    fn push_out(&self, body: Body, p: Vec2, movable: &[Block], people: &[Disc]) -> (Vec2, f32) {
        let mut at = p;
        let mut deepest: f32 = 0.0;
        for block in self.near(p, body.radius_m).chain(movable) {
            let [low, high] = block.y_range();
            if high <= body.low_m || low >= body.high_m {
                continue;
            }
            let (nearest, inside) = block.nearest_in_plan(Vec3::new(at.x, 0.0, at.y));
            let away = at - to_xz(nearest);
            let distance = away.length();
            // Rounding can put a point on the edge of a turned box, but not inside.
            if inside || distance == 0.0 {
                let (out, depth) = shortest_way_out(block, at);
                deepest = deepest.max(depth + body.radius_m);
                at += out * (depth + body.radius_m);
            } else if distance < body.radius_m {
                deepest = deepest.max(body.radius_m - distance);
                at += away * ((body.radius_m - distance) / distance);
            }
        }
        for disc in people {
            let away = at - disc.center;
            let (distance, min_distance) = (away.length(), body.radius_m + disc.radius_m);
            if distance < min_distance {
                deepest = deepest.max(min_distance - distance);
                let direction = if distance > 1e-6 { away / distance } else { Vec2::X };
                at += direction * (min_distance - distance);
            }
        }
        (at, deepest)
    }
}

/// Returns the direction and the length of the shortest way out of a box, for a point inside.
fn shortest_way_out(block: &Block, p: Vec2) -> (Vec2, f32) {
    let d = Vec3::new(p.x - block.center.x, 0.0, p.y - block.center.z);
    let local = chaic_core::geom::rotate_yaw(d, -block.yaw_rad);
    let (dx, dz) = (block.half.x - local.x.abs(), block.half.z - local.z.abs());
    let direction = if dx < dz {
        Vec3::new(if local.x < 0.0 { -1.0 } else { 1.0 }, 0.0, 0.0)
    } else {
        Vec3::new(0.0, 0.0, if local.z < 0.0 { -1.0 } else { 1.0 })
    };
    (to_xz(chaic_core::geom::rotate_yaw(direction, block.yaw_rad)), dx.min(dz))
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::EntityId;

    const WALKER: Body = Body { radius_m: 0.2, low_m: 0.12, high_m: 1.75 };
    const WHEELCHAIR: Body = Body { radius_m: 0.35, low_m: 0.12, high_m: 1.35 };

    fn block(center: [f32; 3], half: [f32; 3]) -> Block {
        Block { center: center.into(), half: half.into(), yaw_rad: 0.0, entity: EntityId::WALL }
    }

    /// A wall along x at z = 0 with a doorway of 1.2 m around x = 0, and a bin 0.48 m wide in it.
    fn doorway() -> BlockIndex {
        let walls = vec![
            block([-2.6, 1.5, 0.0], [2.0, 1.5, 0.06]),
            block([2.6, 1.5, 0.0], [2.0, 1.5, 0.06]),
            block([0.3, 0.28, 0.0], [0.24, 0.28, 0.24]),
        ];
        BlockIndex::new(walls, Rect::new([-5.0, -5.0], [5.0, 5.0]))
    }

    fn walk(s: &BlockIndex, body: Body, from: Vec2, direction: Vec2, steps: usize) -> Vec2 {
        (0..steps).fold(from, |p, _| s.slide(body, p, p + 0.047 * direction, &[], &[]))
    }

    #[test]
    fn a_partly_blocked_doorway_stops_a_wheelchair_and_lets_a_walker_through() {
        let s = doorway();
        let from = Vec2::new(-0.25, 2.0);
        assert!(walk(&s, WALKER, from, Vec2::NEG_Y, 80).y < -1.0);
        assert!(walk(&s, WHEELCHAIR, from, Vec2::NEG_Y, 80).y > 0.2);
    }

    #[test]
    fn a_wall_stops_frontal_motion_and_allows_sliding() {
        let s = doorway();
        let p = walk(&s, WALKER, Vec2::new(2.0, 1.0), Vec2::NEG_Y, 100);
        assert!((p.y - 0.26).abs() < 2e-3 && (p.x - 2.0).abs() < 1e-3, "{p}");
        let p = walk(&s, WALKER, Vec2::new(2.0, 0.3), Vec2::new(0.8, -0.6), 40);
        assert!(p.x > 3.2 && p.y > 0.25, "{p}");
    }

    #[test]
    fn agents_do_not_pass_through_agents_or_bounds() {
        let s = doorway();
        let other = Disc { center: Vec2::new(0.0, 2.0), radius_m: 0.2 };
        let mut p = Vec2::new(0.0, 3.0);
        for _ in 0..60 {
            p = s.slide(WALKER, p, p + Vec2::new(0.0, -0.047), &[], &[other]);
            assert!(p.distance(other.center) > 0.398, "{p}");
        }
        assert!(walk(&s, WALKER, Vec2::new(4.0, 3.0), Vec2::X, 200).x <= 5.0);
    }

    #[test]
    fn a_body_inside_a_turned_box_leaves_it_by_the_shortest_way() {
        let turned = Block { yaw_rad: 0.6, ..block([0.0, 0.5, 0.0], [1.0, 0.5, 0.3]) };
        let index = BlockIndex::new(vec![turned], Rect::new([-5.0, -5.0], [5.0, 5.0]));
        let to_world = |x: f32, z: f32| {
            to_xz(chaic_core::geom::rotate_yaw(Vec3::new(x, 0.0, z), turned.yaw_rad))
        };
        for (inside, outside) in [([0.3, 0.2], [0.3, 0.5]), ([0.3, -0.2], [0.3, -0.5])] {
            let from = to_world(inside[0], inside[1]);
            let at = index.slide(WALKER, from, from, &[], &[]);
            let expected = to_world(outside[0], outside[1]);
            assert!(at.distance(expected) < 2e-3, "{at} instead of {expected}");
        }
    }

    #[test]
    fn a_body_centered_on_the_edge_of_a_turned_box_has_a_position() {
        let bounds = Rect::new([-5.0, -5.0], [5.0, 5.0]);
        for k in 0..400 {
            let turned =
                Block { yaw_rad: 0.013 * k as f32, ..block([0.7, 0.5, -0.3], [1.0, 0.5, 0.3]) };
            let far = Vec3::new(3.0, 0.0, -4.0 + 0.02 * k as f32);
            let edge = to_xz(turned.nearest_in_plan(far).0);
            let index = BlockIndex::new(vec![turned], bounds);
            let at = index.slide(WALKER, edge, edge, &[], &[]);
            assert!(at.is_finite() && at.distance(edge) < 1.0, "{at} from {edge}");
        }
    }

    #[test]
    fn large_bodies_touch_distant_boxes() {
        let index = BlockIndex::new(
            vec![block([3.5, 0.5, 0.5], [0.1, 0.5, 0.1])],
            Rect::new([-5.0, -5.0], [5.0, 5.0]),
        );
        let p = Vec2::new(0.5, 0.5);
        for (radius_m, expected) in [(0.2, 0.0), (2.8, 0.0), (3.0, 0.1), (3.4, 0.5)] {
            let overlap = index.overlap(Body { radius_m, ..WALKER }, p, &[], &[]);
            assert!((overlap - expected).abs() < 1e-4, "{radius_m}: {overlap}");
        }
    }

    #[test]
    fn low_obstacles_are_stepped_over() {
        let rug = BlockIndex::new(
            vec![block([0.0, 0.05, 0.0], [1.0, 0.05, 1.0])],
            Rect::new([-5.0, -5.0], [5.0, 5.0]),
        );
        assert!(walk(&rug, WALKER, Vec2::new(0.0, 2.0), Vec2::NEG_Y, 100).y < -2.0);
    }
}
