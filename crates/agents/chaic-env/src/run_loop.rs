//! The loop that every episode runs through, be it played or played again.

use chaic_core::agent::{ChildState, Thought};
use chaic_core::{AgentId, ResolvedAction};
use chaic_world::World;

use crate::digest::Digest;
use crate::trace::{ChildRecord, Decision, End, Record, TraceEvent, is_recorded};

/// What somebody chose to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Who.
    pub agent: AgentId,
    /// What.
    pub action: ResolvedAction,
    /// What it thought, if that changed.
    pub thought: Option<Thought>,
    /// What it is doing, if it is the child and that changed.
    pub child: Option<ChildState>,
}

/// Who chooses for everybody, and looks on meanwhile.
pub trait Players<E> {
    /// Chooses for those who wait; `None` to stop.
    ///
    /// # Errors
    /// If it can't.
    fn decide(&mut self, world: &World, waiting: &[AgentId]) -> Result<Option<Vec<Choice>>, E>;

    /// A frame has passed.
    fn look_on(&mut self, _: &World) {}
}

impl<E, F> Players<E> for F
where
    F: FnMut(&World, &[AgentId]) -> Result<Option<Vec<Choice>>, E>,
{
    fn decide(&mut self, world: &World, waiting: &[AgentId]) -> Result<Option<Vec<Choice>>, E> {
        self(world, waiting)
    }
}

/// Asks the players whenever somebody waits, submits the choices in their order, lets frames pass,
/// and hands `sink` all that is worth recording, until the episode ends or the players stop.
///
/// All who wait in one frame choose before any of them acts.
///
/// # Errors
/// Those of the players and `sink`.
pub fn run_loop<E>(
    world: &mut World,
    players: &mut dyn Players<E>,
    sink: &mut dyn FnMut(&Record) -> Result<(), E>,
) -> Result<bool, E> {
    while !world.is_over() {
        let waiting = world.waiting();
        if !waiting.is_empty() {
            let Some(choices) = players.decide(world, &waiting)? else { return Ok(false) };
            for choice in choices {
                let state = choice.child;
                submit(world, choice, sink)?;
                if let Some(state) = state {
                    sink(&Record::Child(ChildRecord { frame: world.state().frame, state }))?;
                }
            }
        }
        world.advance_watched(&mut |world| players.look_on(world));
        for event in world.drain_events().into_iter().filter(is_recorded) {
            sink(&Record::Event(TraceEvent::new(event, world)))?;
        }
    }
    sink(&Record::End(End::of(world)))?;
    Ok(true)
}

fn submit<E>(
    world: &mut World,
    Choice { agent, action, thought, .. }: Choice,
    sink: &mut dyn FnMut(&Record) -> Result<(), E>,
) -> Result<(), E> {
    // Another's choice of this frame may have given this agent something to do already.
    if !world.waiting().contains(&agent) {
        return Ok(());
    }
    let (frame, digest) = (world.state().frame, Digest(world.digest()));
    sink(&Record::Decision(Decision { frame, agent, action, digest, thought }))?;
    world.submit(agent, action).expect("the agent waits");
    Ok(())
}
