//! Structure of a building: floors, walls with windows and door frames, and ceilings with a lamp in
//! each room.
//!
//! Bodies collide with the boxes of walls. Boards, frames and panes extend a few centimeters beyond
//! them and are visual only.

use chaic_core::catalogue::Finish;
use chaic_core::geom::Rect;
use chaic_core::{AgentId, EntityId, Vec3};
use chaic_world::{FloorMaterial, Room, RoomKind, Setup};
use glam::Mat3;

use crate::mesh::{self, Material, Mesh};
use crate::texture::Texture;

mod joinery;
mod wall_frame;
mod walls;

pub(crate) use wall_frame::WallFrame;

/// Meshes of the building in the world frame.
pub(crate) fn meshes(setup: &Setup) -> Vec<(EntityId, Mesh)> {
    let mut structure = Vec::new();
    // Without a split, which only a setup that no world accepts may prevent, floors overlap.
    for floor in setup.floor_pieces().unwrap_or_else(|| setup.floors.clone()) {
        structure.push((EntityId::FLOOR, floor_mesh(&floor.rect, floor.material, floor.color)));
    }
    let wall_materials = walls::wall_materials(setup);
    for wall in &setup.walls {
        let meshes = walls::meshes(setup, wall, &wall_materials);
        structure.extend(meshes.into_iter().map(|m| (EntityId::WALL, m)));
    }
    for opening in setup.openings.iter().take(MAX_PIECES) {
        let meshes = joinery::door_frame(setup, opening).into_iter().flatten();
        let meshes = meshes.filter(|m| !m.triangles.is_empty());
        structure.extend(meshes.map(|m| (EntityId::WALL, m)));
    }
    if let Some(height) = setup.ceiling_m {
        // As with floors, only a setup that no world accepts has too many pieces.
        for rect in setup.ceiling_pieces().unwrap_or_default() {
            structure.push((EntityId::CEILING, ceiling_mesh(&rect, height)));
        }
        for room in indoors(setup).take(MAX_PIECES) {
            structure.push((EntityId::CEILING, joinery::lamp(room, height)));
        }
    }
    structure
}

fn indoors(setup: &Setup) -> impl Iterator<Item = &Room> {
    setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors)
}

/// Maximum number of frames or lamps; it limits the work on invalid input.
const MAX_PIECES: usize = 4096;

// Visibility ids name every instance of a setup that a world accepts: floors, walls, both parts of
// door frames, ceilings in and between rooms, lamps, people and objects.
const _: () = assert!(
    Setup::MAX_FLOOR_PIECES
        + walls::MAX_MESHES
        + 2 * Setup::MAX_OPENINGS
        + (Setup::MAX_ROOMS + Setup::MAX_CEILING_PIECES)
        + Setup::MAX_ROOMS
        + AgentId::MAX_AGENTS
        + Setup::MAX_OBJECTS
        < 0xffff
);

fn floor_mesh(rect: &Rect, floor_material: FloorMaterial, color: [u8; 3]) -> Mesh {
    // Neighbors overlap by a millimeter, so that no pixel falls between them.
    let rect = rect.expanded(0.001);
    let mut mesh = Mesh::default();
    let mut material = Material::new(color, Finish::Matte);
    material.texture = match floor_material {
        FloorMaterial::Wood => Texture::Planks,
        FloorMaterial::Tiles => Texture::Tiles,
        FloorMaterial::Carpet => Texture::Carpet,
        FloorMaterial::Asphalt => Texture::Asphalt,
        FloorMaterial::Pavement => Texture::Pavement,
        FloorMaterial::Grass => Texture::Grass,
    };
    if matches!(floor_material, FloorMaterial::Wood | FloorMaterial::Tiles) {
        material.gloss = mesh::SpecularPreset::Satin;
    }
    // Planks run along the longer side.
    if rect.size().y > rect.size().x {
        material.axes = Mat3::from_cols(Vec3::Z, Vec3::Y, Vec3::X);
    }
    mesh.set_material(material);
    level_quad(&mut mesh, &rect, 0.0, false);
    mesh.finish()
}

fn ceiling_mesh(rect: &Rect, height_m: f32) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.set_material(Material::new([244, 243, 240], Finish::Matte));
    level_quad(&mut mesh, rect, height_m, true);
    mesh.finish()
}

fn level_quad(mesh: &mut Mesh, rect: &Rect, y: f32, faces_down: bool) {
    let (a, b) = (rect.min, rect.max);
    let ring = [(a.x, a.y), (a.x, b.y), (b.x, b.y), (b.x, a.y)];
    let mut vertices = ring.map(|(x, z)| mesh.vertex(Vec3::new(x, y, z), Vec3::Y));
    if faces_down {
        vertices.reverse();
    }
    mesh.quad(vertices, false);
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::briefing::Goal;
    use chaic_core::{Frame, TaskId, Vec2};
    use chaic_world::{Opening, Wall};

    /// Two rooms with a wall of 0.5 m between them and a doorway 0.9 m wide; an alcove is next to
    /// the second room.
    fn two_rooms() -> Setup {
        let room = |rect| Room { kind: RoomKind::Office, rect };
        let wall = |a: [f32; 2], b: [f32; 2], [bottom_m, top_m]: [f32; 2]| Wall {
            a: a.into(),
            b: b.into(),
            thickness_m: 0.5,
            bottom_m,
            top_m,
            color: [230; 3],
        };
        Setup {
            task: TaskId::NoConstraint,
            seed: 0,
            horizon: Frame::default(),
            bounds: Rect::new([0.0, 0.0], [5.0, 4.0]),
            ceiling_m: Some(3.0),
            rooms: vec![
                room(Rect::new([0.0, 0.0], [2.0, 4.0])),
                room(Rect::new([2.5, 0.0], [5.0, 2.0])),
            ],
            // Wall boxes are half a thickness longer at each end.
            walls: vec![
                wall([2.25, 0.25], [2.25, 0.35], [0.0, 3.0]),
                wall([2.25, 1.75], [2.25, 3.75], [0.0, 3.0]),
                wall([2.25, 0.85], [2.25, 1.25], [2.1, 3.0]),
                wall([0.25, -0.25], [4.75, -0.25], [0.0, 3.0]),
            ],
            openings: vec![Opening {
                a: Vec2::new(2.25, 0.6),
                b: Vec2::new(2.25, 1.5),
                rooms: [0, 1],
            }],
            floors: Vec::new(),
            things: Vec::new(),
            people: Vec::new(),
            goal: Goal { targets: Vec::new() },
            goal_places: Vec::new(),
        }
    }

    #[test]
    fn there_is_a_ceiling_over_every_room_and_doorway() {
        let pieces = two_rooms().ceiling_pieces().expect("few enough");
        for i in 0..50 {
            for k in 0..40 {
                let p = 0.1 * Vec2::new(i as f32 + 0.5, k as f32 + 0.5);
                assert!(pieces.iter().any(|r| r.contains(p)), "none above {p}");
            }
        }
    }

    #[test]
    fn a_door_frame_does_not_block_the_doorway() {
        let setup = two_rooms();
        let [sides, above] = joinery::door_frame(&setup, &setup.openings[0]).expect("a frame");
        for p in &sides.positions {
            assert!(p.z < 0.61 || p.z > 1.49, "{p} blocks the doorway");
        }
        for p in sides.positions.iter().chain(&above.positions) {
            assert!((p.x - 2.25).abs() < 0.28, "{p} is far off the wall");
            assert!((0.5..1.6).contains(&p.z), "{p} is far off the doorway");
        }
        assert!(above.min.y > 2.0);
    }

    #[test]
    fn windows_are_in_outer_walls_and_protrude_little() {
        let setup = two_rooms();
        let wall_materials = walls::wall_materials(&setup);
        let has_window: Vec<bool> = setup
            .walls
            .iter()
            .map(|w| {
                let meshes = walls::meshes(&setup, w, &wall_materials);
                let [mesh] = &meshes[..] else { panic!("{} meshes", meshes.len()) };
                let wall_frame = WallFrame::new(w);
                for p in &mesh.positions {
                    let d = Vec2::new(p.x, p.z) - wall_frame.center;
                    let offset = (d.y * wall_frame.axis.x - d.x * wall_frame.axis.y).abs();
                    assert!(offset < wall_frame.half.y + 0.08, "{p}");
                }
                mesh.materials.iter().any(|material| material.gloss == mesh::SpecularPreset::Pane)
            })
            .collect();
        // The other walls are interior walls; one of them borders an alcove.
        assert_eq!(has_window, [false, false, false, true]);
    }

    /// A row of living rooms along one outer wall, `gap_m` apart.
    fn row_of_rooms(n: usize, width_m: f32, gap_m: f32) -> Setup {
        let room = |k: usize| {
            let x = (width_m + gap_m) * k as f32;
            Room { kind: RoomKind::LivingRoom, rect: Rect::new([x, 0.0], [x + width_m, 4.0]) }
        };
        let length_m = (width_m + gap_m) * n as f32 - gap_m;
        let mut setup = two_rooms();
        setup.walls.truncate(1);
        setup.walls[0].a = Vec2::new(0.0, -0.25);
        setup.walls[0].b = Vec2::new(length_m, -0.25);
        Setup { rooms: (0..n).map(room).collect(), ..setup }
    }

    #[test]
    fn long_walls_have_all_windows_and_the_paint_of_every_room() {
        for (n, width_m, gap_m, n_windows) in [(60, 16.0, 0.0, 6), (200, 4.0, 0.2, 1)] {
            let setup = row_of_rooms(n, width_m, gap_m);
            let wall_materials = walls::wall_materials(&setup);
            let axes = WallFrame::new(&setup.walls[0]).axes();
            let (mut n_pane, mut n_painted) = (vec![0; n], vec![0; n]);
            for mesh in walls::meshes(&setup, &setup.walls[0], &wall_materials) {
                assert_eq!(mesh.min.y, 0.0, "a map would leave it out");
                for triangle in &mesh.triangles {
                    let corners = triangle.vertices.map(|k| mesh.positions[usize::from(k)]);
                    let x = corners.iter().map(|p| p.x).sum::<f32>() / 3.0;
                    let k = ((x / (width_m + gap_m)) as usize).min(n - 1);
                    let material = mesh.materials[usize::from(triangle.material)];
                    let is_inner = corners.iter().all(|p| p.z.abs() < 1e-3);
                    let has_paint = |m: &Material| material == m.with_axes(axes);
                    n_pane[k] += usize::from(material.gloss == mesh::SpecularPreset::Pane);
                    n_painted[k] += usize::from(is_inner && has_paint(&wall_materials[k]));
                }
            }
            assert_eq!(n_pane, vec![12 * n_windows; n], "triangles of panes per room");
            assert!(n_painted.iter().all(|n| *n >= 2), "{n_painted:?}");
        }
    }
}
