//! Occupancy grid: free, occupied and unknown space, from depth images.

mod layout;
mod scan;

use chaic_core::geom::{Camera, Rect, to_xz};
use chaic_core::{Frame, Observation, Vec2, Vec3};

use super::collision_memory::CollisionMemory;
use super::grid::{CELL_M, Grid};
use crate::perception::Percepts;
use scan::Scan;

/// Maximum depth that is used for maps, meters (facts A1.1).
pub const MAP_RANGE_M: f32 = 5.0;
/// Occupied cells with points above this are walls, meters (facts A1.1).
const WALL_M: f32 = 2.0;
/// Points above this may be a ceiling and are ignored, meters: the minimum height in typical homes.
/// (The original looks up to 4 m, in houses without ceilings; facts A1.4.)
const TOP_M: f32 = 2.4;
/// Points above this belong to permanent walls, because no movable object is as tall, meters. (The
/// original: 2.9 m, in houses without ceilings whose walls are 3 m high.)
const TALL_M: f32 = 2.2;
/// Height above the body up to which obstacles block it, meters.
const HEAD_MARGIN_M: f32 = 0.05;
/// Increase of the confidence per observation of an occupied cell; next, its maximum.
const CONFIDENCE_STEP: u8 = 3;
const MAX_CONFIDENCE: u8 = 6;
/// Side of the coarse squares that record when a place was last seen, cells (1 m).
const PLACE_CELLS: usize = 8;
/// Added to the row of a projected point, pixels: more than the rounding error of the projection.
const ROW_ROUNDING: f32 = 1e-3;

/// State of one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CellOccupancy {
    /// Its floor was seen.
    Free,
    /// Never seen.
    Unknown,
    /// Occupied between ankle and head height.
    Occupied,
    /// Occupied up to more than two meters.
    Wall,
}

/// State of one cell as stored.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Confidence that the cell is occupied, 0..=6.
    confidence: u8,
    /// Bits (`SEEN_*`) of everything ever seen of the cell.
    seen_bits: u8,
}

impl Cell {
    /// Returns the state of the cell.
    #[inline]
    pub fn state(self) -> CellOccupancy {
        match (self.confidence > 0, self.seen_bits) {
            (true, bits) if bits & SEEN_HIGH != 0 => CellOccupancy::Wall,
            (true, _) => CellOccupancy::Occupied,
            (false, bits) if bits & SEEN_FREE != 0 => CellOccupancy::Free,
            _ => CellOccupancy::Unknown,
        }
    }

    /// Returns whether any part of the cell was ever seen within the known range.
    #[inline]
    pub fn is_known(self) -> bool {
        self.seen_bits & SEEN_NEAR != 0
    }

    /// Returns whether a part as tall as only walls was ever seen that extends down to people's
    /// height. A lintel does not count: its floor is seen, and nothing in between.
    #[inline]
    pub fn is_tall(self) -> bool {
        let is_open = self.seen_bits & SEEN_FREE != 0 && self.seen_bits & SEEN_FIRM == 0;
        self.seen_bits & SEEN_TALL != 0 && !is_open
    }
}

/// Bits of everything ever seen of a cell.
const SEEN_FREE: u8 = 1;
const SEEN_HIGH: u8 = 2;
/// Too near to the feet to be visible, but no obstacle there reaches up to the camera.
const SEEN_BELOW_VIEW: u8 = 4;
/// Some part was seen from near enough to count as known.
const SEEN_NEAR: u8 = 8;
/// Some part was seen that is as tall as only walls are.
const SEEN_TALL: u8 = 16;
/// Some part was seen between ankle and head height.
const SEEN_FIRM: u8 = 32;
/// Bits that do not affect whether the cell is traversable.
const UNRELATED_BITS: u8 = SEEN_NEAR | SEEN_TALL | SEEN_FIRM;
/// Bits of what one image shows of a cell.
const NOW_FLOOR: u8 = 1;
const NOW_OCCUPIED: u8 = 2;
const NOW_HIGH: u8 = 4;
const NOW_NEAR: u8 = 8;
const NOW_TALL: u8 = 16;

/// Occupancy grid of static structure and furniture. People and movable objects are excluded; the
/// semantic map tracks them.
#[derive(Clone, Debug)]
pub struct OccupancyMap {
    grid: Grid,
    /// Obstacles below this are stepped over, meters.
    step_over_m: f32,
    /// Confidence that each cell is occupied, 0..=6.
    confidence: Vec<u8>,
    /// Bits of everything ever seen of each cell.
    seen_bits: Vec<u8>,
    /// Working memory: `NOW_*` bits of each cell in the current image, and the cells with any.
    now: Vec<u8>,
    touched: Vec<u32>,
    /// Frame in which each coarse square was last seen, plus one; 0 if never.
    last_seen: Vec<Frame>,
    bumps: CollisionMemory,
    version: u32,
}

impl OccupancyMap {
    /// Creates an unknown map, where obstacles lower than `step_over_m` do not block.
    pub fn new(bounds: &Rect, step_over_m: f32) -> OccupancyMap {
        OccupancyMap::with_grid(Grid::new(bounds), step_over_m)
    }

    /// Creates a map with these cell states.
    #[cfg(test)]
    pub(crate) fn from_cells(grid: Grid, cells: &[CellOccupancy]) -> OccupancyMap {
        let mut map = OccupancyMap::with_grid(grid, crate::test_support::MOTION.step_over_m);
        for (cell, state) in cells.iter().enumerate() {
            (map.confidence[cell], map.seen_bits[cell]) = match state {
                CellOccupancy::Free => (0, SEEN_FREE),
                CellOccupancy::Unknown => (0, 0),
                CellOccupancy::Occupied => (MAX_CONFIDENCE, 0),
                CellOccupancy::Wall => (MAX_CONFIDENCE, SEEN_HIGH),
            };
        }
        map
    }

    fn with_grid(grid: Grid, step_over_m: f32) -> OccupancyMap {
        let n = grid.n_cells();
        let n_places = grid.nx().div_ceil(PLACE_CELLS) * grid.nz().div_ceil(PLACE_CELLS);
        OccupancyMap {
            grid,
            step_over_m,
            confidence: vec![0; n],
            seen_bits: vec![0; n],
            now: vec![0; n],
            touched: Vec::new(),
            last_seen: vec![0; n_places],
            bumps: CollisionMemory::default(),
            version: 0,
        }
    }

    /// Grid of the map.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Increases whenever any cell changes.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// Returns the state of a cell.
    #[inline]
    pub fn state(&self, cell: usize) -> CellOccupancy {
        self.cell(cell).state()
    }

    /// Returns a cell.
    #[inline]
    pub fn cell(&self, cell: usize) -> Cell {
        Cell { confidence: self.confidence[cell], seen_bits: self.seen_bits[cell] }
    }

    /// Returns all cells, row by row.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + '_ {
        self.confidence
            .iter()
            .zip(&self.seen_bits)
            .map(|(confidence, bits)| Cell { confidence: *confidence, seen_bits: *bits })
    }

    /// Returns whether a cell is worth exploring: unknown, and not only because it was too near to
    /// the feet.
    pub fn is_unexplored(&self, cell: usize) -> bool {
        self.state(cell) == CellOccupancy::Unknown && self.seen_bits[cell] & SEEN_BELOW_VIEW == 0
    }

    /// Returns whether any part of a cell was ever seen within the known range.
    pub fn is_known(&self, cell: usize) -> bool {
        self.seen_bits[cell] & SEEN_NEAR != 0
    }

    /// Frame in which the square meter around a cell was last seen, if ever.
    pub fn last_seen(&self, cell: usize) -> Option<Frame> {
        self.last_seen[self.place_of(cell)].checked_sub(1)
    }

    fn place_of(&self, cell: usize) -> usize {
        let (i, j) = self.grid.column_row(cell);
        (j / PLACE_CELLS) * self.grid.nx().div_ceil(PLACE_CELLS) + i / PLACE_CELLS
    }

    /// Records a collision at `at` (x, z), see [`CollisionMemory::record`].
    pub fn record_bump(&mut self, at: Vec2, now: Frame, repeated_collision_frames: Frame) {
        self.bumps.record(at, now, repeated_collision_frames);
        self.version += 1;
    }

    /// Removes all barriers.
    pub fn clear_barriers(&mut self) {
        self.version += u32::from(self.bumps.clear_barriers());
    }

    /// Collisions at positions that the map shows as free.
    pub fn bumps(&self) -> &CollisionMemory {
        &self.bumps
    }

    /// Integrates one image. `height_m` is the height of the agent's body: obstacles above it do
    /// not block. Cells seen within `known_m` count as known.
    pub fn integrate(
        &mut self,
        observation: &Observation,
        percepts: &Percepts,
        height_m: f32,
        known_m: f32,
    ) {
        let now = observation.frame;
        let mut changed = self.bumps.expire(now);
        if let Some(depth) = observation.images.depth_m.as_ref() {
            let camera = &observation.camera;
            if depth.len() == camera.width as usize * camera.height as usize {
                let scan = Scan { map: self, depth, percepts, camera, height_m, known_m };
                pulp::Arch::new().dispatch(scan);
                changed |= self.apply_scan(now);
                changed |= self.mark_area_at_feet(depth, camera);
            }
        }
        // The agent's own position is free.
        let here = to_xz(observation.proprioception.pose.position);
        for cell in self.grid.disc(here, CELL_M) {
            changed |= self.seen_bits[cell] & SEEN_FREE == 0 || self.confidence[cell] > 0;
            self.seen_bits[cell] |= SEEN_FREE;
            self.confidence[cell] = 0;
        }
        self.version += u32::from(changed);
    }

    /// Merges `now` into the map; returns whether anything changed.
    fn apply_scan(&mut self, now: Frame) -> bool {
        let mut changed = false;
        let touched = std::mem::take(&mut self.touched);
        for &cell in &touched {
            let cell = cell as usize;
            let before = (self.confidence[cell] > 0, self.seen_bits[cell] & !UNRELATED_BITS);
            let bits = std::mem::take(&mut self.now[cell]);
            if bits & NOW_OCCUPIED != 0 {
                self.confidence[cell] =
                    (self.confidence[cell] + CONFIDENCE_STEP).min(MAX_CONFIDENCE);
                self.seen_bits[cell] |= SEEN_FIRM;
            } else if bits & NOW_FLOOR != 0 {
                self.confidence[cell] = self.confidence[cell].saturating_sub(1);
            }
            if bits & NOW_FLOOR != 0 {
                self.seen_bits[cell] |= SEEN_FREE;
            }
            if bits & NOW_HIGH != 0 {
                self.seen_bits[cell] |= SEEN_HIGH;
            }
            if bits & NOW_TALL != 0 {
                self.seen_bits[cell] |= SEEN_TALL;
            }
            if bits & (NOW_FLOOR | NOW_OCCUPIED) != 0 {
                let place = self.place_of(cell);
                self.last_seen[place] = now + 1;
            }
            changed |=
                before != (self.confidence[cell] > 0, self.seen_bits[cell] & !UNRELATED_BITS);
            if bits & NOW_NEAR != 0 {
                self.seen_bits[cell] |= SEEN_NEAR;
            }
        }
        self.touched = touched;
        changed
    }

    /// Marks unseen cells around the feet, which are below the image. If the view at camera height
    /// reaches beyond a cell, nothing large stands on it.
    fn mark_area_at_feet(&mut self, depth: &[f32], camera: &Camera) -> bool {
        let eye = to_xz(camera.eye_in_world);
        let reach_m = camera.eye_in_world.y + 0.2;
        let (width, height) = (camera.width as f32, camera.height as f32);
        let mut changed = false;
        for cell in self.grid.disc(eye, reach_m) {
            if self.seen_bits[cell] & (SEEN_FREE | SEEN_BELOW_VIEW) != 0
                || self.confidence[cell] > 0
            {
                continue;
            }
            let center = self.grid.center(cell);
            let point = Vec3::new(center.x, camera.eye_in_world.y, center.y);
            let Some((px, d)) = camera.project(point) else { continue };
            // The height of a level camera is at the border of two rows.
            let row = px.y + ROW_ROUNDING;
            if !(0.0..width).contains(&px.x) || !(0.0..height).contains(&row) {
                continue;
            }
            if depth[row as usize * camera.width as usize + px.x as usize] > d {
                self.seen_bits[cell] |= SEEN_BELOW_VIEW;
                changed = true;
            }
        }
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::test_support::{MOTION, Toy, ToyObject};

    fn observe(map: &mut OccupancyMap, toy: &Toy) {
        let observation = toy.observe();
        let percepts = GroundTruthIds.perceive(&observation);
        map.integrate(&observation, &percepts, 1.75, MAP_RANGE_M);
    }

    fn state(map: &OccupancyMap, x: f32, z: f32) -> CellOccupancy {
        map.state(map.grid().cell_at(Vec2::new(x, z)).expect("inside"))
    }

    #[test]
    fn floor_furniture_walls_and_unseen_cells_have_their_own_states() {
        let mut toy = Toy::room(6.0, 6.0);
        toy.add(ToyObject::new("cabinet", [1.0, 0.0, -2.0], [0.8, 1.0, 0.4]));
        toy.add(ToyObject::new("apple", [-1.0, 0.0, -2.0], [0.3, 0.3, 0.3]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        observe(&mut map, &toy);
        assert_eq!(state(&map, 0.0, -2.0), CellOccupancy::Free);
        assert_eq!(state(&map, 1.0, -1.82), CellOccupancy::Occupied);
        // The wall's face lies on a border between cells.
        let face = state(&map, 0.0, -3.01).max(state(&map, 0.0, -2.99));
        assert_eq!(face, CellOccupancy::Wall);
        assert_eq!(state(&map, 0.0, 2.0), CellOccupancy::Unknown, "behind the back");
        assert_ne!(state(&map, -1.0, -1.9), CellOccupancy::Occupied, "an apple does not block");
        let near = map.grid().cell_at(Vec2::new(0.0, -1.0)).expect("inside");
        assert!(!map.is_unexplored(near), "just before the feet");
    }

    #[test]
    fn the_area_at_the_feet_is_seen_at_eye_height_with_a_level_and_with_a_lowered_gaze() {
        use chaic_core::geom::pitch_rotation;
        // Row at eye height: tan(30°) of 32 rows above the center with the lowered gaze.
        for (lowered_rad, level_row) in [(0.0, 32), (std::f32::consts::FRAC_PI_6, 13)] {
            let camera = Camera {
                eye_in_world: Vec3::new(0.0, 1.65, 0.0),
                world_from_camera: pitch_rotation(-lowered_rad),
                vertical_fov_rad: Camera::EYE_FOV_RAD,
                width: 64,
                height: 64,
            };
            for far_row in [level_row, level_row + 1] {
                let depth: Vec<f32> = (0..64 * 64)
                    .map(|pixel| if pixel / 64 == far_row { 10.0 } else { 0.1 })
                    .collect();
                let toy = Toy::room(6.0, 6.0);
                let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
                let is_marked = map.mark_area_at_feet(&depth, &camera);
                assert_eq!(is_marked, far_row == level_row, "{lowered_rad} rad, row {far_row}");
                let ahead = map.grid().cell_at(Vec2::new(0.0, -1.0)).expect("inside");
                assert_eq!(map.is_unexplored(ahead), !is_marked);
            }
        }
    }

    #[test]
    fn furniture_under_a_ceiling_is_not_a_wall() {
        let mut toy = Toy::room(6.0, 6.0);
        toy.add(ToyObject::new("cabinet", [1.0, 0.0, -2.0], [0.8, 1.0, 0.4]));
        toy.add(ToyObject::new("bed", [0.0, 2.6, 0.0], [6.0, 0.1, 6.0]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        observe(&mut map, &toy);
        assert_eq!(state(&map, 1.0, -1.82), CellOccupancy::Occupied);
        let face = state(&map, 0.0, -3.01).max(state(&map, 0.0, -2.99));
        assert_eq!(face, CellOccupancy::Wall);
    }

    #[test]
    fn a_removed_object_leaves_free_cells_after_some_observations() {
        let mut toy = Toy::room(6.0, 6.0);
        let cabinet = toy.add(ToyObject::new("cabinet", [0.0, 0.0, -2.2], [0.8, 0.6, 0.8]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        observe(&mut map, &toy);
        assert_eq!(state(&map, 0.0, -1.85), CellOccupancy::Occupied);
        toy.remove(cabinet);
        for _ in 0..MAX_CONFIDENCE {
            observe(&mut map, &toy);
        }
        assert_eq!(state(&map, 0.0, -1.85), CellOccupancy::Free);
    }

    #[test]
    fn a_repeated_observation_changes_nothing() {
        let mut toy = Toy::room(6.0, 6.0);
        toy.stand([0.0, 0.0], 0.3);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        observe(&mut map, &toy);
        let version = map.version();
        observe(&mut map, &toy);
        assert_eq!(map.version(), version);
        map.record_bump(Vec2::ZERO, 0, 0);
        assert!(map.version() > version && map.bumps().recent_cells(map.grid()).count() > 4);
    }

    #[test]
    fn structure_taller_than_any_movable_object_is_never_forgotten() {
        let mut toy = Toy::room(6.0, 6.0);
        // Between the thresholds of walls and of permanent walls, and above both.
        let heights_m = [0.5 * (WALL_M + TALL_M), 0.5 * (TALL_M + TOP_M)];
        let boxes = [(-0.7, heights_m[0]), (0.7, heights_m[1])].map(|(x, height_m)| {
            toy.add(ToyObject::new("cabinet", [x, 0.0, -2.2], [0.8, height_m, 0.8]))
        });
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        let state = |map: &OccupancyMap| {
            [-0.7, 0.7].map(|x| {
                let cell = map.grid().cell_at(Vec2::new(x, -1.85)).expect("inside");
                (map.state(cell), map.cells().nth(cell).expect("inside").is_tall())
            })
        };
        observe(&mut map, &toy);
        assert_eq!(state(&map), [(CellOccupancy::Wall, false), (CellOccupancy::Wall, true)]);
        boxes.into_iter().for_each(|entity| toy.remove(entity));
        for _ in 0..2 * MAX_CONFIDENCE {
            observe(&mut map, &toy);
        }
        assert_eq!(state(&map), [(CellOccupancy::Free, false), (CellOccupancy::Free, true)]);
    }

    #[test]
    fn an_object_above_the_head_makes_its_cell_known_but_neither_free_nor_occupied() {
        let mut toy = Toy::room(8.0, 8.0);
        // A wide cabinet hides the floor; a board hangs above it, slightly behind.
        toy.add(ToyObject::new("cabinet", [0.0, 0.0, -1.0], [3.0, 1.2, 0.4]));
        toy.add(ToyObject::new("cabinet", [0.0, 1.83, -2.6], [0.8, 0.12, 0.4]));
        toy.stand([0.0, 0.0], 0.0);
        let observation = toy.observe();
        let percepts = GroundTruthIds.perceive(&observation);
        for (known_m, is_known) in [(MAP_RANGE_M, true), (2.0, false)] {
            let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
            map.integrate(&observation, &percepts, 1.75, known_m);
            let [under, beside] =
                [0.0, 1.0].map(|x| map.grid().cell_at(Vec2::new(x, -2.44)).expect("inside"));
            assert_eq!(map.is_known(under), is_known, "within {known_m} m");
            assert!(!map.is_known(beside), "nothing of it is seen");
            assert_eq!([map.state(under), map.state(beside)], [CellOccupancy::Unknown; 2]);
        }
    }
}
