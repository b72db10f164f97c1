//! Numbers of an episode beside the paper's metrics: a table whose rows are folds over what was recorded.
//!
//! A row is all that a further measure takes. It then stands in `results.jsonl`, as the mean over
//! episode runs in `scores.json`, and in every report.

use std::fmt;

use chaic_core::{Action, AgentId, Frame};
use chaic_env::trace::Record;
use chaic_world::EventKind;

/// One measure.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Its name in files.
    pub key: &'static str,
    /// What it is, for the head of a table.
    pub title: &'static str,
    /// Decimals that are shown.
    pub decimals: usize,
    /// A fold that has seen nothing yet.
    pub begin: fn() -> Box<dyn Fold>,
}

/// Reads the records of one episode.
pub trait Fold: fmt::Debug + Send {
    /// Takes in the next record.
    fn take_in(&mut self, record: &Record);

    /// What it comes to at the end; `None` where there is nothing to say.
    fn value(&self) -> Option<f64>;
}

/// All measures, in the order of reports.
pub static MEASURES: [Measure; 3] = [
    Measure {
        key: "first_delivery",
        title: "Frame of the first delivery that counts",
        decimals: 0,
        begin: || Box::new(FirstDelivery(None)),
    },
    Measure {
        key: "partner_failures",
        title: "Share of the partner's attempts to take or put something that failed",
        decimals: 2,
        begin: || Box::new(Failures::of(AgentId::PARTNER)),
    },
    Measure {
        key: "helper_failures",
        title: "Share of the helper's attempts to take or put something that failed",
        decimals: 2,
        begin: || Box::new(Failures::of(AgentId::HELPER)),
    },
];

/// When something wanted was delivered first.
#[derive(Debug)]
struct FirstDelivery(Option<Frame>);

impl Fold for FirstDelivery {
    fn take_in(&mut self, record: &Record) {
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

/// How many of somebody's attempts failed, for whatever reason.
#[derive(Debug)]
struct Failures {
    agent: AgentId,
    attempts: u32,
    failures: u32,
}

impl Failures {
    fn of(agent: AgentId) -> Failures {
        Failures { agent, attempts: 0, failures: 0 }
    }
}

impl Fold for Failures {
    fn take_in(&mut self, record: &Record) {
        if let Record::Event(event) = record
            && let EventKind::Ended { agent, action, outcome } = event.event.kind
            && agent == self.agent
            && !action.is_locomotion()
            && !matches!(action, Action::Wait { .. })
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
    use chaic_core::{EntityId, FailureReason, Hand, Outcome};
    use chaic_env::trace::TraceEvent;
    use chaic_world::Event;

    fn happened(frame: Frame, kind: EventKind) -> Record {
        Record::Event(TraceEvent { event: Event { frame, kind }, class: None })
    }

    fn ended(agent: AgentId, action: Action<EntityId>, outcome: Outcome) -> Record {
        happened(5, EventKind::Ended { agent, action, outcome })
    }

    fn value(key: &str, records: &[Record]) -> Option<f64> {
        let measure = MEASURES.iter().find(|m| m.key == key).expect("it is listed");
        let mut fold = (measure.begin)();
        records.iter().for_each(|record| fold.take_in(record));
        fold.value()
    }

    #[test]
    fn the_first_delivery_that_counts_is_the_first() {
        let (object, by) = (EntityId(40), AgentId::PARTNER);
        let delivered =
            |frame, counted| happened(frame, EventKind::Delivered { object, by, counted });
        let records = [delivered(10, false), delivered(20, true), delivered(30, true)];
        assert_eq!(value("first_delivery", &records), Some(20.0));
        assert_eq!(value("first_delivery", &records[..1]), None);
    }

    #[test]
    fn steps_and_waits_are_no_attempts() {
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        let pick = Action::PickUp { object: EntityId(40), hand: Hand::Left };
        let me = AgentId::PARTNER;
        let records = [
            ended(me, pick, failed),
            ended(me, pick, Outcome::Success),
            ended(me, Action::MoveForward, failed),
            ended(me, Action::Wait { frames: 9 }, Outcome::Success),
            ended(AgentId::HELPER, pick, failed),
        ];
        assert_eq!(value("partner_failures", &records), Some(0.5));
        assert_eq!(value("helper_failures", &records), Some(1.0));
        assert_eq!(value("helper_failures", &records[..4]), None);
    }
}
