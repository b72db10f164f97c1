//! Walls: papered differently in each room, with skirting boards, and windows where the other side
//! is outdoors.

use chaic_core::catalogue::Finish;
use chaic_core::geom::Rect;
use chaic_core::{Vec2, Vec3};
use chaic_world::{RoomKind, Setup, Wall};
use glam::Mat3;

use super::joinery;
use crate::mesh::{Mesh, Place, Skin};
use crate::mesh_builder::scramble;
use crate::solids::cuboid;
use crate::texture::Texture;

/// Height and thickness of skirting boards, metres.
const SKIRTING_M: [f32; 2] = [0.085, 0.012];

/// A wall's own frame: x along it, y up, z to one side.
#[derive(Clone, Copy)]
pub(crate) struct Line {
    pub middle: Vec2,
    pub axis: Vec2,
    /// Half of its length and of its thickness, metres.
    pub half: Vec2,
}

impl Line {
    /// The box that bodies collide with, overlapping its neighbors by half of its thickness.
    pub fn of(wall: &Wall) -> Line {
        let along = wall.b - wall.a;
        let length = (along.x * along.x + along.y * along.y).sqrt();
        let axis = if length > 1e-6 { along / length } else { Vec2::X };
        let half = 0.5 * Vec2::new(length + wall.thickness_m, wall.thickness_m);
        Line { middle: 0.5 * (wall.a + wall.b), axis, half }
    }

    /// A point `x` along the wall, `z` off its center line.
    pub fn plan(&self, x: f32, z: f32) -> Vec2 {
        self.middle + self.axis * x + Vec2::new(-self.axis.y, self.axis.x) * z
    }

    pub fn axes(&self) -> Mat3 {
        let a = self.axis;
        Mat3::from_cols(Vec3::new(a.x, 0.0, a.y), Vec3::Y, Vec3::new(-a.y, 0.0, a.x))
    }

    /// A box about (x, y, z) of the wall's frame.
    pub fn place(&self, center: [f32; 3], extent: [f32; 3]) -> Place {
        let p = self.plan(center[0], center[2]);
        let center = Vec3::new(p.x, center[1], p.y);
        Place { center, axes: self.axes(), extent: Vec3::from(extent) }
    }
}

/// A stretch of one side of a wall that belongs to one room or to none.
#[derive(Clone, Copy)]
pub(super) struct Stretch {
    pub from: f32,
    pub to: f32,
    /// 1 for the side towards the wall's +z, -1 for the other.
    pub side: f32,
    pub room: Option<usize>,
}

/// The mesh of a wall with all that hangs on it.
pub(super) fn mesh(setup: &Setup, wall: &Wall, papers: &[Skin]) -> Mesh {
    let line = Line::of(wall);
    let cuts = cuts(setup, &line);
    let mut stretches = Vec::new();
    for side in [-1.0, 1.0] {
        for ends in cuts.windows(2) {
            let p = line.plan(0.5 * (ends[0] + ends[1]), side * (line.half.y + 0.1));
            let room = room_at(setup, p);
            stretches.push(Stretch { from: ends[0], to: ends[1], side, room });
        }
    }
    join_scraps(&mut stretches);
    let mut mesh = Mesh::default();
    faces(&mut mesh, wall, &line, papers, &stretches);
    if wall.bottom_m < 0.1 {
        skirting(&mut mesh, &line, &stretches);
        let rooms = super::indoors(setup).map(|r| r.rect);
        let house = rooms.reduce(|a, b| Rect { min: a.min.min(b.min), max: a.max.max(b.max) });
        let Some(house) = house else { return mesh.finish() };
        for stretch in stretches.iter().filter(|s| s.room.is_some()) {
            let beyond =
                line.plan(0.5 * (stretch.from + stretch.to), -stretch.side * (line.half.y + 0.3));
            // Alcoves belong to no room: outdoors is what lies beyond all rooms.
            if !house.contains(beyond) {
                joinery::windows(&mut mesh, setup, wall, &line, stretch);
            }
        }
    }
    mesh.finish()
}

/// Corners and ends of walls belong to the room beside them, though its floor ends before.
fn join_scraps(stretches: &mut [Stretch]) {
    const SCRAP_M: f32 = 0.35;
    for k in 0..stretches.len() {
        let Stretch { from, to, side, room } = stretches[k];
        if room.is_none() && to - from < SCRAP_M {
            let is_near = |s: &&Stretch| s.side == side && (s.to == from || s.from == to);
            stretches[k].room = stretches.iter().filter(is_near).find_map(|s| s.room);
        }
    }
}

fn room_at(setup: &Setup, p: Vec2) -> Option<usize> {
    setup.rooms.iter().position(|r| r.kind != RoomKind::Outdoors && r.rect.grown(0.02).contains(p))
}

/// Most cuts of a wall, its ends among them: bounds the work on odd input.
const MAX_CUTS: usize = 64;

/// Where along the wall a room begins or ends, from end to end.
fn cuts(setup: &Setup, line: &Line) -> Vec<f32> {
    let mut cuts = vec![-line.half.x, line.half.x];
    for room in setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors) {
        let touching = room.rect.grown(line.half.y + 0.2);
        for k in 0..4 {
            let pick = |bit: usize, v: [f32; 2]| v[k >> bit & 1];
            let (min, max) = (room.rect.min, room.rect.max);
            let d = Vec2::new(pick(0, [min.x, max.x]), pick(1, [min.y, max.y])) - line.middle;
            let t = d.x * line.axis.x + d.y * line.axis.y;
            let near = line.plan(t, 0.0);
            if t.abs() < line.half.x - 0.05 && touching.contains(near) {
                cuts.push(t);
            }
        }
    }
    cuts.sort_by(f32::total_cmp);
    cuts.dedup_by(|a, b| (*a - *b).abs() < 0.02);
    // However short the wall is, and however many rooms it passes, it has two ends.
    if cuts.len() < 2 || cuts.len() > MAX_CUTS {
        cuts.truncate(MAX_CUTS - 1);
        cuts.push(line.half.x);
    }
    cuts
}

/// The closed box of the wall, its sides cut where rooms meet.
fn faces(mesh: &mut Mesh, wall: &Wall, line: &Line, papers: &[Skin], stretches: &[Stretch]) {
    let n = stretches.len() / 2;
    let cuts = stretches[..n].iter().map(|s| s.from).chain(stretches.last().map(|s| s.to));
    let base = mesh.positions.len();
    for t in cuts {
        for z in [-line.half.y, line.half.y] {
            for y in [wall.bottom_m, wall.top_m] {
                let p = line.plan(t, z);
                mesh.vertex(Vec3::new(p.x, y, p.y), Vec3::Y);
            }
        }
    }
    // Corners of a cut: 0 and 1 low and high at -z, 2 and 3 at +z.
    let at = |k: usize, vertex: usize| base + 4 * k + vertex;
    let bare = plaster(wall.color);
    mesh.skin(bare.with_axes(line.axes()));
    mesh.quad([at(0, 0), at(0, 2), at(0, 3), at(0, 1)], false);
    mesh.quad([at(n, 0), at(n, 1), at(n, 3), at(n, 2)], false);
    for k in 0..n {
        mesh.quad([at(k, 1), at(k, 3), at(k + 1, 3), at(k + 1, 1)], false);
        mesh.quad([at(k, 0), at(k + 1, 0), at(k + 1, 2), at(k, 2)], false);
    }
    for (j, stretch) in stretches.iter().enumerate() {
        let k = j % n;
        let paper = stretch.room.and_then(|k| papers.get(k)).unwrap_or(&bare);
        mesh.skin(paper.with_axes(line.axes()));
        if stretch.side < 0.0 {
            mesh.quad([at(k, 0), at(k, 1), at(k + 1, 1), at(k + 1, 0)], false);
        } else {
            mesh.quad([at(k, 2), at(k + 1, 2), at(k + 1, 3), at(k, 3)], false);
        }
    }
}

fn plaster(color: [u8; 3]) -> Skin {
    Skin { texture: Texture::Plaster, ..Skin::new(color, Finish::Matte) }
}

/// What the walls of each room are papered with: the color of one of them, shifted as the room
/// likes it.
pub(super) fn papers(setup: &Setup) -> Vec<Skin> {
    const SHIFTS: [[f32; 3]; 8] = [
        [1.0, 1.0, 1.0],
        [0.88, 0.97, 1.04],
        [1.03, 0.96, 0.86],
        [0.92, 1.0, 0.88],
        [1.02, 0.9, 0.86],
        [1.0, 0.98, 0.8],
        [0.94, 0.9, 1.0],
        [0.82, 0.88, 0.9],
    ];
    let first = scramble(setup.seed as u32 ^ 0x7a11) as usize % 8;
    let paper = |(k, room): (usize, &chaic_world::Room)| {
        let is_near = |w: &&Wall| room.rect.grown(w.thickness_m).contains(Line::of(w).middle);
        let own = setup.walls.iter().rev().find(is_near).or(setup.walls.first());
        let color = own.map_or([232, 228, 220], |w| w.color);
        // Neighboring numbers are far apart in the list.
        let shift = SHIFTS[(first + 3 * k) % 8];
        let color = [0, 1, 2].map(|c| (f32::from(color[c]) * shift[c]).min(250.0) as u8);
        match room.kind {
            RoomKind::Bathroom => Skin { texture: Texture::Tiles, ..plaster(color) },
            _ => plaster(color),
        }
    };
    setup.rooms.iter().enumerate().map(paper).collect()
}

fn skirting(mesh: &mut Mesh, line: &Line, stretches: &[Stretch]) {
    let [high, thick] = SKIRTING_M;
    mesh.skin(Skin::new([236, 232, 224], Finish::Glossy));
    for s in stretches.iter().filter(|s| s.room.is_some()) {
        let z = s.side * (line.half.y + 0.5 * thick);
        let center = [0.5 * (s.from + s.to), 0.5 * high, z];
        cuboid(mesh, &line.place(center, [s.to - s.from, high, thick]));
    }
}
