//! What happened in one episode, as lines that are only ever appended.
//!
//! A trace is JSON lines: a [`Header`], then [`Record`]s in the order in which they happened, the
//! last of which is an [`End`]. `docs/reference/trace.md` describes the format for other programs.

mod parse;
mod record;

pub use parse::{MAX_TRACE_BYTES, Warning, parse};
pub use record::{ChildRecord, Decision, End, Record, TraceEvent, is_recorded};

use chaic_core::capability::{Impairments, Persona};
use chaic_core::observation::{Grants, Senses};
use chaic_core::{AgentId, TaskId};
use chaic_render::Appearance;
use serde::{Deserialize, Serialize};

use crate::digest::Digest;
use crate::key::RunKey;
use crate::rules::RuleSet;

/// What the field `format` of a header says.
pub const FORMAT: &str = "chaic-trace";
/// The version of the format.
pub const VERSION: u32 = 2;

/// What was played, under which rules, and what everybody was told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Always [`FORMAT`].
    pub format: String,
    /// Always [`VERSION`].
    pub version: u32,
    /// The version of the program that played.
    pub chaic: String,
    /// The task.
    pub task: TaskId,
    /// The episode's id.
    pub episode: String,
    /// Digest of the episode's setup as it stands in its file.
    pub setup: Digest,
    /// Which of the run's seeds; 0 is the episode's own.
    pub seed: u32,
    /// The seed that the world was played with.
    pub world_seed: u64,
    /// The rules.
    pub rules: RuleSet,
    /// The helper's name; `none` where the partner is alone.
    pub helper: String,
    /// The name of the partner's mind; absent for the rule-based one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partner: Option<String>,
    /// Who took part, by agent.
    pub people: Vec<Participant>,
    /// What made the images; only `cpu` gives the same on every machine.
    pub renderer: String,
    /// How what eyes see was lit and colored; absent for the benchmark's own look.
    #[serde(default, skip_serializing_if = "is_canonical", with = "as_text")]
    pub appearance: Appearance,
}

// `skip_serializing_if` hands over a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_canonical(appearance: &Appearance) -> bool {
    *appearance == Appearance::Canonical
}

/// An appearance as the command line has it.
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
    /// The first line of a trace, without its line break.
    pub fn to_line(&self) -> String {
        serde_json::to_string(self).expect("a header has string keys")
    }

    /// The episode run that this is the trace of.
    pub fn key(&self) -> RunKey {
        RunKey {
            task: self.task,
            helper: self.helper.clone(),
            episode: self.episode.clone(),
            seed: self.seed,
        }
    }
}

/// Somebody who takes part in an episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Participant {
    /// Who.
    pub agent: AgentId,
    /// What kind of person.
    pub persona: Persona,
    /// What impairs it besides.
    #[serde(default, skip_serializing_if = "Impairments::is_empty")]
    pub impairments: Impairments,
    /// What it is granted beyond own images and state.
    pub grants: Grants,
    /// Which images it looks at.
    pub senses: Senses,
    /// By what it tells what is in them; absent where that is granted or its author's affair.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perception: Option<String>,
    /// How the process of its mind is confined, such as `sandbox`; absent for a mind within this process.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub isolation: Option<String>,
}

/// A whole trace in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// What was played.
    pub header: Header,
    /// What happened.
    pub records: Vec<Record>,
}

impl Trace {
    /// How it ended, if the trace goes so far.
    pub fn end(&self) -> Option<&End> {
        match self.records.last() {
            Some(Record::End(end)) => Some(end),
            _ => None,
        }
    }

    /// The decisions in order.
    pub fn decisions(&self) -> impl Iterator<Item = &Decision> {
        self.records.iter().filter_map(|r| match r {
            Record::Decision(d) => Some(d),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests;
