//! Initial condition of an episode, and the check of its values.

use chaic_core::briefing::Goal;
use chaic_core::capability::{
    Capability, Gait, Impairments, PersonChange, PersonKind, Persona, UsableHands,
};
use chaic_core::geom::{Pose, Rect, to_xz};
use chaic_core::{AgentId, ClassId, EntityId, Frame, TaskId, Vec2, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Initial condition of a world: everything that is fixed before the first frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Setup {
    /// The task.
    pub task: TaskId,
    /// Seed of every random draw in the world.
    pub seed: u64,
    /// Frames until the episode ends.
    pub horizon: Frame,
    /// Part of the plane where the episode takes place; agents cannot leave it.
    pub bounds: Rect,
    /// Height of ceilings above the floor, meters; `None` outdoors.
    pub ceiling_m: Option<f32>,
    /// Named rooms. They are logical only; walls are listed separately.
    pub rooms: Vec<Room>,
    /// Walls, already cut at their openings.
    pub walls: Vec<Wall>,
    /// Openings in walls that connect rooms.
    pub openings: Vec<Opening>,
    /// Floor coverings; later ones are drawn on top of earlier ones.
    pub floors: Vec<Floor>,
    /// All objects; the k-th is entity `FIRST_OBJECT + k`.
    pub things: Vec<ObjectSpec>,
    /// All people; the k-th is agent k: partner, helper, child.
    pub people: Vec<AgentSpec>,
    /// Goal of the partner.
    pub goal: Goal,
    /// Goal places: delivery to any of these objects counts.
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
    /// Kind of the room.
    pub kind: RoomKind,
    /// Extent in plan.
    pub rect: Rect,
}

/// A straight wall, solid from `bottom_m` to `top_m`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// First end of the center line (x, z), meters.
    #[schemars(with = "[f32; 2]")]
    pub a: Vec2,
    /// Second end of the center line (x, z), meters.
    #[schemars(with = "[f32; 2]")]
    pub b: Vec2,
    /// Thickness, meters.
    pub thickness_m: f32,
    /// Height of the lower edge, meters: 0, or the top of a doorway.
    pub bottom_m: f32,
    /// Height of the upper edge, meters.
    pub top_m: f32,
    /// sRGB color.
    pub color: [u8; 3],
}

/// A gap in the walls that connects two rooms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Opening {
    /// First jamb (x, z), meters.
    #[schemars(with = "[f32; 2]")]
    pub a: Vec2,
    /// Second jamb (x, z), meters.
    #[schemars(with = "[f32; 2]")]
    pub b: Vec2,
    /// Indices of the rooms on its two sides.
    pub rooms: [u32; 2],
}

/// Material of a floor.
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

/// A rectangle of floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Floor {
    /// Extent in plan.
    pub rect: Rect,
    /// Material.
    pub material: FloorMaterial,
    /// sRGB color.
    pub color: [u8; 3],
}

/// An object at its initial position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectSpec {
    /// Class of the object.
    pub class: ClassId,
    /// Center of the bottom face, meters.
    #[schemars(with = "[f32; 3]")]
    pub position: Vec3,
    /// Rotation about the vertical axis, radians; at 0 the front faces -z.
    pub yaw_rad: f32,
    /// Factors on the width, height and depth in the catalogue.
    pub scale: [f32; 3],
    /// Height of the lowest supporting top (a seat, a mattress, a truck bed) above the bottom,
    /// meters. `None` scales it with the object; see [`ObjectSpec::parts`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seat_m: Option<f32>,
    /// Index of the color of the class, modulo the number of colors.
    pub variant: u8,
    /// True if the object stays in place even if its class is movable.
    pub fixed: bool,
}

impl ObjectSpec {
    /// Creates an object of catalogue size.
    pub fn new(class: ClassId, position: Vec3, yaw_rad: f32) -> ObjectSpec {
        ObjectSpec {
            class,
            position,
            yaw_rad,
            scale: [1.0; 3],
            seat_m: None,
            variant: 0,
            fixed: !class.info().is_movable(),
        }
    }

    /// Returns the extents along the object's own x, y and z axes, meters.
    pub fn size_m(&self) -> Vec3 {
        Vec3::from(self.class.info().size_m) * Vec3::from(self.scale)
    }

    /// Returns half of the longer side in plan, meters. Rules that measure to the center use it as
    /// the radius of the object (facts S1.1 and S5.2).
    pub fn half_longer_side_m(&self) -> f32 {
        let size = self.size_m();
        0.5 * size.x.max(size.z)
    }
}

/// A person at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AgentSpec {
    /// Persona: kind of person.
    pub persona: Persona,
    /// Initial pose.
    pub pose: Pose,
    /// Appearance index: selects clothes and hair.
    #[serde(rename = "look")]
    pub appearance: u8,
    /// Capability that replaces the one of the persona.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capability: Option<Capability>,
    /// Impairments that are applied on top of the capability.
    #[serde(default, skip_serializing_if = "Impairments::is_empty")]
    pub impairments: Impairments,
}

impl AgentSpec {
    /// Creates a person of this kind with the capability of the persona.
    pub fn new(kind: impl Into<PersonKind>, pose: Pose, appearance: u8) -> AgentSpec {
        let PersonKind { persona, impairments } = kind.into();
        AgentSpec { persona, pose, appearance, capability: None, impairments }
    }

    /// Returns the effective capability: the base capability with the impairments applied.
    pub fn capability(&self) -> Capability {
        self.impairments.apply(self.capability.unwrap_or_else(|| self.persona.capability()))
    }

    /// Returns the person after a change. Another persona replaces capability and impairments.
    #[must_use]
    pub fn changed(&self, change: PersonChange) -> AgentSpec {
        let AgentSpec { pose, appearance, .. } = *self;
        let base = change.persona().map(|persona| AgentSpec::new(persona, pose, appearance));
        let mut person = base.unwrap_or(*self);
        person.impairments =
            change.impairments().iter().fold(person.impairments, Impairments::with);
        let own = person.capability.unwrap_or_else(|| person.persona.capability());
        person.capability = change.with_speed(own).or(person.capability);
        person
    }

    /// Returns the persona together with the impairments.
    pub fn kind(&self) -> PersonKind {
        PersonKind { persona: self.persona, impairments: self.impairments }
    }
}

/// A setup that cannot become a world.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: {problem}")]
pub struct SetupError {
    /// Path of the field in the setup, for example `things[3].position`.
    pub field: String,
    /// The wrong value, and the expected one.
    pub problem: String,
}

impl SetupError {
    fn new(field: impl Into<String>, problem: impl Into<String>) -> SetupError {
        SetupError { field: field.into(), problem: problem.into() }
    }
}

fn check_range(field: String, x: f32, low: f32, high: f32) -> Result<(), SetupError> {
    if x >= low && x <= high {
        Ok(())
    } else {
        Err(SetupError::new(field, format!("is {x}, expected a number in [{low}, {high}]")))
    }
}

/// Checks the optional limits: eyesight, endurance, tremor, and hands that fit the gait.
fn check_optional_limits(i: usize, c: &Capability) -> Result<(), SetupError> {
    const FRAMES: [f32; 2] = [1.0, 1e6];
    let mut limits: Vec<(&str, f32, [f32; 2])> = vec![];
    if let Some(eyesight) = c.eyesight {
        limits.extend([
            ("sight.range_m", eyesight.range_m, [0.1, 1000.0]),
            ("sight.blur_rad", eyesight.blur_rad, [0.0, 0.2]),
            ("sight.field_rad", eyesight.field_rad, [0.01, std::f32::consts::PI]),
            ("sight.lowered_rad", eyesight.lowered_rad, [0.0, std::f32::consts::FRAC_PI_2]),
        ]);
    }
    if let Some(endurance) = c.endurance {
        limits.extend([
            ("endurance.work_frames", endurance.work_frames, FRAMES),
            ("endurance.rest_frames", endurance.rest_frames, FRAMES),
            ("endurance.least", endurance.min_fraction, [0.05, 1.0]),
        ]);
    }
    if let Some(tremor) = c.tremor {
        limits.extend([
            ("tremor.slip_chance", tremor.slip_chance, [0.0, 1.0]),
            ("tremor.drop_chance", tremor.drop_chance, [0.0, 1.0]),
        ]);
    }
    for (name, x, [low, high]) in limits {
        check_range(format!("people[{i}].capability.{name}"), x, low, high)?;
    }
    if c.gait == Gait::WalkBike && c.hands != UsableHands::Both {
        let problem =
            "has one usable hand, expected both: a bicycle needs one hand and its basket the other";
        return Err(SetupError::new(format!("people[{i}].capability.hands"), problem));
    }
    Ok(())
}

impl Setup {
    /// Maximum number of objects in one episode. Ids must fit in 16 bits, and memory stays bounded.
    pub const MAX_OBJECTS: usize = 4096;
    /// Maximum side length of the bounds, meters. Maps cover the whole area.
    pub const MAX_LENGTH_M: f32 = 200.0;
    /// Maximum number of walls in one episode.
    pub const MAX_WALLS: usize = 4096;
    /// Maximum total length of all walls, meters. Our choice: walls two meters apart in both
    /// directions over the largest bounds have 40 km, and a wall has a window every few meters.
    pub const MAX_WALL_LENGTH_M: f32 = 100_000.0;
    /// Maximum number of rooms in one episode. Our choice: far more than any generated or imported
    /// house has, and small enough for a linear search of the room at a point. Images name a room
    /// and its lamp by one byte, of which one value means no room.
    pub const MAX_ROOMS: usize = 255;
    /// Maximum number of openings in one episode. Our choice: several for each room.
    pub const MAX_OPENINGS: usize = 1024;
    /// Maximum number of floors in one episode, as [`Setup::MAX_OPENINGS`].
    pub const MAX_FLOORS: usize = 1024;
    /// Maximum absolute coordinate, meters: f32 still resolves millimeters there.
    pub const MAX_COORDINATE_M: f32 = 1000.0;

    /// Returns the object with this id.
    pub fn object(&self, entity: EntityId) -> Option<&ObjectSpec> {
        self.object_index(entity).map(|i| &self.things[i])
    }

    /// Returns the index of an object in [`Setup::things`].
    pub fn object_index(&self, entity: EntityId) -> Option<usize> {
        let i = usize::from(entity.0.checked_sub(EntityId::FIRST_OBJECT.0)?);
        (i < self.things.len()).then_some(i)
    }

    /// Returns the id of the k-th object.
    pub fn entity(index: usize) -> EntityId {
        EntityId(EntityId::FIRST_OBJECT.0 + index as u16)
    }

    /// Returns the ids of all objects, in order.
    pub fn entities(&self) -> impl Iterator<Item = EntityId> + use<> {
        (0..self.things.len()).map(Setup::entity)
    }

    /// Returns the ids of all agents, in order.
    pub fn agents(&self) -> impl Iterator<Item = AgentId> + use<> {
        (0..self.people.len() as u8).map(AgentId)
    }

    /// Returns the index of the room that contains a point.
    pub fn room_at(&self, p: Vec2) -> Option<usize> {
        self.rooms.iter().position(|r| r.rect.contains(p))
    }

    /// Checks what [`crate::World::new`] relies on: finite numbers, valid ids and bounds. The
    /// validator of `chaic-episodes` checks whether the episode is playable.
    pub fn check(&self) -> Result<(), SetupError> {
        let max = Setup::MAX_COORDINATE_M;
        let rect = |field: String, r: &Rect| {
            for (name, v) in [("min", r.min), ("max", r.max)] {
                check_range(format!("{field}.{name}[0]"), v.x, -max, max)?;
                check_range(format!("{field}.{name}[1]"), v.y, -max, max)?;
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
            check_range(format!("bounds (length along {axis})"), length, 0.1, Setup::MAX_LENGTH_M)?;
        }
        for (field, n, max) in [
            ("rooms", self.rooms.len(), Setup::MAX_ROOMS),
            ("walls", self.walls.len(), Setup::MAX_WALLS),
            ("openings", self.openings.len(), Setup::MAX_OPENINGS),
            ("floors", self.floors.len(), Setup::MAX_FLOORS),
            ("things", self.things.len(), Setup::MAX_OBJECTS),
            ("goal_places", self.goal_places.len(), Setup::MAX_OBJECTS),
        ] {
            if n > max {
                return Err(SetupError::new(field, format!("has {n} entries, at most {max}")));
            }
        }
        if self.horizon == 0 {
            return Err(SetupError::new("horizon", "is 0, expected at least one frame"));
        }
        if let Some(h) = self.ceiling_m {
            check_range("ceiling_m".into(), h, 2.0, 20.0)?;
        }
        for (i, room) in self.rooms.iter().enumerate() {
            rect(format!("rooms[{i}].rect"), &room.rect)?;
        }
        for (i, floor) in self.floors.iter().enumerate() {
            rect(format!("floors[{i}].rect"), &floor.rect)?;
        }
        if self.floor_pieces().is_none() {
            let max = Setup::MAX_FLOOR_PIECES;
            let problem = format!("cut each other into more than {max} pieces");
            return Err(SetupError::new("floors", problem));
        }
        for (i, w) in self.walls.iter().enumerate() {
            for (name, v) in [("a", w.a), ("b", w.b)] {
                check_range(format!("walls[{i}].{name}[0]"), v.x, -max, max)?;
                check_range(format!("walls[{i}].{name}[1]"), v.y, -max, max)?;
            }
            check_range(format!("walls[{i}].thickness_m"), w.thickness_m, 0.01, 5.0)?;
            check_range(format!("walls[{i}].bottom_m"), w.bottom_m, 0.0, 20.0)?;
            check_range(format!("walls[{i}].top_m"), w.top_m, w.bottom_m + 0.01, 20.0)?;
        }
        let length_m: f32 = self.walls.iter().map(|w| w.a.distance(w.b)).sum();
        check_range("walls (total length)".into(), length_m, 0.0, Setup::MAX_WALL_LENGTH_M)?;
        if self.ceiling_m.is_some() && self.ceiling_pieces().is_none() {
            let max = Setup::MAX_CEILING_PIECES;
            let problem = format!("cut the ceiling between them into more than {max} pieces");
            return Err(SetupError::new("rooms", problem));
        }
        for (i, o) in self.openings.iter().enumerate() {
            for (side, room) in o.rooms.iter().enumerate() {
                if *room as usize >= self.rooms.len() {
                    let problem = format!("is {room}, but there are {} rooms", self.rooms.len());
                    return Err(SetupError::new(format!("openings[{i}].rooms[{side}]"), problem));
                }
            }
            for (name, v) in [("a", o.a), ("b", o.b)] {
                check_range(format!("openings[{i}].{name}[0]"), v.x, -max, max)?;
                check_range(format!("openings[{i}].{name}[1]"), v.y, -max, max)?;
            }
        }
        for (i, t) in self.things.iter().enumerate() {
            for (axis, x) in t.position.to_array().into_iter().enumerate() {
                check_range(format!("things[{i}].position[{axis}]"), x, -max, max)?;
            }
            check_range(format!("things[{i}].yaw_rad"), t.yaw_rad, -100.0, 100.0)?;
            for (axis, s) in t.scale.into_iter().enumerate() {
                check_range(format!("things[{i}].scale[{axis}]"), s, 0.01, 100.0)?;
            }
            if let Some(seat_m) = t.seat_m {
                check_range(format!("things[{i}].seat_m"), seat_m, 0.001, t.size_m().y)?;
            }
        }
        if self.people.is_empty() || self.people.len() > AgentId::MAX_AGENTS {
            let (n, max) = (self.people.len(), AgentId::MAX_AGENTS);
            let problem = format!("has {n} entries, expected 1 to {max}");
            return Err(SetupError::new("people", problem));
        }
        for (i, p) in self.people.iter().enumerate() {
            for (axis, x) in p.pose.position.to_array().into_iter().enumerate() {
                check_range(format!("people[{i}].pose.position[{axis}]"), x, -max, max)?;
            }
            check_range(format!("people[{i}].pose.yaw_rad"), p.pose.yaw_rad, -100.0, 100.0)?;
            let c = p.capability();
            for (name, x, low, high) in [
                // A step longer than the radius of the body could pass through a wall.
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
                check_range(format!("people[{i}].capability.{name}"), x, low, high)?;
            }
            check_optional_limits(i, &c)?;
        }
        if self.goal.targets.is_empty() {
            return Err(SetupError::new("goal.targets", "is empty, expected at least one class"));
        }
        for (i, (class, n)) in self.goal.targets.iter().enumerate() {
            if *n == 0 || *n as usize > Setup::MAX_OBJECTS {
                let problem =
                    format!("asks for {n} of {class}, expected 1 to {}", Setup::MAX_OBJECTS);
                return Err(SetupError::new(format!("goal.targets[{i}]"), problem));
            }
            if self.goal.targets[..i].iter().any(|(c, _)| c == class) {
                return Err(SetupError::new(
                    format!("goal.targets[{i}]"),
                    format!("lists {class} again, expected each class once"),
                ));
            }
        }
        if self.goal_places.is_empty() {
            return Err(SetupError::new("goal_places", "is empty, expected at least one object"));
        }
        for (i, entity) in self.goal_places.iter().enumerate() {
            let last = Setup::entity(self.things.len().saturating_sub(1));
            match self.object(*entity) {
                None => {
                    let problem = format!(
                        "is {}, expected the id of an object: {} (things[0]) to {}",
                        entity.0,
                        EntityId::FIRST_OBJECT.0,
                        last.0
                    );
                    return Err(SetupError::new(format!("goal_places[{i}]"), problem));
                }
                Some(t) if !t.fixed => {
                    let k = self.object_index(*entity).unwrap_or_default();
                    let problem = format!("names things[{k}] ({}), which is not fixed", t.class);
                    return Err(SetupError::new(format!("goal_places[{i}]"), problem));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }

    /// Returns the distance in plan from a point to the nearest opening, meters.
    pub(crate) fn distance_to_opening(&self, p: Vec3) -> f32 {
        let to_segment = |a: Vec2, b: Vec2| {
            let (p, ab) = (to_xz(p), b - a);
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
