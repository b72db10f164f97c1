//! Cost model for a body of its true radius.

use std::cell::OnceCell;
use std::ops::Range;

use chaic_core::Frame;
use chaic_core::geom::to_xz;

use super::cost_map::{
    CostMap, FARTHEST, FARTHEST_CELLS, FREE, M_PER_UNIT, OCCUPIED, UNKNOWN_CELL_COST, WALL,
    chamfer_transform,
};
use super::cost_model::{CostInputs, CostModel, MapChanges};
use crate::mapping::grid::Grid;
use crate::mapping::occupancy::CellOccupancy;

/// Cost of each [`CellOccupancy`] without obstacles nearby.
const STATE_COSTS: [u32; 4] = [FREE, FREE + UNKNOWN_CELL_COST, OCCUPIED, WALL];
/// States as bytes, which compare fast.
const UNKNOWN_STATE: u8 = CellOccupancy::Unknown as u8;
const OCCUPIED_STATE: u8 = CellOccupancy::Occupied as u8;
const _: () = assert!(CellOccupancy::Free as u8 == 0 && CellOccupancy::Wall as u8 == 3);
const _: () = assert!(UNKNOWN_STATE == 1 && OCCUPIED_STATE == 2);
/// Cost of a cell in which the body would touch something.
const TIGHT: u32 = 600;
/// Added for cells near a recently seen person.
const PERSON_EXTRA: u32 = 150;
/// Radius of the disc around a person, meters.
const PERSON_RADIUS_M: f32 = 0.5;
/// Time since a sighting that counts as recent, frames.
const PERSON_FRAMES: Frame = 45;
/// Added to cells around a bump, for each bump.
const BUMP_EXTRA: u32 = 250;
/// Objects closer than this to the body's center are ignored, meters.
const BODY_MARGIN_M: f32 = 0.2;
/// Soft inflation: extra cost by distance beyond the body's radius, meters.
const RINGS: [(f32, u32); 4] = [(0.08, 60), (0.16, 30), (0.29, 12), (0.42, 4)];

/// Costs for a body of its true radius. A computation changes only the surroundings of cells whose
/// state has changed. It requires that no other model writes the map.
#[derive(Clone, Copy, Debug, Default)]
pub struct CarefulCosts;

impl CostModel for CarefulCosts {
    fn is_outdated_by(&self, changes: MapChanges) -> bool {
        changes.layout || changes.people
    }

    fn recompute(&mut self, costs: &mut CostMap, inputs: &CostInputs<'_>) {
        let CostInputs { map, people, now, .. } = *inputs;
        let grid = costs.grid;
        costs.version += 1;
        let mut basis = std::mem::take(&mut costs.basis);
        for (cell, extra) in basis.extras.drain(..) {
            costs.cost[cell] -= extra;
        }
        collect_states(costs, inputs, &mut basis.latest);
        if basis.states.is_empty() {
            basis.states.resize(grid.n_cells(), UNKNOWN_STATE);
            reset_to_unknown(costs);
        }
        if let Some(changed) = Area::of_differences(grid.nx(), &basis.states, &basis.latest) {
            update_around(costs, &basis.latest, &changed);
            std::mem::swap(&mut basis.states, &mut basis.latest);
        }
        let bumps = map.bumps().recent_cells(&grid).map(|cell| (cell, BUMP_EXTRA));
        basis.extras.extend(bumps);
        for person in people.iter().filter(|p| p.frame + PERSON_FRAMES > now) {
            let disc = grid.disc(to_xz(person.position_in_world), PERSON_RADIUS_M);
            basis.extras.extend(disc.map(|cell| (cell, PERSON_EXTRA)));
        }
        for (cell, extra) in &basis.extras {
            costs.cost[*cell] += extra;
        }
        costs.basis = basis;
    }

    fn uses_path_length(&self) -> bool {
        true
    }

    fn fork(&self) -> Box<dyn CostModel> {
        Box::new(*self)
    }
}

/// Collects the states of all cells, with movable objects and barriers as occupied cells.
fn collect_states(costs: &CostMap, inputs: &CostInputs<'_>, states: &mut Vec<u8>) {
    let CostInputs { map, objects, position, now, .. } = *inputs;
    let grid = &costs.grid;
    states.clear();
    states.extend(map.cells().map(|cell| cell.state() as u8));
    for object in objects.iter().filter(|o| o.is_present && now >= o.held_until) {
        if object.blocks_path() {
            // An obstacle at the body's own position cannot be there; otherwise the body could
            // not move away.
            let points = object.footprint.iter().filter(|p| p.distance(position) > BODY_MARGIN_M);
            for cell in points.filter_map(|p| grid.cell_at(*p)) {
                states[cell] = states[cell].max(OCCUPIED_STATE);
            }
        }
    }
    let is_at_body = |cell: usize| grid.center(cell).distance(position) <= BODY_MARGIN_M;
    for cell in map.bumps().blocked_cells(grid, costs.radius_m).filter(|cell| !is_at_body(*cell)) {
        states[cell] = states[cell].max(OCCUPIED_STATE);
    }
}

/// Resets all cells to unknown ones without obstacles nearby.
fn reset_to_unknown(costs: &mut CostMap) {
    let [.., farthest] = inflation(costs.radius_m);
    costs.cost.fill(STATE_COSTS[usize::from(UNKNOWN_STATE)] + farthest);
    costs.clearance = OnceCell::from(vec![FARTHEST; costs.grid.n_cells()]);
}

/// Recomputes clearance and costs around an area whose states have changed.
fn update_around(costs: &mut CostMap, states: &[u8], changed: &Area) {
    let CostMap { grid, radius_m, cost, clearance, .. } = costs;
    let clearance = clearance.get_mut().expect("the first computation sets the clearance");
    let nx = grid.nx();
    // Cells farther away keep their clearance. Those on the border are the sources of the transform
    // in place of all occupied cells outside: every path from outside passes one of them.
    let affected = changed.grown(FARTHEST_CELLS - 1, grid);
    let with_border = changed.grown(FARTHEST_CELLS, grid);
    for cells in affected.cell_ranges(nx) {
        for (clearance, state) in clearance[cells.clone()].iter_mut().zip(&states[cells]) {
            *clearance = if *state < OCCUPIED_STATE { FARTHEST } else { 0 };
        }
    }
    let rows = with_border.rows.start * nx..with_border.rows.end * nx;
    chamfer_transform(&mut clearance[rows], nx, &with_border.columns);
    let inflation = inflation(*radius_m);
    let reach = inflation.iter().rposition(|extra| *extra > 0).map_or(0, |units| units as u16 + 1);
    for cells in affected.cell_ranges(nx) {
        let (row, states) = (&mut cost[cells.clone()], &states[cells.clone()]);
        for (cost, state) in row.iter_mut().zip(states) {
            *cost = STATE_COSTS[usize::from(*state)];
        }
        add_inflation(row, &clearance[cells], &inflation, reach);
    }
}

/// Rectangle of cells.
#[derive(Debug, PartialEq)]
struct Area {
    columns: Range<usize>,
    rows: Range<usize>,
}

impl Area {
    /// Returns the smallest rectangle with all cells whose states differ; rows have `nx` cells.
    fn of_differences(nx: usize, before: &[u8], after: &[u8]) -> Option<Area> {
        let mut area: Option<Area> = None;
        let rows = before.chunks_exact(nx).zip(after.chunks_exact(nx));
        for (row, (before, after)) in rows.enumerate().filter(|(_, (a, b))| a != b) {
            let differs = |i: &usize| before[*i] != after[*i];
            let first = (0..nx).find(differs).unwrap_or(0);
            let end = (0..nx).rfind(differs).map_or(nx, |last| last + 1);
            let area = area.get_or_insert(Area { columns: first..end, rows: row..row + 1 });
            area.columns = area.columns.start.min(first)..area.columns.end.max(end);
            area.rows.end = row + 1;
        }
        area
    }

    /// Returns the area with more cells on each side, as far as the grid extends.
    fn grown(&self, by: usize, grid: &Grid) -> Area {
        let grow = |range: &Range<usize>, n: usize| {
            range.start.saturating_sub(by)..(range.end + by).min(n)
        };
        Area { columns: grow(&self.columns, grid.nx()), rows: grow(&self.rows, grid.nz()) }
    }

    /// Returns the cells of each row.
    fn cell_ranges(&self, nx: usize) -> impl Iterator<Item = Range<usize>> {
        let Range { start, end } = self.columns;
        self.rows.clone().map(move |row| row * nx + start..row * nx + end)
    }
}

/// Number of distances.
const N_DISTANCES: usize = FARTHEST as usize + 1;

/// Returns the soft inflation by clearance, chamfer units: once per possible value instead of once
/// per cell.
fn inflation(radius_m: f32) -> [u32; N_DISTANCES] {
    std::array::from_fn(|units| {
        let beyond_m = f32::from(units as u16) * M_PER_UNIT - radius_m;
        if beyond_m < 0.0 {
            return TIGHT;
        }
        RINGS.iter().find(|(m, _)| beyond_m < *m).map_or(0, |(_, extra)| *extra)
    })
}

/// Adds the soft inflation around occupied cells. It is 0 from the clearance `reach` on.
fn add_inflation(costs: &mut [u32], clearance: &[u16], inflation: &[u32; N_DISTANCES], reach: u16) {
    // Most cells are farther from obstacles than the inflation reaches. A comparison of whole chunks
    // is faster than a table lookup for each cell.
    const CHUNK: usize = 16;
    for (costs, clearance) in costs.chunks_mut(CHUNK).zip(clearance.chunks(CHUNK)) {
        if clearance.iter().fold(true, |all, clearance| all & (*clearance >= reach)) {
            continue;
        }
        for (cost, clearance) in costs.iter_mut().zip(clearance) {
            if *clearance > 0 {
                *cost += inflation[usize::from((*clearance).min(FARTHEST))];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use chaic_core::Vec2;
    use chaic_core::rng::RngStream;

    use super::*;
    use crate::mapping::{OccupancyMap, PersonMap, SemanticMap};
    use crate::test_support::{Toy, seen, seen_partner};
    use crate::track::TrackId;

    /// Computes costs and clearance of all cells from their definitions.
    fn reference_costs(costs: &CostMap, inputs: &CostInputs<'_>) -> (Vec<u32>, Vec<u16>) {
        let (grid, radius_m) = (costs.grid(), costs.radius_m());
        let is_away = |p: Vec2| p.distance(inputs.position) > BODY_MARGIN_M;
        let barred = inputs.map.bumps().blocked_cells(grid, radius_m);
        let mut blocked: Vec<usize> = barred.filter(|cell| is_away(grid.center(*cell))).collect();
        for object in inputs.objects.iter().filter(|o| o.is_present && inputs.now >= o.held_until) {
            let points = object.footprint.iter().filter(|p| is_away(**p));
            blocked.extend(points.filter_map(|p| grid.cell_at(*p)));
        }
        let mut states: Vec<CellOccupancy> = inputs.map.cells().map(|cell| cell.state()).collect();
        for cell in blocked {
            states[cell] = states[cell].max(CellOccupancy::Occupied);
        }
        let is_occupied = |cell: &usize| states[*cell] >= CellOccupancy::Occupied;
        let occupied: Vec<usize> = (0..grid.n_cells()).filter(is_occupied).collect();
        let distance = |from: usize, to: usize| {
            let ((a, b), (c, d)) = (grid.column_row(from), grid.column_row(to));
            let (along, across) = (a.abs_diff(c), b.abs_diff(d));
            5 * along.max(across) + 2 * along.min(across)
        };
        let farthest = usize::from(FARTHEST);
        let clearance: Vec<u16> = (0..grid.n_cells())
            .map(|to| occupied.iter().map(|from| distance(*from, to)).min().unwrap_or(farthest))
            .map(|units| units.min(farthest) as u16)
            .collect();
        let place = |(state, units): (&CellOccupancy, &u16)| match state {
            CellOccupancy::Wall => WALL,
            CellOccupancy::Occupied => OCCUPIED,
            state => {
                let is_unknown = *state == CellOccupancy::Unknown;
                let beyond_m = f32::from(*units) * M_PER_UNIT - radius_m;
                let ring = RINGS.iter().find(|(m, _)| beyond_m < *m);
                let near = if beyond_m < 0.0 { TIGHT } else { ring.map_or(0, |(_, extra)| *extra) };
                FREE + if is_unknown { UNKNOWN_CELL_COST } else { 0 } + near
            }
        };
        let mut cost: Vec<u32> = states.iter().zip(&clearance).map(place).collect();
        inputs.map.bumps().recent_cells(grid).for_each(|cell| cost[cell] += BUMP_EXTRA);
        for person in inputs.people.iter().filter(|p| p.frame + PERSON_FRAMES > inputs.now) {
            let disc = grid.disc(to_xz(person.position_in_world), PERSON_RADIUS_M);
            disc.for_each(|cell| cost[cell] += PERSON_EXTRA);
        }
        (cost, clearance)
    }

    #[test]
    fn repeated_computations_equal_those_from_definitions() {
        use CellOccupancy::{Free, Occupied, Unknown, Wall};
        let mut toy = Toy::room(4.0, 4.0);
        toy.size = 4;
        let (briefing, mut observation) = (toy.briefing(), toy.observe());
        for seed in 0..20 {
            let mut rng = RngStream::new(seed, "careful costs", 0);
            let grid = Grid::with_size(1 + rng.below(40), 1 + rng.below(28));
            let n = grid.n_cells();
            // Around the largest body, the inflation reaches farther than the clearance.
            let mut costs = CostMap::new(grid, [0.2, 0.35, 1.3][rng.below(3)]);
            let (mut objects, mut people) = (SemanticMap::default(), PersonMap::default());
            let mut cells = vec![Unknown; n];
            for step in 0..10 {
                let now = 30 * step;
                let at = grid.center(rng.below(n));
                let state = [Free, Free, Unknown, Occupied, Wall][rng.below(5)];
                match rng.below(4) {
                    0 => {}
                    1 => cells[rng.below(n)] = state,
                    2 => grid.disc(at, rng.range(0.1, 1.0)).for_each(|cell| cells[cell] = state),
                    _ => {
                        for _ in 0..n / 20 {
                            cells[rng.below(n)] = [Free, Unknown, Occupied, Wall][rng.below(4)];
                        }
                    }
                }
                let mut map = OccupancyMap::from_cells(grid, &cells);
                // Enough at one position for a barrier, or not.
                for _ in 0..rng.below(6) {
                    map.record_bump(at + rng.range(-0.3, 0.3), now, 300);
                }
                let mut point = || grid.center(rng.below(n));
                let (bin, partner, position) = (point(), point(), point());
                if rng.chance(0.4) {
                    let bin = seen(TrackId(30), "trashbin", [bin.x, 0.0, bin.y], 0.5, 0.6);
                    objects.update(&[bin], &[], 300, now);
                }
                if rng.chance(0.4) {
                    observation.frame = now;
                    people.update(&briefing, &observation, &[seen_partner(partner.x, partner.y)]);
                }
                for (k, later) in [0, 60].into_iter().enumerate() {
                    let inputs = CostInputs {
                        map: &map,
                        objects: &objects,
                        people: &people,
                        avoids_obstacles: false,
                        position: if rng.chance(0.5) { position } else { bin },
                        now: now + later,
                    };
                    CarefulCosts.recompute(&mut costs, &inputs);
                    let (cost, clearance) = reference_costs(&costs, &inputs);
                    assert_eq!(costs.costs(), cost, "seed {seed}, step {step}.{k}");
                    assert_eq!(costs.clearance.get(), Some(&clearance), "seed {seed}, step {step}");
                    assert_eq!(costs.version() as usize, 2 * step as usize + k + 1);
                }
            }
        }
    }

    #[test]
    fn the_changed_area_contains_all_differences() {
        let before = [0; 24];
        assert_eq!(Area::of_differences(6, &before, &before), None);
        let mut after = before;
        (after[7], after[16]) = (1, 2);
        let area = Area::of_differences(6, &before, &after).expect("two cells differ");
        assert_eq!(area, Area { columns: 1..5, rows: 1..3 });
        let grid = Grid::with_size(6, 4);
        assert_eq!(area.grown(1, &grid), Area { columns: 0..6, rows: 0..4 });
        assert_eq!(area.cell_ranges(6).collect::<Vec<_>>(), [7..11, 13..17]);
    }
}
