//! From the records of one episode to its result.

use std::collections::BTreeSet;

use chaic_protocol::{AgentId, ClassId, EntityId};
use chaic_world::EventKind;

use crate::metrics::{Delivery, Ending, RunKey, RunResult, Summary};
use crate::trace::{End, Header, Record, Trace};

/// Reads records one by one.
#[derive(Clone, Debug)]
pub struct Tally {
    key: RunKey,
    has_child: bool,
    /// Things whose last carrying was a joint one.
    together: BTreeSet<EntityId>,
    /// Things that the helper has taken at some time.
    taken_by_helper: BTreeSet<EntityId>,
    deliveries: Vec<Delivery>,
}

impl Tally {
    /// For the trace of this header.
    pub fn new(header: &Header) -> Tally {
        Tally {
            key: header.key(),
            has_child: header.people.iter().any(|p| p.agent == AgentId::CHILD),
            together: BTreeSet::new(),
            taken_by_helper: BTreeSet::new(),
            deliveries: Vec::new(),
        }
    }

    /// Takes in a record; the last one of an episode gives the result.
    pub fn record(&mut self, record: &Record) -> Option<RunResult> {
        match record {
            Record::Decision(_) => None,
            Record::Event(event) => {
                self.event(&event.event.kind, event.event.frame, event.class);
                None
            }
            Record::End(end) => Some(self.result(end)),
        }
    }

    fn event(&mut self, kind: &EventKind, frame: u32, class: Option<ClassId>) {
        match *kind {
            EventKind::Taken { agent, object } => {
                self.together.remove(&object);
                if agent == AgentId::HELPER {
                    self.taken_by_helper.insert(object);
                }
            }
            EventKind::LiftedTogether { leader, follower, object }
                if [leader, follower].contains(&AgentId::HELPER) =>
            {
                self.together.insert(object);
                self.taken_by_helper.insert(object);
            }
            EventKind::Delivered { object, by, counted } => {
                // A trace of this version always names the class.
                let Some(class) = class else { return };
                let together = self.together.contains(&object);
                let handed = self.taken_by_helper.contains(&object);
                let delivery = Delivery { frame, object, class, by, counted, together, handed };
                self.deliveries.push(delivery);
            }
            _ => {}
        }
    }

    fn result(&self, end: &End) -> RunResult {
        RunResult {
            key: self.key.clone(),
            ending: Ending::Done(Summary {
                frames: end.frame,
                done: end.done,
                total: end.total,
                away_frames: self.has_child.then_some(end.away_frames),
                deliveries: self.deliveries.clone(),
                digest: end.digest,
            }),
        }
    }
}

/// The result that a whole trace leads to; `None` if its end is missing.
pub fn tally(trace: &Trace) -> Option<RunResult> {
    let mut tally = Tally::new(&trace.header);
    trace.records.iter().fold(None, |last, record| tally.record(record).or(last))
}
