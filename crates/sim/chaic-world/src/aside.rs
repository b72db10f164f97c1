//! Choice of a spot for a removed obstacle: it must not block a passage or enclose the agent.

use std::collections::VecDeque;

use chaic_core::capability::Capability;
use chaic_core::geom::{horizontal_distance, math, to_xz};
use chaic_core::{AgentId, EntityId, Vec2, Vec3};

use crate::collide::Body;
use crate::world::World;

/// A spot at this distance from every opening is far enough, meters (our choice, as all values
/// here).
const MAX_OPENING_DISTANCE_M: f32 = 3.0;
/// Maximum distance beyond the nearest possible spot, meters.
const EXTRA_REACH_M: f32 = 1.0;
/// Side length of a cell of the local floor grid, meters.
const CELL_M: f32 = 0.125;
/// Number of cells to each side of the agent: 3 m, so that any spot within reach is clear of the
/// border for any body.
const HALF: i32 = 24;
/// Number of cells per row of the grid.
const SIDE: i32 = 2 * HALF + 1;
/// Small objects whose position is higher than this do not lie on the floor, meters.
const SMALL_OBJECT_M: f32 = 0.3;
/// Maximum number of cells that may be cut off, such as corners, which do not matter.
const MAX_CUT_OFF_CELLS: usize = 8;

impl World {
    /// Returns a spot on free floor within reach and one step, with nothing fixed in between. Of
    /// the spots that cut off no relevant floor for any agent, it is the one farthest from every
    /// opening. If there is none, it is the spot that cuts off the fewest cells, which may be the
    /// initial position of the obstacle.
    pub(crate) fn set_down_spot(&self, agent: AgentId, obstacle: EntityId) -> Vec3 {
        let pose = self.person(agent).pose;
        let size = self.object(obstacle).0.size_m();
        let radius = 0.5 * math::hypot(size.x, size.z);
        let nearest = self.capability(agent).radius_m + radius + 0.05;
        let within_reach = nearest..nearest + EXTRA_REACH_M;
        let middle = to_xz(pose.position);
        let spots = (0..SIDE * SIDE).map(|cell| center(middle, cell));
        let spots = spots.filter(|spot| within_reach.contains(&spot.distance(middle)));
        let spots = spots.map(|spot| Vec3::new(spot.x, 0.0, spot.y));
        let free = |spot: &Vec3| {
            self.is_free_floor(obstacle, *spot)
                && self.has_no_small_object(*spot, radius)
                && self.is_open_between(middle, to_xz(*spot), size.y)
        };
        let with_opening_distance =
            |p: Vec3| (p, self.setup.distance_to_opening(p).min(MAX_OPENING_DISTANCE_M));
        let mut spots: Vec<_> = spots.filter(free).map(with_opening_distance).collect();
        spots.sort_by(|a, b| b.1.total_cmp(&a.1));
        let initial = self.object(obstacle).0.position;
        let is_clear_of_agents =
            |p| self.discs().iter().all(|d| d.center.distance(to_xz(p)) > d.radius_m + radius);
        let is_near = to_xz(initial).distance(middle) <= self.rules.reach_limit_m + radius;
        if is_near && is_clear_of_agents(initial) && self.is_free_for(obstacle, initial, radius) {
            spots.push(with_opening_distance(initial));
        }
        let spaces: Vec<_> =
            self.setup.agents().map(|a| FreeSpace::around(self, a, middle)).collect();
        let mut best: Option<(usize, Vec3)> = None;
        for (spot, _) in spots {
            let lost = spaces.iter().map(|space| space.cut_off(to_xz(spot), radius)).sum();
            if best.is_none_or(|(min_lost, _)| lost < min_lost) {
                best = Some((lost, spot));
            }
            if lost <= MAX_CUT_OFF_CELLS {
                break;
            }
        }
        best.map_or_else(|| self.floor_spot_beside(agent, obstacle), |(_, spot)| spot)
    }

    /// Returns whether no small object lies on the floor within `radius_m` of a spot.
    fn has_no_small_object(&self, spot: Vec3, radius_m: f32) -> bool {
        self.setup.entities().all(|e| {
            let (spec, state) = self.object(e);
            let lies_on_floor = state.is_resting()
                && spec.class.info().is_carriable()
                && (state.position.y - spot.y).abs() < SMALL_OBJECT_M;
            let clear_m = radius_m + spec.half_longer_side_m();
            !lies_on_floor || horizontal_distance(state.position, spot) > clear_m
        })
    }

    /// Returns whether no wall or other fixed object is between two points, up to this height.
    fn is_open_between(&self, from: Vec2, to: Vec2, high_m: f32) -> bool {
        let arm = Body { radius_m: 0.5 * CELL_M, low_m: self.rules.step_over_m, high_m };
        let steps = (from.distance(to) / CELL_M).ceil();
        let mut along = (0..=steps as i32).map(|step| from.lerp(to, step as f32 / steps));
        along.all(|p| self.block_index.overlap(arm, p, &[], &[]) <= 0.0)
    }
}

/// Cells around a point in which a body fits, ignoring other agents.
struct FreeSpace {
    middle: Vec2,
    body_m: f32,
    /// True if the body fits in each cell, row by row.
    fits: Vec<bool>,
    /// True if each cell is reachable from the center.
    reached: Vec<bool>,
}

impl FreeSpace {
    fn around(world: &World, agent: AgentId, middle: Vec2) -> FreeSpace {
        let Capability { radius_m, height_m, .. } = world.capability(agent);
        let body = Body { radius_m, low_m: world.rules.step_over_m, high_m: height_m };
        let bounds = world.setup.bounds.expanded(-radius_m);
        let movable = world.movable_blocks();
        let fits = |p: Vec2| {
            bounds.contains(p) && world.block_index.overlap(body, p, &movable, &[]) <= 0.0
        };
        let cells = (0..SIDE * SIDE).map(|cell| fits(center(middle, cell)));
        let mut space =
            FreeSpace { middle, body_m: radius_m, fits: cells.collect(), reached: Vec::new() };
        space.reached = space.flood(|_| true);
        space
    }

    /// Returns the number of reachable cells that become unreachable with an object of this radius
    /// at `p`.
    fn cut_off(&self, p: Vec2, radius_m: f32) -> usize {
        let clear_m = radius_m + self.body_m;
        let is_clear = |cell: i32| center(self.middle, cell).distance(p) > clear_m;
        let reached = self.flood(is_clear);
        let lost = |cell: &i32| {
            self.reached[*cell as usize] && !reached[*cell as usize] && is_clear(*cell)
        };
        (0..SIDE * SIDE).filter(lost).count()
    }

    /// Returns the cells that are reachable from the open cell nearest to the center.
    fn flood(&self, is_clear: impl Fn(i32) -> bool) -> Vec<bool> {
        let is_open = |cell: i32| self.fits[cell as usize] && is_clear(cell);
        let mut reached = vec![false; self.fits.len()];
        let distance_m = |cell: &i32| center(Vec2::ZERO, *cell).length();
        let open = (0..SIDE * SIDE).filter(|cell| is_open(*cell));
        let Some(start) = open.min_by(|a, b| distance_m(a).total_cmp(&distance_m(b))) else {
            return reached;
        };
        reached[start as usize] = true;
        let mut queue = VecDeque::from([start]);
        while let Some(cell) = queue.pop_front() {
            let (i, j) = (cell % SIDE, cell / SIDE);
            let neighbors = [(i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)];
            let inside = neighbors
                .into_iter()
                .filter(|(i, j)| (0..SIDE).contains(i) && (0..SIDE).contains(j));
            for next in inside.map(|(i, j)| j * SIDE + i) {
                if is_open(next) && !std::mem::replace(&mut reached[next as usize], true) {
                    queue.push_back(next);
                }
            }
        }
        reached
    }
}

/// Returns the center of a cell of the grid around `middle`.
fn center(middle: Vec2, cell: i32) -> Vec2 {
    middle + CELL_M * Vec2::new((cell % SIDE - HALF) as f32, (cell / SIDE - HALF) as f32)
}
