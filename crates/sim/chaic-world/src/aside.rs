//! Where an obstacle is put aside: not where it closes a way, or walls in who puts it there.

use std::collections::VecDeque;

use chaic_core::capability::Capability;
use chaic_core::geom::{math, xz};
use chaic_core::{AgentId, EntityId, Vec2, Vec3};

use crate::collide::Body;
use crate::world::World;

/// A place this far from every doorway is far enough, metres (ours, as all here).
const FAR_M: f32 = 3.0;
/// It is put no farther off than this from where arms reach without a step, metres.
const STEP_M: f32 = 1.0;
/// Side of a cell of the floor around a person, metres.
const CELL_M: f32 = 0.125;
/// Cells to each side of the person: 3 m, so that what is put at arm's length and a step is clear
/// of the border by any body.
const HALF: i32 = 24;
const SIDE: i32 = 2 * HALF + 1;
/// So many cells may be cut off: corners in which nobody has anything to do.
const CUT_OFF: usize = 8;

impl World {
    /// On free floor within an arm and a step, nothing fixed in between: as far from every doorway
    /// as can be, where everybody still gets everywhere; or else where the least is cut off, which
    /// may be where it stood at the beginning.
    pub(crate) fn spot_aside(&self, agent: AgentId, obstacle: EntityId) -> Vec3 {
        let pose = self.person(agent).pose;
        let size = self.thing(obstacle).0.size_m();
        let radius = 0.5 * math::hypot(size.x, size.z);
        let nearest = self.capability(agent).radius_m + radius + 0.05;
        let within_reach = nearest..nearest + STEP_M;
        let middle = xz(pose.position);
        let spots = (0..SIDE * SIDE).map(|cell| center(middle, cell));
        let spots = spots.filter(|spot| within_reach.contains(&spot.distance(middle)));
        let spots = spots.map(|spot| Vec3::new(spot.x, 0.0, spot.y));
        let free = |spot: &Vec3| {
            self.is_free_floor(obstacle, *spot) && self.is_open_between(middle, xz(*spot), size.y)
        };
        let from_opening_m = |p: Vec3| (p, self.setup.distance_to_opening(p).min(FAR_M));
        let mut spots: Vec<_> = spots.filter(free).map(from_opening_m).collect();
        spots.sort_by(|a, b| b.1.total_cmp(&a.1));
        let stood = self.thing(obstacle).0.position;
        let nobody_is_at =
            |p| self.discs().iter().all(|d| d.center.distance(xz(p)) > d.radius_m + radius);
        if nobody_is_at(stood) && self.is_free_for(obstacle, stood, radius) {
            spots.push(from_opening_m(stood));
        }
        let spaces: Vec<_> =
            self.setup.agents().map(|who| FreeSpace::around(self, who, middle)).collect();
        let mut best: Option<(usize, Vec3)> = None;
        for (spot, _) in spots {
            let lost = spaces.iter().map(|space| space.cut_off(xz(spot), radius)).sum();
            if best.is_none_or(|(least, _)| lost < least) {
                best = Some((lost, spot));
            }
            if lost <= CUT_OFF {
                break;
            }
        }
        best.map_or_else(|| self.floor_spot_beside(agent, obstacle), |(_, spot)| spot)
    }

    /// Whether no wall or other fixed thing stands between two places, up to this height.
    fn is_open_between(&self, from: Vec2, to: Vec2, high_m: f32) -> bool {
        let arm = Body { radius_m: 0.5 * CELL_M, low_m: self.rules.step_over_m, high_m };
        let steps = (from.distance(to) / CELL_M).ceil();
        let mut along = (0..=steps as i32).map(|step| from.lerp(to, step as f32 / steps));
        along.all(|p| self.block_index.overlap(arm, p, &[], &[]) <= 0.0)
    }
}

/// Where a person fits around a place, nobody being there.
struct FreeSpace {
    middle: Vec2,
    body_m: f32,
    /// Row by row.
    fits: Vec<bool>,
    /// Cells that one can get to from the middle.
    reached: Vec<bool>,
}

impl FreeSpace {
    fn around(world: &World, person: AgentId, middle: Vec2) -> FreeSpace {
        let Capability { radius_m, height_m, .. } = world.capability(person);
        let body = Body { radius_m, low_m: world.rules.step_over_m, high_m: height_m };
        let bounds = world.setup.bounds.grown(-radius_m);
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

    /// How many cells a thing of this radius at `p` cuts off that can be got to without it.
    fn cut_off(&self, p: Vec2, radius_m: f32) -> usize {
        let clear_m = radius_m + self.body_m;
        let is_clear = |cell: i32| center(self.middle, cell).distance(p) > clear_m;
        let still = self.flood(is_clear);
        let lost =
            |cell: &i32| self.reached[*cell as usize] && !still[*cell as usize] && is_clear(*cell);
        (0..SIDE * SIDE).filter(lost).count()
    }

    /// The cells that one can get to from the one nearest to the middle that `is_clear`.
    fn flood(&self, is_clear: impl Fn(i32) -> bool) -> Vec<bool> {
        let is_open = |cell: i32| self.fits[cell as usize] && is_clear(cell);
        let mut reached = vec![false; self.fits.len()];
        let away_m = |cell: &i32| center(Vec2::ZERO, *cell).length();
        let open = (0..SIDE * SIDE).filter(|cell| is_open(*cell));
        let Some(start) = open.min_by(|a, b| away_m(a).total_cmp(&away_m(b))) else {
            return reached;
        };
        reached[start as usize] = true;
        let mut queue = VecDeque::from([start]);
        while let Some(cell) = queue.pop_front() {
            let (i, j) = (cell % SIDE, cell / SIDE);
            let beside = [(i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)];
            let inside =
                beside.into_iter().filter(|(i, j)| (0..SIDE).contains(i) && (0..SIDE).contains(j));
            for next in inside.map(|(i, j)| j * SIDE + i) {
                if is_open(next) && !std::mem::replace(&mut reached[next as usize], true) {
                    queue.push_back(next);
                }
            }
        }
        reached
    }
}

/// The middle of a cell around `middle`.
fn center(middle: Vec2, cell: i32) -> Vec2 {
    middle + CELL_M * Vec2::new((cell % SIDE - HALF) as f32, (cell / SIDE - HALF) as f32)
}
