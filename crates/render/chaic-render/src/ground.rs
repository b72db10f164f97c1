//! Ground grid of a floor plan: the room of each cell, the lamps of rooms, and contact shadows near
//! walls and objects.

use chaic_core::geom::Rect;
use chaic_core::{Vec2, Vec3};
use chaic_world::{RoomKind, Setup};

use crate::grid::neighbors;

/// Marker of a cell without a room.
pub(crate) const NO_ROOM: u8 = u8::MAX;

// Every room of a setup that a world accepts has a lamp.
const _: () = assert!(Setup::MAX_ROOMS <= NO_ROOM as usize);

/// Reach of contact shadows, meters.
const CONTACT_SHADOW_M: f32 = 0.22;
/// Maximum number of cells along one side; cells of a house are a few centimeters wide.
pub(crate) const MAX_CELLS: usize = 256;

/// Number of ground cells, plus one unshaded cell for everything outside the ground.
pub(crate) const N_GROUND: usize = MAX_CELLS * MAX_CELLS + 1;

/// The ground as a grid of cells, with columns along x and rows along z.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    min: Vec2,
    cells_per_m: f32,
    /// Number of cells along x and z.
    pub nx: usize,
    pub nz: usize,
    /// Room of each cell, or [`NO_ROOM`].
    rooms: Vec<u8>,
    /// Shadow of walls per cell, 0 to 255.
    pub wall_shadows: Vec<u8>,
    /// Position of each room's lamp.
    lamps: Vec<Vec3>,
    pub ceiling_m: Option<f32>,
}

/// Footprint of an object on the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    /// Center (x, z), meters.
    pub center: Vec2,
    /// Unit vector of its own x axis in world (x, z).
    pub axis: Vec2,
    /// Half extents along its own x and z axes, meters.
    pub half_extent: Vec2,
    /// Shadow strength under it, 0 to 1.
    pub strength: f32,
    pub is_round: bool,
}

impl Ground {
    pub fn new(setup: &Setup) -> Ground {
        let floors = setup.floors.iter().map(|f| f.rect);
        let all =
            floors.fold(setup.bounds, |a, b| Rect { min: a.min.min(b.min), max: a.max.max(b.max) });
        let all = all.expanded(0.5);
        let size = all.size();
        let max_cells = MAX_CELLS as f32 - 1.0;
        // Large enough for floors as far apart as coordinates permit.
        let cells_per_m = (max_cells / size.x.max(size.y)).clamp(0.1, 25.0);
        let count = |m: f32| ((m * cells_per_m) as usize).min(MAX_CELLS - 1) + 1;
        let (nx, nz) = (count(size.x), count(size.y));
        let height = setup.ceiling_m.unwrap_or(3.0);
        let lamp = |r: &chaic_world::Room| {
            let c = r.rect.center();
            Vec3::new(c.x, height - 0.35, c.y)
        };
        let mut ground = Ground {
            min: all.min,
            cells_per_m,
            nx,
            nz,
            rooms: vec![NO_ROOM; nx * nz],
            wall_shadows: vec![0; nx * nz],
            lamps: setup.rooms.iter().take(usize::from(NO_ROOM)).map(lamp).collect(),
            ceiling_m: setup.ceiling_m,
        };
        for (k, room) in setup.rooms.iter().enumerate().take(usize::from(NO_ROOM)).rev() {
            if room.kind == RoomKind::Outdoors || setup.ceiling_m.is_none() {
                continue;
            }
            let (x0, z0) = ground.cell(room.rect.min);
            let (x1, z1) = ground.cell(room.rect.max);
            // Corners may be swapped.
            let (x0, x1) = (x0.min(x1), x0.max(x1));
            for z in z0.min(z1)..=z0.max(z1) {
                ground.rooms[z * nx + x0..=z * nx + x1].fill(k as u8);
            }
        }
        ground.spread_rooms();
        let mut wall_shadows = std::mem::take(&mut ground.wall_shadows);
        for w in setup.walls.iter().filter(|w| w.bottom_m < 0.1) {
            let along = w.b - w.a;
            let length = (along.x * along.x + along.y * along.y).sqrt();
            let axis = if length > 1e-6 { along / length } else { Vec2::X };
            let half_extent = Vec2::new(0.5 * length, 0.5 * w.thickness_m);
            let footprint = Footprint {
                center: 0.5 * (w.a + w.b),
                axis,
                half_extent,
                strength: 0.3,
                is_round: false,
            };
            ground.splat_shadow(&mut wall_shadows, &footprint);
        }
        ground.wall_shadows = wall_shadows;
        ground
    }

    /// Assigns each cell without a room (doorways, alcoves, cells under walls) to the nearest room,
    /// measured in cells. The lamp of that room lights it.
    fn spread_rooms(&mut self) {
        let mut frontier: Vec<usize> =
            (0..self.rooms.len()).filter(|k| self.rooms[*k] != NO_ROOM).collect();
        while !frontier.is_empty() {
            let mut next = Vec::new();
            for k in frontier {
                for neighbor in neighbors(k, self.nx, self.nz) {
                    if self.rooms[neighbor] == NO_ROOM {
                        self.rooms[neighbor] = self.rooms[k];
                        next.push(neighbor);
                    }
                }
            }
            frontier = next;
        }
    }

    #[inline(always)]
    fn cell(&self, p: Vec2) -> (usize, usize) {
        let (x, z) = ((p.x - self.min.x) * self.cells_per_m, (p.y - self.min.y) * self.cells_per_m);
        ((x.max(0.0) as usize).min(self.nx - 1), (z.max(0.0) as usize).min(self.nz - 1))
    }

    /// Returns the number of cells per meter, and the corner (x, z) of the first cell.
    pub fn grid(&self) -> (f32, Vec2) {
        (self.cells_per_m, self.min)
    }

    /// Returns the room of each cell in a row along x, or [`NO_ROOM`].
    pub fn rooms_in_row(&self, z: usize) -> &[u8] {
        &self.rooms[z * self.nx..][..self.nx]
    }

    /// Returns the room at a point, or [`NO_ROOM`].
    #[inline(always)]
    pub fn room_at(&self, p: Vec3) -> u8 {
        let (x, z) = self.cell(Vec2::new(p.x, p.z));
        self.rooms[z * self.nx + x]
    }

    /// Returns the position of each room's lamp.
    pub fn lamps(&self) -> &[Vec3] {
        &self.lamps
    }

    /// Returns the lamp of a room.
    #[inline(always)]
    pub fn lamp(&self, room: u8) -> Option<Vec3> {
        self.lamps.get(usize::from(room)).copied()
    }

    /// Adds the shadow of a footprint; returns the changed cells as [first x, first z, last x, last
    /// z].
    pub fn splat_shadow(&self, shadows: &mut [u8], footprint: &Footprint) -> [usize; 4] {
        // Small objects have smaller shadows.
        let size = footprint.half_extent.x.max(footprint.half_extent.y);
        let reach_m = CONTACT_SHADOW_M.min(0.02 + 0.6 * size).max(1.2 / self.cells_per_m);
        let reach = Vec2::new(
            footprint.axis.x.abs() * footprint.half_extent.x
                + footprint.axis.y.abs() * footprint.half_extent.y,
            footprint.axis.y.abs() * footprint.half_extent.x
                + footprint.axis.x.abs() * footprint.half_extent.y,
        ) + reach_m;
        let (x0, z0) = self.cell(footprint.center - reach);
        let (x1, z1) = self.cell(footprint.center + reach);
        for z in z0..=z1 {
            for x in x0..=x1 {
                let p = self.min + (Vec2::new(x as f32, z as f32) + 0.5) / self.cells_per_m;
                let d = p - footprint.center;
                let local = Vec2::new(
                    (d.x * footprint.axis.x + d.y * footprint.axis.y).abs(),
                    (d.y * footprint.axis.x - d.x * footprint.axis.y).abs(),
                );
                let distance = if footprint.is_round {
                    let s = local / (footprint.half_extent + reach_m);
                    (s.x * s.x + s.y * s.y).sqrt()
                } else {
                    let o = (local - footprint.half_extent).max(Vec2::ZERO);
                    (o.x * o.x + o.y * o.y).sqrt() / reach_m
                };
                let fade = (1.0 - distance).max(0.0);
                let value = (255.0 * footprint.strength * fade * (2.0 - fade)) as u8;
                let cell = &mut shadows[z * self.nx + x];
                *cell = (*cell).max(value);
            }
        }
        [x0, z0, x1, z1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_test_kit::scenes::{empty, floor};
    use chaic_world::{FloorMaterial, Room};

    #[test]
    fn the_ground_covers_floors_of_any_permitted_size() {
        for max_m in [20.0, 600.0, 640.0, Setup::MAX_COORDINATE_M] {
            let mut setup = empty();
            setup.ceiling_m = Some(2.8);
            setup.floors =
                vec![floor([-max_m; 2], [max_m; 2], FloorMaterial::Wood, [190, 160, 120])];
            let room = |from: f32, to: f32| Room {
                kind: RoomKind::Office,
                rect: Rect::new([from * max_m; 2], [to * max_m; 2]),
            };
            setup.rooms = vec![room(0.3, 0.5), room(0.8, 0.95)];
            let ground = Ground::new(&setup);
            assert!(ground.nx.max(ground.nz) <= MAX_CELLS);
            let rooms = [0.4, 0.9].map(|at| ground.room_at(Vec3::new(at * max_m, 0.0, at * max_m)));
            assert_eq!(rooms, [0, 1], "{max_m} m");
        }
    }
}
