//! What it costs to enter each cell, for one body.

use std::cell::OnceCell;

use chaic_core::geom::xz;
use chaic_core::{Frame, Vec2};

use super::cost_model::Seen;
use super::lattice_costs;
use crate::mapping::grid::{CELL_M, Grid};
use crate::mapping::occupancy::Space;

/// Cost of entering a free cell with nothing near. Costs rise in the paper's order: free,
/// unknown, near something, occupied, wall.
pub const FREE: u32 = 10;
/// Added for a cell whose floor was never seen (facts A1.5: 2.5 times a free cell).
pub const UNKNOWN_EXTRA: u32 = 25;
/// A cell in which the body, if it stood there, would touch something.
pub const TIGHT: u32 = 600;
/// A cell with something in it.
pub const OCCUPIED: u32 = 40_000;
/// A cell with a wall in it.
pub const WALL: u32 = 400_000;
/// Added for cells where somebody stood a moment ago.
const PERSON_EXTRA: u32 = 150;
/// How near to a person's middle that is, metres.
const PERSON_RADIUS_M: f32 = 0.5;
/// How long a moment is, frames.
const PERSON_FRAMES: Frame = 45;
/// Added to cells around a bump, for each bump.
const BUMP_EXTRA: u32 = 250;
/// Nothing is in the way so near to one's own middle, metres.
const OWN_PLACE_M: f32 = 0.2;
/// The soft ring: extra cost by distance beyond the body's radius, metres.
const RING: [(f32, u32); 4] = [(0.08, 60), (0.16, 30), (0.29, 12), (0.42, 4)];

/// Chamfer distances: units per straight and diagonal step between cells.
const STRAIGHT: u16 = 5;
const DIAGONAL: u16 = 7;
const M_PER_UNIT: f32 = CELL_M / STRAIGHT as f32;
/// Distances are not followed farther than this, chamfer units (1.5 m).
const FARTHEST: u16 = 60;

/// A cost for every cell, for a body of one radius.
#[derive(Clone, Debug)]
pub struct CostMap {
    grid: Grid,
    radius_m: f32,
    cost: Vec<u32>,
    /// Working space: the costs before they were computed last.
    before: Vec<u32>,
    /// Chamfer distance of each cell from the nearest occupied one; measured when first asked for.
    clearance: OnceCell<Vec<u16>>,
    version: u32,
    belief: lattice_costs::Belief,
}

impl CostMap {
    /// A map for a body of this radius, on which everything is unknown.
    pub fn new(grid: Grid, radius_m: f32) -> CostMap {
        CostMap {
            grid,
            radius_m,
            cost: vec![FREE + UNKNOWN_EXTRA; grid.n_cells()],
            before: Vec::new(),
            clearance: OnceCell::from(vec![FARTHEST; grid.n_cells()]),
            version: 0,
            belief: lattice_costs::Belief::default(),
        }
    }

    /// Its lattice.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Grows whenever costs may have changed.
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

    /// Whether something firm is in the cell.
    #[inline]
    pub fn is_blocked(&self, cell: usize) -> bool {
        self.cost[cell] >= OCCUPIED
    }

    /// Whether the body touches something (or may not stand at all) with its middle in this cell.
    #[inline]
    pub fn is_tight(&self, cell: usize) -> bool {
        self.clearance_m(cell) < self.radius_m
    }

    /// Distance from the middle of the cell to the nearest occupied one, metres, up to 1.5.
    #[inline]
    pub fn clearance_m(&self, cell: usize) -> f32 {
        let clearance = self.clearance.get_or_init(|| self.believed_clearance());
        f32::from(clearance[cell]) * M_PER_UNIT
    }

    #[cold]
    fn believed_clearance(&self) -> Vec<u16> {
        let distance = |cell| if self.belief.is_occupied(cell) { 0 } else { FARTHEST };
        let mut clearance: Vec<u16> = (0..self.grid.n_cells()).map(distance).collect();
        measure_clearance(&self.grid, &mut clearance);
        clearance
    }

    /// Radius of the body, metres.
    pub fn radius_m(&self) -> f32 {
        self.radius_m
    }

    /// Whether the body can go straight from one point to another without touching what is known.
    pub fn is_straight_clear(&self, from: Vec2, to: Vec2) -> bool {
        self.grid.line(from, to).all(|cell| !self.is_tight(cell))
    }

    /// Whether there is a wall in the cell.
    #[inline]
    pub fn is_wall(&self, cell: usize) -> bool {
        self.cost[cell] >= WALL
    }

    /// Computes all costs anew.
    pub fn rebuild(&mut self, seen: &Seen<'_>) {
        let Seen { map, things, people, here, now, .. } = *seen;
        self.version += 1;
        let mut clearance = self.clearance.take().unwrap_or_default();
        clearance.resize(self.grid.n_cells(), FARTHEST);
        for ((cost, clearance), cell) in self.cost.iter_mut().zip(&mut clearance).zip(map.cells()) {
            (*cost, *clearance) = match cell.space() {
                Space::Free => (FREE, FARTHEST),
                Space::Unknown => (FREE + UNKNOWN_EXTRA, FARTHEST),
                Space::Occupied => (OCCUPIED, 0),
                Space::Wall => (WALL, 0),
            };
        }
        for thing in things.iter().filter(|t| t.is_present && now >= t.held_until) {
            let info = thing.class.info();
            if info.is_movable() && !info.is_carriable() {
                // What one seems to stand in is not there, or one could not leave it.
                let points = thing.footprint.iter().filter(|p| p.distance(here) > OWN_PLACE_M);
                for cell in points.filter_map(|p| self.grid.cell_at(*p)) {
                    self.cost[cell] = self.cost[cell].max(OCCUPIED);
                    clearance[cell] = 0;
                }
            }
        }
        let own = |cell: usize| self.grid.center(cell).distance(here) <= OWN_PLACE_M;
        for cell in map.bumps().barred_cells(&self.grid, self.radius_m).filter(|cell| !own(*cell)) {
            self.cost[cell] = self.cost[cell].max(OCCUPIED);
            clearance[cell] = 0;
        }
        measure_clearance(&self.grid, &mut clearance);
        self.add_rings(&clearance);
        self.clearance = OnceCell::from(clearance);
        for cell in map.bumps().cells(&self.grid) {
            self.cost[cell] += BUMP_EXTRA;
        }
        for person in people.iter().filter(|p| p.frame + PERSON_FRAMES > now) {
            for cell in self.grid.disc(xz(person.position_in_world), PERSON_RADIUS_M) {
                self.cost[cell] += PERSON_EXTRA;
            }
        }
    }

    /// Computes all costs anew by the original's reckoning.
    pub fn rebuild_lattice(&mut self, seen: &Seen<'_>) {
        std::mem::swap(&mut self.cost, &mut self.before);
        self.cost.resize(self.grid.n_cells(), 0);
        lattice_costs::lattice_costs(&self.grid, seen, &mut self.belief, &mut self.cost);
        self.version += u32::from(self.cost != self.before);
        // Hardly anybody asks for it.
        self.clearance.take();
    }

    fn add_rings(&mut self, clearance: &[u16]) {
        // Extra cost by clearance, once per possible value instead of once per cell.
        let extra: Vec<u32> = (0..=FARTHEST)
            .map(|units| {
                let beyond_m = f32::from(units) * M_PER_UNIT - self.radius_m;
                if beyond_m < 0.0 {
                    return TIGHT;
                }
                RING.iter().find(|(m, _)| beyond_m < *m).map_or(0, |(_, extra)| *extra)
            })
            .collect();
        for (cost, clearance) in self.cost.iter_mut().zip(clearance) {
            if *clearance > 0 {
                *cost += extra[usize::from((*clearance).min(FARTHEST))];
            }
        }
    }
}

/// Two-pass chamfer distance transform from the cells at distance 0.
fn measure_clearance(grid: &Grid, d: &mut [u16]) {
    let nx = grid.nx();
    let mut above: Option<&mut [u16]> = None;
    for row in d.chunks_exact_mut(nx) {
        if let Some(above) = above {
            step_across(row, above);
        }
        step_along(row.iter_mut());
        above = Some(row);
    }
    let mut below: Option<&mut [u16]> = None;
    for row in d.chunks_exact_mut(nx).rev() {
        if let Some(below) = below {
            step_across(row, below);
        }
        step_along(row.iter_mut().rev());
        below = Some(row);
    }
}

/// Distances of a row that come from the finished row beside it.
fn step_across(row: &mut [u16], beside: &[u16]) {
    let shorter = |(to, from): (&mut u16, &u16), step: u16| *to = (*to).min(*from + step);
    row.iter_mut().zip(beside).for_each(|pair| shorter(pair, STRAIGHT));
    row[1..].iter_mut().zip(beside).for_each(|pair| shorter(pair, DIAGONAL));
    row.iter_mut().zip(&beside[1..]).for_each(|pair| shorter(pair, DIAGONAL));
}

/// Distances of a row that come from the cell before.
fn step_along<'a>(row: impl Iterator<Item = &'a mut u16>) {
    let mut before = FARTHEST;
    for d in row {
        *d = (*d).min(before + STRAIGHT);
        before = *d;
    }
}

#[cfg(test)]
mod tests {
    use crate::test_support::Plan2d;

    #[test]
    fn costs_rise_from_free_over_near_and_unknown_to_occupied_and_wall() {
        let plan = Plan2d::parse(
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
    fn a_door_of_85_cm_lets_an_adult_through_and_one_of_a_metre_a_wheelchair() {
        // 0.85 m between surfaces leaves at least 5 free cells, 1 m at least 6.
        for (n_free, radius_m) in [(5usize, 0.20), (6, 0.35)] {
            let row = format!("{}{}{}", "#".repeat(6), ".".repeat(n_free), "#".repeat(6));
            let plan = Plan2d::parse(&[row.as_str(); 4].join("\n"));
            let costs = plan.costs(radius_m);
            let through = (0..n_free).any(|i| !costs.is_tight(2 * (12 + n_free) + 6 + i));
            assert!(through, "{n_free} cells for {radius_m} m");
        }
        let plan = Plan2d::parse(&["####....####"; 4].join("\n"));
        let costs = plan.costs(0.35);
        assert!((0..4).all(|i| costs.is_tight(24 + 4 + i)), "half a metre is too narrow");
    }
}
