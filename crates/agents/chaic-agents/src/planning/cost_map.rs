//! Cost map: the cost of entering each cell with a body of a given radius.

use std::cell::OnceCell;
use std::ops::Range;

use chaic_core::Vec2;

use crate::mapping::grid::{CELL_M, Grid};

/// Cost of entering a free cell without obstacles nearby. Costs rise in the paper's order: free,
/// unknown, near something, occupied, wall.
pub const FREE: u32 = 10;
/// Extra cost of a cell whose floor was never seen (facts A1.5: 2.5 times a free cell).
pub const UNKNOWN_CELL_COST: u32 = 25;
/// Cost of an occupied cell.
pub const OCCUPIED: u32 = 40_000;
/// Cost of a cell with a wall.
pub const WALL: u32 = 400_000;

/// Chamfer distances: units per straight and diagonal step between cells.
const STRAIGHT: u16 = 5;
const DIAGONAL: u16 = 7;
pub(super) const M_PER_UNIT: f32 = CELL_M / STRAIGHT as f32;
/// Maximum distance, chamfer units (1.5 m).
pub(super) const FARTHEST: u16 = 60;
/// Number of steps from a cell after which the distance from it is at least [`FARTHEST`].
pub(super) const FARTHEST_CELLS: usize = FARTHEST.div_ceil(STRAIGHT) as usize;

/// Cost of every cell, for a body of one radius. A [`CostModel`](super::cost_model::CostModel)
/// writes it.
#[derive(Clone, Debug)]
pub struct CostMap {
    pub(super) grid: Grid,
    pub(super) radius_m: f32,
    pub(super) cost: Vec<u32>,
    /// Chamfer distance of each cell from the nearest occupied one; computed on first use.
    pub(super) clearance: OnceCell<Vec<u16>>,
    /// Occupied cells from which `clearance` is computed; an empty list is a map without any.
    pub(super) occupied: Vec<bool>,
    pub(super) basis: CostBasis,
    pub(super) version: u32,
}

/// Inputs of the costs, kept by a model that recomputes changed parts only.
#[derive(Clone, Debug, Default)]
pub(super) struct CostBasis {
    /// State of each cell; empty before the first computation.
    pub states: Vec<u8>,
    /// Working memory: the states of the next computation.
    pub latest: Vec<u8>,
    /// Cells with temporary extra costs, and the amounts. A cell may occur several times.
    pub extras: Vec<(usize, u32)>,
}

impl CostMap {
    /// Creates a map for a body of this radius with all cells unknown.
    pub fn new(grid: Grid, radius_m: f32) -> CostMap {
        CostMap {
            grid,
            radius_m,
            cost: vec![FREE + UNKNOWN_CELL_COST; grid.n_cells()],
            clearance: OnceCell::from(vec![FARTHEST; grid.n_cells()]),
            occupied: Vec::new(),
            basis: CostBasis::default(),
            version: 0,
        }
    }

    /// Grid of the map.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Increases whenever costs may have changed.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// Cost of entering a cell.
    #[inline]
    pub fn cost(&self, cell: usize) -> u32 {
        self.cost[cell]
    }

    /// Costs of all cells, row by row.
    pub fn costs(&self) -> &[u32] {
        &self.cost
    }

    /// Returns whether the cell is occupied.
    #[inline]
    pub fn is_blocked(&self, cell: usize) -> bool {
        self.cost[cell] >= OCCUPIED
    }

    /// Returns whether the body, centered in this cell, touches an obstacle.
    #[inline]
    pub fn touches_obstacle(&self, cell: usize) -> bool {
        self.clearance_m(cell) < self.radius_m
    }

    /// Distance from the cell's center to the nearest occupied cell, meters, at most 1.5.
    #[inline]
    pub fn clearance_m(&self, cell: usize) -> f32 {
        let clearance = self.clearance.get_or_init(|| self.compute_clearance());
        f32::from(clearance[cell]) * M_PER_UNIT
    }

    #[cold]
    fn compute_clearance(&self) -> Vec<u16> {
        let is_occupied = |cell: usize| self.occupied.get(cell).copied().unwrap_or(false);
        let distance = |cell| if is_occupied(cell) { 0 } else { FARTHEST };
        let mut clearance: Vec<u16> = (0..self.grid.n_cells()).map(distance).collect();
        chamfer_transform(&mut clearance, self.grid.nx(), &(0..self.grid.nx()));
        clearance
    }

    /// Radius of the body, meters.
    pub fn radius_m(&self) -> f32 {
        self.radius_m
    }

    /// Returns whether the body can move straight between two points without touching known
    /// obstacles.
    pub fn is_straight_clear(&self, from: Vec2, to: Vec2) -> bool {
        self.grid.line(from, to).all(|cell| !self.touches_obstacle(cell))
    }

    /// Returns whether the cell contains a wall.
    #[inline]
    pub fn is_wall(&self, cell: usize) -> bool {
        self.cost[cell] >= WALL
    }
}

/// Two-pass chamfer distance transform from the cells at known distances; all others are at
/// [`FARTHEST`]. Distances are exact within these columns of rows with `nx` cells each.
pub(super) fn chamfer_transform(rows: &mut [u16], nx: usize, columns: &Range<usize>) {
    let mut above: Option<&mut [u16]> = None;
    for row in rows.chunks_exact_mut(nx) {
        let row = &mut row[columns.clone()];
        if let Some(above) = above {
            step_across(row, above);
        }
        step_along(row.iter_mut());
        above = Some(row);
    }
    let mut below: Option<&mut [u16]> = None;
    for row in rows.chunks_exact_mut(nx).rev() {
        let row = &mut row[columns.clone()];
        if let Some(below) = below {
            step_across(row, below);
        }
        step_along(row.iter_mut().rev());
        below = Some(row);
    }
}

/// Propagates distances from the finished adjacent row.
fn step_across(row: &mut [u16], beside: &[u16]) {
    let shorter = |(to, from): (&mut u16, &u16), step: u16| *to = (*to).min(*from + step);
    row.iter_mut().zip(beside).for_each(|pair| shorter(pair, STRAIGHT));
    row[1..].iter_mut().zip(beside).for_each(|pair| shorter(pair, DIAGONAL));
    row.iter_mut().zip(&beside[1..]).for_each(|pair| shorter(pair, DIAGONAL));
}

/// Propagates distances from the previous cell in the row.
fn step_along<'a>(row: impl Iterator<Item = &'a mut u16>) {
    let mut before = FARTHEST;
    for d in row {
        *d = (*d).min(before + STRAIGHT);
        before = *d;
    }
}

#[cfg(test)]
mod tests {
    use crate::test_support::DrawnMap;

    #[test]
    fn costs_rise_from_free_over_near_and_unknown_to_occupied_and_wall() {
        let plan = DrawnMap::parse(
            "????????????????
             ????????????????
             ................
             ................
             ................
             ................
             ................
             ................
             ................
             ################",
        );
        let costs = plan.costs(0.2);
        let at = |i: usize, j: usize| costs.cost(j * 16 + i);
        let (free, unknown, near, tight, wall) = (at(8, 4), at(8, 1), at(8, 7), at(8, 8), at(8, 9));
        assert!(
            free < unknown && unknown < tight && tight < wall,
            "{free} {unknown} {tight} {wall}"
        );
        assert!(free < near && near < tight);
    }

    #[test]
    fn a_door_of_85_cm_lets_an_adult_through_and_one_of_a_meter_a_wheelchair() {
        // 0.85 m between surfaces leaves at least 5 free cells, 1 m at least 6.
        for (n_free, radius_m) in [(5usize, 0.20), (6, 0.35)] {
            let row = format!("{}{}{}", "#".repeat(6), ".".repeat(n_free), "#".repeat(6));
            let plan = DrawnMap::parse(&[row.as_str(); 4].join("\n"));
            let costs = plan.costs(radius_m);
            let through = (0..n_free).any(|i| !costs.touches_obstacle(2 * (12 + n_free) + 6 + i));
            assert!(through, "{n_free} cells for {radius_m} m");
        }
        let plan = DrawnMap::parse(&["####....####"; 4].join("\n"));
        let costs = plan.costs(0.35);
        assert!((0..4).all(|i| costs.touches_obstacle(24 + 4 + i)), "half a meter is too narrow");
    }
}
