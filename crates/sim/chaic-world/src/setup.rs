//! How an episode begins.

use chaic_core::briefing::Goal;
use chaic_core::capability::{Capability, Gait, Impairments, PersonKind, Persona, UsableHands};
use chaic_core::geom::{Pose, Rect, xz};
use chaic_core::{AgentId, ClassId, EntityId, Frame, TaskId, Vec2, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The initial condition of a world: everything that is fixed before the first frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Setup {
    /// The task.
    pub task: TaskId,
    /// Seed of every random draw in the world.
    pub seed: u64,
    /// Frames until the episode ends.
    pub horizon: Frame,
    /// The part of the plane where the episode happens; nobody leaves it.
    pub bounds: Rect,
    /// Height of ceilings above the floor, metres; absent outdoors.
    pub ceiling_m: Option<f32>,
    /// Named rooms; logical only, walls are listed apart.
    pub rooms: Vec<Room>,
    /// Walls, already cut at their openings.
    pub walls: Vec<Wall>,
    /// Where one walks between rooms.
    pub openings: Vec<Opening>,
    /// What covers the ground; later ones lie on earlier ones.
    pub floors: Vec<Floor>,
    /// All things; the k-th is entity `FIRST_OBJECT + k`.
    pub things: Vec<Thing>,
    /// All people; the k-th is agent k: partner, helper, child.
    pub people: Vec<Person>,
    /// What the partner wants.
    pub goal: Goal,
    /// The goal place: delivering to any of these things counts.
    pub goal_places: Vec<EntityId>,
}

/// Kinds of rooms.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "the names say it")]
pub enum RoomKind {
    Kitchen,
    LivingRoom,
    Bedroom,
    Office,
    Bathroom,
    Corridor,
    Outdoors,
}

/// A named room.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Room {
    /// Its kind.
    pub kind: RoomKind,
    /// Its extent.
    pub rect: Rect,
}

/// A straight wall, solid from floor to `height_m`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// One end of the center line (x, z), metres.
    #[schemars(with = "[f32; 2]")]
    pub a: Vec2,
    /// The other end.
    #[schemars(with = "[f32; 2]")]
    pub b: Vec2,
    /// Thickness, metres.
    pub thickness_m: f32,
    /// Height of the lower edge, metres: 0, or above a doorway.
    pub bottom_m: f32,
    /// Height of the upper edge, metres.
    pub top_m: f32,
    /// sRGB color.
    pub color: [u8; 3],
}

/// A gap in the walls that leads from one room to another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Opening {
    /// One jamb (x, z), metres.
    #[schemars(with = "[f32; 2]")]
    pub a: Vec2,
    /// The other jamb.
    #[schemars(with = "[f32; 2]")]
    pub b: Vec2,
    /// The rooms on its two sides, as indices.
    pub rooms: [u32; 2],
}

/// What a piece of ground is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "the names say it")]
pub enum FloorMaterial {
    Wood,
    Tiles,
    Carpet,
    Asphalt,
    Pavement,
    Grass,
}

/// A rectangle of ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Floor {
    /// Its extent.
    pub rect: Rect,
    /// What it is made of.
    pub material: FloorMaterial,
    /// sRGB color.
    pub color: [u8; 3],
}

/// A thing at its place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Thing {
    /// What it is.
    pub class: ClassId,
    /// Middle of its bottom, metres.
    #[schemars(with = "[f32; 3]")]
    pub position: Vec3,
    /// Its turn about the vertical, radians; at 0 its front faces -z.
    pub yaw_rad: f32,
    /// Factors on the catalogue's width, height and depth.
    pub scale: [f32; 3],
    /// Height of its lowest top that bears things (a seat, a mattress, a truck's bed) above its
    /// bottom, metres, where that isn't in proportion to the whole; see [`Thing::parts`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seat_m: Option<f32>,
    /// Which of the class's colors, modulo their number.
    pub variant: u8,
    /// Whether it stays where it is, whatever its class allows.
    pub fixed: bool,
}

impl Thing {
    /// A thing of catalogue size.
    pub fn new(class: ClassId, position: Vec3, yaw_rad: f32) -> Thing {
        Thing {
            class,
            position,
            yaw_rad,
            scale: [1.0; 3],
            seat_m: None,
            variant: 0,
            fixed: !class.info().is_movable(),
        }
    }

    /// Extents along its own x, y and z, metres.
    pub fn size_m(&self) -> Vec3 {
        Vec3::from(self.class.info().size_m) * Vec3::from(self.scale)
    }

    /// Half of its longer side in plan, metres: as far as it reaches from its middle wherever a rule
    /// measures to the middle (facts S1.1 and S5.2).
    pub fn half_longer_side_m(&self) -> f32 {
        let size = self.size_m();
        0.5 * size.x.max(size.z)
    }
}

/// A person at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Person {
    /// What kind of person.
    pub persona: Persona,
    /// Where.
    pub pose: Pose,
    /// Which clothes and hair, any number.
    pub look: u8,
    /// Limits and measures other than the persona's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capability: Option<Capability>,
    /// What impairs this person besides.
    #[serde(default, skip_serializing_if = "Impairments::is_empty")]
    pub impairments: Impairments,
}

impl Person {
    /// Somebody of this kind, without limits and measures of its own.
    pub fn new(kind: impl Into<PersonKind>, pose: Pose, look: u8) -> Person {
        let PersonKind { persona, impairments } = kind.into();
        Person { persona, pose, look, capability: None, impairments }
    }

    /// The limits and measures that hold for this person.
    pub fn capability(&self) -> Capability {
        self.impairments.apply(self.capability.unwrap_or_else(|| self.persona.capability()))
    }

    /// What kind of person this is.
    pub fn kind(&self) -> PersonKind {
        PersonKind { persona: self.persona, impairments: self.impairments }
    }
}

/// Why a setup can't become a world.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: {problem}")]
pub struct SetupError {
    /// Path of the field within the setup, for example `things[3].position`.
    pub field: String,
    /// What is wrong, and what was expected.
    pub problem: String,
}

impl SetupError {
    fn new(field: impl Into<String>, problem: impl Into<String>) -> SetupError {
        SetupError { field: field.into(), problem: problem.into() }
    }
}

fn number(field: String, x: f32, low: f32, high: f32) -> Result<(), SetupError> {
    if x >= low && x <= high {
        Ok(())
    } else {
        Err(SetupError::new(field, format!("is {x}, expected a number in [{low}, {high}]")))
    }
}

/// The limits that only some people have.
fn check_impaired(i: usize, c: &Capability) -> Result<(), SetupError> {
    const FRAMES: [f32; 2] = [1.0, 1e6];
    let mut limits: Vec<(&str, f32, [f32; 2])> = vec![];
    if let Some(sight) = c.sight {
        limits.extend([
            ("sight.range_m", sight.range_m, [0.1, 1000.0]),
            ("sight.blur_rad", sight.blur_rad, [0.0, 0.2]),
            ("sight.field_rad", sight.field_rad, [0.01, std::f32::consts::PI]),
            ("sight.lowered_rad", sight.lowered_rad, [0.0, std::f32::consts::FRAC_PI_2]),
        ]);
    }
    if let Some(endurance) = c.endurance {
        limits.extend([
            ("endurance.work_frames", endurance.work_frames, FRAMES),
            ("endurance.rest_frames", endurance.rest_frames, FRAMES),
            ("endurance.least", endurance.least, [0.05, 1.0]),
        ]);
    }
    if let Some(tremor) = c.tremor {
        limits.extend([
            ("tremor.slip_chance", tremor.slip_chance, [0.0, 1.0]),
            ("tremor.drop_chance", tremor.drop_chance, [0.0, 1.0]),
        ]);
    }
    for (name, x, [low, high]) in limits {
        number(format!("people[{i}].capability.{name}"), x, low, high)?;
    }
    if c.gait == Gait::WalkBike && c.hands != UsableHands::Both {
        let problem = "are one, expected both: a bicycle needs one and its basket the other";
        return Err(SetupError::new(format!("people[{i}].capability.hands"), problem));
    }
    Ok(())
}

impl Setup {
    /// Most things in one episode: ids must fit 16 bits with room to spare, and memory is bounded.
    pub const MAX_THINGS: usize = 4096;
    /// Longest side of the bounds, metres: maps are made of all that is in them.
    pub const MAX_LENGTH_M: f32 = 200.0;
    /// Most walls in one episode.
    pub const MAX_WALLS: usize = 4096;
    /// Most rooms in one episode. Ours: many times those of any generated or imported house, and few
    /// enough that all may be searched for the one at a place.
    pub const MAX_ROOMS: usize = 256;
    /// Most openings, and most floors, in one episode. Ours: several for each room.
    pub const MAX_OPENINGS: usize = 1024;
    /// See [`Setup::MAX_OPENINGS`].
    pub const MAX_FLOORS: usize = 1024;
    /// Farthest coordinate, metres: f32 keeps millimetres there.
    pub const MAX_COORDINATE_M: f32 = 1000.0;

    /// The thing that this entity names.
    pub fn thing(&self, entity: EntityId) -> Option<&Thing> {
        self.thing_index(entity).map(|i| &self.things[i])
    }

    /// Its place in [`Setup::things`].
    pub fn thing_index(&self, entity: EntityId) -> Option<usize> {
        let i = usize::from(entity.0.checked_sub(EntityId::FIRST_OBJECT.0)?);
        (i < self.things.len()).then_some(i)
    }

    /// The entity of the k-th thing.
    pub fn entity(index: usize) -> EntityId {
        EntityId(EntityId::FIRST_OBJECT.0 + index as u16)
    }

    /// All entities of things, in order.
    pub fn entities(&self) -> impl Iterator<Item = EntityId> + use<> {
        (0..self.things.len()).map(Setup::entity)
    }

    /// The agents, in order.
    pub fn agents(&self) -> impl Iterator<Item = AgentId> + use<> {
        (0..self.people.len() as u8).map(AgentId)
    }

    /// The room that a point lies in.
    pub fn room_at(&self, p: Vec2) -> Option<usize> {
        self.rooms.iter().position(|r| r.rect.contains(p))
    }

    /// Checks what [`crate::World::new`] relies on: finite numbers, ids that exist, bounds.
    /// Whether the episode makes sense to play is for the validator of `chaic-episodes`.
    pub fn check(&self) -> Result<(), SetupError> {
        let max = Setup::MAX_COORDINATE_M;
        let rect = |field: String, r: &Rect| {
            for (name, v) in [("min", r.min), ("max", r.max)] {
                number(format!("{field}.{name}[0]"), v.x, -max, max)?;
                number(format!("{field}.{name}[1]"), v.y, -max, max)?;
            }
            if r.min.x < r.max.x && r.min.y < r.max.y {
                Ok(())
            } else {
                Err(SetupError::new(field, "is empty, expected min below max on both axes"))
            }
        };
        rect("bounds".into(), &self.bounds)?;
        let extent = self.bounds.max - self.bounds.min;
        for (axis, length) in [("x", extent.x), ("z", extent.y)] {
            number(format!("bounds (its length along {axis})"), length, 0.1, Setup::MAX_LENGTH_M)?;
        }
        for (field, n, most) in [
            ("rooms", self.rooms.len(), Setup::MAX_ROOMS),
            ("walls", self.walls.len(), Setup::MAX_WALLS),
            ("openings", self.openings.len(), Setup::MAX_OPENINGS),
            ("floors", self.floors.len(), Setup::MAX_FLOORS),
            ("things", self.things.len(), Setup::MAX_THINGS),
            ("goal_places", self.goal_places.len(), Setup::MAX_THINGS),
        ] {
            if n > most {
                return Err(SetupError::new(field, format!("has {n} entries, at most {most}")));
            }
        }
        if self.horizon == 0 {
            return Err(SetupError::new("horizon", "is 0, expected at least one frame"));
        }
        if let Some(h) = self.ceiling_m {
            number("ceiling_m".into(), h, 2.0, 20.0)?;
        }
        for (i, room) in self.rooms.iter().enumerate() {
            rect(format!("rooms[{i}].rect"), &room.rect)?;
        }
        for (i, floor) in self.floors.iter().enumerate() {
            rect(format!("floors[{i}].rect"), &floor.rect)?;
        }
        for (i, w) in self.walls.iter().enumerate() {
            for (name, v) in [("a", w.a), ("b", w.b)] {
                number(format!("walls[{i}].{name}[0]"), v.x, -max, max)?;
                number(format!("walls[{i}].{name}[1]"), v.y, -max, max)?;
            }
            number(format!("walls[{i}].thickness_m"), w.thickness_m, 0.01, 5.0)?;
            number(format!("walls[{i}].bottom_m"), w.bottom_m, 0.0, 20.0)?;
            number(format!("walls[{i}].top_m"), w.top_m, w.bottom_m + 0.01, 20.0)?;
        }
        for (i, o) in self.openings.iter().enumerate() {
            for (side, room) in o.rooms.iter().enumerate() {
                if *room as usize >= self.rooms.len() {
                    let problem = format!("is {room}, but there are {} rooms", self.rooms.len());
                    return Err(SetupError::new(format!("openings[{i}].rooms[{side}]"), problem));
                }
            }
            for (name, v) in [("a", o.a), ("b", o.b)] {
                number(format!("openings[{i}].{name}[0]"), v.x, -max, max)?;
                number(format!("openings[{i}].{name}[1]"), v.y, -max, max)?;
            }
        }
        for (i, t) in self.things.iter().enumerate() {
            for (axis, x) in t.position.to_array().into_iter().enumerate() {
                number(format!("things[{i}].position[{axis}]"), x, -max, max)?;
            }
            number(format!("things[{i}].yaw_rad"), t.yaw_rad, -100.0, 100.0)?;
            for (axis, s) in t.scale.into_iter().enumerate() {
                number(format!("things[{i}].scale[{axis}]"), s, 0.01, 100.0)?;
            }
            if let Some(seat_m) = t.seat_m {
                number(format!("things[{i}].seat_m"), seat_m, 0.001, t.size_m().y)?;
            }
        }
        if self.people.is_empty() || self.people.len() > AgentId::MAX_AGENTS {
            let (n, most) = (self.people.len(), AgentId::MAX_AGENTS);
            let problem = format!("has {n} entries, expected 1 to {most}");
            return Err(SetupError::new("people", problem));
        }
        for (i, p) in self.people.iter().enumerate() {
            for (axis, x) in p.pose.position.to_array().into_iter().enumerate() {
                number(format!("people[{i}].pose.position[{axis}]"), x, -max, max)?;
            }
            number(format!("people[{i}].pose.yaw_rad"), p.pose.yaw_rad, -100.0, 100.0)?;
            let c = p.capability();
            for (name, x, low, high) in [
                // A step longer than the body could pass through a wall.
                ("speed_m_per_frame", c.speed_m_per_frame, 0.001, c.radius_m.min(0.2)),
                (
                    "approach_speed_m_per_frame",
                    c.approach_speed_m_per_frame,
                    0.001,
                    c.radius_m.min(0.2),
                ),
                ("radius_m", c.radius_m, 0.05, 1.0),
                ("height_m", c.height_m, 0.3, 3.0),
                ("eye_height_m", c.eye_height_m, 0.1, c.height_m),
                ("strength_kg", c.strength_kg, 0.0, 10_000.0),
                ("pick_range_m[0]", c.pick_range_m[0], 0.0, 10.0),
                ("pick_range_m[1]", c.pick_range_m[1], c.pick_range_m[0], 10.0),
                ("put_range_m[0]", c.put_range_m[0], 0.0, 10.0),
                ("put_range_m[1]", c.put_range_m[1], c.put_range_m[0], 10.0),
            ] {
                number(format!("people[{i}].capability.{name}"), x, low, high)?;
            }
            check_impaired(i, &c)?;
        }
        if self.goal.targets.is_empty() {
            return Err(SetupError::new("goal.targets", "is empty, expected at least one class"));
        }
        for (i, (class, n)) in self.goal.targets.iter().enumerate() {
            if *n == 0 || *n as usize > Setup::MAX_THINGS {
                let problem =
                    format!("asks for {n} of {class}, expected 1 to {}", Setup::MAX_THINGS);
                return Err(SetupError::new(format!("goal.targets[{i}]"), problem));
            }
            if self.goal.targets[..i].iter().any(|(c, _)| c == class) {
                return Err(SetupError::new(
                    format!("goal.targets[{i}]"),
                    format!("names {class} again, expected each class once"),
                ));
            }
        }
        if self.goal_places.is_empty() {
            return Err(SetupError::new("goal_places", "is empty, expected at least one thing"));
        }
        for (i, entity) in self.goal_places.iter().enumerate() {
            let last = Setup::entity(self.things.len().saturating_sub(1));
            match self.thing(*entity) {
                None => {
                    let problem = format!(
                        "is {}, expected the id of a thing: {} (things[0]) to {}",
                        entity.0,
                        EntityId::FIRST_OBJECT.0,
                        last.0
                    );
                    return Err(SetupError::new(format!("goal_places[{i}]"), problem));
                }
                Some(t) if !t.fixed => {
                    let k = self.thing_index(*entity).unwrap_or_default();
                    let problem = format!("names things[{k}] ({}), which isn't fixed", t.class);
                    return Err(SetupError::new(format!("goal_places[{i}]"), problem));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }

    /// Distance in plan from a point to the nearest opening, metres.
    pub(crate) fn distance_to_opening(&self, p: Vec3) -> f32 {
        let to_segment = |a: Vec2, b: Vec2| {
            let (p, ab) = (xz(p), b - a);
            let t = if ab.length_squared() > 0.0 {
                ((p - a).dot(ab) / ab.length_squared()).clamp(0.0, 1.0)
            } else {
                0.0
            };
            p.distance(a + ab * t)
        };
        self.openings.iter().map(|o| to_segment(o.a, o.b)).fold(f32::INFINITY, f32::min)
    }
}
