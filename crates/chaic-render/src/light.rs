//! Light: lamps of rooms or the sun, and how dark the ground is near what stands on it.

use chaic_protocol::geom::Rect;
use chaic_protocol::{Vec2, Vec3};
use chaic_world::{RoomKind, Setup};

use crate::texture::split;

/// No room.
pub(crate) const NO_ROOM: u8 = u8::MAX;
/// How far the darkness at the foot of things reaches, metres.
const CONTACT_M: f32 = 0.22;
/// Most cells of the ground along one side; a house gets cells of a few centimetres.
const MAX_CELLS: f32 = 400.0;

/// The ground as a grid of cells; x across, z down.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    min: Vec2,
    cells_per_m: f32,
    nx: usize,
    nz: usize,
    /// Room of each cell, or [`NO_ROOM`].
    rooms: Vec<u8>,
    /// Darkness from walls, 0 to 255, per cell.
    walls: Vec<u8>,
    /// Where each room's lamp hangs.
    lamps: Vec<Vec3>,
    pub ceiling_m: Option<f32>,
}

/// The light at one moment.
#[derive(Clone)]
pub(crate) struct Light<'a> {
    pub ground: &'a Ground,
    /// Darkness per cell, 0 to 255; empty until shadows are cast.
    dark: Vec<u8>,
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
        let cells_per_m = (MAX_CELLS / size.x.max(size.y)).clamp(0.2, 25.0);
        let count = |m: f32| ((m * cells_per_m) as usize + 1).min(MAX_CELLS as usize + 1);
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
            for z in z0..=z1 {
                ground.rooms[z * nx + x0..=z * nx + x1].fill(k as u8);
            }
        }
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

    fn cell(&self, p: Vec2) -> (usize, usize) {
        let at = (p - self.min) * self.cells_per_m;
        let whole = |x: f32, n: usize| (x as i32).clamp(0, n as i32 - 1) as usize;
        (whole(at.x, self.nx), whole(at.y, self.nz))
    }

    /// The room at a point, or [`NO_ROOM`].
    pub fn room_at(&self, p: Vec3) -> u8 {
        let (x, z) = self.cell(Vec2::new(p.x, p.z));
        self.rooms[z * self.nx + x]
    }

    /// The lamp of a room.
    pub fn lamp(&self, room: u8) -> Option<Vec3> {
        self.lamps.get(usize::from(room)).copied()
    }

    fn darken(&self, dark: &mut [u8], foot: &Foot) {
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
    }
}

impl<'a> Light<'a> {
    /// Light with the shadows of walls only, or none at all if nobody looks at color.
    pub fn new(ground: &'a Ground, wants_color: bool) -> Light<'a> {
        Light { ground, dark: if wants_color { ground.walls.clone() } else { Vec::new() } }
    }

    /// Whether shadows are wanted.
    pub fn wants_color(&self) -> bool {
        !self.dark.is_empty()
    }

    /// Adds the shadow of a foot.
    pub fn cast(&mut self, foot: &Foot) {
        if self.wants_color() && foot.center.is_finite() && foot.half.max_element() < 50.0 {
            self.ground.darken(&mut self.dark, foot);
        }
    }

    /// What stands in the ground's cells; see [`crate::lighting`].
    pub fn cells(&self) -> crate::lighting::Cells {
        let g = self.ground;
        crate::lighting::Cells {
            min: g.min.to_array(),
            cells_per_m: g.cells_per_m,
            n_x: g.nx,
            n_z: g.nz,
            rooms: g.rooms.clone(),
            brightness: self.dark.iter().map(|dark| 255 - dark).collect(),
        }
    }

    /// Where each room's lamp hangs.
    pub fn lamps_of_rooms(&self) -> &[Vec3] {
        &self.ground.lamps
    }

    /// How bright the ground is at (x, z), 0 to 1.
    #[inline]
    pub fn ground_brightness(&self, x: f32, z: f32) -> f32 {
        let g = self.ground;
        let u = ((x - g.min.x) * g.cells_per_m - 0.5).max(0.0);
        let v = ((z - g.min.y) * g.cells_per_m - 0.5).max(0.0);
        let ((i, fu), (j, fv)) = (split(u), split(v));
        let (i, j) = (i.max(0) as usize, j.max(0) as usize);
        if i + 1 >= g.nx || j + 1 >= g.nz {
            return 1.0;
        }
        let at = |k: usize| f32::from(self.dark[k]);
        let (a, b) = (j * g.nx + i, (j + 1) * g.nx + i);
        let low = at(a) + (at(a + 1) - at(a)) * fu;
        let high = at(b) + (at(b + 1) - at(b)) * fu;
        1.0 - (low + (high - low) * fv) * (1.0 / 255.0)
    }
}
