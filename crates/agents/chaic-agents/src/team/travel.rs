//! Path lengths between places on the helper's map.

use std::collections::BTreeMap;

use chaic_core::Vec2;
use chaic_core::geom::to_xz;

use crate::execution::careful_approach::{ARM_OFFSETS_M, RELAXED_M};
use crate::execution::destination::Destination;
use crate::mapping::MappedObject;
use crate::planning::cost_map::CostMap;
use crate::planning::path::{CostField, PathCosts, Search};

/// Radius in which a nearby reachable cell stands for an unreachable one, meters.
const NEAR_M: f32 = 0.4;
/// Cost fields are reused if their origin moved by less, meters.
const SAME_ORIGIN_M: f32 = 0.1;
/// Places to stand are reused if the object moved by less, meters.
const SAME_OBJECT_M: f32 = 0.3;

/// A path as the forward model needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// Length, meters.
    pub length_m: f32,
    /// Obstacles that it passes, as bits in the order of the given obstacles.
    pub obstacles: u64,
}

/// Cost fields and places to stand, kept until the map changes.
#[derive(Clone, Debug, Default)]
pub struct TravelCache {
    epoch: u64,
    fields: BTreeMap<u32, (Vec2, CostField)>,
    stands: BTreeMap<u32, (Vec2, Option<Vec2>)>,
    search: Option<Search>,
}

impl TravelCache {
    /// Drops everything if the epoch differs from that of the last call.
    pub fn start(&mut self, epoch: u64) {
        if self.epoch != epoch {
            self.epoch = epoch;
            self.fields.clear();
            self.stands.clear();
        }
    }

    /// Returns the position from which the helper would use an object, as its navigation chooses
    /// it: the cheapest to reach, given the costs from the current position.
    pub fn stand(
        &mut self,
        from: PathCosts<'_>,
        object: &MappedObject,
        within_m: f32,
        arm_reach_m: f32,
    ) -> Option<Vec2> {
        let at = to_xz(object.position_in_world);
        if let Some((before, stand)) = self.stands.get(&object.track.0)
            && before.distance(at) < SAME_OBJECT_M
        {
            return *stand;
        }
        let mut destination = Destination::at_object(object, within_m);
        let arms = ARM_OFFSETS_M.map(|offset_m| Some(arm_reach_m + offset_m));
        let stand = arms.into_iter().chain([None]).find_map(|arm_m| {
            destination.arm_m = arm_m;
            if arm_m.is_none() {
                destination.within_m = RELAXED_M;
            }
            cheapest(from, &destination)
        });
        self.stands.insert(object.track.0, (at, stand));
        stand
    }

    /// Returns the costs from `origin`, final for the paths to these positions; recomputed if the
    /// origin moved.
    pub fn field(
        &mut self,
        costs: &CostMap,
        key: u32,
        origin: Vec2,
        positions: impl Iterator<Item = Vec2>,
    ) -> &CostField {
        let cell_or_none = |position| costs.grid().cell_at(position).unwrap_or(usize::MAX);
        let cells: Vec<usize> = positions.map(cell_or_none).collect();
        let is_fresh = self.fields.get(&key).is_some_and(|(at, field)| {
            at.distance(origin) < SAME_ORIGIN_M && cells.iter().all(|cell| field.is_final(*cell))
        });
        if !is_fresh {
            let search = self.search.get_or_insert_with(|| Search::new(costs.grid().n_cells()));
            let field = CostField::until_final(costs, origin, search, &cells);
            self.fields.insert(key, (origin, field));
        }
        &self.fields[&key].1
    }
}

/// Returns the center of the cheapest cell at which the destination is reached.
fn cheapest(from: PathCosts<'_>, destination: &Destination) -> Option<Vec2> {
    let costs = from.costs;
    let grid = costs.grid();
    let (center, radius_m) = destination.center_and_radius();
    let near = grid.disc(center, radius_m + destination.within_m);
    let mut cells: Vec<(u32, usize)> = near
        .filter(|cell| !costs.touches_obstacle(*cell))
        .filter_map(|cell| Some((from.cost(cell)?, cell)))
        .collect();
    cells.sort_unstable();
    let accepted = cells.iter().map(|(_, cell)| grid.center(*cell));
    accepted.into_iter().find(|p| destination.accepts(costs, *p, 0.0))
}

/// Returns the path from the origin of `field` to `to` by descending the costs, and the obstacles
/// that it passes within `near_m`. Obstacles are given as centers (x, z), at most 64.
pub fn trace(
    costs: &CostMap,
    field: &CostField,
    to: Vec2,
    obstacles: &[Vec2],
    near_m: f32,
) -> Option<Travel> {
    let grid = costs.grid();
    let direct = grid.cell_at(to).filter(|cell| field.cost(*cell).is_some());
    let nearby = || {
        let cells = grid.disc(to, NEAR_M).filter_map(|c| Some((field.cost(c)?, c)));
        cells.min().map(|(_, cell)| cell)
    };
    let mut cell = direct.or_else(nearby)?;
    let mut travel = Travel { length_m: 0.0, obstacles: 0 };
    loop {
        let p = grid.center(cell);
        for (k, obstacle) in obstacles.iter().enumerate() {
            if obstacle.distance(p) < near_m {
                travel.obstacles |= 1 << k;
            }
        }
        let cost = field.cost(cell)?;
        let next = grid.neighbors(cell).filter_map(|(n, _)| Some((field.cost(n)?, n))).min();
        let Some((lower, next)) = next.filter(|(lower, _)| *lower < cost) else { break };
        debug_assert!(lower < cost, "costs fall on the way to the origin");
        travel.length_m += p.distance(grid.center(next));
        cell = next;
    }
    Some(travel)
}

#[cfg(test)]
mod tests;
