//! Steps of an episode and the records that they give, for [`Env::run`](crate::Env::run) and
//! [`Playback`](crate::Playback).

use chaic_core::agent::{ChildState, Thought};
use chaic_core::{AgentId, ResolvedAction};
use chaic_world::World;

use crate::digest::Digest;
use crate::trace::{ChildRecord, Decision, Record, TraceEvent, is_recorded};

/// An agent's next action, with the changes of its state that a trace records.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ChosenAction {
    /// The agent.
    pub agent: AgentId,
    /// Its action.
    pub action: ResolvedAction,
    /// The agent's thought, if it changed.
    pub thought: Option<Thought>,
    /// The child's state, if the agent is the child and the state changed.
    pub child: Option<ChildState>,
}

/// Submits the actions that agents chose in one frame, in order, and passes the records to `sink`.
///
/// Drops the action of an agent that an earlier action has engaged in a joint lift. Returns the
/// agents of dropped actions whose thought had changed.
///
/// # Errors
/// Those of `sink`.
pub(crate) fn submit_all<E>(
    world: &mut World,
    choices: Vec<ChosenAction>,
    sink: &mut dyn FnMut(&Record) -> Result<(), E>,
) -> Result<Vec<AgentId>, E> {
    let frame = world.state().frame;
    let mut without_thought = Vec::new();
    for ChosenAction { agent, action, thought, child } in choices {
        // An earlier action of this frame may have engaged this agent already.
        if world.waiting().contains(&agent) {
            let digest = Digest(world.digest());
            sink(&Record::Decision(Decision { frame, agent, action, digest, thought }))?;
            world.submit(agent, action).expect("the agent waits");
        } else if thought.is_some() {
            without_thought.push(agent);
        }
        if let Some(state) = child {
            sink(&Record::Child(ChildRecord { frame, state }))?;
        }
    }
    Ok(without_thought)
}

/// Passes the recorded events since the last call to `sink`.
///
/// # Errors
/// Those of `sink`.
pub(crate) fn record_events<E>(
    world: &mut World,
    sink: &mut dyn FnMut(&Record) -> Result<(), E>,
) -> Result<(), E> {
    for event in world.drain_events().into_iter().filter(is_recorded) {
        sink(&Record::Event(TraceEvent::new(event, world)))?;
    }
    Ok(())
}
