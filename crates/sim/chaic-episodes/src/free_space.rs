//! Occupancy grid in plan: cells in which a body of a given radius can stand.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use chaic_core::Vec2;
use chaic_core::geom::Rect;

use crate::upright_box::{UprightBox, rect_distance};

/// Default side of a cell, meters.
pub(crate) const CELL_M: f32 = 0.1;

/// Grid of free and blocked cells in plan.
#[derive(Clone, Debug)]
pub(crate) struct FreeSpace {
    min: Vec2,
    cell_m: f32,
    pub(crate) nx: usize,
    pub(crate) nz: usize,
    /// True if the center of a body may be at the center of the cell, per cell.
    pub(crate) free: Vec<bool>,
}

impl FreeSpace {
    /// Returns a grid over a rectangle with all cells free.
    pub(crate) fn new(rect: Rect) -> FreeSpace {
        FreeSpace::with_cell_size(rect, CELL_M)
    }

    /// Returns a grid with cells of another size.
    fn with_cell_size(rect: Rect, cell_m: f32) -> FreeSpace {
        let size = rect.size() / cell_m;
        let (nx, nz) = (size.x.ceil().max(1.0) as usize, size.y.ceil().max(1.0) as usize);
        FreeSpace { min: rect.min, cell_m, nx, nz, free: vec![true; nx * nz] }
    }

    /// Returns the cells in which a body of `radius_m` can stand within `rect` among solids.
    pub(crate) fn around<'a>(
        rect: Rect,
        radius_m: f32,
        solids: impl IntoIterator<Item = &'a UprightBox>,
    ) -> FreeSpace {
        FreeSpace::block_solids(FreeSpace::new(rect), rect, radius_m, solids)
    }

    /// Same as [`FreeSpace::around`] with cells of another size.
    pub(crate) fn around_with_cell_size<'a>(
        rect: Rect,
        cell_m: f32,
        radius_m: f32,
        solids: impl IntoIterator<Item = &'a UprightBox>,
    ) -> FreeSpace {
        FreeSpace::block_solids(FreeSpace::with_cell_size(rect, cell_m), rect, radius_m, solids)
    }

    fn block_solids<'a>(
        mut grid: FreeSpace,
        rect: Rect,
        radius_m: f32,
        solids: impl IntoIterator<Item = &'a UprightBox>,
    ) -> FreeSpace {
        for i in 0..grid.free.len() {
            let p = grid.middle(i);
            grid.free[i] = rect.expanded(-radius_m).contains(p);
        }
        for solid in solids {
            grid.block(solid.bounds().expanded(radius_m), |p| solid.distance(p) < radius_m);
        }
        grid
    }

    /// Blocks the cells nearer than `radius_m` to a rectangle.
    pub(crate) fn block_rect(&mut self, rect: &Rect, radius_m: f32) {
        self.block(rect.expanded(radius_m), |p| rect_distance(rect, p) < radius_m);
    }

    fn block(&mut self, within: Rect, is_blocked: impl Fn(Vec2) -> bool) {
        for i in self.cells_in(within) {
            if self.free[i] && is_blocked(self.middle(i)) {
                self.free[i] = false;
            }
        }
    }

    /// Returns the center of a cell.
    pub(crate) fn middle(&self, i: usize) -> Vec2 {
        let (x, z) = (i % self.nx, i / self.nx);
        self.min + self.cell_m * Vec2::new(x as f32 + 0.5, z as f32 + 0.5)
    }

    /// Returns the cell that contains a point.
    pub(crate) fn cell(&self, p: Vec2) -> Option<usize> {
        let d = (p - self.min) / self.cell_m;
        if d.x < 0.0 || d.y < 0.0 {
            return None;
        }
        let (x, z) = (d.x as usize, d.y as usize);
        (x < self.nx && z < self.nz).then_some(z * self.nx + x)
    }

    /// Returns the cells whose centers may lie in a rectangle.
    pub(crate) fn cells_in(&self, rect: Rect) -> impl Iterator<Item = usize> + use<> {
        let clamp = |v: f32, n: usize| v.clamp(0.0, n as f32) as usize;
        let (low, high) =
            ((rect.min - self.min) / self.cell_m, (rect.max - self.min) / self.cell_m);
        let xs = clamp(low.x.floor(), self.nx)..clamp(high.x.ceil(), self.nx);
        let zs = clamp(low.y.floor(), self.nz)..clamp(high.y.ceil(), self.nz);
        let nx = self.nx;
        zs.flat_map(move |z| xs.clone().map(move |x| z * nx + x))
    }

    /// Returns the free cells that are reachable from the cells around `start`. A body at `start`
    /// may overlap a wall by less than half a cell.
    pub(crate) fn flood(&self, start: Vec2) -> Vec<bool> {
        let mut reached = vec![false; self.free.len()];
        let near = Rect { min: start, max: start }.expanded(self.cell_m);
        let mut open: Vec<usize> = self.cells_in(near).filter(|i| self.free[*i]).collect();
        open.iter().for_each(|i| reached[*i] = true);
        while let Some(i) = open.pop() {
            let (x, z) = (i % self.nx, i / self.nx);
            let mut visit = |j: usize| {
                if self.free[j] && !reached[j] {
                    reached[j] = true;
                    open.push(j);
                }
            };
            if x > 0 {
                visit(i - 1);
            }
            if x + 1 < self.nx {
                visit(i + 1);
            }
            if z > 0 {
                visit(i - self.nx);
            }
            if z + 1 < self.nz {
                visit(i + self.nx);
            }
        }
        reached
    }

    /// Returns the shortest path length from the nearest start cell to every cell, meters, over
    /// straight and diagonal steps. Unreachable cells are infinite.
    pub(crate) fn path_lengths(&self, starts: impl Iterator<Item = usize>) -> Vec<f32> {
        let mut length_m = vec![f32::INFINITY; self.free.len()];
        // Positive floats sort like their bits.
        let mut open = BinaryHeap::new();
        for i in starts.filter(|i| self.free[*i]) {
            length_m[i] = 0.0;
            open.push(Reverse((0.0_f32.to_bits(), i)));
        }
        while let Some(Reverse((bits, i))) = open.pop() {
            let distance_so_far_m = f32::from_bits(bits);
            if distance_so_far_m > length_m[i] {
                continue;
            }
            let (x, z) = ((i % self.nx) as isize, (i / self.nx) as isize);
            for (dx, dz) in (-1..=1).flat_map(|dz| (-1..=1).map(move |dx| (dx, dz))) {
                let (x, z) = (x + dx, z + dz);
                if x < 0 || z < 0 || x >= self.nx as isize || z >= self.nz as isize {
                    continue;
                }
                let j = z as usize * self.nx + x as usize;
                let step_m = self.cell_m * ((dx * dx + dz * dz) as f32).sqrt();
                if self.free[j] && distance_so_far_m + step_m < length_m[j] {
                    length_m[j] = distance_so_far_m + step_m;
                    open.push(Reverse((length_m[j].to_bits(), j)));
                }
            }
        }
        length_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_in_a_wall_stops_only_wide_bodies() {
        let room = Rect::new([0.0, 0.0], [4.0, 2.0]);
        for (radius, passes) in [(0.2, true), (0.35, false)] {
            let mut grid = FreeSpace::around(room, radius, []);
            grid.block_rect(&Rect::new([2.0, 0.0], [2.1, 1.42]), radius);
            let reached = grid.flood(Vec2::new(1.0, 1.0));
            let there = grid.cell(Vec2::new(3.0, 1.0)).map(|i| reached[i]);
            assert_eq!(there, Some(passes), "radius {radius}");
        }
    }

    #[test]
    fn paths_go_around_walls_and_diagonally() {
        // A wall between two halves, open at the top only.
        let mut grid = FreeSpace::around(Rect::new([0.0, 0.0], [4.0, 4.0]), 0.0, []);
        grid.block_rect(&Rect::new([1.9, 0.0], [2.1, 3.0]), 0.04);
        let at = |x, z| grid.cell(Vec2::new(x, z)).expect("inside");
        let length_m = grid.path_lengths([at(0.05, 0.05)].into_iter());
        assert!((length_m[at(1.05, 1.05)] - 2.0_f32.sqrt()).abs() < 1e-4);
        // To the corner and around it by 19 diagonal and 11 straight steps, one along the top,
        // and down again in the same way.
        let expected_m = 0.1 * (38.0 * 2.0_f32.sqrt() + 23.0);
        let found_m = length_m[at(3.95, 0.05)];
        assert!((found_m - expected_m).abs() < 1e-3, "{found_m} for {expected_m}");
        assert_eq!(length_m[at(1.95, 0.05)], f32::INFINITY, "in the wall");
    }
}
