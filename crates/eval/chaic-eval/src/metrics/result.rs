//! Result of one episode run: a line of `results.jsonl`, and the input of all scores.

use std::collections::BTreeMap;

use chaic_core::{AgentId, ClassId, EntityId, Frame, TaskId};
use chaic_env::{Digest, RunKey};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};

/// Result of one episode run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunResult {
    /// The episode run.
    #[serde(flatten)]
    pub key: RunKey,
    /// Status and summary.
    #[serde(flatten)]
    pub status: RunStatus,
}

/// Final status of an episode run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case", deny_unknown_fields)]
pub enum RunStatus {
    /// The run was played to its end.
    Done(Summary),
    /// An agent failed. The run counts as zero.
    Error {
        /// Error message.
        message: String,
    },
}

/// Data of a completed episode run that scores need.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Summary {
    /// Number of frames.
    pub frames: Frame,
    /// Delivered part of the goal: objects, or kilograms when moving house.
    pub done: f64,
    /// Size of the goal, in the same unit.
    pub total: f64,
    /// Frames in which the child was away; absent without child.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub away_frames: Option<u32>,
    /// Frames of the child's escapes as the original counts them: the child was away and ran by its
    /// own decision. Absent without child.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub escape_frames: Option<u32>,
    /// Frames in which the partner or the helper had made no progress for 200 frames; absent in
    /// results of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stuck_frames: Option<u32>,
    /// All deliveries in order.
    pub deliveries: Vec<Delivery>,
    /// Digest of the last state of the world.
    pub digest: Digest,
    /// Counters that agents report of themselves, as `AGENT.NAME`; absent without counters. They
    /// are not in traces, and no score depends on them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub counts: BTreeMap<String, u64>,
    /// Values of the diagnostic metrics of [`METRICS`](crate::metrics::METRICS), by key. Undefined
    /// values are absent, as are all values in results of older versions.
    #[serde(default, rename = "measures", skip_serializing_if = "BTreeMap::is_empty")]
    pub diagnostics: BTreeMap<String, f64>,
}

/// Delivery of one object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Delivery {
    /// Frame of the delivery.
    pub frame: Frame,
    /// Delivered object.
    pub object: EntityId,
    /// Class of the object.
    pub class: ClassId,
    /// Agent that released it.
    pub by: AgentId,
    /// True if the object was part of the goal and not yet delivered often enough.
    pub counted: bool,
    /// True if partner and helper carried it together.
    #[serde(default, skip_serializing_if = "is_false")]
    pub together: bool,
    /// True if the helper had held it before, regardless of who delivered it.
    #[serde(default, skip_serializing_if = "is_false")]
    pub handed: bool,
}

// `skip_serializing_if` passes a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_false(b: &bool) -> bool {
    !b
}

impl<'de> Deserialize<'de> for RunResult {
    /// Implemented by hand because a flattened field accepts unknown names. All fields must belong
    /// to the key or to the status.
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<RunResult, D::Error> {
        let mut status = Map::deserialize(from)?;
        let key: Map<String, Value> =
            RunKey::FIELDS.iter().filter_map(|name| status.remove_entry(*name)).collect();
        Ok(RunResult {
            key: RunKey::deserialize(Value::Object(key)).map_err(D::Error::custom)?,
            status: RunStatus::deserialize(Value::Object(status)).map_err(D::Error::custom)?,
        })
    }
}

impl RunResult {
    /// Returns the summary of a run that was played to its end.
    pub fn summary(&self) -> Option<&Summary> {
        match &self.status {
            RunStatus::Done(summary) => Some(summary),
            RunStatus::Error { .. } => None,
        }
    }

    /// Checks that the values are possible in an episode.
    pub(crate) fn check(&self) -> Result<(), String> {
        self.summary().map_or(Ok(()), Summary::check)
    }
}

impl Summary {
    fn check(&self) -> Result<(), String> {
        /// Masses are sums of rounded values.
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
        let frame_counts = [
            ("away_frames", self.away_frames),
            ("escape_frames", self.escape_frames),
            ("stuck_frames", self.stuck_frames),
        ];
        if let Some((name, n)) = self.diagnostics.iter().find(|(_, n)| !n.is_finite()) {
            return Err(format!("`measures.{name}` is {n}, expected a number"));
        }
        let last_delivery = self.deliveries.iter().map(|d| d.frame).max();
        let frame_counts = frame_counts.into_iter().chain([("frame of a delivery", last_delivery)]);
        for (name, n) in frame_counts.filter_map(|(name, n)| Some((name, n?))) {
            if n > frames {
                return Err(format!("`{name}` is {n}, expected at most `frames`, {frames}"));
            }
        }
        Ok(())
    }

    /// Returns the transport rate: the delivered fraction of the goal.
    pub fn rate(&self) -> f64 {
        if self.total > 0.0 { self.done / self.total } else { 0.0 }
    }
}

impl Delivery {
    /// Returns whether the delivery counts for the helper: released by it, or carried by both.
    pub fn is_by_helper(&self) -> bool {
        self.by == AgentId::HELPER || self.together
    }

    /// Returns whether the object can be a target. Containers and vehicles can't.
    pub fn is_target_class(&self) -> bool {
        self.class.info().is_possible_target()
    }

    /// Returns the value of the object in this task.
    pub fn value(&self, task: TaskId) -> f64 {
        task.info().target_value.value(self.class)
    }
}
