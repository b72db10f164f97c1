//! A trace played again, frame by frame.

use std::collections::VecDeque;

use chaic_core::Frame;
use chaic_core::agent::Thought;
use chaic_episodes::Episode;
use chaic_world::{Event, World};

use crate::config::world_of;
use crate::digest::Digest;
use crate::error::{EnvError, Result};
use crate::trace::{Decision, Header, Trace};

/// From a trace to the states of its world, one a frame, and to what its minds said.
///
/// Each decision's digest is compared with the state that comes of those before it, so that an
/// altered trace is refused instead of shown.
pub struct Playback<'a> {
    header: &'a Header,
    world: World,
    /// Those to come, first one first.
    decisions: VecDeque<&'a Decision>,
    thoughts: Vec<Thought>,
    /// The last frame that the trace knows of.
    last: Frame,
}

impl<'a> Playback<'a> {
    /// At the beginning of the trace.
    ///
    /// # Errors
    /// If the episode isn't the one that was played.
    pub fn new(trace: &'a Trace, episode: &Episode) -> Result<Playback<'a>> {
        let world = world_of(&trace.header, episode)?;
        let n = world.setup().people.len();
        let last = trace.end().map(|e| e.frame);
        let last = last.or_else(|| trace.decisions().last().map(|d| d.frame)).unwrap_or(0);
        Ok(Playback {
            header: &trace.header,
            world,
            decisions: trace.decisions().collect(),
            thoughts: vec![Thought::default(); n],
            last,
        })
    }

    /// What was played.
    pub fn header(&self) -> &'a Header {
        self.header
    }

    /// The world as it stands.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// What each agent last said that it thinks, by agent.
    pub fn thoughts(&self) -> &[Thought] {
        &self.thoughts
    }

    /// Lets those who wait do what they did, and one frame pass. Returns what happened; `None` once
    /// there is no more.
    ///
    /// # Errors
    /// If the trace doesn't fit the world, as an altered one does.
    pub fn step(&mut self) -> Result<Option<Vec<Event>>> {
        let frame = self.world.state().frame;
        if self.world.is_over() || frame >= self.last {
            return Ok(None);
        }
        while let Some(d) = self.decisions.pop_front_if(|d| d.frame == frame) {
            if let (Some(thought), Some(slot)) =
                (&d.thought, self.thoughts.get_mut(d.agent.index()))
            {
                slot.clone_from(thought);
            }
            let comes = Digest(self.world.digest());
            if comes != d.digest {
                let said = d.digest;
                return Err(self.differs(format!(
                    "the state's digest is {said} in the trace, {comes} when played again"
                )));
            }
            self.world.submit(d.agent, d.action).map_err(|e| self.differs(e.to_string()))?;
        }
        if let Some(late) = self.decisions.front().filter(|d| d.frame <= frame) {
            return Err(self.differs(format!("a decision of frame {} comes too late", late.frame)));
        }
        self.world.tick();
        Ok(Some(self.world.drain_events()))
    }

    fn differs(&self, problem: String) -> EnvError {
        let (episode, frame) = (self.header.episode.clone(), self.world.state().frame);
        EnvError::Altered { episode, frame, problem }
    }
}
