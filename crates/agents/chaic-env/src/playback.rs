//! Re-simulation of a trace.

use std::collections::VecDeque;
use std::convert::Infallible;

use chaic_core::agent::{ChildState, Thought};
use chaic_core::{AgentId, Frame};
use chaic_episodes::Episode;
use chaic_world::{Event, World};

use crate::config::world_from_header;
use crate::digest::Digest;
use crate::error::{EnvError, Result};
use crate::step::{ChosenAction, advance, submit_all};
use crate::trace::{Decision, Header, Record, Trace};

/// Re-simulation of a trace: its decisions are submitted again to a world of the same setup.
///
/// [`Playback::step`] advances one frame and refuses a trace that does not fit the world, for
/// programs that show it. [`Playback::next_records`] returns the records that come out, for
/// programs that compare them with the trace.
pub struct Playback<'a> {
    header: &'a Header,
    world: World,
    /// Remaining decisions in order, each with the child's state that the trace has after it.
    decisions: VecDeque<(&'a Decision, Option<ChildState>)>,
    thoughts: Vec<Thought>,
    /// Frame of the trace's end, or of its last decision if it has no end.
    last_frame: Frame,
}

impl<'a> Playback<'a> {
    /// Creates a playback at the first frame of the trace.
    ///
    /// # Errors
    /// If the episode is not the one of the trace.
    pub fn new(trace: &'a Trace, episode: &Episode) -> Result<Playback<'a>> {
        let world = world_from_header(&trace.header, episode)?;
        let n_agents = world.setup().people.len();
        let last_frame = trace.end().map(|e| e.frame);
        let last_frame = last_frame.or_else(|| trace.decisions().last().map(|d| d.frame));
        Ok(Playback {
            header: &trace.header,
            world,
            decisions: decisions(trace),
            thoughts: vec![Thought::default(); n_agents],
            last_frame: last_frame.unwrap_or(0),
        })
    }

    /// Returns the header of the trace.
    pub fn header(&self) -> &'a Header {
        self.header
    }

    /// Returns the world in its current state.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Returns the last recorded thought of each agent.
    pub fn thoughts(&self) -> &[Thought] {
        &self.thoughts
    }

    /// Submits the decisions of the current frame, advances the world by one frame and returns its
    /// events; `None` at the end of the trace.
    ///
    /// # Errors
    /// If the trace does not fit the world: a digest differs, or an agent decides at the wrong time.
    pub fn step(&mut self) -> Result<Option<Vec<Event>>> {
        let frame = self.world.state().frame;
        if self.world.is_over() || frame >= self.last_frame {
            return Ok(None);
        }
        while let Some((d, _)) = self.decisions.pop_front_if(|(d, _)| d.frame == frame) {
            self.note_thought(d);
            let digest = Digest(self.world.digest());
            if digest != d.digest {
                return Err(self.altered(format!(
                    "the state's digest is {} in the trace, {digest} when played again",
                    d.digest
                )));
            }
            self.world.submit(d.agent, d.action).map_err(|e| self.altered(e.to_string()))?;
        }
        if let Some((late, _)) = self.decisions.front().filter(|(d, _)| d.frame <= frame) {
            let problem = format!("a decision of frame {} comes too late", late.frame);
            return Err(self.altered(problem));
        }
        self.world.tick();
        Ok(Some(self.world.drain_events()))
    }

    /// Submits the decisions of the agents that wait now, runs frames until the next agent waits,
    /// and returns the records that come out, without [`Record::End`].
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
        let Ok(()) = submit_all(&mut self.world, choices, &mut sink);
        let Ok(()) = advance(&mut self.world, &mut |_| (), &mut sink);
        Some(records)
    }

    /// Removes the next decisions that belong to this frame and to waiting agents, at most one per
    /// agent.
    fn take_choices(&mut self, waiting: &[AgentId]) -> Vec<ChosenAction> {
        let frame = self.world.state().frame;
        let mut choices: Vec<ChosenAction> = Vec::new();
        while let Some((d, child)) = self.decisions.pop_front_if(|(d, _)| {
            d.frame == frame
                && waiting.contains(&d.agent)
                && !choices.iter().any(|c| c.agent == d.agent)
        }) {
            self.note_thought(d);
            let Decision { agent, action, ref thought, .. } = *d;
            choices.push(ChosenAction { agent, action, thought: thought.clone(), child });
        }
        choices
    }

    fn note_thought(&mut self, decision: &Decision) {
        let slot = self.thoughts.get_mut(decision.agent.index());
        if let (Some(thought), Some(slot)) = (&decision.thought, slot) {
            slot.clone_from(thought);
        }
    }

    fn altered(&self, problem: String) -> EnvError {
        let (episode, frame) = (self.header.episode.clone(), self.world.state().frame);
        EnvError::Altered { episode, frame, problem }
    }
}

/// Returns the decisions of a trace, each with the child's state that the trace has after it.
fn decisions(trace: &Trace) -> VecDeque<(&Decision, Option<ChildState>)> {
    let mut decisions: VecDeque<(&Decision, Option<ChildState>)> = VecDeque::new();
    for record in &trace.records {
        match record {
            Record::Decision(decision) => decisions.push_back((decision, None)),
            Record::Child(child) => {
                if let Some((_, state)) = decisions.back_mut() {
                    *state = Some(child.state);
                }
            }
            Record::Event(_) | Record::End(_) => {}
        }
    }
    decisions
}
