//! Trace of an episode: an append-only sequence of lines.
//!
//! A trace is JSON lines: a [`Header`], then [`Record`]s in chronological order; the last one is an
//! [`End`]. `docs/reference/trace.md` describes the format for other programs.

mod parse;
mod record;
mod version;

pub use parse::{MAX_TRACE_BYTES, TraceWarning, parse};
pub use record::{ChildRecord, Decision, End, Record, TraceEvent, is_recorded};

use chaic_core::capability::{Impairments, Persona};
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{AgentId, Frame, TaskId};
use chaic_render::Appearance;
use serde::{Deserialize, Serialize};

use crate::digest::Digest;
use crate::key::RunKey;
use crate::rules::RuleSet;

/// Value of the field `format` of a header.
pub const FORMAT: &str = "chaic-trace";
/// Version of the format that is written.
pub const VERSION: u32 = 4;
/// Oldest version that is read. Earlier versions have other names of some fields and rules, which are
/// aliases here.
pub const MIN_VERSION: u32 = 2;

/// Configuration of an episode run: setup, rules, agents and grants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Always [`FORMAT`].
    pub format: String,
    /// [`MIN_VERSION`] to [`VERSION`].
    pub version: u32,
    /// Version of the program that ran the episode.
    pub chaic: String,
    /// Task.
    pub task: TaskId,
    /// Episode id.
    pub episode: String,
    /// Digest of the setup in the episode's file.
    pub setup: Digest,
    /// Index of the run's seed; 0 is the episode's own.
    pub seed: u32,
    /// Seed of the world.
    pub world_seed: u64,
    /// Rules of the world and of the planners.
    pub rules: RuleSet,
    /// Helper name; `none` if the partner is alone.
    pub helper: String,
    /// Name of the partner's agent; absent for the rule-based one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partner: Option<String>,
    /// Participants, by agent id.
    pub people: Vec<Participant>,
    /// Renderer of the images; only `cpu` gives the same images on every machine.
    pub renderer: String,
    /// Lighting and colors; absent for the canonical appearance.
    #[serde(default, skip_serializing_if = "is_canonical", with = "as_text")]
    pub appearance: Appearance,
    /// Trace from which a person or another helper took over; absent for an episode that was played from
    /// its start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub branch_of: Option<BranchPoint>,
}

/// Point of another trace from which an episode continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BranchPoint {
    /// Digest of the bytes of the other trace.
    pub trace: Digest,
    /// First frame in which the decisions may differ.
    pub frame: Frame,
}

impl BranchPoint {
    /// Returns the point at this frame of a trace with these bytes.
    pub fn new(trace: &[u8], frame: Frame) -> BranchPoint {
        BranchPoint { trace: Digest::of_bytes(trace), frame }
    }
}

// `skip_serializing_if` passes a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_canonical(appearance: &Appearance) -> bool {
    *appearance == Appearance::Canonical
}

/// Serialization of an appearance as on the command line.
mod as_text {
    use chaic_render::Appearance;
    use serde::de::Error as _;
    use serde::{Deserialize as _, Deserializer, Serializer};

    #[allow(clippy::trivially_copy_pass_by_ref)]
    pub(super) fn serialize<S: Serializer>(
        appearance: &Appearance,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        to.collect_str(appearance)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Appearance, D::Error> {
        String::deserialize(from)?.parse().map_err(D::Error::custom)
    }
}

impl Header {
    /// Returns the first line of a trace, with the keys of [`VERSION`] and without its line break.
    pub fn to_line(&self) -> String {
        serde_json::to_string(self).expect("a header has string keys")
    }

    /// Returns the frame at which the helper takes over from another trace; `None` if it does not.
    pub fn helper_takes_over(&self) -> Option<Frame> {
        let is_person = self.people.iter().any(|person| person.input.is_some());
        self.branch_of.filter(|_| !is_person).map(|branch| branch.frame)
    }

    /// Returns the key of the episode run.
    pub fn key(&self) -> RunKey {
        RunKey {
            task: self.task,
            helper: self.helper.clone(),
            episode: self.episode.clone(),
            seed: self.seed,
        }
    }
}

/// A participant of an episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Participant {
    /// Agent id.
    pub agent: AgentId,
    /// Persona.
    pub persona: Persona,
    /// Additional impairments.
    #[serde(default, skip_serializing_if = "Impairments::is_empty")]
    pub impairments: Impairments,
    /// Grants beyond own images and proprioception.
    pub grants: Grants,
    /// Requested images.
    #[serde(alias = "senses")]
    pub sensors: SensorConfig,
    /// Perception of a built-in agent; absent for the perception `gt` and for agents of other authors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perception: Option<String>,
    /// Confinement of its process, such as `sandbox`; absent for an agent in this process.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub isolation: Option<String>,
    /// Digest of its weights; absent for an agent without trained weights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<String>,
    /// Digest of the recording that it repeats; absent for an agent that repeats none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording: Option<String>,
    /// Level of the decisions if a person controls it, `plans` or `steps`; absent for a program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input: Option<String>,
    /// True if the world did not wait for the decisions of the person.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_live: bool,
}

/// A trace in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Configuration of the episode run.
    pub header: Header,
    /// Records in chronological order.
    pub records: Vec<Record>,
}

impl Trace {
    /// Returns the end of the episode, if the trace is complete.
    pub fn end(&self) -> Option<&End> {
        match self.records.last() {
            Some(Record::End(end)) => Some(end),
            _ => None,
        }
    }

    /// Returns the decisions in order.
    pub fn decisions(&self) -> impl Iterator<Item = &Decision> {
        self.records.iter().filter_map(|r| match r {
            Record::Decision(d) => Some(d),
            _ => None,
        })
    }

    /// Returns the lines of the trace with the keys of its version, without their line breaks.
    pub fn lines(&self) -> impl Iterator<Item = String> {
        let records = self.records.iter().map(Record::to_line);
        let lines = std::iter::once(self.header.to_line()).chain(records);
        lines.map(|line| version::with_keys_of(self.header.version, line))
    }
}

#[cfg(test)]
mod tests;
