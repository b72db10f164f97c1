//! Re-simulation of a trace.

use std::convert::Infallible;
use std::ops::Deref;
use std::sync::Arc;

use chaic_core::agent::{ChildState, Thought};
use chaic_core::{AgentId, Frame};
use chaic_episodes::Episode;
use chaic_world::{Event, World};

use crate::config::world_from_header;
use crate::digest::Digest;
use crate::error::{EnvError, Result};
use crate::step::{ChosenAction, record_events, submit_all};
use crate::trace::{Decision, Header, Record, Trace};

/// Re-simulation of a trace: its decisions are submitted again to a world of the same setup.
///
/// [`Playback::step`] advances one frame and refuses a trace that does not fit the world, for
/// programs that show the trace. [`Playback::next_records`] returns the resulting records, for
/// programs that compare them with the trace.
///
/// `T` is a reference to a trace or a shared trace. A clone is a copy of the current state, from which
/// the playback continues.
#[derive(Clone)]
pub struct Playback<T> {
    trace: T,
    world: World,
    /// All decisions in order.
    decisions: Arc<[RecordedDecision]>,
    /// Number of decisions that were submitted.
    n_submitted: usize,
    thoughts: Vec<Thought>,
    /// Frame of the trace's end, or of its last decision if it has no end.
    last_frame: Frame,
}

/// Decision in a trace.
#[derive(Clone, Copy, Debug)]
struct RecordedDecision {
    /// Index of its record.
    record: usize,
    /// State of the child that the trace has after it.
    child: Option<ChildState>,
}

impl<T: Deref<Target = Trace>> Playback<T> {
    /// Creates a playback at the first frame of the trace.
    ///
    /// # Errors
    /// If the episode is not the one of the trace.
    pub fn new(trace: T, episode: &Episode) -> Result<Playback<T>> {
        let world = world_from_header(&trace.header, episode)?;
        let n_agents = world.setup().people.len();
        let last_frame = trace.end().map(|e| e.frame);
        let last_frame = last_frame.or_else(|| trace.decisions().last().map(|d| d.frame));
        Ok(Playback {
            decisions: decisions(&trace).into(),
            trace,
            world,
            n_submitted: 0,
            thoughts: vec![Thought::default(); n_agents],
            last_frame: last_frame.unwrap_or(0),
        })
    }

    /// Returns the header of the trace.
    pub fn header(&self) -> &Header {
        &self.trace.header
    }

    /// Returns the frame of the trace's end, or of its last decision if it has no end.
    pub fn last_frame(&self) -> Frame {
        self.last_frame
    }

    /// Returns the number of decisions so far. [`Playback::step`] counts only those at which the
    /// state's digest is that of the trace.
    pub fn n_decisions(&self) -> usize {
        self.n_submitted
    }

    /// Returns the world in its current state.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Returns the last recorded thought of each agent.
    pub fn thoughts(&self) -> &[Thought] {
        &self.thoughts
    }

    /// Returns the decisions that the next [`Playback::step`] submits.
    pub fn due_decisions(&self) -> impl Iterator<Item = &Decision> {
        let frame = self.world.state().frame;
        let next = self.decisions.iter().skip(self.n_submitted);
        next.map_while(|next| decision(&self.trace, *next)).take_while(move |d| d.frame == frame)
    }

    /// Returns the digest of the state at a frame, or at the end if that comes first.
    ///
    /// # Errors
    /// If the trace does not fit the world.
    pub fn digest_at(mut self, frame: Frame) -> Result<Digest> {
        while self.world.state().frame < frame && self.step()?.is_some() {}
        Ok(Digest(self.world.digest()))
    }

    /// Submits the decisions of the current frame, advances the world by one frame and returns its
    /// events; `None` at the end of the trace.
    ///
    /// # Errors
    /// If the trace does not fit the world: a digest differs, or an agent decides at the wrong time.
    pub fn step(&mut self) -> Result<Option<Vec<Event>>> {
        let frame = self.world.state().frame;
        if self.world.is_over() {
            return Ok(None);
        }
        while let Some(next) = self.next_decision().filter(|next| next.frame == frame) {
            let (digest, recorded) = (Digest(self.world.digest()), next.digest);
            if digest != recorded {
                return Err(self.altered(format!(
                    "the state's digest is {recorded} in the trace, {digest} when played again"
                )));
            }
            let Some(ChosenAction { agent, action, .. }) = self.next_choice(|_| true) else {
                break;
            };
            self.world.submit(agent, action).map_err(|e| self.altered(e.to_string()))?;
        }
        if let Some(late) = self.next_decision().map(|d| d.frame).filter(|late| *late <= frame) {
            return Err(self.altered(format!("a decision of frame {late} comes too late")));
        }
        if frame >= self.last_frame {
            return Ok(None);
        }
        self.world.tick();
        Ok(Some(self.world.drain_events()))
    }

    /// Submits the decisions of the agents that wait now, runs frames until the next agent waits,
    /// and returns the resulting records, without [`Record::End`].
    ///
    /// Returns `None` once the episode is over, or if the trace has no decision for the agents that
    /// wait.
    pub fn next_records(&mut self) -> Option<Vec<Record>> {
        if self.world.is_over() {
            return None;
        }
        let waiting = self.world.waiting();
        let choices = self.take_choices(&waiting);
        if choices.is_empty() && !waiting.is_empty() {
            return None;
        }
        let mut records = Vec::new();
        let mut sink = |record: &Record| {
            records.push(record.clone());
            Ok::<(), Infallible>(())
        };
        let Ok(_) = submit_all(&mut self.world, choices, &mut sink);
        self.world.advance();
        let Ok(()) = record_events(&mut self.world, &mut sink);
        Some(records)
    }

    /// Removes the next decisions that belong to this frame and to waiting agents, at most one per
    /// agent.
    fn take_choices(&mut self, waiting: &[AgentId]) -> Vec<ChosenAction> {
        let frame = self.world.state().frame;
        let mut choices: Vec<ChosenAction> = Vec::new();
        while let Some(choice) = self.next_choice(|d| {
            let is_waiting = waiting.contains(&d.agent);
            d.frame == frame && is_waiting && !choices.iter().any(|c| c.agent == d.agent)
        }) {
            choices.push(choice);
        }
        choices
    }

    fn next_decision(&self) -> Option<&Decision> {
        self.decisions.get(self.n_submitted).and_then(|next| decision(&self.trace, *next))
    }

    /// Takes the next decision if `accepts` returns true for it, and notes its thought.
    fn next_choice(&mut self, accepts: impl Fn(&Decision) -> bool) -> Option<ChosenAction> {
        let next = *self.decisions.get(self.n_submitted)?;
        let decision = decision(&self.trace, next).filter(|decision| accepts(decision))?;
        let Decision { agent, action, ref thought, .. } = *decision;
        let thought = thought.clone();
        if let (Some(thought), Some(slot)) = (&thought, self.thoughts.get_mut(agent.index())) {
            slot.clone_from(thought);
        }
        self.n_submitted += 1;
        Some(ChosenAction { agent, action, thought, child: next.child })
    }

    fn altered(&self, problem: String) -> EnvError {
        let (episode, frame) = (self.header().episode.clone(), self.world.state().frame);
        EnvError::Altered { episode, frame, problem }
    }
}

fn decision(trace: &Trace, recorded: RecordedDecision) -> Option<&Decision> {
    match trace.records.get(recorded.record) {
        Some(Record::Decision(decision)) => Some(decision),
        _ => None,
    }
}

/// Returns the decisions of a trace, each with the child's state that the trace has after it.
fn decisions(trace: &Trace) -> Vec<RecordedDecision> {
    let mut decisions: Vec<RecordedDecision> = Vec::new();
    for (record, content) in trace.records.iter().enumerate() {
        match content {
            Record::Decision(_) => decisions.push(RecordedDecision { record, child: None }),
            Record::Child(child) => {
                if let Some(last) = decisions.last_mut() {
                    last.child = Some(child.state);
                }
            }
            Record::Event(_) | Record::End(_) => {}
        }
    }
    decisions
}
