//! What of an episode never changes, made ready for drawing.

use std::sync::Arc;

use chaic_protocol::catalogue::Finish;
use chaic_protocol::geom::Rect;
use chaic_protocol::observation::Images;
use chaic_protocol::{EntityId, Vec2, Vec3};
use chaic_world::{FloorMaterial, Place, Posture, RoomKind, Setup, State, Wall, World};
use glam::Mat3;
use rayon::prelude::*;

use crate::frame::{ClassMesh, Frame, Instance, Shape};
use crate::light::{Foot, Ground, Light};
use crate::mesh::{self, Mesh, Skin};
use crate::people::Body;
use crate::solids::cuboid;
use crate::texture::{Texture, linear_from_srgb};
use crate::view::{View, look};

/// Everything of an episode that is drawn and never changes: floors, walls, ceilings, and the
/// shapes of things. Cheap to make; cameras share it.
#[derive(Debug)]
pub struct Scene {
    structure: Vec<(EntityId, Mesh)>,
    things: Vec<(Arc<ClassMesh>, Option<[f32; 3]>)>,
    ground: Ground,
}

impl Scene {
    /// Makes the shapes of an episode ready.
    pub fn new(setup: &Setup) -> Scene {
        let mut structure = Vec::new();
        for (rect, material, color) in floor_pieces(setup) {
            structure.push((EntityId::FLOOR, floor_mesh(&rect, material, color)));
        }
        for wall in &setup.walls {
            structure.push((EntityId::WALL, wall_mesh(wall)));
        }
        if let Some(height) = setup.ceiling_m {
            for rect in ceiling_pieces(setup) {
                structure.push((EntityId::CEILING, ceiling_mesh(&rect, height)));
            }
        }
        let things = setup.things.iter().map(|thing| {
            let palette = thing.class.info().palette;
            let tint = (!palette.is_empty())
                .then(|| linear_from_srgb(palette[usize::from(thing.variant) % palette.len()]));
            (ClassMesh::of(thing), tint)
        });
        Scene { structure, things: things.collect(), ground: Ground::new(setup) }
    }

    /// What many cameras see of a world, in their order. The images don't depend on the number of
    /// threads. See [`View`] for cameras that can't see.
    pub fn render(&self, world: &World, views: &[View]) -> Vec<Images> {
        let agents = world.setup().agents();
        let postures: Vec<Posture> = agents.map(|agent| world.posture(agent)).collect();
        self.render_state(world.state(), &postures, views)
    }

    /// The same for a state and postures that come from elsewhere: a recording, a test.
    /// `postures` are those of the agents in order.
    pub fn render_state(&self, state: &State, postures: &[Posture], views: &[View]) -> Vec<Images> {
        let wants_color = views.iter().any(|v| v.channels.rgb);
        let bodies: Vec<Body> = postures.iter().map(|p| Body::new(p, state.frame)).collect();
        let frame = self.frame(state, &bodies, wants_color);
        if let [view] = views {
            return vec![look(&frame, view)];
        }
        views.par_iter().map(|view| look(&frame, view)).collect()
    }

    /// What is underfoot, and the lamps.
    pub(crate) fn ground(&self) -> &Ground {
        &self.ground
    }

    pub(crate) fn frame<'a>(
        &'a self,
        state: &State,
        bodies: &'a [Body],
        wants_color: bool,
    ) -> Frame<'a> {
        let mut light = Light::new(&self.ground, wants_color);
        let mut instances =
            Vec::with_capacity(self.structure.len() + self.things.len() + bodies.len());
        for (entity, mesh) in &self.structure {
            instances.push(Instance {
                entity: *entity,
                shape: Shape::Fixed(mesh),
                rotation: Mat3::IDENTITY,
                origin: Vec3::ZERO,
                min: mesh.min,
                max: mesh.max,
                tint: None,
                room: None,
            });
        }
        for (k, body) in bodies.iter().enumerate().filter(|(_, b)| b.pose.position.is_finite()) {
            let pose = &body.pose;
            let center = Vec2::new(pose.position.x, pose.position.z);
            let half = Vec2::splat(body.foot_radius_m);
            light.cast(&Foot { center, axis: Vec2::X, half, depth: 0.5, round: true });
            let rotation = Mat3::from_quat(chaic_protocol::geom::yaw_rotation(pose.yaw_rad));
            instances.push(Instance {
                entity: EntityId(EntityId::FIRST_PERSON.0 + k.min(7) as u16),
                shape: Shape::Body(body),
                rotation,
                origin: pose.position,
                min: body.min,
                max: body.max,
                tint: None,
                room: Some(self.ground.room_at(pose.position)),
            });
        }
        for (k, (class, tint)) in self.things.iter().enumerate() {
            let Some(thing) = state.things.get(k) else { break };
            let q = thing.rotation;
            let norm2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
            let is_sane = thing.position.is_finite() && (norm2 - 1.0).abs() < 0.01;
            if thing.place == Place::Broken || !is_sane {
                continue;
            }
            let rotation = Mat3::from_quat(q);
            if light.wants_color() {
                cast_foot(&mut light, class, &rotation, thing.position);
            }
            instances.push(Instance {
                entity: Setup::entity(k),
                shape: Shape::Class(class),
                rotation,
                origin: thing.position,
                min: class.min,
                max: class.max,
                tint: *tint,
                room: Some(self.ground.room_at(thing.position)),
            });
        }
        Frame { instances, light }
    }
}

fn cast_foot(light: &mut Light, class: &ClassMesh, rotation: &Mat3, position: Vec3) {
    // Only what is near the ground darkens it, the more the nearer.
    let depth = 0.55 * (1.0 - 3.0 * position.y).clamp(0.0, 1.0);
    let axis = Vec2::new(rotation.x_axis.x, rotation.x_axis.z);
    let length = (axis.x * axis.x + axis.y * axis.y).sqrt();
    if depth <= 0.0 || length < 0.1 {
        return;
    }
    let middle = 0.5 * (class.min + class.max);
    let center = position + *rotation * Vec3::new(middle.x, 0.0, middle.z);
    let half = 0.5 * (class.max - class.min);
    light.cast(&Foot {
        center: Vec2::new(center.x, center.z),
        axis: axis / length,
        half: Vec2::new(half.x, half.z),
        depth,
        round: half.x.max(half.z) < 0.12,
    });
}

/// More pieces of floor or ceiling than any street or house needs; bounds the work on odd input.
const MAX_PIECES: usize = 4096;

/// The floors without overlaps: where two overlap, the later one lies on top.
fn floor_pieces(setup: &Setup) -> Vec<(Rect, FloorMaterial, [u8; 3])> {
    let mut pieces: Vec<(Rect, FloorMaterial, [u8; 3])> = Vec::new();
    for floor in setup.floors.iter().take(MAX_PIECES) {
        let mut left = Vec::new();
        for (rect, material, color) in pieces.drain(..) {
            without(&rect, &floor.rect, |piece| left.push((piece, material, color)));
        }
        left.push((floor.rect, floor.material, floor.color));
        left.truncate(MAX_PIECES);
        pieces = left;
    }
    pieces
}

/// The ceilings of rooms, and what is left between them and the outermost walls: doorways and
/// alcoves belong to no room.
fn ceiling_pieces(setup: &Setup) -> Vec<Rect> {
    /// Rooms end at the faces of walls; their ceilings go on into these, metres.
    const INTO_WALL_M: f32 = 0.15;
    let rooms = setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors);
    let mut pieces: Vec<Rect> = rooms.map(|r| r.rect.grown(INTO_WALL_M)).collect();
    let ends = setup.walls.iter().flat_map(|w| [w.a, w.b]);
    let house = ends.fold(setup.bounds, |r, p| Rect { min: r.min.min(p), max: r.max.max(p) });
    let mut between = vec![house];
    for room in &pieces {
        let mut left = Vec::new();
        for rect in between {
            without(&rect, room, |piece| left.push(piece));
        }
        left.truncate(MAX_PIECES);
        between = left;
    }
    // They overlap the ceilings of rooms by a millimetre, so that no pixel falls between them.
    pieces.extend(between.iter().map(|r| r.grown(0.001)));
    pieces
}

/// The parts of `rect` outside of `hole`.
fn without(rect: &Rect, hole: &Rect, mut keep: impl FnMut(Rect)) {
    let (low, high) = (rect.min.max(hole.min), rect.max.min(hole.max));
    if low.x >= high.x || low.y >= high.y {
        keep(*rect);
        return;
    }
    let mut keep_some = |x0: f32, z0: f32, x1: f32, z1: f32| {
        if x1 > x0 && z1 > z0 {
            keep(Rect::new([x0, z0], [x1, z1]));
        }
    };
    keep_some(rect.min.x, rect.min.y, low.x, rect.max.y);
    keep_some(high.x, rect.min.y, rect.max.x, rect.max.y);
    keep_some(low.x, rect.min.y, high.x, low.y);
    keep_some(low.x, high.y, high.x, rect.max.y);
}

fn floor_mesh(rect: &Rect, material: FloorMaterial, color: [u8; 3]) -> Mesh {
    // Neighbors overlap by a millimetre, so that no pixel falls between them.
    let rect = rect.grown(0.001);
    let mut mesh = Mesh::default();
    let mut skin = Skin::new(color, Finish::Matte);
    skin.texture = match material {
        FloorMaterial::Wood => Texture::Planks,
        FloorMaterial::Tiles => Texture::Tiles,
        FloorMaterial::Carpet => Texture::Carpet,
        FloorMaterial::Asphalt => Texture::Asphalt,
        FloorMaterial::Pavement => Texture::Pavement,
        FloorMaterial::Grass => Texture::Grass,
    };
    if matches!(material, FloorMaterial::Wood | FloorMaterial::Tiles) {
        skin.gloss = mesh::Gloss::Satin;
    }
    // Planks run along the longer side.
    if rect.size().y > rect.size().x {
        skin.axes = Mat3::from_cols(Vec3::Z, Vec3::Y, Vec3::X);
    }
    mesh.skin(skin);
    level_quad(&mut mesh, &rect, 0.0, false);
    mesh.finish()
}

fn ceiling_mesh(rect: &Rect, height_m: f32) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.skin(Skin::new([244, 243, 240], Finish::Matte));
    level_quad(&mut mesh, rect, height_m, true);
    mesh.finish()
}

fn level_quad(mesh: &mut Mesh, rect: &Rect, y: f32, downwards: bool) {
    let (a, b) = (rect.min, rect.max);
    let ring = [(a.x, a.y), (a.x, b.y), (b.x, b.y), (b.x, a.y)];
    let mut corners = ring.map(|(x, z)| mesh.corner(Vec3::new(x, y, z), Vec3::Y));
    if downwards {
        corners.reverse();
    }
    mesh.quad(corners, false);
}

/// A wall as the box that bodies collide with, overlapping its neighbors by half of its thickness.
fn wall_mesh(wall: &Wall) -> Mesh {
    let along = wall.b - wall.a;
    let length = (along.x * along.x + along.y * along.y).sqrt();
    let axis = if length > 1e-6 { along / length } else { Vec2::X };
    let middle = 0.5 * (wall.a + wall.b);
    let place = mesh::Place {
        center: Vec3::new(middle.x, 0.5 * (wall.bottom_m + wall.top_m), middle.y),
        axes: Mat3::from_cols(
            Vec3::new(axis.x, 0.0, axis.y),
            Vec3::Y,
            Vec3::new(-axis.y, 0.0, axis.x),
        ),
        extent: Vec3::new(length + wall.thickness_m, wall.top_m - wall.bottom_m, wall.thickness_m),
    };
    let mut mesh = Mesh::default();
    let mut skin = Skin::new(wall.color, Finish::Matte).with_axes(place.axes);
    skin.texture = Texture::Plaster;
    mesh.skin(skin);
    cuboid(&mut mesh, &place);
    mesh.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_protocol::briefing::Goal;
    use chaic_protocol::{Frame, TaskId};
    use chaic_world::Room;

    #[test]
    fn there_is_a_ceiling_over_every_room_and_doorway() {
        let room = |rect| Room { kind: RoomKind::Office, rect };
        let setup = Setup {
            task: TaskId::NoConstraint,
            seed: 0,
            horizon: Frame::default(),
            bounds: Rect::new([0.0, 0.0], [5.0, 4.0]),
            ceiling_m: Some(3.0),
            // A wall of 0.5 m with a doorway lies between them, an alcove beside the second.
            rooms: vec![
                room(Rect::new([0.0, 0.0], [2.0, 4.0])),
                room(Rect::new([2.5, 0.0], [5.0, 2.0])),
            ],
            walls: Vec::new(),
            openings: Vec::new(),
            floors: Vec::new(),
            things: Vec::new(),
            people: Vec::new(),
            goal: Goal { targets: Vec::new() },
            goal_places: Vec::new(),
        };
        let pieces = ceiling_pieces(&setup);
        for i in 0..50 {
            for k in 0..40 {
                let p = 0.1 * Vec2::new(i as f32 + 0.5, k as f32 + 0.5);
                assert!(pieces.iter().any(|r| r.contains(p)), "none above {p}");
            }
        }
    }
}
