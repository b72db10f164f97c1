//! What is kept of one episode run: a line of `results.jsonl`, and all that scores are made of.

use std::collections::BTreeMap;

use chaic_core::{AgentId, ClassId, EntityId, Frame, Role, TaskId};
use chaic_env::{Digest, RunKey};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};

/// What became of one episode run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunResult {
    /// Which.
    #[serde(flatten)]
    pub key: RunKey,
    /// How it ended.
    #[serde(flatten)]
    pub ending: Ending,
}

/// How an episode run ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case", deny_unknown_fields)]
pub enum Ending {
    /// It was played to its end.
    Done(Summary),
    /// An agent broke down, which counts as zero.
    Error {
        /// What it said.
        message: String,
    },
}

/// What scores need to know of an episode run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Summary {
    /// Frames that passed.
    pub frames: Frame,
    /// What is done of what was wanted: objects, or kilograms when moving house.
    pub done: f64,
    /// All that was wanted.
    pub total: f64,
    /// Frames in which the child was away; absent without child.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub away_frames: Option<u32>,
    /// Frames of its escapes as the original counts them: while it ran away by its own decision and was
    /// away; absent without child.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub escape_frames: Option<u32>,
    /// Frames in which the partner or the helper had made no progress for 200 frames; absent in
    /// results of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stuck_frames: Option<u32>,
    /// Everything that was delivered, in order.
    pub deliveries: Vec<Delivery>,
    /// Digest of the world's last state.
    pub digest: Digest,
    /// What minds counted of their own doings, as `AGENT.NAME`; absent where nobody counts. No
    /// trace has it, and no score rests on it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub counts: BTreeMap<String, u64>,
    /// What each of the [`MEASURES`](crate::metrics::MEASURES) came to, by its key; those with nothing
    /// to say, and all in results of older versions, are absent.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub measures: BTreeMap<String, f64>,
}

/// One thing that was delivered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Delivery {
    /// When.
    pub frame: Frame,
    /// The thing.
    pub object: EntityId,
    /// Its class.
    pub class: ClassId,
    /// Who let it go there.
    pub by: AgentId,
    /// Whether it was wanted and not yet there often enough.
    pub counted: bool,
    /// Whether partner and helper carried it together.
    #[serde(default, skip_serializing_if = "is_false")]
    pub together: bool,
    /// Whether the helper had taken it before, whoever delivered it.
    #[serde(default, skip_serializing_if = "is_false")]
    pub handed: bool,
}

// `skip_serializing_if` hands over a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_false(b: &bool) -> bool {
    !b
}

impl<'de> Deserialize<'de> for RunResult {
    /// By hand, as a flattened field takes unknown names in silence: what is not of the key must be
    /// of the ending.
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<RunResult, D::Error> {
        let mut ending = Map::deserialize(from)?;
        let key: Map<String, Value> =
            RunKey::FIELDS.iter().filter_map(|name| ending.remove_entry(*name)).collect();
        Ok(RunResult {
            key: RunKey::deserialize(Value::Object(key)).map_err(D::Error::custom)?,
            ending: Ending::deserialize(Value::Object(ending)).map_err(D::Error::custom)?,
        })
    }
}

impl RunResult {
    /// The summary of a run that was played to its end.
    pub fn summary(&self) -> Option<&Summary> {
        match &self.ending {
            Ending::Done(summary) => Some(summary),
            Ending::Error { .. } => None,
        }
    }

    /// Whether its numbers can be those of an episode.
    pub(crate) fn check(&self) -> Result<(), String> {
        self.summary().map_or(Ok(()), Summary::check)
    }
}

impl Summary {
    fn check(&self) -> Result<(), String> {
        /// Masses are sums of numbers that are rounded.
        const ROUNDING: f64 = 1e-6;
        let Summary { frames, done, total, .. } = *self;
        for (name, n) in [("done", done), ("total", total)] {
            if !(n.is_finite() && n >= 0.0) {
                return Err(format!("`{name}` is {n}, expected a number from 0 on"));
            }
        }
        if done > total * (1.0 + ROUNDING) {
            return Err(format!("`done` is {done}, expected at most `total`, {total}"));
        }
        let within = [
            ("away_frames", self.away_frames),
            ("escape_frames", self.escape_frames),
            ("stuck_frames", self.stuck_frames),
        ];
        if let Some((name, n)) = self.measures.iter().find(|(_, n)| !n.is_finite()) {
            return Err(format!("`measures.{name}` is {n}, expected a number"));
        }
        let late = self.deliveries.iter().map(|d| d.frame).max();
        let within = within.into_iter().chain([("frame of a delivery", late)]);
        for (name, n) in within.filter_map(|(name, n)| Some((name, n?))) {
            if n > frames {
                return Err(format!("`{name}` is {n}, expected at most `frames`, {frames}"));
            }
        }
        Ok(())
    }

    /// The transport rate: what is done of what was wanted.
    pub fn rate(&self) -> f64 {
        if self.total > 0.0 { self.done / self.total } else { 0.0 }
    }
}

impl Delivery {
    /// Whether it is the helper's: let go by the helper, or carried with its hands too.
    pub fn is_helpers(&self) -> bool {
        self.by == AgentId::HELPER || self.together
    }

    /// Whether it could be a target at all; containers and vehicles are only means.
    pub fn is_goods(&self) -> bool {
        matches!(self.class.info().role, Role::Target | Role::Fragile | Role::HeavyTarget)
    }

    /// What it counts for in this task.
    pub fn worth(&self, task: TaskId) -> f64 {
        task.info().worth.of(self.class)
    }
}
