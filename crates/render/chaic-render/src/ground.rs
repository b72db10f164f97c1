//! The ground of a plan in cells: which room each belongs to, where rooms have their lamps, and how
//! dark it is near walls and the feet of things.

use chaic_core::geom::Rect;
use chaic_core::{Vec2, Vec3};
use chaic_world::{RoomKind, Setup};

use crate::grid::neighbors;

/// No room.
pub(crate) const NO_ROOM: u8 = u8::MAX;
/// How far the darkness at the foot of things reaches, metres.
const CONTACT_M: f32 = 0.22;
/// Cells of the ground along one side at most; a house gets cells of a few centimetres.
pub(crate) const MAX_CELLS: usize = 256;

/// Cells of the ground, and one for what isn't ground: unshaded.
pub(crate) const N_GROUND: usize = MAX_CELLS * MAX_CELLS + 1;

/// The ground as a grid of cells; x across, z down.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    min: Vec2,
    cells_per_m: f32,
    /// Number of cells along x and z.
    pub nx: usize,
    pub nz: usize,
    /// Room of each cell, or [`NO_ROOM`].
    rooms: Vec<u8>,
    /// Darkness from walls, 0 to 255, per cell.
    pub walls: Vec<u8>,
    /// Where each room's lamp hangs.
    lamps: Vec<Vec3>,
    pub ceiling_m: Option<f32>,
}

/// The foot of something on the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foot {
    /// Middle (x, z), metres.
    pub center: Vec2,
    /// Unit vector of its own x in the world's (x, z).
    pub axis: Vec2,
    /// Half extents along its own x and z, metres.
    pub half: Vec2,
    /// Darkness under it, 0 to 1.
    pub depth: f32,
    pub round: bool,
}

impl Ground {
    pub fn new(setup: &Setup) -> Ground {
        let floors = setup.floors.iter().map(|f| f.rect);
        let all =
            floors.fold(setup.bounds, |a, b| Rect { min: a.min.min(b.min), max: a.max.max(b.max) });
        let all = all.grown(0.5);
        let size = all.size();
        let most = MAX_CELLS as f32 - 1.0;
        let cells_per_m = (most / size.x.max(size.y)).clamp(0.2, 25.0);
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
            walls: vec![0; nx * nz],
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
        let mut walls = std::mem::take(&mut ground.walls);
        for w in setup.walls.iter().filter(|w| w.bottom_m < 0.1) {
            let along = w.b - w.a;
            let length = (along.x * along.x + along.y * along.y).sqrt();
            let axis = if length > 1e-6 { along / length } else { Vec2::X };
            let half = Vec2::new(0.5 * length, 0.5 * w.thickness_m);
            let foot = Foot { center: 0.5 * (w.a + w.b), axis, half, depth: 0.3, round: false };
            ground.darken(&mut walls, &foot);
        }
        ground.walls = walls;
        ground
    }

    /// Gives what belongs to no room of a house (doorways, alcoves, the cells beneath walls) to the
    /// nearest room, counted in cells: its lamp shines there too.
    fn spread_rooms(&mut self) {
        let mut front: Vec<usize> =
            (0..self.rooms.len()).filter(|k| self.rooms[*k] != NO_ROOM).collect();
        while !front.is_empty() {
            let mut next = Vec::new();
            for k in front {
                for neighbor in neighbors(k, self.nx, self.nz) {
                    if self.rooms[neighbor] == NO_ROOM {
                        self.rooms[neighbor] = self.rooms[k];
                        next.push(neighbor);
                    }
                }
            }
            front = next;
        }
    }

    #[inline(always)]
    fn cell(&self, p: Vec2) -> (usize, usize) {
        let (x, z) = ((p.x - self.min.x) * self.cells_per_m, (p.y - self.min.y) * self.cells_per_m);
        ((x.max(0.0) as usize).min(self.nx - 1), (z.max(0.0) as usize).min(self.nz - 1))
    }

    /// Cells per metre, and the corner (x, z) where the first cell begins.
    pub fn grid(&self) -> (f32, Vec2) {
        (self.cells_per_m, self.min)
    }

    /// The room of each cell in a row along x, or [`NO_ROOM`].
    pub fn rooms_in_row(&self, z: usize) -> &[u8] {
        &self.rooms[z * self.nx..][..self.nx]
    }

    /// The room at a point, or [`NO_ROOM`].
    #[inline(always)]
    pub fn room_at(&self, p: Vec3) -> u8 {
        let (x, z) = self.cell(Vec2::new(p.x, p.z));
        self.rooms[z * self.nx + x]
    }

    /// Where each room's lamp hangs.
    pub fn lamps(&self) -> &[Vec3] {
        &self.lamps
    }

    /// The lamp of a room.
    #[inline(always)]
    pub fn lamp(&self, room: u8) -> Option<Vec3> {
        self.lamps.get(usize::from(room)).copied()
    }

    /// Adds the shadow of a foot; gives the cells from the first x and z to the last.
    pub fn darken(&self, dark: &mut [u8], foot: &Foot) -> [usize; 4] {
        // Small things darken less around them.
        let size = foot.half.x.max(foot.half.y);
        let reach_m = CONTACT_M.min(0.02 + 0.6 * size).max(1.2 / self.cells_per_m);
        let spread = Vec2::new(
            foot.axis.x.abs() * foot.half.x + foot.axis.y.abs() * foot.half.y,
            foot.axis.y.abs() * foot.half.x + foot.axis.x.abs() * foot.half.y,
        ) + reach_m;
        let (x0, z0) = self.cell(foot.center - spread);
        let (x1, z1) = self.cell(foot.center + spread);
        for z in z0..=z1 {
            for x in x0..=x1 {
                let p = self.min + (Vec2::new(x as f32, z as f32) + 0.5) / self.cells_per_m;
                let d = p - foot.center;
                let own = Vec2::new(
                    (d.x * foot.axis.x + d.y * foot.axis.y).abs(),
                    (d.y * foot.axis.x - d.x * foot.axis.y).abs(),
                );
                let out = if foot.round {
                    let s = own / (foot.half + reach_m);
                    (s.x * s.x + s.y * s.y).sqrt()
                } else {
                    let o = (own - foot.half).max(Vec2::ZERO);
                    (o.x * o.x + o.y * o.y).sqrt() / reach_m
                };
                let fade = (1.0 - out).max(0.0);
                let value = (255.0 * foot.depth * fade * (2.0 - fade)) as u8;
                let cell = &mut dark[z * self.nx + x];
                *cell = (*cell).max(value);
            }
        }
        [x0, z0, x1, z1]
    }
}
