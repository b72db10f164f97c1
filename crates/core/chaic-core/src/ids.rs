//! Ids of entities, agents and object classes. The world resolves them; agents see only the
//! numbers.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::catalogue::{self, ClassInfo};

/// Number of frames since the start of the episode; [`FRAMES_PER_SECOND`] are one second of walking.
pub type Frame = u32;

/// Number of frames in a second of simulated time (docs/rules.md, time).
pub const FRAMES_PER_SECOND: Frame = 30;

/// Id of an entity of an episode, and the value of its pixels in an id image.
///
/// Low numbers are structure and people and are the same in every episode. Objects start at
/// [`EntityId::FIRST_OBJECT`].
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(transparent)]
pub struct EntityId(pub u16);

impl EntityId {
    /// Sky, or beyond the far plane.
    pub const NOTHING: EntityId = EntityId(0);
    /// Floors and the ground.
    pub const FLOOR: EntityId = EntityId(1);
    /// Walls, including window panes.
    pub const WALL: EntityId = EntityId(2);
    /// Ceilings and roofs.
    pub const CEILING: EntityId = EntityId(3);
    /// Body of agent 0; the body of agent k is this plus k.
    pub const FIRST_PERSON: EntityId = EntityId(8);
    /// First id of an object.
    pub const FIRST_OBJECT: EntityId = EntityId(16);

    /// Returns the name of the class, or of the structural element. `classes` holds the classes of
    /// people and objects by id.
    pub fn class_name(self, classes: &[Option<ClassId>]) -> &'static str {
        match self {
            EntityId::NOTHING => "nothing",
            EntityId::FLOOR => "floor",
            EntityId::WALL => "wall",
            EntityId::CEILING => "ceiling",
            other => {
                let class = classes.get(usize::from(other.0)).copied().flatten();
                class.map_or("unknown", |class| class.name())
            }
        }
    }

    /// Returns the entity id of an agent's body, or [`EntityId::NOTHING`] for an index that is not
    /// below [`AgentId::MAX_AGENTS`].
    pub fn from_agent(agent: AgentId) -> EntityId {
        if agent.index() < AgentId::MAX_AGENTS {
            EntityId(EntityId::FIRST_PERSON.0 + u16::from(agent.0))
        } else {
            EntityId::NOTHING
        }
    }

    /// Returns the agent with this body; `None` if the entity is no body.
    pub fn agent(self) -> Option<AgentId> {
        (EntityId::FIRST_PERSON..EntityId::FIRST_OBJECT)
            .contains(&self)
            .then(|| AgentId((self.0 - EntityId::FIRST_PERSON.0) as u8))
    }

    /// Returns whether the id is an object rather than structure or a person.
    pub fn is_object(self) -> bool {
        self >= EntityId::FIRST_OBJECT
    }
}

impl fmt::Display for EntityId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// Id of an agent of an episode.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(transparent)]
pub struct AgentId(pub u8);

impl AgentId {
    /// The partner: the person with the constraint.
    pub const PARTNER: AgentId = AgentId(0);
    /// The helper.
    pub const HELPER: AgentId = AgentId(1);
    /// The child in the shopping task.
    pub const CHILD: AgentId = AgentId(2);
    /// Maximum number of agents in an episode, given by the id range of bodies.
    pub const MAX_AGENTS: usize = (EntityId::FIRST_OBJECT.0 - EntityId::FIRST_PERSON.0) as usize;

    /// Returns the index in per-agent arrays.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }

    /// Returns the role name for display.
    pub fn role_name(self) -> &'static str {
        match self {
            AgentId::PARTNER => "partner",
            AgentId::HELPER => "helper",
            AgentId::CHILD => "child",
            _ => "agent",
        }
    }
}

impl fmt::Display for AgentId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.role_name())
    }
}

/// Id of a class of the catalogue. It is serialized as the name of the class.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClassId(u8);

impl ClassId {
    pub(crate) const fn from_index(index: usize) -> ClassId {
        assert!(index < 256, "the catalogue has at most 256 classes");
        ClassId(index as u8)
    }

    /// Returns the class with this name.
    pub fn from_name(name: &str) -> Option<ClassId> {
        catalogue::CLASSES.iter().position(|c| c.name == name).map(ClassId::from_index)
    }

    /// Returns the class with this name, which must exist.
    ///
    /// # Panics
    /// If the catalogue has no such class: for names in code, not for input.
    pub fn named(name: &str) -> ClassId {
        ClassId::from_name(name).unwrap_or_else(|| panic!("the catalogue has no class `{name}`"))
    }

    /// Returns all classes in the order of the catalogue.
    pub fn all() -> impl Iterator<Item = ClassId> {
        (0..catalogue::CLASSES.len()).map(ClassId::from_index)
    }

    /// Returns the index in the catalogue.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }

    /// Returns the entry in the catalogue.
    pub fn info(self) -> &'static ClassInfo {
        &catalogue::CLASSES[self.index()]
    }

    /// Returns the name.
    pub fn name(self) -> &'static str {
        self.info().name
    }
}

impl fmt::Debug for ClassId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for ClassId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for ClassId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for ClassId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<ClassId, D::Error> {
        let name = <std::borrow::Cow<'de, str>>::deserialize(deserializer)?;
        ClassId::from_name(&name).ok_or_else(|| {
            de::Error::custom(format!("unknown class `{name}`, expected a name in the catalogue"))
        })
    }
}

impl JsonSchema for ClassId {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "ClassId".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let names: Vec<&str> = catalogue::CLASSES.iter().map(|c| c.name).collect();
        schemars::json_schema!({
            "type": "string",
            "description": "Name of a class in the catalogue",
            "enum": names,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_of_agents_have_their_own_ids() {
        for number in 0..=u8::MAX {
            let agent = AgentId(number);
            let body = EntityId::from_agent(agent);
            let has_one = agent.index() < AgentId::MAX_AGENTS;
            assert_eq!(body.agent(), has_one.then_some(agent), "{number}");
            assert_eq!(body == EntityId::NOTHING, !has_one, "{number}");
            assert!(!body.is_object(), "{number}");
        }
    }
}
