//! The lattice that all maps share.

use chaic_core::Vec2;
use chaic_core::geom::Rect;
use chaic_core::geom::math::floor_small;

/// Side of a cell, metres (facts A1.1).
pub const CELL_M: f32 = 0.125;
/// How far the lattice reaches beyond the bounds of the episode, metres.
const MARGIN_M: f32 = 1.0;
/// Most cells along one side: 128 m; a larger place is seen in part only.
const MAX_SIDE: usize = 1024;

/// A lattice of square cells over a part of the plane, row by row along x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    min: Vec2,
    nx: usize,
    nz: usize,
}

impl Grid {
    /// The lattice over `bounds`, grown by one metre.
    pub fn over(bounds: &Rect) -> Grid {
        let grown = bounds.grown(MARGIN_M);
        let cells = |length: f32| ((length / CELL_M).ceil() as usize).clamp(1, MAX_SIDE);
        let size = grown.size();
        Grid { min: grown.min, nx: cells(size.x), nz: cells(size.y) }
    }

    /// A lattice of so many cells from the origin on.
    #[cfg(test)]
    pub(crate) fn of_cells(nx: usize, nz: usize) -> Grid {
        Grid { min: Vec2::ZERO, nx, nz }
    }

    /// How many cells there are.
    pub fn n_cells(&self) -> usize {
        self.nx * self.nz
    }

    /// Cells along x.
    pub fn nx(&self) -> usize {
        self.nx
    }

    /// Cells along z.
    pub fn nz(&self) -> usize {
        self.nz
    }

    /// The cell that the point (x, z) lies in, if any: points outside belong to no cell.
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

    /// [`Grid::cell_at`] without branches, for loops over very many points; -1 if there is none.
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
        // Divides in 32 bits, which takes half as long: there are 2^20 cells at most.
        let (cell, nx) = (cell as u32, self.nx as u32);
        ((cell % nx) as usize, (cell / nx) as usize)
    }

    /// Middle of a cell (x, z).
    pub fn center(&self, cell: usize) -> Vec2 {
        let (i, j) = self.column_row(cell);
        self.center_at(i, j)
    }

    fn center_at(&self, column: usize, row: usize) -> Vec2 {
        self.min + CELL_M * Vec2::new(column as f32 + 0.5, row as f32 + 0.5)
    }

    /// The neighbors of a cell: its number, and whether it lies diagonally.
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
    /// [`Grid::neighbors`], with number, column and row of each.
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

    /// The cells whose middle is within `radius_m` of `center`.
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

    /// The cells along a straight line, in steps of half a cell, both ends included; points
    /// outside the lattice are left out.
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
        let grid = Grid::over(&Rect::new([-2.0, -1.0], [3.0, 4.0]));
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
        let grid = Grid::over(&Rect::new([0.0, 0.0], [1.0, 1.0]));
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
}
