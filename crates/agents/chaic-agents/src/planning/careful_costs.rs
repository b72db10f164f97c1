//! Cost model for a body of its true radius.

use std::cell::OnceCell;

use chaic_core::Frame;
use chaic_core::geom::to_xz;

use super::cost_map::{
    CostMap, FARTHEST, FREE, M_PER_UNIT, OCCUPIED, UNKNOWN_EXTRA, WALL, chamfer_transform,
};
use super::cost_model::{CostInputs, CostModel, MapChanges};
use crate::mapping::occupancy::CellOccupancy;

/// Cell in which the body would touch something.
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

/// Costs for a body of its true radius.
#[derive(Clone, Copy, Debug, Default)]
pub struct CarefulCosts;

impl CostModel for CarefulCosts {
    fn is_outdated_by(&self, changes: MapChanges) -> bool {
        changes.layout || changes.people
    }

    fn recompute(&mut self, costs: &mut CostMap, inputs: &CostInputs<'_>) {
        let CostInputs { map, objects, people, position, now, .. } = *inputs;
        let grid = costs.grid;
        costs.version += 1;
        let mut clearance = costs.clearance.take().unwrap_or_default();
        clearance.resize(grid.n_cells(), FARTHEST);
        for ((cost, clearance), cell) in costs.cost.iter_mut().zip(&mut clearance).zip(map.cells())
        {
            (*cost, *clearance) = match cell.state() {
                CellOccupancy::Free => (FREE, FARTHEST),
                CellOccupancy::Unknown => (FREE + UNKNOWN_EXTRA, FARTHEST),
                CellOccupancy::Occupied => (OCCUPIED, 0),
                CellOccupancy::Wall => (WALL, 0),
            };
        }
        for object in objects.iter().filter(|o| o.is_present && now >= o.held_until) {
            let info = object.class.info();
            if info.is_movable() && !info.is_carriable() {
                // An obstacle at the body's own position cannot be there; otherwise the body could
                // not move away.
                let points =
                    object.footprint.iter().filter(|p| p.distance(position) > BODY_MARGIN_M);
                for cell in points.filter_map(|p| grid.cell_at(*p)) {
                    costs.cost[cell] = costs.cost[cell].max(OCCUPIED);
                    clearance[cell] = 0;
                }
            }
        }
        let is_at_body = |cell: usize| grid.center(cell).distance(position) <= BODY_MARGIN_M;
        for cell in
            map.bumps().barred_cells(&grid, costs.radius_m).filter(|cell| !is_at_body(*cell))
        {
            costs.cost[cell] = costs.cost[cell].max(OCCUPIED);
            clearance[cell] = 0;
        }
        chamfer_transform(&grid, &mut clearance);
        add_rings(costs, &clearance);
        costs.clearance = OnceCell::from(clearance);
        for cell in map.bumps().recent_cells(&grid) {
            costs.cost[cell] += BUMP_EXTRA;
        }
        for person in people.iter().filter(|p| p.frame + PERSON_FRAMES > now) {
            for cell in grid.disc(to_xz(person.position_in_world), PERSON_RADIUS_M) {
                costs.cost[cell] += PERSON_EXTRA;
            }
        }
    }

    fn uses_path_length(&self) -> bool {
        true
    }

    fn fork(&self) -> Box<dyn CostModel> {
        Box::new(*self)
    }
}

/// Adds the soft inflation around occupied cells.
fn add_rings(costs: &mut CostMap, clearance: &[u16]) {
    // Extra cost by clearance, once per possible value instead of once per cell.
    let extra: Vec<u32> = (0..=FARTHEST)
        .map(|units| {
            let beyond_m = f32::from(units) * M_PER_UNIT - costs.radius_m;
            if beyond_m < 0.0 {
                return TIGHT;
            }
            RINGS.iter().find(|(m, _)| beyond_m < *m).map_or(0, |(_, extra)| *extra)
        })
        .collect();
    // Most cells are farther from obstacles than the inflation reaches. A comparison of whole chunks
    // is faster than a table lookup for each cell.
    const CHUNK: usize = 16;
    let reach = extra.iter().rposition(|extra| *extra > 0).map_or(0, |units| units as u16 + 1);
    for (costs, clearance) in costs.cost.chunks_mut(CHUNK).zip(clearance.chunks(CHUNK)) {
        if clearance.iter().fold(true, |all, clearance| all & (*clearance >= reach)) {
            continue;
        }
        for (cost, clearance) in costs.iter_mut().zip(clearance) {
            if *clearance > 0 {
                *cost += extra[usize::from((*clearance).min(FARTHEST))];
            }
        }
    }
}
