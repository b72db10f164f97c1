//! Computation of an episode run's result from its records.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::agent::ChildState;
use chaic_core::{AgentId, ClassId, EntityId, Frame};
use chaic_env::RunKey;
use chaic_env::trace::{End, Header, Record, Trace};
use chaic_world::EventKind;

use crate::metrics::accumulators::MetricAccumulator;
use crate::metrics::table::Metric;
use crate::metrics::{Delivery, RunResult, RunStatus, Summary};

/// Accumulator of the records of one episode run.
#[derive(Debug)]
pub struct ResultAccumulator {
    key: RunKey,
    has_child: bool,
    /// Objects that partner and helper carried together when they were last carried.
    together: BTreeSet<EntityId>,
    /// Objects that the helper has held at some time.
    taken_by_helper: BTreeSet<EntityId>,
    deliveries: Vec<Delivery>,
    escape: Escape,
    /// Keys and accumulators of the diagnostic metrics.
    diagnostics: Vec<(&'static str, Box<dyn MetricAccumulator>)>,
}

/// The child's escapes as the original counts them (facts S8.4): by the child's decisions.
#[derive(Clone, Copy, Debug, Default)]
struct Escape {
    /// True if the child runs away, as of its last decision.
    is_running: bool,
    /// True if the child is away from its guardian now.
    is_away: bool,
    /// Frame of its last decision.
    last_decision: Frame,
    /// Frames counted so far.
    frames: u32,
}

impl Escape {
    fn add_decision(&mut self, frame: Frame) {
        if self.is_running && self.is_away {
            // An altered trace may not be in order.
            let frames = frame.saturating_sub(self.last_decision);
            self.frames = self.frames.saturating_add(frames);
        }
        self.last_decision = frame;
    }

    /// Returns all counted frames. The frames from the last decision to the end count if the child
    /// ran then, even if it was not away.
    fn total(&self, end: Frame) -> u32 {
        let last = if self.is_running { end.saturating_sub(self.last_decision) } else { 0 };
        self.frames.saturating_add(last)
    }
}

impl ResultAccumulator {
    /// Creates an accumulator for the trace with this header.
    pub fn new(header: &Header) -> ResultAccumulator {
        ResultAccumulator {
            key: header.key(),
            has_child: header.people.iter().any(|p| p.agent == AgentId::CHILD),
            together: BTreeSet::new(),
            taken_by_helper: BTreeSet::new(),
            deliveries: Vec::new(),
            escape: Escape::default(),
            diagnostics: Metric::diagnostics()
                .filter_map(|metric| Some((metric.key, metric.accumulator()?)))
                .collect(),
        }
    }

    /// Adds a record; returns the result after the last record of an episode.
    pub fn add(&mut self, record: &Record) -> Option<RunResult> {
        self.diagnostics.iter_mut().for_each(|(_, accumulator)| accumulator.add(record));
        match record {
            Record::Decision(decision) => {
                if decision.agent == AgentId::CHILD {
                    self.escape.add_decision(decision.frame);
                }
                None
            }
            Record::Child(child) => {
                self.escape.is_running = child.state == ChildState::RunAway;
                None
            }
            Record::Event(event) => {
                self.add_event(&event.event.kind, event.event.frame, event.class);
                None
            }
            Record::End(end) => Some(self.result(end)),
        }
    }

    fn add_event(&mut self, kind: &EventKind, frame: u32, class: Option<ClassId>) {
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
                // A trace of this version always has the class.
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
            status: RunStatus::Done(Summary {
                frames: end.frame,
                done: end.done,
                total: end.total,
                away_frames: self.has_child.then_some(end.away_frames),
                escape_frames: self.has_child.then(|| self.escape.total(end.frame)),
                stuck_frames: Some(end.stuck_frames),
                deliveries: self.deliveries.clone(),
                digest: end.digest,
                counts: BTreeMap::new(),
                diagnostics: self.diagnostic_values(),
            }),
        }
    }

    fn diagnostic_values(&self) -> BTreeMap<String, f64> {
        let values = self.diagnostics.iter();
        values.filter_map(|(key, a)| Some(((*key).to_owned(), a.value()?))).collect()
    }
}

/// Returns the result of a complete trace; `None` if its end is missing.
pub fn result_of_trace(trace: &Trace) -> Option<RunResult> {
    let mut tally = ResultAccumulator::new(&trace.header);
    trace.records.iter().fold(None, |last, record| tally.add(record).or(last))
}

#[cfg(test)]
mod tests {
    use chaic_env::{Digest, EpisodeConfig, trace_header};
    use chaic_episodes::find_episode;

    use super::*;

    /// Returns the header of an episode without helper and child.
    fn header() -> Header {
        let episode = find_episode("low_target/test/01").unwrap();
        trace_header(EpisodeConfig::new(&episode, "none"), None).unwrap()
    }

    fn end() -> End {
        let (frame, digest) = (90, Digest(1));
        let (away_frames, stuck_frames) = (7, 5);
        End { frame, done: 1.0, total: 3.0, complete: false, away_frames, stuck_frames, digest }
    }

    #[test]
    fn deliveries_name_the_work_of_the_helper() {
        let (partner, helper, child) = (AgentId::PARTNER, AgentId::HELPER, AgentId::CHILD);
        let object = EntityId(40);
        let taken = |agent| EventKind::Taken { agent, object };
        let lifted = |leader, follower| EventKind::LiftedTogether { leader, follower, object };
        // Whether the object was carried together, and whether the helper has held it.
        for (events, expected) in [
            (vec![taken(partner)], (false, false)),
            (vec![taken(helper), taken(partner)], (false, true)),
            (vec![lifted(partner, helper)], (true, true)),
            (vec![lifted(helper, partner)], (true, true)),
            (vec![lifted(partner, child)], (false, false)),
            (vec![lifted(partner, helper), taken(partner)], (false, true)),
        ] {
            let mut tally = ResultAccumulator::new(&header());
            let delivered = EventKind::Delivered { object, by: partner, counted: true };
            events.iter().for_each(|kind| tally.add_event(kind, 20, None));
            tally.add_event(&delivered, 30, Some(ClassId::named("apple")));
            let [delivery] = &tally.deliveries[..] else { panic!("{:?}", tally.deliveries) };
            assert_eq!((delivery.together, delivery.handed), expected, "{events:?}");
            assert_eq!((delivery.frame, delivery.by, delivery.counted), (30, partner, true));
        }
    }

    #[test]
    fn only_episodes_with_a_child_have_frames_of_its_absence() {
        let alone = header();
        let mut with_child = alone.clone();
        with_child.people.push(alone.people[0].clone());
        with_child.people[1].agent = AgentId::CHILD;
        for (header, away, escape) in [(alone, None, None), (with_child, Some(7), Some(0))] {
            let result = ResultAccumulator::new(&header).add(&Record::End(end())).unwrap();
            let summary = result.summary().unwrap();
            assert_eq!((summary.away_frames, summary.escape_frames), (away, escape));
            assert_eq!((summary.frames, summary.stuck_frames), (90, Some(5)));
        }
    }

    #[test]
    fn escapes_are_counted_between_the_childs_decisions_and_to_the_end() {
        let mut escape = Escape::default();
        let mut decide = |frame, is_running, is_away| {
            escape.is_away = is_away;
            escape.add_decision(frame);
            escape.is_running = is_running;
            (escape.frames, escape.total(200))
        };
        // Counted frames, and the total if the episode ended at frame 200.
        assert_eq!(decide(0, false, true), (0, 0), "away, but not running");
        assert_eq!(decide(50, true, false), (0, 150));
        assert_eq!(decide(70, true, false), (0, 130), "running, but still near");
        assert_eq!(decide(90, true, true), (20, 130));
        assert_eq!(decide(120, false, true), (50, 50));
        assert_eq!(decide(150, false, true), (50, 50), "on the way back");
        assert_eq!(decide(160, true, true), (50, 90));
        assert_eq!(decide(100, true, true), (50, 150), "an altered trace goes back in time");
    }
}
