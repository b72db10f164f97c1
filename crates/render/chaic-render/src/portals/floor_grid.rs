//! The grid of a house's plan: which cells walls fill, and which region each other one belongs to.

use chaic_core::Vec2;
use chaic_core::geom::Rect;
use chaic_world::{RoomKind, Setup, Wall};

use super::{MAX_REGIONS, Portal, Run, SLACK_M, WALL};
use crate::grid::neighbors;
use crate::structure::Line;

/// Side of a cell, metres, unless the plan is too large for it: walls that are twice as thick have
/// opaque cells wherever they stand.
const CELL_M: f32 = 0.05;
/// Most cells along a side.
const MAX_CELLS: usize = 512;
/// Cells beyond the plan on each side: what they belong to goes on for ever.
const BORDER: usize = 2;
/// A cell that has no region yet.
const NONE: u8 = u8::MAX - 1;

/// A house's plan in cells.
pub(super) struct FloorGrid {
    /// Where the first cell begins.
    pub min: Vec2,
    pub cell_m: f32,
    pub n_x: usize,
    pub n_z: usize,
    /// Each cell's region, or [`WALL`]; shape [n_z, n_x].
    cells: Vec<u8>,
}

impl FloorGrid {
    /// The plan of a house; `None` if it has no walls, or no size.
    pub fn new(setup: &Setup, ceiling_m: f32) -> Option<FloorGrid> {
        let is_high = |w: &&Wall| w.bottom_m <= SLACK_M && w.top_m >= ceiling_m - SLACK_M;
        let walls: Vec<Line> = setup.walls.iter().filter(is_high).map(Line::of).collect();
        let ends = setup.walls.iter().flat_map(|w| [w.a, w.b]);
        let house = ends.fold(setup.bounds, |r, p| Rect { min: r.min.min(p), max: r.max.max(p) });
        let size = house.size();
        if walls.is_empty() || !size.is_finite() || size.min_element() <= 0.0 {
            return None;
        }
        let cell_m = CELL_M.max(size.max_element() / (MAX_CELLS - 2 * BORDER - 1) as f32);
        let count = |m: f32| (m / cell_m) as usize + 2 * BORDER + 1;
        let (n_x, n_z) = (count(size.x), count(size.y));
        let min = house.min - BORDER as f32 * cell_m;
        let mut plan = FloorGrid { min, cell_m, n_x, n_z, cells: vec![NONE; n_x * n_z] };
        for wall in &walls {
            plan.fill_wall(wall);
        }
        plan.fill_regions(setup);
        Some(plan)
    }

    fn corner(&self, x: usize, z: usize) -> Vec2 {
        self.min + self.cell_m * Vec2::new(x as f32, z as f32)
    }

    /// The cells that a rectangle touches, row by row.
    fn cells_of(&self, rect: &Rect) -> impl Iterator<Item = (usize, usize)> + use<> {
        let cell = |m: f32, n: usize| ((m / self.cell_m) as usize).min(n - 1);
        let (low, high) = (rect.min - self.min, rect.max - self.min);
        let (first, last) = (cell(low.x, self.n_x), cell(high.x, self.n_x));
        let rows = cell(low.y, self.n_z)..=cell(high.y, self.n_z);
        rows.flat_map(move |z| (first..=last).map(move |x| (x, z)))
    }

    /// Makes the cells opaque that are wholly inside a wall.
    fn fill_wall(&mut self, wall: &Line) {
        let reach = wall.axis.abs() * wall.half.x + wall.axis.perp().abs() * wall.half.y;
        // Walls begin just where cells do as often as not.
        let half = wall.half + 0.01 * self.cell_m;
        for (x, z) in self.cells_of(&Rect { min: wall.middle - reach, max: wall.middle + reach }) {
            let is_inside = [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().all(|(dx, dz)| {
                let d = self.corner(x + dx, z + dz) - wall.middle;
                d.dot(wall.axis).abs() <= half.x && d.perp_dot(wall.axis).abs() <= half.y
            });
            if is_inside {
                self.cells[z * self.n_x + x] = WALL;
            }
        }
    }

    /// Gives all other cells a region: that of their room, or else of all that is connected with
    /// them outside of rooms.
    fn fill_regions(&mut self, setup: &Setup) {
        let name = |n: usize| n.min(MAX_REGIONS - 1) as u8;
        let mut n = 0;
        for room in setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors) {
            for (x, z) in self.cells_of(&room.rect) {
                let middle = self.corner(x, z) + 0.5 * self.cell_m;
                let cell = &mut self.cells[z * self.n_x + x];
                if *cell == NONE && room.rect.contains(middle) {
                    *cell = name(n);
                }
            }
            n += 1;
        }
        for k in 0..self.cells.len() {
            if self.cells[k] == NONE {
                self.flood(k, name(n));
                n += 1;
            }
        }
    }

    /// Gives a cell that has none a region, and all that are connected with it.
    fn flood(&mut self, k: usize, region: u8) {
        self.cells[k] = region;
        let mut todo = vec![k];
        while let Some(k) = todo.pop() {
            for k in neighbors(k, self.n_x, self.n_z) {
                if self.cells[k] == NONE {
                    self.cells[k] = region;
                    todo.push(k);
                }
            }
        }
    }

    /// Where cells of different regions meet.
    pub fn portals(&self) -> Vec<Portal> {
        let cell = |x: usize, z: usize| self.cells[z * self.n_x + x];
        let mut portals: Vec<Portal> = Vec::new();
        let mut add = |a: Vec2, b: Vec2, regions: [u8; 2]| {
            if regions[0] == regions[1] || regions.contains(&WALL) {
                return;
            }
            // It may go on where the one before ended.
            match portals.last_mut() {
                Some(last) if last.b == a && last.regions == regions => last.b = b,
                _ => portals.push(Portal { a, b, regions }),
            }
        };
        for x in 1..self.n_x {
            for z in 0..self.n_z {
                let regions = [cell(x - 1, z), cell(x, z)];
                add(self.corner(x, z), self.corner(x, z + 1), regions);
            }
        }
        for z in 1..self.n_z {
            for x in 0..self.n_x {
                let regions = [cell(x, z - 1), cell(x, z)];
                add(self.corner(x, z), self.corner(x + 1, z), regions);
            }
        }
        portals
    }

    /// Rows of cells that are alike, as the end of each band and its runs of one region.
    pub fn bands(&self) -> Vec<(u16, Vec<Run>)> {
        let mut bands: Vec<(u16, Vec<Run>)> = Vec::new();
        for (z, row) in self.cells.chunks(self.n_x).enumerate() {
            let mut runs: Vec<Run> = Vec::new();
            for (x, region) in row.iter().enumerate() {
                let end = x as u16 + 1;
                match runs.last_mut() {
                    Some(last) if last.region == *region => last.end = end,
                    _ => runs.push(Run { end, region: *region }),
                }
            }
            let end = z as u16 + 1;
            match bands.last_mut() {
                Some((last_end, last)) if *last == runs => *last_end = end,
                _ => bands.push((end, runs)),
            }
        }
        bands
    }
}
