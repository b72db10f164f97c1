//! Door frames, windows and lamps.

use chaic_core::catalogue::Finish;
use chaic_core::{Vec2, Vec3};
use chaic_world::{Opening, Room, RoomKind, Setup, Wall};

use super::walls::{Line, Stretch};
use crate::mesh::{Gloss, Mesh, Place, Section, Skin};
use crate::mesh_builder::scramble;
use crate::solids::{cuboid, ellipsoid, frustum};

/// Width of a door's casing, and how far it and a window's frame stand out from the wall, metres.
const CASING_M: f32 = 0.07;
const STANDS_OUT_M: f32 = 0.016;
/// Thickness of the boards that line a doorway, metres.
const LINING_M: f32 = 0.008;

/// The wood of a house's doors and windows.
fn wood(setup: &Setup) -> Skin {
    const WOODS: [([u8; 3], Finish); 4] = [
        ([238, 236, 230], Finish::Glossy),
        ([238, 236, 230], Finish::Glossy),
        ([176, 124, 78], Finish::Wood),
        ([120, 82, 56], Finish::Wood),
    ];
    let (color, finish) = WOODS[scramble(setup.seed as u32 ^ 0xd00e) as usize % 4];
    Skin::new(color, finish)
}

/// The frame around a doorway between two walls, if there are such walls: its sides, and what is
/// above people's heads, which a map leaves out.
pub(super) fn door_frame(setup: &Setup, opening: &Opening) -> Option<[Mesh; 2]> {
    let along = opening.b - opening.a;
    let length = (along.x * along.x + along.y * along.y).sqrt();
    if !(0.3..6.0).contains(&length) {
        return None;
    }
    let mut line = Line {
        middle: 0.5 * (opening.a + opening.b),
        axis: along / length,
        half: 0.5 * Vec2::new(length, 0.1),
    };
    // Walls in line with the doorway end where it begins; the one above it says how high it is.
    let (mut low, mut high) = (f32::NEG_INFINITY, f32::INFINITY);
    let (mut top, mut thick) = (None, None);
    for wall in &setup.walls {
        let own = Line::of(wall);
        let d = own.middle - line.middle;
        let t = d.x * line.axis.x + d.y * line.axis.y;
        let off = (d.y * line.axis.x - d.x * line.axis.y).abs();
        let turn = (own.axis.x * line.axis.y - own.axis.y * line.axis.x).abs();
        if off > 0.12 || turn > 0.02 {
            continue;
        }
        let (from, to) = (t - own.half.x, t + own.half.x);
        if wall.bottom_m > 1.0 && from < 0.0 && to > 0.0 {
            top = Some(wall.bottom_m);
            thick = thick.or(Some(wall.thickness_m));
        } else if wall.bottom_m < 0.1 && to < 0.0 && to > low {
            (low, thick) = (to, Some(wall.thickness_m));
        } else if wall.bottom_m < 0.1 && from > 0.0 && from < high {
            (high, thick) = (from, Some(wall.thickness_m));
        }
    }
    let (low, high, thick) = (Some(low), Some(high), thick?);
    let near = |edge: Option<f32>| edge.filter(|t| t.is_finite() && t.abs() < 0.5 * length + 0.4);
    let (low, high) = (near(low)?, near(high)?);
    let head = top.or(setup.ceiling_m)?;
    line.half.y = 0.5 * thick;

    let skin = wood(setup).with_axes(line.axes());
    let (mut sides, mut above) = (Mesh::default(), Mesh::default());
    sides.skin(skin);
    above.skin(skin);
    let board = |mesh: &mut Mesh, center: [f32; 3], extent: [f32; 3]| {
        cuboid(mesh, &line.place(center, extent));
    };
    let deep = thick + 2.0 * STANDS_OUT_M;
    for (edge, out) in [(low, -1.0f32), (high, 1.0)] {
        // The lining inside, and a casing on either face.
        let tall = head - if top.is_some() { LINING_M } else { 0.0 };
        board(&mut sides, [edge - out * 0.5 * LINING_M, 0.5 * tall, 0.0], [LINING_M, tall, deep]);
        for side in [-1.0, 1.0] {
            let z = side * 0.5 * (thick + STANDS_OUT_M);
            let x = edge + out * 0.5 * CASING_M;
            board(&mut sides, [x, 0.5 * head, z], [CASING_M, head, STANDS_OUT_M]);
        }
    }
    if top.is_some() {
        let middle = 0.5 * (low + high);
        board(&mut above, [middle, head - 0.5 * LINING_M, 0.0], [high - low, LINING_M, deep]);
        for side in [-1.0, 1.0] {
            let z = side * 0.5 * (thick + STANDS_OUT_M);
            let wide = high - low + 2.0 * CASING_M;
            board(&mut above, [middle, head + 0.5 * CASING_M, z], [wide, CASING_M, STANDS_OUT_M]);
        }
    }
    Some([sides.finish(), above.finish()])
}

/// Windows along a stretch of outer wall, on its inner side, where nothing hangs or stands high.
pub(super) fn windows(mesh: &mut Mesh, setup: &Setup, wall: &Wall, line: &Line, stretch: &Stretch) {
    const EVERY_M: f32 = 2.6;
    let Some(kind) = stretch.room.map(|k| setup.rooms[k].kind) else { return };
    let length = stretch.to - stretch.from;
    let small = matches!(kind, RoomKind::Bathroom | RoomKind::Corridor);
    let (wide, sill) = if small { (0.7, 1.45) } else { (1.2, 0.95) };
    let high = (wall.top_m - 0.45).min(2.15) - sill;
    if length < wide + 0.5 || high < 0.4 {
        return;
    }
    let n = ((length / EVERY_M) as usize).clamp(1, 6);
    for k in 0..n {
        let x = stretch.from + length * (k as f32 + 0.5) / n as f32;
        let p = line.plan(x, stretch.side * line.half.y);
        let is_free = setup.things.iter().all(|t| {
            let (size, d) = (t.size_m(), Vec2::new(t.position.x, t.position.z) - p);
            let off = (d.x * line.axis.y - d.y * line.axis.x).abs();
            let along = (d.x * line.axis.x + d.y * line.axis.y).abs();
            let half = 0.5 * size.x.max(size.z);
            off > half + 0.15 || along > half + 0.5 * wide || t.position.y + size.y < sill
        });
        if is_free {
            let seed = scramble(setup.seed as u32 ^ (x * 1000.0) as i32 as u32);
            let has_curtains =
                matches!(kind, RoomKind::Bedroom | RoomKind::LivingRoom) && !seed.is_multiple_of(4);
            let size = [wide, high];
            window(mesh, setup, line, [x, sill], size, stretch.side);
            if has_curtains {
                curtains(mesh, line, [x, sill], size, stretch.side, seed);
            }
        }
    }
}

fn window(
    mesh: &mut Mesh,
    setup: &Setup,
    line: &Line,
    [x, sill]: [f32; 2],
    [wide, high]: [f32; 2],
    side: f32,
) {
    let z = |out: f32| side * (line.half.y + out);
    let block = |mesh: &mut Mesh, center: [f32; 2], extent: [f32; 2], thick: f32| {
        let center = [x + center[0], sill + center[1], z(0.5 * thick)];
        cuboid(mesh, &line.place(center, [extent[0], extent[1], thick]));
    };
    mesh.skin(Skin { gloss: Gloss::Pane, ..Skin::new([180, 210, 242], Finish::Glass) });
    block(mesh, [0.0, 0.5 * high], [wide, high], 0.008);
    mesh.skin(wood(setup).with_axes(line.axes()));
    let bar = 0.055;
    for dx in [-0.5, 0.5] {
        block(mesh, [dx * wide, 0.5 * high], [bar, high + bar], 0.03);
    }
    for dy in [0.0, high] {
        block(mesh, [0.0, dy], [wide, bar], 0.03);
    }
    block(mesh, [0.0, 0.5 * high], [0.05, high], 0.024);
    block(mesh, [0.0, 0.64 * high], [wide, 0.03], 0.02);
    block(mesh, [0.0, -0.045], [wide + 0.16, 0.03], 0.06);
}

fn curtains(
    mesh: &mut Mesh,
    line: &Line,
    [x, sill]: [f32; 2],
    [wide, high]: [f32; 2],
    side: f32,
    seed: u32,
) {
    const CLOTHS: [[u8; 3]; 6] = [
        [196, 176, 146],
        [128, 150, 166],
        [176, 108, 92],
        [222, 216, 204],
        [132, 148, 116],
        [150, 128, 158],
    ];
    let out = line.half.y + 0.03;
    let at = |dx: f32, y: f32, z: f32| {
        let p = line.plan(x + dx, side * (out + z));
        Vec3::new(p.x, y, p.y)
    };
    let axes = line.axes();
    mesh.skin(Skin::new(CLOTHS[seed as usize / 8 % 6], Finish::Fabric).with_axes(axes));
    let (low, top) = ((sill - 0.2).max(0.1), sill + high + 0.14);
    for end in [-1.0f32, 1.0] {
        for k in 0..3 {
            // Folds beside the window, wider below.
            let dx = end * (0.5 * wide - 0.05 + 0.1 * k as f32);
            let section = |y: f32, grow: f32| Section {
                center: at(dx * grow, y, 0.0),
                a: axes.x_axis * (0.062 * grow),
                b: axes.z_axis * 0.03,
            };
            mesh.tube(&[section(low, 1.02), section(top, 0.98)], 5);
        }
    }
    mesh.skin(Skin::new([120, 96, 66], Finish::Metal));
    let half = 0.5 * wide + 0.26;
    let [x0, y0, z0] = [x, top, side * (out + 0.005)];
    cuboid(mesh, &line.place([x0, y0, z0], [2.0 * half, 0.022, 0.022]));
    for dx in [-half, half] {
        cuboid(mesh, &line.place([x0 + dx, y0, z0], [0.05, 0.04, 0.04]));
    }
}

/// A lamp under the ceiling of a room.
pub(super) fn lamp(room: &Room, ceiling_m: f32) -> Mesh {
    let c = room.rect.center();
    let mut mesh = Mesh::default();
    let n = 10;
    let at = |y: f32, extent: [f32; 3]| {
        Place::upright(Vec3::new(c.x, ceiling_m - y, c.y), Vec3::from(extent))
    };
    mesh.skin(Skin::new([176, 178, 182], Finish::Metal));
    frustum(&mut mesh, &at(0.015, [0.46, 0.03, 0.46]), 1.0, n);
    mesh.skin(Skin { gloss: Gloss::Glow, ..Skin::new([255, 253, 250], Finish::Matte) });
    ellipsoid(&mut mesh, &at(0.03, [0.4, 0.16, 0.4]), n);
    mesh.finish()
}
