//! Structure of a building: floors, walls with windows and door frames, and ceilings with a lamp in
//! each room.
//!
//! Bodies collide with the boxes of walls. Boards, frames and panes extend a few centimeters beyond
//! them and are visual only.

use chaic_core::catalogue::Finish;
use chaic_core::geom::Rect;
use chaic_core::{AgentId, EntityId, Vec3};
use chaic_world::{FloorMaterial, Room, RoomKind, Setup, subtract_rect};
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
        structure.push((EntityId::WALL, walls::mesh(setup, wall, &wall_materials)));
    }
    for opening in setup.openings.iter().take(MAX_PIECES) {
        let meshes = joinery::door_frame(setup, opening).into_iter().flatten();
        let meshes = meshes.filter(|m| !m.triangles.is_empty());
        structure.extend(meshes.map(|m| (EntityId::WALL, m)));
    }
    if let Some(height) = setup.ceiling_m {
        for rect in ceiling_pieces(setup) {
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

/// Maximum number of pieces of ceiling, frames or lamps; it limits the work on invalid input.
const MAX_PIECES: usize = 4096;

// Visibility ids name every instance of a setup that a world accepts: floors, walls, both parts of
// door frames, ceilings in and between rooms, lamps, people and objects.
const _: () = assert!(
    Setup::MAX_FLOOR_PIECES
        + Setup::MAX_WALLS
        + 2 * Setup::MAX_OPENINGS
        + (Setup::MAX_ROOMS + MAX_PIECES)
        + Setup::MAX_ROOMS
        + AgentId::MAX_AGENTS
        + Setup::MAX_THINGS
        < 0xffff
);

/// Ceilings of rooms, and of the area between them and the outermost walls: doorways and alcoves
/// belong to no room.
fn ceiling_pieces(setup: &Setup) -> Vec<Rect> {
    /// Overlap of ceilings with walls, meters: rooms end at the faces of walls.
    const WALL_OVERLAP_M: f32 = 0.15;
    let rooms = setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors);
    let mut pieces: Vec<Rect> = rooms.map(|r| r.rect.expanded(WALL_OVERLAP_M)).collect();
    let ends = setup.walls.iter().flat_map(|w| [w.a, w.b]);
    let house = ends.fold(setup.bounds, |r, p| Rect { min: r.min.min(p), max: r.max.max(p) });
    let mut between = vec![house];
    for room in &pieces {
        let mut remaining = Vec::new();
        for rect in between {
            subtract_rect(&rect, room, |piece| remaining.push(piece));
        }
        remaining.truncate(MAX_PIECES);
        between = remaining;
    }
    // They overlap the ceilings of rooms by a millimeter, so that no pixel falls between them.
    pieces.extend(between.iter().map(|r| r.expanded(0.001)));
    pieces
}

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
        let pieces = ceiling_pieces(&two_rooms());
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
                let mesh = walls::mesh(&setup, w, &wall_materials);
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
}
