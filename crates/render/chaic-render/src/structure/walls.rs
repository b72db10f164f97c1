//! Walls: a paint per room, skirting boards, and windows in outer walls.

use chaic_core::catalogue::Finish;
use chaic_core::geom::Rect;
use chaic_core::{Vec2, Vec3};
use chaic_world::{RoomKind, Setup, Wall};

use super::joinery;
use super::wall_frame::{WallFrame, WallInterval};
use crate::mesh::{Material, Mesh};
use crate::mesh_builder::hash_u32;
use crate::solids::cuboid;
use crate::texture::Texture;

/// Height and thickness of skirting boards, meters.
const SKIRTING_M: [f32; 2] = [0.085, 0.012];

/// Maximum number of intervals on each side of a wall in one mesh: each has a material, and plaster
/// and skirting boards have two more.
const MAX_INTERVALS: usize = (Mesh::MAX_MATERIALS - 2) / 2;

/// Maximum number of meshes of all walls of a setup that a world accepts. A room cuts a wall at most
/// four times. Windows are on both sides, at least 1.2 m apart, on a box that is longer than the
/// wall by its thickness of at most 5 m. A mesh holds at least 63 windows of four materials.
pub(super) const MAX_MESHES: usize = {
    let length_m = Setup::MAX_WALL_LENGTH_M as usize + 5 * Setup::MAX_WALLS;
    let n_windows = 2 * 10 * length_m / 12;
    let n_parts = (4 * Setup::MAX_ROOMS + 1).div_ceil(MAX_INTERVALS);
    (n_parts + 1) * Setup::MAX_WALLS + n_windows / 63
};

/// Meshes of a wall with its windows and skirting boards: one, unless the wall is long.
pub(super) fn meshes(setup: &Setup, wall: &Wall, wall_materials: &[Material]) -> Vec<Mesh> {
    let wall_frame = WallFrame::new(wall);
    let cuts = cuts(setup, &wall_frame);
    let mut intervals = Vec::new();
    for side in [-1.0, 1.0] {
        for ends in cuts.windows(2) {
            let p = wall_frame.point(0.5 * (ends[0] + ends[1]), side * (wall_frame.half.y + 0.1));
            let room = room_at(setup, p);
            intervals.push(WallInterval { from: ends[0], to: ends[1], side, room });
        }
    }
    assign_short_intervals(&mut intervals);
    let (left, right) = intervals.split_at(intervals.len() / 2);
    let n_parts = left.len().div_ceil(MAX_INTERVALS);
    let sides = left.chunks(MAX_INTERVALS).zip(right.chunks(MAX_INTERVALS));
    let part = |(k, (left, right)): (usize, (&[WallInterval], &[WallInterval]))| {
        let mut mesh = Mesh::default();
        let has_ends = [k == 0, k + 1 == n_parts];
        faces(&mut mesh, wall, &wall_frame, wall_materials, [left, right], has_ends);
        if wall.bottom_m < 0.1 {
            skirting(&mut mesh, &wall_frame, [left, right]);
        }
        mesh
    };
    let mut meshes: Vec<Mesh> = sides.enumerate().map(part).collect();
    if wall.bottom_m < 0.1 {
        let rooms = super::indoors(setup).map(|r| r.rect);
        let house = rooms.reduce(|a, b| Rect { min: a.min.min(b.min), max: a.max.max(b.max) });
        let is_outdoors = |p: Vec2| house.is_some_and(|house| !house.contains(p));
        for interval in intervals.iter().filter(|s| s.room.is_some()) {
            let beyond = wall_frame.point(
                0.5 * (interval.from + interval.to),
                -interval.side * (wall_frame.half.y + 0.3),
            );
            // Alcoves belong to no room: a point is outdoors if it is outside the hull of all
            // rooms.
            if is_outdoors(beyond) {
                joinery::windows(&mut meshes, setup, wall, &wall_frame, interval);
            }
        }
    }
    let finish = |mesh: Mesh| {
        let mut mesh = mesh.finish();
        // A map leaves out meshes above doorways, but not windows that have a mesh of their own.
        mesh.min.y = mesh.min.y.min(wall.bottom_m);
        mesh
    };
    meshes.into_iter().map(finish).collect()
}

/// Assigns short intervals at corners and ends of walls to the adjacent room, although its floor
/// ends before.
fn assign_short_intervals(intervals: &mut [WallInterval]) {
    const SHORT_INTERVAL_M: f32 = 0.35;
    for k in 0..intervals.len() {
        let WallInterval { from, to, side, room } = intervals[k];
        if room.is_none() && to - from < SHORT_INTERVAL_M {
            let room_of = |j: usize| intervals.get(j).filter(|s| s.side == side)?.room;
            let room = room_of(k.wrapping_sub(1)).or_else(|| room_of(k + 1));
            intervals[k].room = room;
        }
    }
}

fn room_at(setup: &Setup, p: Vec2) -> Option<usize> {
    setup
        .rooms
        .iter()
        .position(|r| r.kind != RoomKind::Outdoors && r.rect.expanded(0.02).contains(p))
}

/// Positions along the wall where a room begins or ends, including both ends of the wall.
fn cuts(setup: &Setup, wall_frame: &WallFrame) -> Vec<f32> {
    let mut cuts = vec![-wall_frame.half.x, wall_frame.half.x];
    for room in setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors) {
        let touching = room.rect.expanded(wall_frame.half.y + 0.2);
        for k in 0..4 {
            let pick = |bit: usize, v: [f32; 2]| v[k >> bit & 1];
            let (min, max) = (room.rect.min, room.rect.max);
            let d = Vec2::new(pick(0, [min.x, max.x]), pick(1, [min.y, max.y])) - wall_frame.center;
            let t = d.x * wall_frame.axis.x + d.y * wall_frame.axis.y;
            let near = wall_frame.point(t, 0.0);
            if t.abs() < wall_frame.half.x - 0.05 && touching.contains(near) {
                cuts.push(t);
            }
        }
    }
    cuts.sort_by(f32::total_cmp);
    cuts.dedup_by(|a, b| (*a - *b).abs() < 0.02);
    // However short the wall is, it has two ends.
    if cuts.len() < 2 {
        cuts.push(wall_frame.half.x);
    }
    cuts
}

/// Adds a part of the box of the wall, whose sides are split where rooms meet. The box is closed
/// where the part has an end of the wall.
fn faces(
    mesh: &mut Mesh,
    wall: &Wall,
    wall_frame: &WallFrame,
    wall_materials: &[Material],
    [left, right]: [&[WallInterval]; 2],
    has_ends: [bool; 2],
) {
    let n = left.len();
    let cuts = left.iter().map(|s| s.from).chain(right.last().map(|s| s.to));
    let base = mesh.positions.len();
    for t in cuts {
        for z in [-wall_frame.half.y, wall_frame.half.y] {
            for y in [wall.bottom_m, wall.top_m] {
                let p = wall_frame.point(t, z);
                mesh.vertex(Vec3::new(p.x, y, p.y), Vec3::Y);
            }
        }
    }
    // Corners of a cut: 0 and 1 low and high at -z, 2 and 3 at +z.
    let at = |k: usize, vertex: usize| base + 4 * k + vertex;
    let unpainted = plaster(wall.color);
    mesh.set_material(unpainted.with_axes(wall_frame.axes()));
    if has_ends[0] {
        mesh.quad([at(0, 0), at(0, 2), at(0, 3), at(0, 1)], false);
    }
    if has_ends[1] {
        mesh.quad([at(n, 0), at(n, 1), at(n, 3), at(n, 2)], false);
    }
    for k in 0..n {
        mesh.quad([at(k, 1), at(k, 3), at(k + 1, 3), at(k + 1, 1)], false);
        mesh.quad([at(k, 0), at(k + 1, 0), at(k + 1, 2), at(k, 2)], false);
    }
    for (j, interval) in left.iter().chain(right).enumerate() {
        let k = j % n;
        let wall_material = interval.room.and_then(|k| wall_materials.get(k)).unwrap_or(&unpainted);
        mesh.set_material(wall_material.with_axes(wall_frame.axes()));
        if interval.side < 0.0 {
            mesh.quad([at(k, 0), at(k, 1), at(k + 1, 1), at(k + 1, 0)], false);
        } else {
            mesh.quad([at(k, 2), at(k + 1, 2), at(k + 1, 3), at(k, 3)], false);
        }
    }
}

fn plaster(color: [u8; 3]) -> Material {
    Material { texture: Texture::Plaster, ..Material::new(color, Finish::Matte) }
}

/// Wall material of each room: the color of one of its walls, shifted by room.
pub(super) fn wall_materials(setup: &Setup) -> Vec<Material> {
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
    let first = hash_u32(setup.seed as u32 ^ 0x7a11) as usize % 8;
    let wall_material = |(k, room): (usize, &chaic_world::Room)| {
        let is_near =
            |w: &&Wall| room.rect.expanded(w.thickness_m).contains(WallFrame::new(w).center);
        let wall = setup.walls.iter().rev().find(is_near).or(setup.walls.first());
        let color = wall.map_or([232, 228, 220], |w| w.color);
        // Neighboring indices are far apart in the list.
        let shift = SHIFTS[(first + 3 * k) % 8];
        let color = [0, 1, 2].map(|c| (f32::from(color[c]) * shift[c]).min(250.0) as u8);
        match room.kind {
            RoomKind::Bathroom => Material { texture: Texture::Tiles, ..plaster(color) },
            _ => plaster(color),
        }
    };
    setup.rooms.iter().enumerate().map(wall_material).collect()
}

fn skirting(mesh: &mut Mesh, wall_frame: &WallFrame, [left, right]: [&[WallInterval]; 2]) {
    let [height, thickness] = SKIRTING_M;
    mesh.set_material(Material::new([236, 232, 224], Finish::Glossy));
    for s in left.iter().chain(right).filter(|s| s.room.is_some()) {
        let z = s.side * (wall_frame.half.y + 0.5 * thickness);
        let center = [0.5 * (s.from + s.to), 0.5 * height, z];
        cuboid(mesh, &wall_frame.obb(center, [s.to - s.from, height, thickness]));
    }
}
