//! Turn of an agent: its state between two actions, and its choice.

use std::collections::VecDeque;

use chaic_core::agent::{ChildState, Thought};
use chaic_core::observation::HistoryFrame;
use chaic_core::{AgentError, AgentId};

use crate::agent_slot::{AgentSlot, Driver};
use crate::observer::RenderedObservation;
use crate::reward::RewardTracker;
use crate::step::ChosenAction;

/// State of an agent between two actions, and data that it keeps during the episode.
#[derive(Clone)]
pub(crate) struct Turn {
    /// True if the agent's action has ended and the next one has not begun.
    pub is_open: bool,
    /// Observation of this turn, once it is rendered.
    pub rendered: Option<RenderedObservation>,
    /// Next action.
    pub choice: Option<ChosenAction>,
    /// Thought and child state as last recorded.
    pub recorded: RecordedState,
    /// Reward state, for external agents.
    pub rewards: RewardTracker,
    /// Images since the last decision, oldest first.
    pub frame_history: VecDeque<HistoryFrame>,
    /// Id buffer for reuse.
    pub spare_ids: Vec<u16>,
}

/// State that an agent reports for the trace.
#[derive(Clone, Default, PartialEq)]
pub(crate) struct RecordedState {
    /// `None` if the trace lacks the agent's last thought.
    pub thought: Option<Thought>,
    /// State of the child, if the agent is the child.
    pub child: Option<ChildState>,
}

impl Turn {
    /// Creates the closed turn of an agent at the start of an episode.
    pub fn new(agent: AgentId) -> Turn {
        Turn {
            is_open: false,
            rendered: None,
            choice: None,
            recorded: RecordedState::default(),
            rewards: RewardTracker::new(agent),
            frame_history: VecDeque::new(),
            spare_ids: Vec::new(),
        }
    }

    /// Ends the turn and returns the agent's next action.
    pub fn close(&mut self) -> Option<ChosenAction> {
        self.is_open = false;
        if let Some(ids) = self.rendered.take().and_then(|rendered| rendered.hidden_ids) {
            self.spare_ids = ids;
        }
        // The agent may have decided without an observation.
        self.frame_history.clear();
        self.choice.take()
    }

    /// Discards the rendered observation, but not its frame history; its images may lie in buffers of
    /// a caller that have changed since.
    pub fn discard_images(&mut self) {
        if let Some(rendered) = self.rendered.take() {
            self.frame_history = rendered.observation.frame_history.into();
        }
    }
}

/// Asks the agent of a slot for its next action; `None` if the caller controls it.
///
/// # Errors
/// If the agent can't decide.
pub(crate) fn choose(
    slot: &mut AgentSlot,
    id: AgentId,
    rendered: &RenderedObservation,
    recorded: &mut RecordedState,
) -> Result<Option<ChosenAction>, AgentError> {
    let Driver::Agent(agent) = &mut slot.driver else { return Ok(None) };
    let chosen = agent.act(&rendered.observation)?;
    let action = rendered.resolve(chosen);
    slot.submitted = Some((chosen, action));
    let state = RecordedState { thought: Some(agent.thought()), child: agent.child_state() };
    let thought = state.thought.clone().filter(|_| state.thought != recorded.thought);
    let child = state.child.filter(|_| state.child != recorded.child);
    *recorded = state;
    Ok(Some(ChosenAction { agent: id, action, thought, child }))
}
