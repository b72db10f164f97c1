//! Door frames, windows and lamps.

use chaic_core::catalogue::Finish;
use chaic_core::{Vec2, Vec3};
use chaic_world::{Opening, Room, RoomKind, Setup, Wall};

use super::wall_frame::{WallFrame, WallInterval};
use crate::mesh::{Material, Mesh, OrientedBox, Section, SpecularPreset};
use crate::mesh_builder::hash_u32;
use crate::solids::{cuboid, ellipsoid, frustum};

/// Width of a door casing, and protrusion of casings and window frames from the wall, meters.
const CASING_M: f32 = 0.07;
const PROTRUSION_M: f32 = 0.016;
/// Thickness of the boards that line a doorway, meters.
const LINING_M: f32 = 0.008;

/// Material of the doors and windows of a house.
fn joinery_material(setup: &Setup) -> Material {
    const WOODS: [([u8; 3], Finish); 4] = [
        ([238, 236, 230], Finish::Glossy),
        ([238, 236, 230], Finish::Glossy),
        ([176, 124, 78], Finish::Wood),
        ([120, 82, 56], Finish::Wood),
    ];
    let (color, finish) = WOODS[hash_u32(setup.seed as u32 ^ 0xd00e) as usize % 4];
    Material::new(color, finish)
}

/// Meshes of the frame around a doorway: its sides, and the part above head height, which a map
/// leaves out. `None` if the doorway is not between two walls.
pub(super) fn door_frame(setup: &Setup, opening: &Opening) -> Option<[Mesh; 2]> {
    let along = opening.b - opening.a;
    let length = (along.x * along.x + along.y * along.y).sqrt();
    if !(0.3..6.0).contains(&length) {
        return None;
    }
    let mut wall_frame = WallFrame {
        center: 0.5 * (opening.a + opening.b),
        axis: along / length,
        half: 0.5 * Vec2::new(length, 0.1),
    };
    // Collinear walls end where the doorway begins; the wall above it gives its height.
    let (mut low, mut high) = (f32::NEG_INFINITY, f32::INFINITY);
    let (mut top, mut thickness) = (None, None);
    for wall in &setup.walls {
        let own = WallFrame::new(wall);
        let d = own.center - wall_frame.center;
        let t = d.x * wall_frame.axis.x + d.y * wall_frame.axis.y;
        let offset = (d.y * wall_frame.axis.x - d.x * wall_frame.axis.y).abs();
        let sine = (own.axis.x * wall_frame.axis.y - own.axis.y * wall_frame.axis.x).abs();
        if offset > 0.12 || sine > 0.02 {
            continue;
        }
        let (from, to) = (t - own.half.x, t + own.half.x);
        if wall.bottom_m > 1.0 && from < 0.0 && to > 0.0 {
            top = Some(wall.bottom_m);
            thickness = thickness.or(Some(wall.thickness_m));
        } else if wall.bottom_m < 0.1 && to < 0.0 && to > low {
            (low, thickness) = (to, Some(wall.thickness_m));
        } else if wall.bottom_m < 0.1 && from > 0.0 && from < high {
            (high, thickness) = (from, Some(wall.thickness_m));
        }
    }
    let (low, high, thickness) = (Some(low), Some(high), thickness?);
    let near = |edge: Option<f32>| edge.filter(|t| t.is_finite() && t.abs() < 0.5 * length + 0.4);
    let (low, high) = (near(low)?, near(high)?);
    let head = top.or(setup.ceiling_m)?;
    wall_frame.half.y = 0.5 * thickness;

    let material = joinery_material(setup).with_axes(wall_frame.axes());
    let (mut sides, mut above) = (Mesh::default(), Mesh::default());
    sides.set_material(material);
    above.set_material(material);
    let board = |mesh: &mut Mesh, center: [f32; 3], extent: [f32; 3]| {
        cuboid(mesh, &wall_frame.obb(center, extent));
    };
    let depth = thickness + 2.0 * PROTRUSION_M;
    for (edge, out) in [(low, -1.0f32), (high, 1.0)] {
        // The lining inside, and a casing on each face.
        let height = head - if top.is_some() { LINING_M } else { 0.0 };
        board(
            &mut sides,
            [edge - out * 0.5 * LINING_M, 0.5 * height, 0.0],
            [LINING_M, height, depth],
        );
        for side in [-1.0, 1.0] {
            let z = side * 0.5 * (thickness + PROTRUSION_M);
            let x = edge + out * 0.5 * CASING_M;
            board(&mut sides, [x, 0.5 * head, z], [CASING_M, head, PROTRUSION_M]);
        }
    }
    if top.is_some() {
        let center = 0.5 * (low + high);
        board(&mut above, [center, head - 0.5 * LINING_M, 0.0], [high - low, LINING_M, depth]);
        for side in [-1.0, 1.0] {
            let z = side * 0.5 * (thickness + PROTRUSION_M);
            let width = high - low + 2.0 * CASING_M;
            board(&mut above, [center, head + 0.5 * CASING_M, z], [width, CASING_M, PROTRUSION_M]);
        }
    }
    Some([sides.finish(), above.finish()])
}

/// Adds windows along an interval of outer wall, on its inner side, where no object blocks them. A
/// window that does not fit in the last mesh begins another one.
pub(super) fn windows(
    meshes: &mut Vec<Mesh>,
    setup: &Setup,
    wall: &Wall,
    wall_frame: &WallFrame,
    interval: &WallInterval,
) {
    const WINDOW_SPACING_M: f32 = 2.6;
    let Some(kind) = interval.room.map(|k| setup.rooms[k].kind) else { return };
    let length = interval.to - interval.from;
    let small = matches!(kind, RoomKind::Bathroom | RoomKind::Corridor);
    let (width, sill) = if small { (0.7, 1.45) } else { (1.2, 0.95) };
    let height = (wall.top_m - 0.45).min(2.15) - sill;
    if length < width + 0.5 || height < 0.4 {
        return;
    }
    let n = ((length / WINDOW_SPACING_M) as usize).clamp(1, 6);
    for k in 0..n {
        let x = interval.from + length * (k as f32 + 0.5) / n as f32;
        let p = wall_frame.point(x, interval.side * wall_frame.half.y);
        let is_free = setup.things.iter().all(|t| {
            let (size, d) = (t.size_m(), Vec2::new(t.position.x, t.position.z) - p);
            let offset = (d.x * wall_frame.axis.y - d.y * wall_frame.axis.x).abs();
            let along = (d.x * wall_frame.axis.x + d.y * wall_frame.axis.y).abs();
            let half = 0.5 * size.x.max(size.z);
            offset > half + 0.15 || along > half + 0.5 * width || t.position.y + size.y < sill
        });
        if is_free {
            let seed = hash_u32(setup.seed as u32 ^ (x * 1000.0) as i32 as u32);
            let has_curtains =
                matches!(kind, RoomKind::Bedroom | RoomKind::LivingRoom) && !seed.is_multiple_of(4);
            let size = [width, height];
            let mut mesh = Mesh::default();
            window(&mut mesh, setup, wall_frame, [x, sill], size, interval.side);
            if has_curtains {
                curtains(&mut mesh, wall_frame, [x, sill], size, interval.side, seed);
            }
            if !meshes.last_mut().is_some_and(|last| last.append(&mesh)) {
                meshes.push(mesh);
            }
        }
    }
}

fn window(
    mesh: &mut Mesh,
    setup: &Setup,
    wall_frame: &WallFrame,
    [x, sill]: [f32; 2],
    [width, height]: [f32; 2],
    side: f32,
) {
    let z = |out: f32| side * (wall_frame.half.y + out);
    let block = |mesh: &mut Mesh, center: [f32; 2], extent: [f32; 2], thickness: f32| {
        let center = [x + center[0], sill + center[1], z(0.5 * thickness)];
        cuboid(mesh, &wall_frame.obb(center, [extent[0], extent[1], thickness]));
    };
    mesh.set_material(Material {
        gloss: SpecularPreset::Pane,
        ..Material::new([180, 210, 242], Finish::Glass)
    });
    block(mesh, [0.0, 0.5 * height], [width, height], 0.008);
    mesh.set_material(joinery_material(setup).with_axes(wall_frame.axes()));
    let bar = 0.055;
    for dx in [-0.5, 0.5] {
        block(mesh, [dx * width, 0.5 * height], [bar, height + bar], 0.03);
    }
    for dy in [0.0, height] {
        block(mesh, [0.0, dy], [width, bar], 0.03);
    }
    block(mesh, [0.0, 0.5 * height], [0.05, height], 0.024);
    block(mesh, [0.0, 0.64 * height], [width, 0.03], 0.02);
    block(mesh, [0.0, -0.045], [width + 0.16, 0.03], 0.06);
}

fn curtains(
    mesh: &mut Mesh,
    wall_frame: &WallFrame,
    [x, sill]: [f32; 2],
    [width, height]: [f32; 2],
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
    let out = wall_frame.half.y + 0.03;
    let at = |dx: f32, y: f32, z: f32| {
        let p = wall_frame.point(x + dx, side * (out + z));
        Vec3::new(p.x, y, p.y)
    };
    let axes = wall_frame.axes();
    mesh.set_material(Material::new(CLOTHS[seed as usize / 8 % 6], Finish::Fabric).with_axes(axes));
    let (low, top) = ((sill - 0.2).max(0.1), sill + height + 0.14);
    for end in [-1.0f32, 1.0] {
        for k in 0..3 {
            // Folds beside the window, wider at the bottom.
            let dx = end * (0.5 * width - 0.05 + 0.1 * k as f32);
            let section = |y: f32, grow: f32| Section {
                center: at(dx * grow, y, 0.0),
                a: axes.x_axis * (0.062 * grow),
                b: axes.z_axis * 0.03,
            };
            mesh.tube(&[section(low, 1.02), section(top, 0.98)], 5);
        }
    }
    mesh.set_material(Material::new([120, 96, 66], Finish::Metal));
    let half = 0.5 * width + 0.26;
    let [x0, y0, z0] = [x, top, side * (out + 0.005)];
    cuboid(mesh, &wall_frame.obb([x0, y0, z0], [2.0 * half, 0.022, 0.022]));
    for dx in [-half, half] {
        cuboid(mesh, &wall_frame.obb([x0 + dx, y0, z0], [0.05, 0.04, 0.04]));
    }
}

/// Lamp under the ceiling of a room.
pub(super) fn lamp(room: &Room, ceiling_m: f32) -> Mesh {
    let c = room.rect.center();
    let mut mesh = Mesh::default();
    let n = 10;
    let at = |y: f32, extent: [f32; 3]| {
        OrientedBox::upright(Vec3::new(c.x, ceiling_m - y, c.y), Vec3::from(extent))
    };
    mesh.set_material(Material::new([176, 178, 182], Finish::Metal));
    frustum(&mut mesh, &at(0.015, [0.46, 0.03, 0.46]), 1.0, n);
    mesh.set_material(Material {
        gloss: SpecularPreset::Glow,
        ..Material::new([255, 253, 250], Finish::Matte)
    });
    ellipsoid(&mut mesh, &at(0.03, [0.4, 0.16, 0.4]), n);
    mesh.finish()
}
