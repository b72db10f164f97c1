//! What it costs to enter each cell by the original's reckoning (facts A1.5): soft rings, nothing
//! quite impassable, and for the partner a wide berth around obstacles.

use chaic_core::geom::xz;
use chaic_core::{Frame, Role, Vec2};

use super::cost_model::{Berth, Seen};
use super::costs::{FREE, UNKNOWN_EXTRA};
use crate::mapping::grid::{CELL_M, Grid};
use crate::mapping::occupancy::Space;

/// A cell with something within two cells, or next to it.
const NEAR: [u32; 2] = [5 * FREE, 10 * FREE];
/// A cell with something in it.
const OCCUPIED: u32 = 1_000 * FREE;
/// The same in the first frames of an episode.
const OCCUPIED_AT_FIRST: u32 = 500_000 * FREE;
/// How long these last, frames.
pub const FIRST_FRAMES: Frame = 200;
/// Added for a wall.
const WALL_EXTRA: u32 = 500_000 * FREE;
/// Added for what was ever seen to be as tall as only walls are: it stays a wall, whatever is seen
/// of its floor later.
const TRUE_WALL_EXTRA: u32 = 5_000_000 * FREE;
/// Added around obstacles, for whoever heeds them.
const OBSTACLE_EXTRA: u32 = 200_000 * FREE;
/// From an obstacle's middle that is so many cells down and up along each axis.
const OBSTACLE_CELLS: [i32; 2] = [5, 6];
/// A way that costs more than this leads past an obstacle or through a wall (facts A1.6).
pub const BLOCKED: u32 = 500_000 * FREE;
/// A way that costs more than this is not worth exploring (facts A1.10).
pub const FARTHEST: u32 = 10_000 * FREE;
/// Where something was seen counts as occupied until, every so many updates, what has been found
/// free since is believed (facts A1.1: 10).
const BELIEVE_EVERY: u32 = 10;
/// Where a person was seen counts as occupied for so long, frames.
const PERSON_FRAMES: Frame = 200;
/// People are as wide as this, metres: half the width of the original's probe.
const PERSON_RADIUS_M: f32 = 0.32;

/// Which cells count as occupied. What is seen counts at once, what is gone only after a while.
#[derive(Clone, Debug, Default)]
pub struct Belief {
    occupied: Vec<bool>,
    /// Whether a cell counts as a wall: as long as it counts as occupied, once it was seen as one.
    wall: Vec<bool>,
    n_updates: u32,
    /// Working space: the latest account, and which cells are near occupied ones.
    latest: Vec<bool>,
    near: [Vec<bool>; 2],
    rows: Vec<bool>,
}

impl Belief {
    /// Takes in `latest`, which cells are occupied by the latest account, and which are walls.
    fn update(&mut self, walls: impl Iterator<Item = bool>) {
        self.wall.resize(self.latest.len(), false);
        if self.n_updates.is_multiple_of(BELIEVE_EVERY) {
            std::mem::swap(&mut self.occupied, &mut self.latest);
        } else {
            self.occupied.iter_mut().zip(&self.latest).for_each(|(old, new)| *old |= new);
        }
        for ((wall, is_occupied), now) in self.wall.iter_mut().zip(&self.occupied).zip(walls) {
            *wall = now || (*wall && *is_occupied);
        }
        self.n_updates += 1;
    }

    /// Finds the cells near occupied ones.
    fn spread(&mut self, grid: &Grid) {
        let Belief { occupied, near: [next_to, within_two], rows, .. } = self;
        grow(occupied, grid.nx(), rows, next_to);
        grow(next_to, grid.nx(), rows, within_two);
    }

    /// Whether a cell counts as occupied.
    pub fn is_occupied(&self, cell: usize) -> bool {
        self.occupied.get(cell).copied().unwrap_or(false)
    }
}

/// Puts into `grown` the cells that are in `cells` or next to one in it, also diagonally. All are
/// row by row, `nx` a row.
fn grow(cells: &[bool], nx: usize, rows: &mut Vec<bool>, grown: &mut Vec<bool>) {
    rows.clear();
    rows.extend_from_slice(cells);
    for (row, from) in rows.chunks_mut(nx).zip(cells.chunks(nx)) {
        row.iter_mut().zip(&from[1..]).for_each(|(to, right)| *to |= right);
        row[1..].iter_mut().zip(from).for_each(|(to, left)| *to |= left);
    }
    grown.clear();
    grown.extend_from_slice(rows);
    grown.iter_mut().zip(&rows[nx..]).for_each(|(to, below)| *to |= below);
    grown[nx..].iter_mut().zip(rows.iter()).for_each(|(to, above)| *to |= above);
}

/// Takes in what is seen, and computes the costs of all cells.
pub fn lattice_costs(grid: &Grid, seen: &Seen<'_>, belief: &mut Belief, cost: &mut [u32]) {
    let occupied = &mut belief.latest;
    occupied.clear();
    occupied.extend(seen.map.cells().map(|cell| cell.space() >= Space::Occupied));
    let firm = |role| matches!(role, Role::Obstacle | Role::HeavyTarget);
    let standing =
        seen.things.iter().filter(|t| t.is_present && !t.is_gone && seen.now >= t.held_until);
    let standing: Vec<_> = standing.filter(|t| firm(t.class.info().role)).collect();
    for cell in standing.iter().flat_map(|t| &t.footprint).filter_map(|p| grid.cell_at(*p)) {
        occupied[cell] = true;
    }
    for person in seen.people.iter().filter(|p| p.frame + PERSON_FRAMES > seen.now) {
        for cell in grid.disc(xz(person.position_in_world), PERSON_RADIUS_M) {
            occupied[cell] = true;
        }
    }
    belief.update(seen.map.cells().map(|cell| cell.space() == Space::Wall));
    belief.spread(grid);
    let in_it = if seen.now < FIRST_FRAMES { OCCUPIED_AT_FIRST } else { OCCUPIED };
    let near = belief.near[0].iter().zip(&belief.near[1]);
    let believed = belief.occupied.iter().zip(&belief.wall).zip(near);
    for ((cost, cell), ((is_occupied, is_wall), (is_next, is_near))) in
        cost.iter_mut().zip(seen.map.cells()).zip(believed)
    {
        let place = if *is_near { NEAR[0] } else { FREE };
        let place = if *is_next { NEAR[1] } else { place };
        let place = if *is_occupied { in_it } else { place };
        let unknown = if cell.is_known() { 0 } else { UNKNOWN_EXTRA };
        let wall = if *is_wall { WALL_EXTRA } else { 0 };
        let true_wall = if cell.is_tall() { TRUE_WALL_EXTRA } else { 0 };
        *cost = place + unknown + wall + true_wall;
    }
    if let Some(berth) = seen.berth {
        let obstacles = standing.iter().filter(|t| t.class.info().role == Role::Obstacle);
        let (mut heeded, extra): (Vec<usize>, u32) = match berth {
            Berth::Wide => {
                let middles = obstacles.filter_map(|t| grid.cell_at(xz(t.position_in_world)));
                let squares = middles.flat_map(|cell| around(grid, cell, OBSTACLE_CELLS));
                (squares.collect(), OBSTACLE_EXTRA)
            }
            Berth::Narrow(radius_m) => {
                let points = obstacles.flat_map(|t| &t.footprint);
                (points.flat_map(|p| grid.disc(*p, radius_m)).collect(), BLOCKED)
            }
        };
        heeded.sort_unstable();
        heeded.dedup();
        heeded.into_iter().for_each(|cell| cost[cell] += extra);
    }
}

/// The cells of a square, so many down and up from its middle along each axis.
fn around(grid: &Grid, cell: usize, [down, up]: [i32; 2]) -> impl Iterator<Item = usize> + use<> {
    let (grid, middle) = (*grid, grid.center(cell));
    (-down..=up).flat_map(move |j| {
        (-down..=up)
            .filter_map(move |i| grid.cell_at(middle + CELL_M * Vec2::new(i as f32, j as f32)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::occupancy::MAP_RANGE_M;
    use crate::mapping::{OccupancyMap, People, SemanticMap};
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::test_support::{MOTION, Toy, ToyObject};

    #[test]
    fn a_wall_stays_one_for_as_long_as_its_cell_counts_as_occupied() {
        let mut belief = Belief::default();
        let mut update = |occupied, wall| {
            belief.latest = vec![occupied];
            belief.update([wall].into_iter());
            (belief.is_occupied(0), belief.wall[0])
        };
        assert_eq!(update(true, true), (true, true));
        for _ in 1..BELIEVE_EVERY {
            assert_eq!(update(false, false), (true, true), "not believed yet");
        }
        assert_eq!(update(true, false), (true, true), "something lower is still there");
        for _ in 1..BELIEVE_EVERY {
            update(false, false);
        }
        assert_eq!(update(false, false), (false, false), "it has gone");
        for _ in 1..BELIEVE_EVERY {
            assert_eq!(update(true, false), (true, false), "something lower is there");
        }
    }

    #[test]
    fn a_lintel_is_no_wall_once_the_floor_below_it_is_seen() {
        let mut toy = Toy::room(8.0, 8.0);
        let lintel = toy.add(ToyObject::new("cabinet", [0.0, 2.1, -2.5], [1.0, 0.4, 0.3]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        let (grid, mut belief) = (*map.grid(), Belief::default());
        let mut cost = vec![0; grid.n_cells()];
        let observation = toy.observe();
        let percepts = GroundTruthIds.perceive(&observation);
        assert!(percepts.detections.iter().any(|d| d.track == lintel), "it is in view");
        map.integrate(&observation, &percepts, 1.75, MAP_RANGE_M);
        let seen = Seen {
            map: &map,
            things: &SemanticMap::default(),
            people: &People::default(),
            berth: None,
            here: Vec2::ZERO,
            now: FIRST_FRAMES,
        };
        lattice_costs(&grid, &seen, &mut belief, &mut cost);
        let below = grid.disc(Vec2::new(0.0, -2.4), 0.3);
        assert!(below.map(|cell| cost[cell]).all(|cost| cost < WALL_EXTRA));
    }

    #[test]
    fn only_what_is_as_tall_as_walls_are_costs_as_much_for_good() {
        let mut toy = Toy::room(6.0, 6.0);
        let boxes = [(-0.7, 2.1), (0.7, 2.3)].map(|(x, height_m)| {
            toy.add(ToyObject::new("cabinet", [x, 0.0, -2.2], [0.8, height_m, 0.8]))
        });
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        let (grid, mut belief) = (*map.grid(), Belief::default());
        let mut cost = vec![0; grid.n_cells()];
        // The costs where the boxes stand, or stood, after so many looks.
        let mut look = |toy: &Toy, n: u32| {
            let observation = toy.observe();
            let percepts = GroundTruthIds.perceive(&observation);
            for _ in 0..n {
                map.integrate(&observation, &percepts, 1.75, MAP_RANGE_M);
                let seen = Seen {
                    map: &map,
                    things: &SemanticMap::default(),
                    people: &People::default(),
                    berth: None,
                    here: Vec2::ZERO,
                    now: FIRST_FRAMES,
                };
                lattice_costs(&grid, &seen, &mut belief, &mut cost);
            }
            [-0.7, 0.7].map(|x| cost[grid.cell_at(Vec2::new(x, -1.85)).expect("inside")])
        };
        let wall = OCCUPIED + WALL_EXTRA;
        assert_eq!(look(&toy, 1), [wall, wall + TRUE_WALL_EXTRA]);
        boxes.into_iter().for_each(|entity| toy.remove(entity));
        assert_eq!(look(&toy, 3 * BELIEVE_EVERY), [FREE, FREE + TRUE_WALL_EXTRA]);
    }
}
