//! Handles. What they refer to is in the world; agents only ever see the numbers.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::catalogue::{self, ClassInfo};

/// A count of frames since the episode began; a walking second has 30.
pub type Frame = u32;

/// Names one thing of an episode, and is the value of its pixels in an id image.
///
/// The low numbers are structure and people, the same in every episode; objects begin at
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
    /// Walls, window panes included.
    pub const WALL: EntityId = EntityId(2);
    /// Ceilings and roofs.
    pub const CEILING: EntityId = EntityId(3);
    /// The body of agent 0; agent k is this plus k.
    pub const FIRST_PERSON: EntityId = EntityId(8);
    /// The first number that names an object.
    pub const FIRST_OBJECT: EntityId = EntityId(16);

    /// The name of its class, or of the part of the structure that it is; `classes` are those of
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

    /// The body of an agent; [`EntityId::NOTHING`] for a number from [`AgentId::MAX_AGENTS`] on, which
    /// no episode has.
    pub fn of_agent(agent: AgentId) -> EntityId {
        if agent.index() < AgentId::MAX_AGENTS {
            EntityId(EntityId::FIRST_PERSON.0 + u16::from(agent.0))
        } else {
            EntityId::NOTHING
        }
    }

    /// The agent whose body this is.
    pub fn agent(self) -> Option<AgentId> {
        (EntityId::FIRST_PERSON..EntityId::FIRST_OBJECT)
            .contains(&self)
            .then(|| AgentId((self.0 - EntityId::FIRST_PERSON.0) as u8))
    }

    /// Whether it names an object rather than structure or a person.
    pub fn is_object(self) -> bool {
        self >= EntityId::FIRST_OBJECT
    }
}

impl fmt::Display for EntityId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// Names one agent of an episode.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(transparent)]
pub struct AgentId(pub u8);

impl AgentId {
    /// The constrained person.
    pub const PARTNER: AgentId = AgentId(0);
    /// The helper.
    pub const HELPER: AgentId = AgentId(1);
    /// The child who comes along while shopping.
    pub const CHILD: AgentId = AgentId(2);
    /// Most agents of one episode: so many numbers are there for their bodies.
    pub const MAX_AGENTS: usize = (EntityId::FIRST_OBJECT.0 - EntityId::FIRST_PERSON.0) as usize;

    /// Its place in per-agent arrays.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }

    /// The word that people read for this agent.
    pub fn word(self) -> &'static str {
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
        f.write_str(self.word())
    }
}

/// Names one class of the catalogue. Written in files as the class's name.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClassId(u8);

impl ClassId {
    pub(crate) const fn from_index(index: usize) -> ClassId {
        assert!(index < 256, "the catalogue has at most 256 classes");
        ClassId(index as u8)
    }

    /// The class of this name, if the catalogue has one.
    pub fn by_name(name: &str) -> Option<ClassId> {
        catalogue::CLASSES.iter().position(|c| c.name == name).map(ClassId::from_index)
    }

    /// The class of this name, which must exist.
    ///
    /// # Panics
    /// If the catalogue has no such class: for names written in code, not for input.
    pub fn named(name: &str) -> ClassId {
        ClassId::by_name(name).unwrap_or_else(|| panic!("the catalogue has no class `{name}`"))
    }

    /// Every class, in the catalogue's order.
    pub fn all() -> impl Iterator<Item = ClassId> {
        (0..catalogue::CLASSES.len()).map(ClassId::from_index)
    }

    /// Its place in the catalogue.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }

    /// What the catalogue says of it.
    pub fn info(self) -> &'static ClassInfo {
        &catalogue::CLASSES[self.index()]
    }

    /// Its name.
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
        ClassId::by_name(&name).ok_or_else(|| {
            de::Error::custom(format!("unknown class `{name}`, expected a name of the catalogue"))
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
            "description": "The name of a class of the catalogue",
            "enum": names,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_nothing_else() {
        for number in 0..=u8::MAX {
            let agent = AgentId(number);
            let body = EntityId::of_agent(agent);
            let has_one = agent.index() < AgentId::MAX_AGENTS;
            assert_eq!(body.agent(), has_one.then_some(agent), "{number}");
            assert_eq!(body == EntityId::NOTHING, !has_one, "{number}");
            assert!(!body.is_object(), "{number}");
        }
    }
}
