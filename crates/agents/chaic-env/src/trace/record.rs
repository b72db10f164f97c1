//! Records: the lines of a trace after its header.

use std::fmt;

use chaic_core::agent::{ChildState, Thought};
use chaic_core::{Action, AgentId, ClassId, Frame, ResolvedAction};
use chaic_world::{Event, EventKind, World};
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::ser::SerializeTuple as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::digest::Digest;

/// Record of a trace.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// An agent decided.
    Decision(Decision),
    /// The child's state changed with its decision before this record.
    Child(ChildRecord),
    /// An event of the world.
    Event(TraceEvent),
    /// The episode ended.
    End(End),
}

/// An agent's decision. Serialized as `[frame, agent, action, digest]`, with the thought as a fifth
/// entry if it differs from the agent's last one.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Frame.
    pub frame: Frame,
    /// Agent id.
    pub agent: AgentId,
    /// Action with its target resolved to an entity.
    pub action: ResolvedAction,
    /// Digest of the world's state right before the action was submitted.
    pub digest: Digest,
    /// Thought, if it changed.
    pub thought: Option<Thought>,
}

/// State of the child. The child's agent reports it, not the world; a re-simulated trace copies it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChildRecord {
    /// Frame.
    pub frame: Frame,
    /// New state.
    pub state: ChildState,
}

/// An event, with the class of its object for metrics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceEvent {
    /// Event.
    #[serde(flatten)]
    pub event: Event,
    /// Class of a delivered object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<ClassId>,
}

/// End of an episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct End {
    /// Number of frames.
    pub frame: Frame,
    /// Delivered amount of what is wanted: objects, or kilograms when moving house.
    pub done: f64,
    /// Wanted amount.
    pub total: f64,
    /// True if everything wanted was delivered.
    pub complete: bool,
    /// Number of frames in which the child was away.
    pub away_frames: u32,
    /// Number of frames in which partner or helper had made no progress for 200 frames.
    pub stuck_frames: u32,
    /// Digest of the last state.
    pub digest: Digest,
}

/// Returns whether a trace keeps an event. The start of an action follows from the decisions, and so
/// does a successful step, turn or wait.
pub fn is_recorded(event: &Event) -> bool {
    match &event.kind {
        EventKind::Began { .. } => false,
        EventKind::Ended { action, outcome, .. } => {
            !outcome.is_success() || action.subject().is_some() || *action == Action::PutIn
        }
        _ => true,
    }
}

impl TraceEvent {
    /// Creates the record of an event in a world.
    pub fn new(event: Event, world: &World) -> TraceEvent {
        let class = match event.kind {
            EventKind::Delivered { object, .. } => world.setup().object(object).map(|t| t.class),
            _ => None,
        };
        TraceEvent { event, class }
    }
}

impl End {
    /// Returns the end of an episode if it ended in the current state.
    pub fn new(world: &World) -> End {
        let (done, total) = world.progress();
        End {
            frame: world.state().frame,
            done,
            total,
            complete: world.is_complete(),
            away_frames: world.state().child_away_frames,
            stuck_frames: world.state().stuck_frames,
            digest: Digest(world.digest()),
        }
    }
}

#[derive(Serialize, Deserialize)]
struct EndLine {
    end: End,
}

#[derive(Serialize, Deserialize)]
struct ChildLine {
    child: ChildRecord,
}

impl Record {
    /// Returns the line, with the keys of [`VERSION`](crate::trace::VERSION) and without its line break.
    pub fn to_line(&self) -> String {
        let text = match self {
            Record::Decision(decision) => serde_json::to_string(decision),
            Record::Child(child) => serde_json::to_string(&ChildLine { child: *child }),
            Record::Event(event) => serde_json::to_string(event),
            Record::End(end) => serde_json::to_string(&EndLine { end: end.clone() }),
        };
        text.expect("records have string keys and finite numbers")
    }

    /// Parses a line.
    ///
    /// # Errors
    /// If the line is not a record.
    pub fn from_line(line: &str) -> Result<Record, serde_json::Error> {
        // Episodes are also read from bytes; a second kind of reader would enlarge the web module.
        let bytes = line.as_bytes();
        if line.starts_with('[') {
            return serde_json::from_slice(bytes).map(Record::Decision);
        }
        if line.starts_with("{\"end\"") {
            return serde_json::from_slice(bytes).map(|l: EndLine| Record::End(l.end));
        }
        if line.starts_with("{\"child\"") {
            return serde_json::from_slice(bytes).map(|l: ChildLine| Record::Child(l.child));
        }
        serde_json::from_slice(bytes).map(Record::Event)
    }
}

impl Serialize for Decision {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(4 + usize::from(self.thought.is_some()))?;
        tuple.serialize_element(&self.frame)?;
        tuple.serialize_element(&self.agent)?;
        tuple.serialize_element(&self.action)?;
        tuple.serialize_element(&self.digest)?;
        if let Some(thought) = &self.thought {
            tuple.serialize_element(thought)?;
        }
        tuple.end()
    }
}

impl<'de> Deserialize<'de> for Decision {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Decision, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = Decision;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("[frame, agent, action, digest] or the same with a thought")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Decision, A::Error> {
                let missing = |name| A::Error::custom(format!("the {name} is missing"));
                Ok(Decision {
                    frame: seq.next_element()?.ok_or_else(|| missing("frame"))?,
                    agent: seq.next_element()?.ok_or_else(|| missing("agent"))?,
                    action: seq.next_element()?.ok_or_else(|| missing("action"))?,
                    digest: seq.next_element()?.ok_or_else(|| missing("digest"))?,
                    thought: seq.next_element()?,
                })
            }
        }
        deserializer.deserialize_seq(Entries)
    }
}
