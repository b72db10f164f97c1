//! Grid that all maps share.

use chaic_core::Vec2;
use chaic_core::geom::Rect;
use chaic_core::geom::math::floor_small;

/// Side of a cell, meters (facts A1.1).
pub const CELL_M: f32 = 0.125;
/// Margin of the grid beyond the bounds of the episode, meters.
const MARGIN_M: f32 = 1.0;
/// Maximum number of cells along one side, 203 m: an episode has at most 200 m, and there are two
/// margins. A larger area is mapped only in part.
pub(crate) const MAX_SIDE: usize = 1624;

/// Grid of square cells over a part of the ground plane, row by row along x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    min: Vec2,
    nx: usize,
    nz: usize,
}

impl Grid {
    /// Creates the grid over `bounds`, grown by one meter.
    pub fn new(bounds: &Rect) -> Grid {
        let grown = bounds.expanded(MARGIN_M);
        let cells = |length: f32| ((length / CELL_M).ceil() as usize).clamp(1, MAX_SIDE);
        let size = grown.size();
        Grid { min: grown.min, nx: cells(size.x), nz: cells(size.y) }
    }

    /// Creates a grid of this size from the origin.
    #[cfg(test)]
    pub(crate) fn with_size(nx: usize, nz: usize) -> Grid {
        Grid { min: Vec2::ZERO, nx, nz }
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.nx * self.nz
    }

    /// Number of cells along x.
    pub fn nx(&self) -> usize {
        self.nx
    }

    /// Number of cells along z.
    pub fn nz(&self) -> usize {
        self.nz
    }

    /// Returns the cell that contains the point (x, z); `None` outside the grid.
    #[inline]
    pub fn cell_at(&self, p: Vec2) -> Option<usize> {
        let q = (p - self.min) * (1.0 / CELL_M);
        if q.x >= 0.0 && q.y >= 0.0 {
            let (i, j) = (q.x as usize, q.y as usize);
            if i < self.nx && j < self.nz {
                return Some(j * self.nx + i);
            }
        }
        None
    }

    /// Returns the same as [`Grid::cell_at`] without branches, for loops over many points; -1
    /// outside the grid.
    #[inline(always)]
    pub fn cell_or_none(&self, x: f32, z: f32) -> i32 {
        let (x, z) = ((x - self.min.x) * (1.0 / CELL_M), (z - self.min.y) * (1.0 / CELL_M));
        let (nx, nz) = (self.nx as i32, self.nz as i32);
        let inside = (x >= 0.0) & (z >= 0.0) & (x < nx as f32) & (z < nz as f32);
        let cell = floor_small(z).wrapping_mul(nx).wrapping_add(floor_small(x));
        cell | i32::from(inside).wrapping_sub(1)
    }

    /// Column and row of a cell.
    #[inline]
    pub fn column_row(&self, cell: usize) -> (usize, usize) {
        // Divides in 32 bits, which takes half as long: there are fewer than 2^22 cells.
        let (cell, nx) = (cell as u32, self.nx as u32);
        ((cell % nx) as usize, (cell / nx) as usize)
    }

    /// Center of a cell (x, z).
    pub fn center(&self, cell: usize) -> Vec2 {
        let (i, j) = self.column_row(cell);
        self.center_at(i, j)
    }

    fn center_at(&self, column: usize, row: usize) -> Vec2 {
        self.min + CELL_M * Vec2::new(column as f32 + 0.5, row as f32 + 0.5)
    }

    /// Returns the neighbors of a cell: index, and whether the neighbor is diagonal.
    #[inline]
    pub fn neighbors(&self, cell: usize) -> impl Iterator<Item = (usize, bool)> + use<> {
        let (i, j) = self.column_row(cell);
        let (nx, nz) = (self.nx as isize, self.nz as isize);
        DIRECTIONS.iter().filter_map(move |&(di, dj)| {
            let (a, b) = (i as isize + di, j as isize + dj);
            let inside = a >= 0 && b >= 0 && a < nx && b < nz;
            inside.then_some(((b * nx + a) as usize, di != 0 && dj != 0))
        })
    }

    /// Visits the straight neighbors of the cell in column `i` and row `j`, in the order of
    /// [`Grid::neighbors`], with index, column and row of each.
    #[inline]
    pub fn for_straight_neighbors(
        &self,
        i: usize,
        j: usize,
        mut visit: impl FnMut(usize, usize, usize),
    ) {
        let cell = j * self.nx + i;
        if i + 1 < self.nx {
            visit(cell + 1, i + 1, j);
        }
        if i > 0 {
            visit(cell - 1, i - 1, j);
        }
        if j + 1 < self.nz {
            visit(cell + self.nx, i, j + 1);
        }
        if j > 0 {
            visit(cell - self.nx, i, j - 1);
        }
    }

    /// Returns the cells whose center is within `radius_m` of `center`.
    pub fn disc(&self, center: Vec2, radius_m: f32) -> impl Iterator<Item = usize> + use<> {
        let grid = *self;
        let low = (center - radius_m - self.min) / CELL_M;
        let high = (center + radius_m - self.min) / CELL_M;
        let clip = |v: f32, n: usize| (v.max(0.0) as usize).min(n);
        let (i0, i1) = (clip(low.x, self.nx), clip(high.x + 1.0, self.nx));
        let (j0, j1) = (clip(low.y, self.nz), clip(high.y + 1.0, self.nz));
        let within =
            move |i, j| grid.center_at(i, j).distance_squared(center) <= radius_m * radius_m;
        (j0..j1).flat_map(move |j| {
            (i0..i1).filter(move |&i| within(i, j)).map(move |i| j * grid.nx + i)
        })
    }

    /// Returns the cells along a straight line, in steps of half a cell, including both ends.
    /// Points outside the grid are skipped.
    pub fn line(&self, from: Vec2, to: Vec2) -> impl Iterator<Item = usize> + use<> {
        let grid = *self;
        let n = (from.distance(to) / (0.5 * CELL_M)).ceil().max(1.0) as usize;
        (0..=n).filter_map(move |k| grid.cell_at(from.lerp(to, k as f32 / n as f32)))
    }
}

/// Straight neighbors first, then diagonal ones.
const DIRECTIONS: [(isize, isize); 8] =
    [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_and_points_agree_and_nothing_is_clamped() {
        let grid = Grid::new(&Rect::new([-2.0, -1.0], [3.0, 4.0]));
        assert_eq!((grid.nx(), grid.nz()), (56, 56));
        for cell in [0, 55, 56, grid.n_cells() - 1] {
            assert_eq!(grid.cell_at(grid.center(cell)), Some(cell));
        }
        assert_eq!(grid.cell_at(Vec2::new(-3.1, 0.0)), None);
        assert_eq!(grid.cell_at(Vec2::new(0.0, 5.1)), None);
        let across = || (-40..60).map(|k| 0.11 * k as f32).chain([f32::NAN, f32::INFINITY, -1e30]);
        for (x, z) in across().flat_map(|x| across().map(move |z| (x, z))) {
            let cell = grid.cell_at(Vec2::new(x, z)).map_or(-1, |c| c as i32);
            assert_eq!(grid.cell_or_none(x, z), cell, "{x} {z}");
        }
    }

    #[test]
    fn corners_have_three_neighbors_and_inner_cells_eight() {
        let grid = Grid::new(&Rect::new([0.0, 0.0], [1.0, 1.0]));
        assert_eq!(grid.neighbors(0).count(), 3);
        assert_eq!(grid.neighbors(grid.nx() + 1).count(), 8);
        for cell in [0, 5, grid.nx() - 1, grid.nx() + 1, grid.n_cells() - 1] {
            let (i, j) = grid.column_row(cell);
            let mut visited = Vec::new();
            grid.for_straight_neighbors(i, j, |next, i, j| {
                assert_eq!(grid.column_row(next), (i, j));
                visited.push(next);
            });
            let straight = grid.neighbors(cell).filter(|(_, diagonal)| !diagonal);
            assert_eq!(visited, straight.map(|(next, _)| next).collect::<Vec<_>>());
        }
        assert_eq!(grid.disc(grid.center(100), 0.13).count(), 5);
    }

    #[test]
    fn the_longest_episode_is_mapped_completely_and_larger_areas_in_part() {
        for (length_m, is_complete) in [(126.5, true), (200.0, true), (205.0, false), (1e9, false)]
        {
            let bounds = Rect::new([-100.0; 2], [length_m - 100.0; 2]);
            let grid = Grid::new(&bounds);
            assert!(grid.nx() <= MAX_SIDE && grid.nz() <= MAX_SIDE, "{length_m} m");
            assert_eq!(grid.cell_at(bounds.max).is_some(), is_complete, "{length_m} m");
            assert!(grid.cell_at(bounds.min).is_some());
            for p in [bounds.min, bounds.max, Vec2::new(99.9, 99.9), Vec2::new(-100.9, 99.9)] {
                let cell = grid.cell_at(p).map_or(-1, |cell| cell as i32);
                assert_eq!(grid.cell_or_none(p.x, p.y), cell, "{length_m} m: {p}");
            }
            let last = grid.n_cells() - 1;
            assert_eq!(grid.column_row(last), (grid.nx() - 1, grid.nz() - 1));
            assert_eq!(grid.cell_at(grid.center(last)), Some(last));
            assert_eq!(grid.neighbors(last).count(), 3);
        }
    }
}
