//! Light: lamps of rooms or the sun, and how dark the ground is near what stands on it.

use std::sync::OnceLock;

use chaic_protocol::geom::Rect;
use chaic_protocol::{Vec2, Vec3};
use chaic_world::{RoomKind, Setup};

use crate::grid::neighbors;

/// No room.
pub(crate) const NO_ROOM: u8 = u8::MAX;
/// How far the darkness at the foot of things reaches, metres.
const CONTACT_M: f32 = 0.22;
/// A ceiling is lit as if it were higher by so much, metres: lamps shine downwards, and what reaches it
/// is mostly what comes back from below.
pub(crate) const CEILING_FARTHER_M: f32 = 1.0;
/// By what light on ceilings is multiplied: they see the whole lit room.
pub(crate) const CEILING_TONE: f32 = 1.05;
/// Cells of the ground along one side at most; a house gets cells of a few centimetres.
pub(crate) const MAX_CELLS: usize = 256;

/// Cells of the ground, and one for what isn't ground: unshaded.
pub(crate) const N_GROUND: usize = MAX_CELLS * MAX_CELLS + 1;

/// The light of a scene. Colors are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lamps {
    /// Unit vector to the sun.
    pub to_sun: Vec3,
    pub sun: Vec3,
    /// A room's lamp, at no distance.
    pub lamp: Vec3,
    /// Light from above and from below, out of doors.
    pub outdoors: [Vec3; 2],
    /// The same in a room.
    pub indoors: [Vec3; 2],
    /// The sky at the horizon and in the zenith, and the ground below the horizon.
    pub sky: [Vec3; 3],
}

impl Lamps {
    /// The canonical look: a bright day.
    pub const DAY: Lamps = Lamps {
        to_sun: Vec3::new(0.42, 0.80, 0.43),
        sun: Vec3::new(0.92, 0.86, 0.74),
        lamp: Vec3::new(0.66, 0.62, 0.55),
        outdoors: [Vec3::new(0.36, 0.41, 0.48), Vec3::new(0.24, 0.23, 0.20)],
        indoors: [Vec3::new(0.40, 0.40, 0.40), Vec3::new(0.34, 0.32, 0.30)],
        sky: [
            Vec3::new(0.74, 0.82, 0.88),
            Vec3::new(0.19, 0.40, 0.74),
            Vec3::new(0.36, 0.38, 0.34),
        ],
    };

    /// Dusk: the sun low and red, the sky dim, lamps on.
    pub const EVENING: Lamps = Lamps {
        to_sun: Vec3::new(0.81, 0.35, 0.47),
        sun: Vec3::new(0.78, 0.50, 0.30),
        lamp: Vec3::new(0.74, 0.58, 0.40),
        outdoors: [Vec3::new(0.25, 0.25, 0.34), Vec3::new(0.17, 0.15, 0.15)],
        indoors: [Vec3::new(0.26, 0.24, 0.24), Vec3::new(0.24, 0.20, 0.17)],
        sky: [
            Vec3::new(0.86, 0.56, 0.36),
            Vec3::new(0.13, 0.18, 0.40),
            Vec3::new(0.24, 0.22, 0.21),
        ],
    };

    /// By what the color of a lamp is multiplied: half of its light's color, as bright as can be shown.
    pub fn glow(&self) -> Vec3 {
        0.5 + 0.5 * self.lamp / self.lamp.max_element().max(1e-6)
    }

    /// What is seen of a level surface out of doors, of linear color, without shadow.
    pub fn in_the_open(&self, color: Vec3) -> Vec3 {
        color * (self.outdoors[0] + self.sun * self.to_sun.y.max(0.0))
    }

    /// The linear color of the sky along a ray, and of the ground, far away, that has this color
    /// close by.
    #[inline(always)]
    pub fn sky_along(&self, ray: Vec3, ground: Vec3) -> Vec3 {
        let [horizon, zenith, _] = self.sky;
        let y = ray.y / ray.dot(ray).max(1e-12).sqrt();
        let up = (1.0 - y) * (1.0 - y);
        let (to, t) = if y >= 0.0 {
            (zenith, 1.0 - up * (0.4 + 0.6 * up))
        } else {
            (ground, (-6.0 * y).min(1.0))
        };
        horizon + (to - horizon) * t
    }
}

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
pub(crate) struct Light<'a> {
    pub ground: &'a Ground,
    pub lamps: &'a Lamps,
    /// None if nobody looks at color.
    pub shadows: Option<Shadows>,
    /// Of which arrangement of still things the shadows are.
    pub version: u64,
}

/// Shadows on the ground.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shadows {
    /// Darkness per cell, 0 to 255.
    dark: Vec<u8>,
    /// Brightness of the ground, four neighbors a cell as in [`crate::texture::Atlas`], 255
    /// unshaded; rows of [`MAX_CELLS`], and one more that is unshaded. Empty until it is asked for.
    quads: Vec<u32>,
    /// Where something was added: cells from the first x and z to the last.
    touched: Vec<[usize; 4]>,
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

    /// Number of cells along x and z.
    pub fn size(&self) -> [usize; 2] {
        [self.nx, self.nz]
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
    fn darken(&self, dark: &mut [u8], foot: &Foot) -> [usize; 4] {
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

impl Shadows {
    /// Those of walls.
    pub fn of_walls(ground: &Ground) -> Shadows {
        Shadows { dark: ground.walls.clone(), ..Shadows::default() }
    }

    /// Brightness of the ground in quads, once it is worked out.
    pub fn quads(&self) -> Option<&[u32; N_GROUND]> {
        self.quads.first_chunk()
    }

    /// The quads of a row along x, and what is beyond the ground; none before they are worked out.
    pub fn row(&self, z: usize) -> &[u32] {
        self.quads.get(z * MAX_CELLS..(z + 1) * MAX_CELLS).unwrap_or_default()
    }

    /// Where something was added: cells from the first x and z to the last.
    pub fn touched(&self) -> &[[usize; 4]] {
        &self.touched
    }

    /// Works out the brightness where it has changed.
    fn finish(&mut self, ground: &Ground) {
        if self.quads.is_empty() {
            self.quads.resize(N_GROUND, u32::MAX);
            self.touched.clear();
            self.brighten(ground, [0, 0, ground.nx - 1, ground.nz - 1]);
            return;
        }
        for k in 0..self.touched.len() {
            self.brighten(ground, self.touched[k]);
        }
    }

    /// Works out the brightness of quads that show any of these cells.
    fn brighten(&mut self, ground: &Ground, [x0, z0, x1, z1]: [usize; 4]) {
        let Ground { nx, nz, .. } = *ground;
        let (x0, z0) = (x0.saturating_sub(1), z0.saturating_sub(1));
        let roots = roots();
        let bright = |row: &[u8], i: usize| roots[usize::from(row[i])];
        for z in z0..=z1 {
            let row = |j: usize| &self.dark[j * nx..][..nx];
            let (here, below) = (row(z), row((z + 1).min(nz - 1)));
            let quads = &mut self.quads[z * MAX_CELLS..][x0..=x1];
            for (x, quad) in (x0..=x1).zip(quads) {
                let right = (x + 1).min(nx - 1);
                *quad = bright(here, x)
                    | bright(here, right) << 8
                    | bright(below, x) << 16
                    | bright(below, right) << 24;
            }
        }
    }

    /// Takes back what was added to these shadows.
    pub fn restore(&mut self, from: &Shadows, ground: &Ground) {
        for [x0, z0, x1, z1] in std::mem::take(&mut self.touched) {
            for z in z0.saturating_sub(1)..=z1 {
                let cells = z * ground.nx + x0..=z * ground.nx + x1;
                self.dark[cells.clone()].copy_from_slice(&from.dark[cells]);
                let quads = z * MAX_CELLS + x0.saturating_sub(1)..=z * MAX_CELLS + x1;
                self.quads[quads.clone()].copy_from_slice(&from.quads[quads]);
            }
        }
    }
}

/// What is shown of light, its root, for each darkness; 255 for none.
fn roots() -> &'static [u32; 256] {
    static ROOTS: OnceLock<[u32; 256]> = OnceLock::new();
    let root = |dark: usize| (255.0 * (1.0 - dark as f32 / 255.0).sqrt()) as u32;
    ROOTS.get_or_init(|| std::array::from_fn(root))
}

impl<'a> Light<'a> {
    /// Light with these shadows on the ground, or none if nobody looks at color.
    pub fn new(ground: &'a Ground, lamps: &'a Lamps, shadows: Option<Shadows>) -> Light<'a> {
        Light { ground, lamps, shadows, version: 0 }
    }

    /// Adds the shadow of a foot.
    pub fn cast(&mut self, foot: &Foot) {
        let is_sane = foot.center.is_finite() && foot.half.max_element() < 50.0;
        if let (Some(shadows), true) = (&mut self.shadows, is_sane) {
            let cells = self.ground.darken(&mut shadows.dark, foot);
            shadows.touched.push(cells);
        }
    }

    /// Adds the sun's shadow of something upright, out of doors: as long as it is high, as wide as
    /// it is on average.
    pub fn cast_by_sun(&mut self, center: Vec2, half: Vec2, height_m: f32) {
        /// Higher things are slender at the top: trees, lamps.
        const LONGEST_M: f32 = 5.0;
        let sun = self.lamps.to_sun;
        if self.ground.ceiling_m.is_some() || sun.y < 0.05 {
            return;
        }
        let away = Vec2::new(-sun.x, -sun.z);
        let flat = (away.x * away.x + away.y * away.y).sqrt();
        if flat < 1e-3 {
            return;
        }
        let axis = away / flat;
        let length = (height_m * flat / sun.y).min(LONGEST_M);
        let wide = 0.5 * (half.x + half.y);
        let half = Vec2::new(0.5 * length + 0.5 * wide, wide);
        let center = center + axis * (0.5 * length);
        self.cast(&Foot { center, axis, half, depth: 0.5, round: false });
    }

    /// Makes the ground ready; to be called when all shadows are cast.
    pub fn finish(&mut self) {
        if let Some(shadows) = &mut self.shadows {
            shadows.finish(self.ground);
        }
    }
}
