//! Accumulators of diagnostic metrics.

use std::fmt;

use chaic_core::{AgentId, Frame};
use chaic_env::narration::ActivityKind;
use chaic_env::trace::Record;
use chaic_world::EventKind;

/// Accumulator of the records of one episode run.
pub trait MetricAccumulator: fmt::Debug + Send {
    /// Adds the next record.
    fn add(&mut self, record: &Record);

    /// Returns the value after the last record; `None` if it is undefined.
    fn value(&self) -> Option<f64>;
}

/// Frame of the first delivery that is part of the goal.
#[derive(Debug, Default)]
pub(super) struct FirstDelivery(Option<Frame>);

impl MetricAccumulator for FirstDelivery {
    fn add(&mut self, record: &Record) {
        if let Record::Event(event) = record
            && let EventKind::Delivered { counted: true, .. } = event.event.kind
        {
            self.0.get_or_insert(event.event.frame);
        }
    }

    fn value(&self) -> Option<f64> {
        self.0.map(f64::from)
    }
}

/// Fraction of an agent's manipulation actions that failed, for any reason.
#[derive(Debug)]
pub(super) struct FailureRate {
    agent: AgentId,
    attempts: u32,
    failures: u32,
}

impl FailureRate {
    pub(super) fn new(agent: AgentId) -> FailureRate {
        FailureRate { agent, attempts: 0, failures: 0 }
    }
}

impl MetricAccumulator for FailureRate {
    fn add(&mut self, record: &Record) {
        if let Record::Event(event) = record
            && let EventKind::Ended { agent, action, outcome } = event.event.kind
            && agent == self.agent
            && ActivityKind::of(&action) == ActivityKind::Interact
        {
            self.attempts += 1;
            self.failures += u32::from(!outcome.is_success());
        }
    }

    fn value(&self) -> Option<f64> {
        (self.attempts > 0).then(|| f64::from(self.failures) / f64::from(self.attempts))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Metric;
    use chaic_core::{Action, EntityId, FailureReason, Hand, Outcome};
    use chaic_env::trace::TraceEvent;
    use chaic_world::Event;

    fn event(frame: Frame, kind: EventKind) -> Record {
        Record::Event(TraceEvent { event: Event { frame, kind }, class: None })
    }

    fn ended(agent: AgentId, action: Action<EntityId>, outcome: Outcome) -> Record {
        event(5, EventKind::Ended { agent, action, outcome })
    }

    fn value(key: &str, records: &[Record]) -> Option<f64> {
        let metric = Metric::from_key(key);
        let mut accumulator = metric.accumulator().expect("a diagnostic metric");
        records.iter().for_each(|record| accumulator.add(record));
        accumulator.value()
    }

    #[test]
    fn the_first_delivery_is_the_first_that_counts() {
        let (object, by) = (EntityId(40), AgentId::PARTNER);
        let delivered = |frame, counted| event(frame, EventKind::Delivered { object, by, counted });
        let records = [delivered(10, false), delivered(20, true), delivered(30, true)];
        assert_eq!(value("first_delivery", &records), Some(20.0));
        assert_eq!(value("first_delivery", &records[..1]), None);
    }

    #[test]
    fn movement_and_waiting_are_no_attempts() {
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        let pick = Action::PickUp { object: EntityId(40), hand: Hand::Left };
        let partner = AgentId::PARTNER;
        let records = [
            ended(partner, pick, failed),
            ended(partner, pick, Outcome::Success),
            ended(partner, Action::MoveForward, failed),
            ended(partner, Action::Wait { frames: 9 }, Outcome::Success),
            ended(AgentId::HELPER, pick, failed),
        ];
        assert_eq!(value("partner_failures", &records), Some(0.5));
        assert_eq!(value("helper_failures", &records), Some(1.0));
        assert_eq!(value("helper_failures", &records[..4]), None);
    }
}
