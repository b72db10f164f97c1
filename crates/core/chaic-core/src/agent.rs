//! Interface of agents: partners and helpers, scripted or learned.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::memory_view::MemoryView;
use crate::{Action, Briefing, ClassId, Observation, observation::SensorConfig};

/// Description of an agent's internal state for traces: shown in replays, never read by rules or
/// scores.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Thought {
    /// Current plan as text, for example `go to apple #31 and pick it up`.
    pub plan: String,
    /// Current mode in one word.
    #[serde(alias = "mood", default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<String>,
    /// Last observed action of another agent as text, for agents that recognize actions in images.
    #[serde(alias = "noticed", default, skip_serializing_if = "Option::is_none")]
    pub last_observed: Option<String>,
    /// Currently perceived objects, for agents that detect objects in color and depth.
    #[serde(alias = "sees", default, skip_serializing_if = "Vec::is_empty")]
    pub perceived: Vec<BelievedObject>,
    /// Belief about the partner, for agents that infer its goal and constraint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub belief: Option<Box<PartnerBelief>>,
}

/// Belief of an agent about its partner, and the plans that follow.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PartnerBelief {
    /// Target sets ([`TargetSet::name`](crate::catalogue::TargetSet::name)) with their
    /// probabilities, per mille.
    pub goals: Vec<(String, u16)>,
    /// Kinds of person with their probabilities, per mille.
    pub people: Vec<(String, u16)>,
    /// Classes that the goal wants beside a target set, with a probability of at least 0.5.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub extra: Vec<ClassId>,
    /// Position of the partner at the last sighting (x, z), centimeters; absent before the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_cm: Option<[i32; 2]>,
    /// Observations of the partner on which the belief rests, as text.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub evidence: Vec<String>,
    /// Planned operations of the agent as text, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plan: Vec<String>,
    /// Expected operations of the partner as text, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub partner_plan: Vec<String>,
}

/// An object in the memory of an agent, which may differ from the actual one. It is serialized as a
/// list of its fields, because traces contain many.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "BelievedFields", into = "BelievedFields")]
pub struct BelievedObject {
    /// Name that the agent uses for it, for example `t13`.
    pub name: String,
    /// Perceived class.
    pub class: ClassId,
    /// Position in the world, centimeters.
    pub position_cm: [i32; 3],
}

type BelievedFields = (String, ClassId, [i32; 3]);

impl From<BelievedFields> for BelievedObject {
    fn from((name, class, position_cm): BelievedFields) -> BelievedObject {
        BelievedObject { name, class, position_cm }
    }
}

impl From<BelievedObject> for BelievedFields {
    fn from(BelievedObject { name, class, position_cm }: BelievedObject) -> BelievedFields {
        (name, class, position_cm)
    }
}

/// Behavior mode of the child, reported by the child's agent. The original's emergency rate depends
/// on it (facts S8.4), so traces record it separately.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChildState {
    /// Follows its guardian.
    Follow,
    /// Runs to a distant place, or stays there.
    RunAway,
    /// Returns to its guardian.
    GotoGuardian,
}

/// An agent that cannot decide.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AgentError {
    /// Temporary failure: the user stopped the agent, or a service that it uses does not respond.
    /// The run pauses, and replays the episode from the start when it resumes.
    #[error("{0}")]
    Halted(String),
    /// Permanent failure, such as a process that exited or an exception. The episode scores zero.
    #[error("{0}")]
    Broken(String),
}

/// An agent. It receives a briefing once. Then it is asked for an action each time its last one has
/// ended.
///
/// It receives all information through [`Agent::reset`], [`Agent::act`] and [`Agent::observe`]. Equal
/// sequences of calls must lead to equal actions: draw random numbers from a
/// [`crate::rng::RngStream`] seeded by the briefing.
pub trait Agent: Send {
    /// Returns the required sensors; called once per episode, after [`Agent::reset`]. Only required
    /// channels are rendered, and only granted ones are provided.
    fn sensors(&self) -> SensorConfig;

    /// Starts an episode.
    fn reset(&mut self, briefing: &Briefing);

    /// Decides on the next action.
    ///
    /// # Errors
    /// If the agent fails; it is not called again in this episode.
    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError>;

    /// Updates the memory while a recording chooses this agent's actions, until the agent takes
    /// over. Without this method, the agent knows nothing of earlier decisions.
    fn observe(&mut self, _observation: &Observation) {}

    /// Returns the name of the perception model, if the agent uses an exchangeable one instead of
    /// granted ids; for the trace.
    fn perception(&self) -> Option<String> {
        None
    }

    /// Returns the confinement of the agent's process, such as `sandbox` or `trusted`; for the
    /// trace. `None` for an agent in this process.
    fn isolation(&self) -> Option<String> {
        None
    }

    /// Returns the digest of the trained weights that choose the actions, if there are any; for the
    /// trace.
    fn weights(&self) -> Option<String> {
        None
    }

    /// Returns the digest of the recording that the agent repeats, if it repeats one; for the trace.
    fn recording(&self) -> Option<String> {
        None
    }

    /// Returns a description of the internal state, for the trace.
    fn thought(&self) -> Thought {
        Thought::default()
    }

    /// Returns the content of the memory after the last [`Agent::act`], for drawings; `None` for an
    /// agent without a map.
    fn memory_view(&self) -> Option<MemoryView> {
        None
    }

    /// Returns the behavior, if this agent is the child; called after each [`Agent::act`].
    fn child_state(&self) -> Option<ChildState> {
        None
    }

    /// Returns counters of the agent's own behavior in this episode, by name. They are for the
    /// trace and never read by rules or scores.
    fn counters(&self) -> BTreeMap<String, u64> {
        BTreeMap::new()
    }

    /// Returns a copy that would continue identically, for snapshots of an episode. `None` if the
    /// agent cannot be copied, like one in another process.
    fn fork(&self) -> Option<Box<dyn Agent>> {
        None
    }
}
