//! Explanations of recorded episodes: what a helper believed and planned, when and why.
//!
//! [`explain`] reads a trace and the setup of its episode, and steps no world. Callers verify the
//! trace first, because it may be altered.

mod sentences;
mod timeline;

use std::path::PathBuf;

use chaic_core::agent::PartnerBelief;
use chaic_core::capability::Persona;
use chaic_core::catalogue::TargetSet;
use chaic_core::{AgentId, Frame};
use chaic_env::RunKey;
use chaic_env::trace::{Record, Trace};
use chaic_world::{EventKind, Setup};
use serde::Serialize;

use crate::error::Result;
use crate::recorded_belief::{
    beliefs, identified, most_likely, per_mille_of, true_person, true_set,
};
use crate::replay;
use crate::run::RunFolder;

/// Helper that is explained if none is named and the run has it.
const PREFERRED_HELPER: &str = "infer";

/// Returns the path of the trace to explain. Without `helper`, it selects `infer` if the run has
/// it, and else the same helper as [`replay::find_trace`].
///
/// # Errors
/// Those of [`replay::find_trace`].
pub fn find_trace(
    folder: &RunFolder,
    traces: &[PathBuf],
    episode: &str,
    helper: Option<&str>,
    seed: Option<u32>,
) -> Result<PathBuf> {
    match helper {
        Some(_) => replay::find_trace(folder, traces, episode, helper, seed),
        None => replay::find_trace(folder, traces, episode, Some(PREFERRED_HELPER), seed)
            .or_else(|_| replay::find_trace(folder, traces, episode, None, seed)),
    }
}

/// Explanation of one episode run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// The episode run.
    #[serde(flatten)]
    pub key: RunKey,
    /// True if the helper records its belief.
    pub records_belief: bool,
    /// Changes in chronological order.
    pub timeline: Vec<TimelineEntry>,
    /// Result of the episode, and the last belief.
    pub end: EndSummary,
}

/// A change at one frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TimelineEntry {
    /// Frame.
    pub frame: Frame,
    /// The change.
    #[serde(flatten)]
    pub change: TimelineChange,
    /// The change as sentences.
    pub text: String,
}

/// Change of a belief or plan, or an event. Probabilities are per mille.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum TimelineChange {
    /// The first belief.
    FirstBelief {
        /// Target sets.
        goals: Vec<(String, u16)>,
        /// Kinds of person.
        people: Vec<(String, u16)>,
    },
    /// New or retracted observations of the partner.
    Evidence {
        /// New observations.
        added: Vec<String>,
        /// Observations that no longer count.
        retracted: Vec<String>,
        /// Most likely target set, if its probability has changed.
        #[serde(skip_serializing_if = "Option::is_none")]
        goal: Option<HypothesisChange>,
    },
    /// The most likely target set is another one, or its probability crosses a threshold.
    Goal(HypothesisChange),
    /// The same for the kind of person.
    Person(HypothesisChange),
    /// The mode or the first planned operation is another one.
    Plan {
        /// New mode, if it has changed.
        #[serde(skip_serializing_if = "Option::is_none")]
        mode: Option<ModeChange>,
        /// Planned operations, or the current plan of a helper that records none.
        operations: Vec<String>,
    },
    /// An object was delivered.
    Delivered {
        /// Role of the agent that delivered it.
        by: &'static str,
        /// Label and id of the object.
        object: String,
        /// True if it counts toward the goal.
        counted: bool,
    },
    /// An attempt failed.
    Failed {
        /// Role of the agent.
        agent: &'static str,
        /// The action.
        action: String,
        /// Reason of the failure.
        reason: String,
    },
    /// Another event of the world.
    Event {
        /// Description of the event.
        event: String,
    },
}

/// Change of the most likely hypothesis, probabilities per mille.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct HypothesisChange {
    /// Most likely hypothesis.
    pub hypothesis: String,
    /// Its probability.
    pub probability: u16,
    /// Its probability in the last entry that has one.
    pub previous: u16,
}

/// Change of the mode.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ModeChange {
    /// Previous mode.
    pub from: String,
    /// New mode.
    pub to: String,
    /// True if the most likely target set is identified.
    pub goal_is_clear: bool,
}

/// Result of an episode run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EndSummary {
    /// Last frame of the trace.
    pub frame: Frame,
    /// Delivered and wanted amounts: objects, or kilograms when moving house. `None` if the trace is
    /// cut off.
    pub progress: Option<[f64; 2]>,
    /// Last belief about the target set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal: Option<FinalBelief>,
    /// Last belief about the kind of person.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub person: Option<FinalBelief>,
    /// Frame from which the true target set stays identified.
    pub identified: Option<Frame>,
    /// Deliveries by the partner.
    pub partner: DeliveryCounts,
    /// Deliveries by the helper.
    pub helper: DeliveryCounts,
}

/// Last belief and the truth, probabilities per mille.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FinalBelief {
    /// Most likely hypothesis.
    pub believed: String,
    /// Its probability.
    pub probability: u16,
    /// True hypothesis, if it is known.
    #[serde(rename = "true")]
    pub truth: Option<&'static str>,
    /// Its probability.
    pub true_probability: u16,
}

/// Deliveries of one agent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct DeliveryCounts {
    /// All deliveries.
    pub all: u32,
    /// Deliveries that count toward the goal.
    pub counted: u32,
}

/// Explains a trace of an episode with this setup.
pub fn explain(trace: &Trace, setup: &Setup) -> Explanation {
    let changes = timeline::changes(trace, setup);
    let entry = |(frame, change): (Frame, TimelineChange)| {
        let text = sentences::describe(&change);
        TimelineEntry { frame, change, text }
    };
    Explanation {
        key: trace.header.key(),
        records_belief: beliefs(trace).next().is_some(),
        timeline: changes.into_iter().map(entry).collect(),
        end: end_summary(trace, setup),
    }
}

impl Explanation {
    /// Returns the explanation as text; it ends with a line break.
    pub fn text(&self) -> String {
        sentences::text(self)
    }
}

fn end_summary(trace: &Trace, setup: &Setup) -> EndSummary {
    let last = beliefs(trace).last().map(|(_, belief)| belief);
    let set = last.and_then(|belief| true_set(&setup.goal, belief)).map(TargetSet::name);
    let person = true_person(&trace.header).map(Persona::name);
    let final_belief = |distribution: &[(String, u16)], truth: Option<&'static str>| {
        let (believed, probability) = most_likely(distribution)?;
        let true_probability = truth.map_or(0, |name| per_mille_of(distribution, name));
        Some(FinalBelief { believed: believed.to_owned(), probability, truth, true_probability })
    };
    let of_last = |select: fn(&PartnerBelief) -> &[(String, u16)], truth| {
        last.and_then(|belief| final_belief(select(belief), truth))
    };
    let end = trace.end();
    EndSummary {
        frame: end.map_or_else(|| last_frame(trace), |end| end.frame),
        progress: end.map(|end| [end.done, end.total]),
        goal: of_last(|belief| &belief.goals, set),
        person: of_last(|belief| &belief.people, person),
        identified: set.and_then(|set| identified(trace, set)),
        partner: deliveries(trace, AgentId::PARTNER),
        helper: deliveries(trace, AgentId::HELPER),
    }
}

/// Returns the frame of the last decision.
fn last_frame(trace: &Trace) -> Frame {
    trace.decisions().last().map_or(0, |decision| decision.frame)
}

/// Counts the deliveries of possible targets by an agent; containers are not counted.
fn deliveries(trace: &Trace, agent: AgentId) -> DeliveryCounts {
    let mut counts = DeliveryCounts::default();
    for record in &trace.records {
        if let Record::Event(event) = record
            && let EventKind::Delivered { by, counted, .. } = event.event.kind
            && by == agent
            && event.class.is_some_and(|class| class.info().is_possible_target())
        {
            counts.all += 1;
            counts.counted += u32::from(counted);
        }
    }
    counts
}

#[cfg(test)]
mod tests;
