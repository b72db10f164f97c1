//! Cell costs of the original (facts A1.5): soft inflation, no impassable cells, and for the
//! partner a wide inflation around obstacles.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::geom::to_xz;
use chaic_core::{Frame, Role, Vec2};

use crate::mapping::grid::{CELL_M, Grid};
use crate::mapping::occupancy::CellOccupancy;
use crate::planning::cost_map::{CostMap, FREE, UNKNOWN_CELL_COST};
use crate::planning::cost_model::{CostInputs, CostModel, MapChanges};
use crate::track::TrackId;

/// Costs of a cell within two cells of an occupied one, and of a cell adjacent to one.
const NEAR: [u32; 2] = [5 * FREE, 10 * FREE];
/// Cost of an occupied cell.
const OCCUPIED: u32 = 1_000 * FREE;
/// The same in the first frames of an episode.
const OCCUPIED_AT_FIRST: u32 = 500_000 * FREE;
/// Number of these first frames.
const FIRST_FRAMES: Frame = 200;
/// Extra cost of a wall.
const WALL_EXTRA: u32 = 500_000 * FREE;
/// Added for cells once seen as tall as only walls are. They stay walls even if their floor is seen
/// later.
const TRUE_WALL_EXTRA: u32 = 5_000_000 * FREE;
/// Added around obstacles, for agents that avoid them.
const OBSTACLE_EXTRA: u32 = 200_000 * FREE;
/// Extent of that area from each observed center of the obstacle, cells down and up along each axis.
const OBSTACLE_CELLS: [i32; 2] = [5, 6];
/// A path that costs more than this passes an obstacle or a wall (facts A1.6).
pub const BLOCKED: u32 = 500_000 * FREE;
/// A path that costs more than this is not worth exploring (facts A1.10).
pub const MAX_PATH_COST: u32 = 10_000 * FREE;
/// Number of updates after which cells that have become free are accepted as free (facts A1.1: 10).
const ACCEPT_FREE_EVERY: u32 = 10;
/// Time for which a person's last position counts as occupied, frames.
const PERSON_FRAMES: Frame = 200;
/// Radius of a person, meters: half the width of the original's probe.
const PERSON_RADIUS_M: f32 = 0.32;

/// Occupied cells. New obstacles count at once, removed ones only after a delay.
#[derive(Clone, Debug, Default)]
struct LaggedOccupancy {
    occupied: Vec<bool>,
    /// True if a cell counts as a wall: once seen as one, as long as it counts as occupied.
    wall: Vec<bool>,
    n_updates: u32,
    /// Working memory: the latest occupancy, and the cells near occupied ones.
    latest: Vec<bool>,
    near: [Vec<bool>; 2],
    rows: Vec<bool>,
}

impl LaggedOccupancy {
    /// Updates the occupancy from `latest` and from the current walls.
    fn update(&mut self, walls: impl Iterator<Item = bool>) {
        self.wall.resize(self.latest.len(), false);
        if self.n_updates.is_multiple_of(ACCEPT_FREE_EVERY) {
            std::mem::swap(&mut self.occupied, &mut self.latest);
        } else {
            self.occupied.iter_mut().zip(&self.latest).for_each(|(old, new)| *old |= new);
        }
        for ((wall, is_occupied), now) in self.wall.iter_mut().zip(&self.occupied).zip(walls) {
            *wall = now || (*wall && *is_occupied);
        }
        self.n_updates += 1;
    }

    /// Computes the cells near occupied ones.
    fn find_near_cells(&mut self, grid: &Grid) {
        let LaggedOccupancy { occupied, near: [adjacent, within_two], rows, .. } = self;
        dilate(occupied, grid.nx(), rows, adjacent);
        dilate(adjacent, grid.nx(), rows, within_two);
    }

    /// Returns whether a cell counts as occupied.
    #[cfg(test)]
    fn is_occupied(&self, cell: usize) -> bool {
        self.occupied.get(cell).copied().unwrap_or(false)
    }
}

/// Observed cells of removable obstacles. The observed center of an obstacle moves with
/// the viewpoint. Each of its cells stays in the map while the obstacle is in place
/// (facts A1.3, A1.8).
#[derive(Clone, Debug, Default)]
struct ObservedObstacles(BTreeMap<TrackId, BTreeSet<usize>>);

impl ObservedObstacles {
    /// Records the current cell of each obstacle in place, and forgets all other obstacles.
    fn record(&mut self, in_place: impl Iterator<Item = (TrackId, usize)>) {
        let mut before = std::mem::take(&mut self.0);
        for (track, cell) in in_place {
            let mut cells = before.remove(&track).unwrap_or_default();
            cells.insert(cell);
            self.0.insert(track, cells);
        }
    }

    /// Returns all cells, in the order of tracks.
    fn cells(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.values().flatten().copied()
    }
}

/// Dilates `cells` by one cell, including diagonals, into `dilated`. All are row-major with `nx`
/// cells per row.
fn dilate(cells: &[bool], nx: usize, rows: &mut Vec<bool>, dilated: &mut Vec<bool>) {
    rows.clear();
    rows.extend_from_slice(cells);
    for (row, from) in rows.chunks_mut(nx).zip(cells.chunks(nx)) {
        row.iter_mut().zip(&from[1..]).for_each(|(to, right)| *to |= right);
        row[1..].iter_mut().zip(from).for_each(|(to, left)| *to |= left);
    }
    dilated.clear();
    dilated.extend_from_slice(rows);
    dilated.iter_mut().zip(&rows[nx..]).for_each(|(to, below)| *to |= below);
    dilated[nx..].iter_mut().zip(rows.iter()).for_each(|(to, above)| *to |= above);
}

/// Costs of the original (facts A1.5).
#[derive(Clone, Debug, Default)]
pub struct LatticeCosts {
    occupancy: LaggedOccupancy,
    observed: ObservedObstacles,
    /// Working memory: the costs before the latest computation.
    previous: Vec<u32>,
}

impl CostModel for LatticeCosts {
    fn is_outdated_by(&self, changes: MapChanges) -> bool {
        changes.any
    }

    fn recompute(&mut self, costs: &mut CostMap, inputs: &CostInputs<'_>) {
        std::mem::swap(&mut costs.cost, &mut self.previous);
        costs.cost.resize(costs.grid.n_cells(), 0);
        lattice_costs(
            &costs.grid,
            inputs,
            &mut self.occupancy,
            &mut self.observed,
            &mut costs.cost,
        );
        costs.version += u32::from(costs.cost != self.previous);
        // Clearance is rarely requested, so it is computed on demand.
        costs.occupied.clone_from(&self.occupancy.occupied);
        costs.clearance.take();
    }

    fn uses_path_length(&self) -> bool {
        false
    }

    fn fork(&self) -> Box<dyn CostModel> {
        Box::new(self.clone())
    }
}

/// Updates the occupancy and the obstacles, and computes the costs of all cells.
fn lattice_costs(
    grid: &Grid,
    inputs: &CostInputs<'_>,
    occupancy: &mut LaggedOccupancy,
    observed: &mut ObservedObstacles,
    cost: &mut [u32],
) {
    let latest = &mut occupancy.latest;
    latest.clear();
    latest.extend(inputs.map.cells().map(|cell| cell.state() >= CellOccupancy::Occupied));
    let is_obstacle = |role| matches!(role, Role::Obstacle | Role::HeavyTarget);
    let present = inputs
        .objects
        .iter()
        .filter(|t| t.is_present && !t.is_out_of_play && inputs.now >= t.held_until);
    let obstacles: Vec<_> = present.filter(|t| is_obstacle(t.class.info().role)).collect();
    for cell in obstacles.iter().flat_map(|t| &t.footprint).filter_map(|p| grid.cell_at(*p)) {
        latest[cell] = true;
    }
    for person in inputs.people.iter().filter(|p| p.frame + PERSON_FRAMES > inputs.now) {
        for cell in grid.disc(to_xz(person.position_in_world), PERSON_RADIUS_M) {
            latest[cell] = true;
        }
    }
    occupancy.update(inputs.map.cells().map(|cell| cell.state() == CellOccupancy::Wall));
    occupancy.find_near_cells(grid);
    let occupied_cost = if inputs.now < FIRST_FRAMES { OCCUPIED_AT_FIRST } else { OCCUPIED };
    let near = occupancy.near[0].iter().zip(&occupancy.near[1]);
    let states = occupancy.occupied.iter().zip(&occupancy.wall).zip(near);
    for ((cost, cell), ((is_occupied, is_wall), (is_adjacent, is_near))) in
        cost.iter_mut().zip(inputs.map.cells()).zip(states)
    {
        let place = if *is_near { NEAR[0] } else { FREE };
        let place = if *is_adjacent { NEAR[1] } else { place };
        let place = if *is_occupied { occupied_cost } else { place };
        let unknown = if cell.is_known() { 0 } else { UNKNOWN_CELL_COST };
        let wall = if *is_wall { WALL_EXTRA } else { 0 };
        let true_wall = if cell.is_tall() { TRUE_WALL_EXTRA } else { 0 };
        *cost = place + unknown + wall + true_wall;
    }
    if inputs.avoids_obstacles {
        let removable = obstacles.iter().filter(|t| t.class.info().role == Role::Obstacle);
        observed.record(removable.filter_map(|t| {
            let cell = grid.cell_at(to_xz(t.position_in_world))?;
            Some((t.track, cell))
        }));
        let mut inflated: Vec<usize> = observed
            .cells()
            .flat_map(|cell| square(grid, cell, OBSTACLE_CELLS[0], OBSTACLE_CELLS[1]))
            .collect();
        inflated.sort_unstable();
        inflated.dedup();
        inflated.into_iter().for_each(|cell| cost[cell] += OBSTACLE_EXTRA);
    }
}

/// Returns the cells of a square with this extent down and up from its center along each axis.
fn square(grid: &Grid, cell: usize, down: i32, up: i32) -> impl Iterator<Item = usize> + use<> {
    let (grid, center) = (*grid, grid.center(cell));
    (-down..=up).flat_map(move |j| {
        (-down..=up)
            .filter_map(move |i| grid.cell_at(center + CELL_M * Vec2::new(i as f32, j as f32)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::occupancy::MAP_RANGE_M;
    use crate::mapping::{OccupancyMap, PersonMap, SemanticMap};
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::test_support::{MOTION, Toy, ToyObject};

    #[test]
    fn a_wall_stays_one_for_as_long_as_its_cell_counts_as_occupied() {
        let mut occupancy = LaggedOccupancy::default();
        let mut update = |occupied, wall| {
            occupancy.latest = vec![occupied];
            occupancy.update([wall].into_iter());
            (occupancy.is_occupied(0), occupancy.wall[0])
        };
        assert_eq!(update(true, true), (true, true));
        for _ in 1..ACCEPT_FREE_EVERY {
            assert_eq!(update(false, false), (true, true), "not accepted yet");
        }
        assert_eq!(update(true, false), (true, true), "something lower is still there");
        for _ in 1..ACCEPT_FREE_EVERY {
            update(false, false);
        }
        assert_eq!(update(false, false), (false, false), "it has gone");
        for _ in 1..ACCEPT_FREE_EVERY {
            assert_eq!(update(true, false), (true, false), "something lower is there");
        }
    }

    #[test]
    fn an_obstacle_keeps_the_cells_of_all_its_sightings_until_it_is_removed() {
        let mut observed = ObservedObstacles::default();
        let mut record = |list: &[(u32, usize)]| {
            observed.record(list.iter().map(|(track, cell)| (TrackId(*track), *cell)));
            observed.cells().collect::<Vec<_>>()
        };
        assert_eq!(record(&[(1, 30), (2, 80)]), [30, 80]);
        assert_eq!(record(&[(1, 31), (2, 80)]), [30, 31, 80], "seen from elsewhere");
        assert_eq!(record(&[(1, 30)]), [30, 31], "the second was removed");
        assert!(record(&[]).is_empty());
        assert_eq!(record(&[(1, 50)]), [50], "put down elsewhere");
    }

    /// Computes the costs of a map without objects and people.
    fn add_costs(map: &OccupancyMap, occupancy: &mut LaggedOccupancy, cost: &mut [u32]) {
        let inputs = CostInputs {
            map,
            objects: &SemanticMap::default(),
            people: &PersonMap::default(),
            avoids_obstacles: false,
            position: Vec2::ZERO,
            now: FIRST_FRAMES,
        };
        lattice_costs(map.grid(), &inputs, occupancy, &mut ObservedObstacles::default(), cost);
    }

    #[test]
    fn a_lintel_is_not_a_wall_once_the_floor_below_it_is_seen() {
        let mut toy = Toy::room(8.0, 8.0);
        let lintel = toy.add(ToyObject::new("cabinet", [0.0, 2.1, -2.5], [1.0, 0.4, 0.3]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        let (grid, mut occupancy) = (*map.grid(), LaggedOccupancy::default());
        let mut cost = vec![0; grid.n_cells()];
        let observation = toy.observe();
        let percepts = GroundTruthIds.perceive(&observation);
        assert!(percepts.detections.iter().any(|d| d.track == lintel), "it is in view");
        map.integrate(&observation, &percepts, 1.75, MAP_RANGE_M);
        add_costs(&map, &mut occupancy, &mut cost);
        let below = grid.disc(Vec2::new(0.0, -2.4), 0.3);
        assert!(below.map(|cell| cost[cell]).all(|cost| cost < WALL_EXTRA));
    }

    #[test]
    fn only_structure_as_tall_as_walls_keeps_the_cost_of_a_wall() {
        let mut toy = Toy::room(6.0, 6.0);
        let boxes = [(-0.7, 2.1), (0.7, 2.3)].map(|(x, height_m)| {
            toy.add(ToyObject::new("cabinet", [x, 0.0, -2.2], [0.8, height_m, 0.8]))
        });
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        let (grid, mut occupancy) = (*map.grid(), LaggedOccupancy::default());
        let mut cost = vec![0; grid.n_cells()];
        // Costs at the positions of the boxes after `n` observations.
        let mut look = |toy: &Toy, n: u32| {
            let observation = toy.observe();
            let percepts = GroundTruthIds.perceive(&observation);
            for _ in 0..n {
                map.integrate(&observation, &percepts, 1.75, MAP_RANGE_M);
                add_costs(&map, &mut occupancy, &mut cost);
            }
            [-0.7, 0.7].map(|x| cost[grid.cell_at(Vec2::new(x, -1.85)).expect("inside")])
        };
        let wall = OCCUPIED + WALL_EXTRA;
        assert_eq!(look(&toy, 1), [wall, wall + TRUE_WALL_EXTRA]);
        boxes.into_iter().for_each(|entity| toy.remove(entity));
        assert_eq!(look(&toy, 3 * ACCEPT_FREE_EVERY), [FREE, FREE + TRUE_WALL_EXTRA]);
    }
}
