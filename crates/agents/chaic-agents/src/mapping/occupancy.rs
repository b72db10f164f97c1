//! Where one can walk: free, occupied and unknown space, from depth images.

use chaic_core::geom::{Camera, Rect, xz};
use chaic_core::{Frame, Observation, Vec2, Vec3};

use super::bumps::Bumps;
use super::grid::{CELL_M, Grid};
use crate::perception::{Percepts, Rays};

/// Depth is trusted up to here for maps, metres (facts A1.1).
pub const MAP_RANGE_M: f32 = 5.0;
/// Points below this are floor, metres. (The paper's code uses 0.05; rugs and curbs need more.)
const FLOOR_M: f32 = 0.08;
/// Occupied cells with points above this are walls, metres (facts A1.1).
const WALL_M: f32 = 2.0;
/// Points above this may be a ceiling and say nothing, metres: the lowest that is usual in homes.
/// (The original looks up to 4 m, in houses without ceilings; facts A1.4.)
const TOP_M: f32 = 2.4;
/// Points above this belong to walls for good: nothing that can be moved is as tall, metres. (The
/// original: 2.9 m, in houses without ceilings whose walls are 3 m high.)
const TALL_M: f32 = 2.2;
/// How sure one is of an occupied cell after one look, and at most.
const SURE_ONCE: u8 = 3;
const SURE_MOST: u8 = 6;
/// Side of the coarse squares that remember when a place was seen last, cells (1 m).
const PLACE_CELLS: usize = 8;

/// What is known of one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Space {
    /// Its floor was seen.
    Free,
    /// Never seen.
    Unknown,
    /// Something between ankle and head is there.
    Occupied,
    /// Something is there that reaches above two metres.
    Wall,
}

/// What is known of one cell, as it is stored.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// How sure one is that it is occupied, 0..=6.
    sure: u8,
    /// Bits of what was ever seen of it.
    seen: u8,
}

impl Cell {
    /// What is known of it.
    #[inline]
    pub fn space(self) -> Space {
        match (self.sure > 0, self.seen) {
            (true, seen) if seen & SEEN_HIGH != 0 => Space::Wall,
            (true, _) => Space::Occupied,
            (false, seen) if seen & SEEN_FREE != 0 => Space::Free,
            _ => Space::Unknown,
        }
    }

    /// Whether anything of it was ever seen within the known range.
    #[inline]
    pub fn is_known(self) -> bool {
        self.seen & SEEN_NEAR != 0
    }

    /// Whether something as tall as only walls are was ever seen there, and reaches down to where
    /// people are. A lintel does not: its floor is seen, and nothing between.
    #[inline]
    pub fn is_tall(self) -> bool {
        let is_open = self.seen & SEEN_FREE != 0 && self.seen & SEEN_FIRM == 0;
        self.seen & SEEN_TALL != 0 && !is_open
    }
}

/// Bits of what was ever seen of a cell.
const SEEN_FREE: u8 = 1;
const SEEN_HIGH: u8 = 2;
/// Too near to the feet to be seen, but nothing rises from it up to the eye.
const ASSUMED: u8 = 4;
/// Something of it was seen from near enough to count as known.
const SEEN_NEAR: u8 = 8;
/// Something of it was seen that is as tall as only walls are.
const SEEN_TALL: u8 = 16;
/// Something between ankle and head was seen there.
const SEEN_FIRM: u8 = 32;
/// What tells nothing of where one can walk.
const BESIDES: u8 = SEEN_NEAR | SEEN_TALL | SEEN_FIRM;
/// Bits of what one image shows of a cell.
const NOW_FLOOR: u8 = 1;
const NOW_OCCUPIED: u8 = 2;
const NOW_HIGH: u8 = 4;
const NOW_NEAR: u8 = 8;
const NOW_TALL: u8 = 16;

/// What a pixel shows is a cell times this, and `NOW_*` bits.
const SHOWN_CELL: u32 = 32;
/// So many pixels are looked at at once.
const LANES: usize = 16;

/// What counts as inside the map, as occupied and as near.
#[derive(Clone, Copy)]
struct Limits {
    grid: Grid,
    /// Nothing above this is in the way, metres; lower things are stepped over.
    head_m: f32,
    step_over_m: f32,
    /// What is seen within this counts as known, metres.
    known_m: f32,
}

impl Limits {
    /// What pixels of one row at depths `d` show, 0 for nothing. `columns` and `row` are those of
    /// [`Rays`], axis by axis.
    #[inline(always)]
    fn shown(
        &self,
        d: &[f32; LANES],
        columns: [&[f32; LANES]; 3],
        eye: Vec3,
        row: Vec3,
    ) -> [u32; LANES] {
        // Plain loops over plain lists, which become vectors: closures would be compiled apart.
        let mut any_near = false;
        for d in d {
            any_near |= (*d < MAP_RANGE_M) & (*d > Camera::NEAR_M);
        }
        let mut shown = [0; LANES];
        if !any_near {
            return shown;
        }
        let head_m = self.head_m.min(WALL_M);
        let [xs, ys, zs] = columns;
        for k in 0..LANES {
            let d = d[k];
            let x = eye.x + d * (xs[k] + row.x);
            let y = eye.y + d * (ys[k] + row.y);
            let z = eye.z + d * (zs[k] + row.z);
            // Masks instead of conditions, which the compiler would make branches of.
            let floor = mask(y < FLOOR_M) & u32::from(NOW_FLOOR);
            let firm = mask((y > self.step_over_m) & (y <= head_m)) & u32::from(NOW_OCCUPIED);
            let high = mask((y > WALL_M) & (y < TOP_M)) & u32::from(NOW_HIGH);
            let tall = mask((y > TALL_M) & (y < TOP_M)) & u32::from(NOW_TALL);
            let near = mask((d < self.known_m) & (y < TOP_M)) & u32::from(NOW_NEAR);
            let bits = floor | firm | high | tall | near;
            let cell = self.grid.cell_or_none(x, z);
            let is_near = (d < MAP_RANGE_M) & (d > Camera::NEAR_M);
            let counts = mask(is_near & (bits != 0) & (cell >= 0));
            shown[k] = ((cell as u32).wrapping_mul(SHOWN_CELL) | bits) & counts;
        }
        shown
    }
}

/// All bits or none.
#[inline(always)]
fn mask(is: bool) -> u32 {
    u32::from(is).wrapping_neg()
}

/// Every so many-th of a row of pixels.
#[inline(always)]
fn every(stride: usize, row: &[f32], sampled: &mut [f32]) {
    if stride == 2 && row.len().is_multiple_of(2) {
        // The usual case in a form that the compiler makes a few instructions of.
        sampled.iter_mut().zip(row.as_chunks::<2>().0).for_each(|(to, pair)| *to = pair[0]);
    } else {
        sampled.iter_mut().zip(row.iter().step_by(stride)).for_each(|(to, d)| *to = *d);
    }
}

/// A scan of one image, so that it is compiled for vectors of each width.
struct Scan<'a> {
    map: &'a mut OccupancyMap,
    depth: &'a [f32],
    percepts: &'a Percepts,
    camera: &'a Camera,
    limits_m: [f32; 2],
}

impl pulp::NullaryFnOnce for Scan<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.map.scan(self.depth, self.percepts, self.camera, self.limits_m);
    }
}

/// A plan of what stands firmly: structure and furniture. People and whatever can be moved are
/// not in it; the semantic map knows of them.
#[derive(Clone, Debug)]
pub struct OccupancyMap {
    grid: Grid,
    /// Lower things are stepped over, metres.
    step_over_m: f32,
    /// How sure one is that the cell is occupied, 0..=6.
    sure: Vec<u8>,
    seen: Vec<u8>,
    now: Vec<u8>,
    touched: Vec<u32>,
    /// Frame in which each coarse square was seen last, plus one; 0 if never.
    place_seen: Vec<Frame>,
    bumps: Bumps,
    version: u32,
}

impl OccupancyMap {
    /// An unknown place, where things lower than `step_over_m` are in nobody's way.
    pub fn new(bounds: &Rect, step_over_m: f32) -> OccupancyMap {
        OccupancyMap::on(Grid::over(bounds), step_over_m)
    }

    /// A drawn place.
    #[cfg(test)]
    pub(crate) fn of_spaces(grid: Grid, spaces: &[Space]) -> OccupancyMap {
        let mut map = OccupancyMap::on(grid, crate::test_support::MOTION.step_over_m);
        for (cell, space) in spaces.iter().enumerate() {
            (map.sure[cell], map.seen[cell]) = match space {
                Space::Free => (0, SEEN_FREE),
                Space::Unknown => (0, 0),
                Space::Occupied => (SURE_MOST, 0),
                Space::Wall => (SURE_MOST, SEEN_HIGH),
            };
        }
        map
    }

    fn on(grid: Grid, step_over_m: f32) -> OccupancyMap {
        let n = grid.n_cells();
        let n_places = grid.nx().div_ceil(PLACE_CELLS) * grid.nz().div_ceil(PLACE_CELLS);
        OccupancyMap {
            grid,
            step_over_m,
            sure: vec![0; n],
            seen: vec![0; n],
            now: vec![0; n],
            touched: Vec::new(),
            place_seen: vec![0; n_places],
            bumps: Bumps::default(),
            version: 0,
        }
    }

    /// Its lattice.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Grows whenever any cell changes.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// What is known of a cell.
    #[inline]
    pub fn space(&self, cell: usize) -> Space {
        Cell { sure: self.sure[cell], seen: self.seen[cell] }.space()
    }

    /// All cells, row by row.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + '_ {
        self.sure.iter().zip(&self.seen).map(|(sure, seen)| Cell { sure: *sure, seen: *seen })
    }

    /// Whether there is something to find out at a cell: it is unknown, and not only because it
    /// was too near to the feet.
    pub fn is_unexplored(&self, cell: usize) -> bool {
        self.space(cell) == Space::Unknown && self.seen[cell] & ASSUMED == 0
    }

    /// Whether anything of a cell was ever seen within the known range.
    pub fn is_known(&self, cell: usize) -> bool {
        self.seen[cell] & SEEN_NEAR != 0
    }

    /// Frame in which the metre square around a cell was seen last, if ever.
    pub fn place_seen(&self, cell: usize) -> Option<Frame> {
        self.place_seen[self.place_of(cell)].checked_sub(1)
    }

    fn place_of(&self, cell: usize) -> usize {
        let (i, j) = self.grid.column_row(cell);
        (j / PLACE_CELLS) * self.grid.nx().div_ceil(PLACE_CELLS) + i / PLACE_CELLS
    }

    /// Remembers that one could not get on at `at` (x, z), see [`Bumps::note`].
    pub fn bump(&mut self, at: Vec2, now: Frame, barred_frames: Frame) {
        self.bumps.note(at, now, barred_frames);
        self.version += 1;
    }

    /// Takes no place for a barrier any more.
    pub fn forget_barriers(&mut self) {
        self.version += u32::from(self.bumps.forget_barriers());
    }

    /// Where one could not get on although the map said so.
    pub fn bumps(&self) -> &Bumps {
        &self.bumps
    }

    /// Takes in what one image shows. `height_m` is the height of the own body: nothing above it
    /// is in the way. What is seen within `known_m` counts as known.
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
                let limits_m = [height_m, known_m];
                pulp::Arch::new().dispatch(Scan { map: self, depth, percepts, camera, limits_m });
                changed |= self.apply_scan(now);
                changed |= self.assume_near(depth, camera);
            }
        }
        // Where one stands is free.
        let here = xz(observation.own.pose.position);
        for cell in self.grid.disc(here, CELL_M) {
            changed |= self.seen[cell] & SEEN_FREE == 0 || self.sure[cell] > 0;
            self.seen[cell] |= SEEN_FREE;
            self.sure[cell] = 0;
        }
        self.version += u32::from(changed);
    }

    /// Marks in `now` what the image shows of each cell.
    #[inline(always)]
    fn scan(
        &mut self,
        depth: &[f32],
        percepts: &Percepts,
        camera: &Camera,
        [height_m, known_m]: [f32; 2],
    ) {
        let stride = percepts.stride.max(1) as usize;
        let (width, height) = (camera.width as usize, camera.height as usize);
        let sampled_width = width.div_ceil(stride);
        let rays = Rays::new(camera);
        // Padded to whole lanes; what is at no distance shows nothing.
        let padded_width = sampled_width.next_multiple_of(LANES);
        let columns: [Vec<f32>; 3] = std::array::from_fn(|axis| {
            let mut columns: Vec<f32> =
                rays.columns.iter().step_by(stride).map(|c| c[axis]).collect();
            columns.resize(padded_width, 0.0);
            columns
        });
        let [xs, ys, zs] = columns.each_ref().map(|c| c.as_chunks::<LANES>().0);
        let mut sampled = vec![0.0; padded_width];
        let limits = Limits {
            grid: self.grid,
            head_m: height_m + 0.05,
            step_over_m: self.step_over_m,
            known_m,
        };
        self.touched.clear();
        let mut above = vec![[0; LANES]; padded_width / LANES];
        for (k, row) in (0..height).step_by(stride).enumerate() {
            every(stride, &depth[row * width..][..width], &mut sampled);
            let dynamic = percepts.dynamic_mask.get(k * sampled_width..(k + 1) * sampled_width);
            for (d, is_dynamic) in sampled.iter_mut().zip(dynamic.unwrap_or_default()) {
                *d = if *is_dynamic { 0.0 } else { *d };
            }
            let mut last = 0;
            let lanes = sampled.as_chunks::<LANES>().0.iter().zip(xs.iter().zip(ys).zip(zs));
            for ((d, ((x, y), z)), above) in lanes.zip(&mut above) {
                let shown = limits.shown(d, [x, y, z], rays.eye, rays.rows[row]);
                // Neighbors mostly show the same: a bit for each that differs from the one before
                // and the one above.
                let mut before = [last; LANES];
                before[1..].copy_from_slice(&shown[..LANES - 1]);
                let mut changes = 0;
                for k in 0..LANES {
                    let is_new = (shown[k] != before[k]) & (shown[k] != above[k]);
                    changes |= u32::from(is_new) << k;
                }
                while changes != 0 {
                    self.mark(shown[changes.trailing_zeros() as usize % LANES]);
                    changes &= changes - 1;
                }
                last = shown[LANES - 1];
                *above = shown;
            }
        }
    }

    /// Marks what a pixel shows, see [`Limits::shown`].
    #[inline(always)]
    fn mark(&mut self, shown: u32) {
        if shown != 0 {
            let (cell, bits) = ((shown / SHOWN_CELL) as usize, (shown % SHOWN_CELL) as u8);
            if self.now[cell] == 0 {
                self.touched.push(cell as u32);
            }
            self.now[cell] |= bits;
        }
    }

    /// Turns `now` into knowledge; tells whether anything changed.
    fn apply_scan(&mut self, now: Frame) -> bool {
        let mut changed = false;
        let touched = std::mem::take(&mut self.touched);
        for &cell in &touched {
            let cell = cell as usize;
            let before = (self.sure[cell] > 0, self.seen[cell] & !BESIDES);
            let bits = std::mem::take(&mut self.now[cell]);
            if bits & NOW_OCCUPIED != 0 {
                self.sure[cell] = (self.sure[cell] + SURE_ONCE).min(SURE_MOST);
                self.seen[cell] |= SEEN_FIRM;
            } else if bits & NOW_FLOOR != 0 {
                self.sure[cell] = self.sure[cell].saturating_sub(1);
            }
            if bits & NOW_FLOOR != 0 {
                self.seen[cell] |= SEEN_FREE;
            }
            if bits & NOW_HIGH != 0 {
                self.seen[cell] |= SEEN_HIGH;
            }
            if bits & NOW_TALL != 0 {
                self.seen[cell] |= SEEN_TALL;
            }
            if bits & (NOW_FLOOR | NOW_OCCUPIED) != 0 {
                let place = self.place_of(cell);
                self.place_seen[place] = now + 1;
            }
            changed |= before != (self.sure[cell] > 0, self.seen[cell] & !BESIDES);
            if bits & NOW_NEAR != 0 {
                self.seen[cell] |= SEEN_NEAR;
            }
        }
        self.touched = touched;
        changed
    }

    /// The floor before one's feet is below the image. Where the view at eye height reaches
    /// beyond a cell, nothing large stands on it.
    fn assume_near(&mut self, depth: &[f32], camera: &Camera) -> bool {
        let eye = xz(camera.eye_in_world);
        let reach_m = camera.eye_in_world.y + 0.2;
        let level = (camera.height / 2) as usize * camera.width as usize;
        let mut changed = false;
        for cell in self.grid.disc(eye, reach_m) {
            if self.seen[cell] & (SEEN_FREE | ASSUMED) != 0 || self.sure[cell] > 0 {
                continue;
            }
            let center = self.grid.center(cell);
            let point = Vec3::new(center.x, camera.eye_in_world.y, center.y);
            let Some((px, d)) = camera.project(point) else { continue };
            if px.x < 0.0 || px.x >= camera.width as f32 {
                continue;
            }
            if depth[level + px.x as usize] > d {
                self.seen[cell] |= ASSUMED;
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

    fn look(map: &mut OccupancyMap, toy: &Toy) {
        let observation = toy.observe();
        let percepts = GroundTruthIds.perceive(&observation);
        map.integrate(&observation, &percepts, 1.75, MAP_RANGE_M);
    }

    fn space(map: &OccupancyMap, x: f32, z: f32) -> Space {
        map.space(map.grid().cell_at(Vec2::new(x, z)).expect("inside"))
    }

    #[test]
    fn floor_is_free_furniture_occupied_walls_wall_and_the_rest_unknown() {
        let mut toy = Toy::room(6.0, 6.0);
        toy.add(ToyObject::new("cabinet", [1.0, 0.0, -2.0], [0.8, 1.0, 0.4]));
        toy.add(ToyObject::new("apple", [-1.0, 0.0, -2.0], [0.3, 0.3, 0.3]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        look(&mut map, &toy);
        assert_eq!(space(&map, 0.0, -2.0), Space::Free);
        assert_eq!(space(&map, 1.0, -1.82), Space::Occupied);
        // The wall's face lies on a border between cells.
        let face = space(&map, 0.0, -3.01).max(space(&map, 0.0, -2.99));
        assert_eq!(face, Space::Wall);
        assert_eq!(space(&map, 0.0, 2.0), Space::Unknown, "behind the back");
        assert_ne!(space(&map, -1.0, -1.9), Space::Occupied, "an apple does not block");
        let near = map.grid().cell_at(Vec2::new(0.0, -1.0)).expect("inside");
        assert!(!map.is_unexplored(near), "just before the feet");
    }

    #[test]
    fn furniture_under_a_ceiling_is_no_wall() {
        let mut toy = Toy::room(6.0, 6.0);
        toy.add(ToyObject::new("cabinet", [1.0, 0.0, -2.0], [0.8, 1.0, 0.4]));
        toy.add(ToyObject::new("bed", [0.0, 2.6, 0.0], [6.0, 0.1, 6.0]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        look(&mut map, &toy);
        assert_eq!(space(&map, 1.0, -1.82), Space::Occupied);
        let face = space(&map, 0.0, -3.01).max(space(&map, 0.0, -2.99));
        assert_eq!(face, Space::Wall);
    }

    #[test]
    fn what_has_gone_is_free_again_after_some_looks() {
        let mut toy = Toy::room(6.0, 6.0);
        let cabinet = toy.add(ToyObject::new("cabinet", [0.0, 0.0, -2.2], [0.8, 0.6, 0.8]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        look(&mut map, &toy);
        assert_eq!(space(&map, 0.0, -1.85), Space::Occupied);
        toy.remove(cabinet);
        for _ in 0..SURE_MOST {
            look(&mut map, &toy);
        }
        assert_eq!(space(&map, 0.0, -1.85), Space::Free);
    }

    #[test]
    fn a_still_look_changes_nothing() {
        let mut toy = Toy::room(6.0, 6.0);
        toy.stand([0.0, 0.0], 0.3);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        look(&mut map, &toy);
        let version = map.version();
        look(&mut map, &toy);
        assert_eq!(map.version(), version);
        map.bump(Vec2::ZERO, 0, 0);
        assert!(map.version() > version && map.bumps().cells(map.grid()).count() > 4);
    }

    #[test]
    fn what_is_taller_than_anything_movable_is_never_forgotten() {
        let mut toy = Toy::room(6.0, 6.0);
        // Between the heights of a wall and of a wall for good, and above both.
        let heights_m = [0.5 * (WALL_M + TALL_M), 0.5 * (TALL_M + TOP_M)];
        let boxes = [(-0.7, heights_m[0]), (0.7, heights_m[1])].map(|(x, height_m)| {
            toy.add(ToyObject::new("cabinet", [x, 0.0, -2.2], [0.8, height_m, 0.8]))
        });
        toy.stand([0.0, 0.0], 0.0);
        let mut map = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        let know = |map: &OccupancyMap| {
            [-0.7, 0.7].map(|x| {
                let cell = map.grid().cell_at(Vec2::new(x, -1.85)).expect("inside");
                (map.space(cell), map.cells().nth(cell).expect("inside").is_tall())
            })
        };
        look(&mut map, &toy);
        assert_eq!(know(&map), [(Space::Wall, false), (Space::Wall, true)]);
        boxes.into_iter().for_each(|entity| toy.remove(entity));
        for _ in 0..2 * SURE_MOST {
            look(&mut map, &toy);
        }
        assert_eq!(know(&map), [(Space::Free, false), (Space::Free, true)]);
    }

    #[test]
    fn what_hangs_above_the_head_makes_its_place_known_but_neither_free_nor_occupied() {
        let mut toy = Toy::room(8.0, 8.0);
        // A wide cabinet hides the floor; a board hangs above it, a little behind.
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
            assert_eq!([map.space(under), map.space(beside)], [Space::Unknown; 2]);
        }
    }
}
