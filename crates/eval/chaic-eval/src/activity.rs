//! Time by activity and failures by reason, from traces.

use std::collections::BTreeMap;

use chaic_core::{AgentId, Frame, Outcome};
use chaic_env::narration::ActivityKind;
use chaic_env::trace::{Record, Trace};
use chaic_world::EventKind;

/// Activities of one agent, summed over traces.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ActivityTotals {
    /// Frames from each decision to the next one of the agent, by kind of the decided action.
    pub frames: BTreeMap<ActivityKind, u64>,
    /// Number of attempts to pick up, put down or remove something.
    pub attempts: u64,
    /// Number of failed attempts by reason.
    pub failures: BTreeMap<String, u64>,
}

impl ActivityTotals {
    /// Adds what `agent` does in a trace.
    pub fn add(&mut self, trace: &Trace, agent: AgentId) {
        let mut last = None;
        for record in &trace.records {
            match record {
                Record::Decision(decision) if decision.agent == agent => {
                    self.add_time(last, decision.frame);
                    last = Some((decision.frame, ActivityKind::of(&decision.action)));
                }
                Record::Event(event) => self.add_event(&event.event.kind, agent),
                Record::End(end) => self.add_time(last.take(), end.frame),
                _ => {}
            }
        }
    }

    fn add_time(&mut self, last: Option<(Frame, ActivityKind)>, until: Frame) {
        if let Some((frame, kind)) = last {
            *self.frames.entry(kind).or_default() += u64::from(until.saturating_sub(frame));
        }
    }

    fn add_event(&mut self, event: &EventKind, of: AgentId) {
        let EventKind::Ended { agent, action, outcome } = event else { return };
        if *agent != of || ActivityKind::of(action) != ActivityKind::Interact {
            return;
        }
        self.attempts += 1;
        if let Outcome::Failure(reason) = outcome {
            *self.failures.entry(reason.to_string()).or_default() += 1;
        }
    }

    /// Returns the fraction of time that an activity takes; zero without any time.
    pub fn fraction(&self, kind: ActivityKind) -> f64 {
        let total: u64 = self.frames.values().sum();
        let frames = self.frames.get(&kind).copied().unwrap_or(0);
        if total == 0 { 0.0 } else { frames as f64 / total as f64 }
    }
}

#[cfg(test)]
mod tests;
