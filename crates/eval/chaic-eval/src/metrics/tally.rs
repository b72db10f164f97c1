//! From the records of one episode to its result.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::agent::ChildState;
use chaic_core::{AgentId, ClassId, EntityId, Frame};
use chaic_env::RunKey;
use chaic_env::trace::{End, Header, Record, Trace};
use chaic_world::EventKind;

use crate::metrics::{Delivery, Ending, Fold, MEASURES, RunResult, Summary};

/// Reads records one by one.
#[derive(Debug)]
pub struct Tally {
    key: RunKey,
    has_child: bool,
    /// Things whose last carrying was a joint one.
    together: BTreeSet<EntityId>,
    /// Things that the helper has taken at some time.
    taken_by_helper: BTreeSet<EntityId>,
    deliveries: Vec<Delivery>,
    escape: Escape,
    /// One for each measure.
    folds: Vec<Box<dyn Fold>>,
}

/// The child's escapes as the original counts them (facts S8.4): by the child's decisions.
#[derive(Clone, Copy, Debug, Default)]
struct Escape {
    /// Whether it runs away, as of its last decision.
    is_running: bool,
    /// Whether it is far from its guardian now.
    is_away: bool,
    /// When it decided last.
    decided: Frame,
    /// Frames counted so far.
    frames: u32,
}

impl Escape {
    fn decides(&mut self, frame: Frame) {
        if self.is_running && self.is_away {
            self.frames += frame - self.decided;
        }
        self.decided = frame;
    }

    /// All frames counted, with those left when the episode ends, wherever the child is then.
    fn total(&self, end: Frame) -> u32 {
        self.frames + if self.is_running { end - self.decided } else { 0 }
    }
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
            escape: Escape::default(),
            folds: MEASURES.iter().map(|measure| (measure.begin)()).collect(),
        }
    }

    /// Takes in a record; the last one of an episode gives the result.
    pub fn record(&mut self, record: &Record) -> Option<RunResult> {
        self.folds.iter_mut().for_each(|fold| fold.take_in(record));
        match record {
            Record::Decision(decision) => {
                if decision.agent == AgentId::CHILD {
                    self.escape.decides(decision.frame);
                }
                None
            }
            Record::Child(child) => {
                self.escape.is_running = child.state == ChildState::RunAway;
                None
            }
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
            EventKind::ChildAway { away } => self.escape.is_away = away,
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
                escape_frames: self.has_child.then(|| self.escape.total(end.frame)),
                stuck_frames: Some(end.stuck_frames),
                deliveries: self.deliveries.clone(),
                digest: end.digest,
                counts: BTreeMap::new(),
                measures: self.measures(),
            }),
        }
    }

    fn measures(&self) -> BTreeMap<String, f64> {
        let folded = MEASURES.iter().zip(&self.folds);
        folded.filter_map(|(m, fold)| Some((m.key.to_owned(), fold.value()?))).collect()
    }
}

/// The result that a whole trace leads to; `None` if its end is missing.
pub fn tally(trace: &Trace) -> Option<RunResult> {
    let mut tally = Tally::new(&trace.header);
    trace.records.iter().fold(None, |last, record| tally.record(record).or(last))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escapes_are_counted_by_the_childs_decisions_and_to_the_end() {
        let mut escape = Escape::default();
        let mut decides = |frame, is_running, is_away| {
            escape.is_away = is_away;
            escape.decides(frame);
            escape.is_running = is_running;
            (escape.frames, escape.total(200))
        };
        // Frames so far, and those counted if the episode ended at frame 200.
        assert_eq!(decides(0, false, true), (0, 0), "away, but not on the run");
        assert_eq!(decides(50, true, false), (0, 150));
        assert_eq!(decides(70, true, false), (0, 130), "on the run, but still near");
        assert_eq!(decides(90, true, true), (20, 130));
        assert_eq!(decides(120, false, true), (50, 50));
        assert_eq!(decides(150, false, true), (50, 50), "on the way back");
    }
}
