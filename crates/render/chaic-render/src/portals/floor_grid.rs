//! Grid of a floor plan: opaque cells inside walls, and the region of every other cell.

use chaic_core::Vec2;
use chaic_core::geom::Rect;
use chaic_world::{RoomKind, Setup, Wall};

use super::{MAX_REGIONS, Portal, Run, TOLERANCE_M, WALL};
use crate::grid::neighbors;
use crate::structure::WallFrame;

/// Cell size, meters, unless the plan is too large for it. Walls that are at least twice as thick
/// always contain opaque cells.
const CELL_M: f32 = 0.05;
/// Maximum number of cells along a side.
const MAX_CELLS: usize = 512;
/// Number of border cells on each side of the plan: their region extends to infinity.
const BORDER: usize = 2;
/// Marker of a cell without a region.
const UNASSIGNED: u8 = u8::MAX - 1;

/// A floor plan as a grid of cells.
pub(super) struct FloorGrid {
    /// Corner of the first cell.
    pub min: Vec2,
    pub cell_m: f32,
    pub n_x: usize,
    pub n_z: usize,
    /// Region of each cell, or [`WALL`]; shape [n_z, n_x].
    cells: Vec<u8>,
}

impl FloorGrid {
    /// Builds the grid of a house; `None` if it has no full-height walls or no size.
    pub fn new(setup: &Setup, ceiling_m: f32) -> Option<FloorGrid> {
        let is_high = |w: &&Wall| w.bottom_m <= TOLERANCE_M && w.top_m >= ceiling_m - TOLERANCE_M;
        let walls: Vec<WallFrame> =
            setup.walls.iter().filter(is_high).map(WallFrame::new).collect();
        let ends = setup.walls.iter().flat_map(|w| [w.a, w.b]);
        let bounds = ends.fold(setup.bounds, |r, p| Rect { min: r.min.min(p), max: r.max.max(p) });
        let size = bounds.size();
        if walls.is_empty() || !size.is_finite() || size.min_element() <= 0.0 {
            return None;
        }
        let cell_m = CELL_M.max(size.max_element() / (MAX_CELLS - 2 * BORDER - 1) as f32);
        let n_cells = |m: f32| (m / cell_m) as usize + 2 * BORDER + 1;
        let (n_x, n_z) = (n_cells(size.x), n_cells(size.y));
        let min = bounds.min - BORDER as f32 * cell_m;
        let mut plan = FloorGrid { min, cell_m, n_x, n_z, cells: vec![UNASSIGNED; n_x * n_z] };
        for wall in &walls {
            plan.mark_wall(wall);
        }
        plan.fill_regions(setup);
        Some(plan)
    }

    fn corner(&self, x: usize, z: usize) -> Vec2 {
        self.min + self.cell_m * Vec2::new(x as f32, z as f32)
    }

    /// Iterates over the cells that a rectangle touches, row by row.
    fn cells_in(&self, rect: &Rect) -> impl Iterator<Item = (usize, usize)> + use<> {
        let cell = |m: f32, n: usize| ((m / self.cell_m) as usize).min(n - 1);
        let (low, high) = (rect.min - self.min, rect.max - self.min);
        let (first, last) = (cell(low.x, self.n_x), cell(high.x, self.n_x));
        let rows = cell(low.y, self.n_z)..=cell(high.y, self.n_z);
        rows.flat_map(move |z| (first..=last).map(move |x| (x, z)))
    }

    /// Marks the cells that are completely inside a wall as opaque.
    fn mark_wall(&mut self, wall: &WallFrame) {
        let half_extent = wall.axis.abs() * wall.half.x + wall.axis.perp().abs() * wall.half.y;
        // Walls often begin exactly at a cell boundary.
        let half = wall.half + 0.01 * self.cell_m;
        for (x, z) in
            self.cells_in(&Rect { min: wall.center - half_extent, max: wall.center + half_extent })
        {
            let is_inside = [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().all(|(dx, dz)| {
                let d = self.corner(x + dx, z + dz) - wall.center;
                d.dot(wall.axis).abs() <= half.x && d.perp_dot(wall.axis).abs() <= half.y
            });
            if is_inside {
                self.cells[z * self.n_x + x] = WALL;
            }
        }
    }

    /// Assigns a region to every other cell: its room, or its connected component outside of rooms.
    fn fill_regions(&mut self, setup: &Setup) {
        let region_id = |n: usize| n.min(MAX_REGIONS - 1) as u8;
        let mut n = 0;
        for room in setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors) {
            for (x, z) in self.cells_in(&room.rect) {
                let center = self.corner(x, z) + 0.5 * self.cell_m;
                let cell = &mut self.cells[z * self.n_x + x];
                if *cell == UNASSIGNED && room.rect.contains(center) {
                    *cell = region_id(n);
                }
            }
            n += 1;
        }
        for k in 0..self.cells.len() {
            if self.cells[k] == UNASSIGNED {
                self.flood_fill(k, region_id(n));
                n += 1;
            }
        }
    }

    /// Assigns a region to a cell and to all cells without a region that are connected to it.
    fn flood_fill(&mut self, k: usize, region: u8) {
        self.cells[k] = region;
        let mut stack = vec![k];
        while let Some(k) = stack.pop() {
            for k in neighbors(k, self.n_x, self.n_z) {
                if self.cells[k] == UNASSIGNED {
                    self.cells[k] = region;
                    stack.push(k);
                }
            }
        }
    }

    /// Returns the portals: segments where cells of different regions meet.
    pub fn portals(&self) -> Vec<Portal> {
        let cell = |x: usize, z: usize| self.cells[z * self.n_x + x];
        let mut portals: Vec<Portal> = Vec::new();
        let mut add = |a: Vec2, b: Vec2, regions: [u8; 2]| {
            if regions[0] == regions[1] || regions.contains(&WALL) {
                return;
            }
            // A portal may continue the previous one.
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

    /// Returns the bands of identical rows: the end of each band and its runs.
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
