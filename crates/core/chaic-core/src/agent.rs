//! What every mind is, be it a partner's, a helper's, a scripted or a learned one.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{Action, Briefing, ClassId, Observation, observation::Senses};

/// What a mind says of itself for the record: shown in replays, never read by rules or scores.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Thought {
    /// The plan it follows, in words, for example `go to apple #31 and pick it up`.
    pub plan: String,
    /// A short word for its state if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mood: Option<String>,
    /// What it noticed last that somebody did, in words, if it tells that from what it sees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noticed: Option<String>,
    /// What it believes to see now, if it tells that from color and depth.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sees: Vec<Believed>,
}

/// A thing as a mind has it: not necessarily what is there. Written as a list of its fields, since traces
/// have many.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "BelievedFields", into = "BelievedFields")]
pub struct Believed {
    /// The mind's own name for it, for example `t13`.
    pub name: String,
    /// What it takes it for.
    pub class: ClassId,
    /// Where, in the world, centimetres.
    pub at_cm: [i32; 3],
}

type BelievedFields = (String, ClassId, [i32; 3]);

impl From<BelievedFields> for Believed {
    fn from((name, class, at_cm): BelievedFields) -> Believed {
        Believed { name, class, at_cm }
    }
}

impl From<Believed> for BelievedFields {
    fn from(Believed { name, class, at_cm }: Believed) -> BelievedFields {
        (name, class, at_cm)
    }
}

/// What the child who comes along is doing, by its own decision. The original's emergency rate asks
/// for it (facts S8.4), so it is a record of its own in traces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChildState {
    /// Comes along with its guardian.
    Follow,
    /// Runs to a place far off, or stays there.
    RunAway,
    /// Goes back to its guardian.
    GotoGuardian,
}

/// Why a mind can't decide.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AgentError {
    /// It can't go on for now: its user stops it, or nobody answers what it asks. A run pauses, and
    /// plays the episode anew when it goes on.
    #[error("{0}")]
    Halted(String),
    /// It broke down, like a process that ended or code that raised an exception. The episode counts
    /// as zero.
    #[error("{0}")]
    Broken(String),
}

/// A mind: it is briefed once, then asked for an action each time its last one has ended.
///
/// Everything it may know comes through these three calls. The same sequence of calls must lead
/// to the same actions: draw random numbers from a [`crate::rng::Stream`] seeded by the briefing.
pub trait Agent: Send {
    /// What it wants to perceive; asked once per episode, after [`Agent::reset`]. Only what is
    /// wanted is rendered, and only what is granted is given.
    fn senses(&self) -> Senses;

    /// Begins an episode.
    fn reset(&mut self, briefing: &Briefing);

    /// Decides what to do next.
    ///
    /// # Errors
    /// If it can't; it isn't asked again in this episode.
    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError>;

    /// By what it tells what is in its images, where that is neither granted nor its own affair; for
    /// the record.
    fn perception(&self) -> Option<String> {
        None
    }

    /// How the process of this mind is confined, such as `sandbox` or `trusted`; for the record. `None` for a
    /// mind within this process.
    fn isolation(&self) -> Option<String> {
        None
    }

    /// What it is thinking, for the record.
    fn thought(&self) -> Thought {
        Thought::default()
    }

    /// What it is doing, if it is the child's mind; asked after each [`Agent::act`].
    fn child_state(&self) -> Option<ChildState> {
        None
    }

    /// What it counted of its own doings in this episode, by name, for the record: never read by
    /// rules or scores.
    fn counts(&self) -> BTreeMap<String, u64> {
        BTreeMap::new()
    }

    /// A copy that goes on as this one would, for snapshots of an episode; `None` if it can't be
    /// copied, like a mind in another process.
    fn fork(&self) -> Option<Box<dyn Agent>> {
        None
    }
}
