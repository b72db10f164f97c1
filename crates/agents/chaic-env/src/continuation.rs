//! Continuation of a trace by another helper.

use std::collections::VecDeque;
use std::sync::atomic::AtomicBool;

use chaic_agents::PlannerRules;
use chaic_core::agent::Thought;
use chaic_core::memory_view::MemoryView;
use chaic_core::observation::SensorConfig;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Frame, Observation, Target};
use chaic_episodes::Episode;

use crate::agent_slot::EpisodeAgents;
use crate::config::EpisodeConfig;
use crate::env::Env;
use crate::error::EnvError;
use crate::helper_registry::{BuiltInHelpers, Helper, HelperRegistry, find};
use crate::playback::Playback;
use crate::trace::{BranchPoint, Decision, Header, Record, Trace, parse};

/// Reason why a trace cannot be continued.
#[derive(Debug, thiserror::Error)]
pub enum ContinuationError {
    /// The trace is unreadable or is of another episode, or the helper is unknown.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// An agent cannot decide.
    #[error(transparent)]
    Agent(#[from] AgentError),
    /// The helper cannot take over, or the partner cannot act again.
    #[error("{0}")]
    Agents(String),
    /// The trace ends before the frame.
    #[error("the trace ends at frame {last_frame}; take an earlier frame than {from}")]
    End {
        /// Wanted frame.
        from: Frame,
        /// Last frame of the trace.
        last_frame: Frame,
    },
    /// The agents act differently than in the trace, such as those of another version.
    #[error("the other agents do not act as in the trace before frame {0}; take an earlier frame")]
    Diverged(Frame),
}

/// Plays an episode again as in a trace (JSON lines) up to a frame, from which on the helper `name`
/// decides. The helper observes all earlier turns ([`Agent::observe`]). Returns a new trace whose `branch_of`
/// names the original trace.
///
/// Seed, rules, appearance and image size are those of the original trace. The partner acts again by its rules.
/// The records before the frame are those of the original trace, with an empty first thought if its helper
/// recorded none.
///
/// # Errors
/// [`ContinuationError`] if the trace is unreadable or altered, ends before the frame, or has no helper or
/// a partner that cannot act again. Also if the helper is unknown, has no grant of ids or cannot decide.
pub fn continue_with(
    bytes: &[u8],
    episode: &Episode,
    from: Frame,
    name: &str,
    helpers: &dyn HelperRegistry,
) -> Result<Trace, ContinuationError> {
    let (trace, _) = parse(bytes, "trace".as_ref())?;
    let header = &trace.header;
    let agents = EpisodeAgents::new(
        Some(new_helper(&trace, from, name, helpers)?),
        named_partner(header, helpers)?,
    );
    let image_size = header.people.first().map(|partner| partner.sensors.image_size);
    let config = EpisodeConfig {
        episode,
        seed: header.seed,
        rules: header.rules,
        helper: name,
        partner: header.partner.as_deref(),
        image_size,
        appearance: header.appearance,
    };
    let playback = Playback::new(&trace, episode)?;
    let last_frame = playback.last_frame();
    if from >= last_frame {
        return Err(ContinuationError::End { from, last_frame });
    }
    let expected = playback.digest_at(from)?;
    let mut env = Env::new(config, agents)?;
    let mut records = Vec::new();
    let mut sink = |record: &Record| {
        records.push(record.clone());
        Ok::<(), AgentError>(())
    };
    while env.world().state().frame < from && !env.world().is_over() {
        env.run_frame(&mut sink)?;
    }
    if env.digest() != expected {
        return Err(ContinuationError::Diverged(from));
    }
    env.run(&AtomicBool::new(false), None, &mut sink)?;
    let branch_of = Some(BranchPoint::new(bytes, from));
    Ok(Trace { header: Header { branch_of, ..env.header().clone() }, records })
}

/// Returns the helper that takes over.
fn new_helper(
    trace: &Trace,
    from: Frame,
    name: &str,
    helpers: &dyn HelperRegistry,
) -> Result<Helper, ContinuationError> {
    let refused = |problem: &str| Err(ContinuationError::Agents(problem.to_owned()));
    if !trace.header.people.iter().any(|person| person.agent == AgentId::HELPER) {
        return refused("the trace has no helper whom another one could replace");
    }
    match find(helpers, name, trace.header.rules.planner)? {
        Some(helper) if helper.grants.ids => Ok(repeating(helper, trace, from)),
        Some(_) => refused("the helper has no grant of ids, which recorded actions need"),
        None => refused("name a helper that takes over"),
    }
}

/// Returns a helper that repeats the decisions of a trace up to a frame, and decides from there on.
fn repeating(helper: Helper, trace: &Trace, from: Frame) -> Helper {
    let before = |decision: &&Decision| decision.agent == AgentId::HELPER && decision.frame < from;
    let decisions = trace.decisions().filter(before).cloned().collect();
    let Helper { agent, grants } = helper;
    let agent = Successor { agent, decisions, from, thought: Some(Thought::default()) };
    Helper { agent: Box::new(agent), grants }
}

/// Built-in helpers that take over in a trace: before, they repeat its decisions.
pub struct Successors<'a> {
    trace: &'a Trace,
    from: Frame,
}

impl Successors<'_> {
    /// Returns the helpers if the helper of a trace took over, as in one of [`continue_with`].
    pub fn of(trace: &Trace) -> Option<Successors<'_>> {
        trace.header.helper_takes_over().map(|from| Successors { trace, from })
    }
}

impl HelperRegistry for Successors<'_> {
    fn names(&self) -> Vec<String> {
        BuiltInHelpers.names()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        Some(repeating(BuiltInHelpers.make(name, rules)?, self.trace, self.from))
    }
}

/// Returns the partner of a trace, if it deviates from the rules.
fn named_partner(
    header: &Header,
    helpers: &dyn HelperRegistry,
) -> Result<Option<Helper>, ContinuationError> {
    let Some(name) = &header.partner else { return Ok(None) };
    let partner = helpers.partner(name, Some(&header.key()), header.rules.planner);
    let unknown =
        || ContinuationError::Agents(format!("the partner `{name}` cannot act again here"));
    partner.map(Some).ok_or_else(unknown)
}

/// Helper that repeats recorded decisions up to a frame, and observes meanwhile.
struct Successor {
    agent: Box<dyn Agent>,
    /// Decisions to be repeated.
    decisions: VecDeque<Decision>,
    from: Frame,
    /// Recorded thought; `None` once the agent decides.
    thought: Option<Thought>,
}

impl Agent for Successor {
    fn sensors(&self) -> SensorConfig {
        self.agent.sensors()
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.agent.reset(briefing);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let frame = observation.frame;
        if frame >= self.from {
            self.thought = None;
            return self.agent.act(observation);
        }
        self.agent.observe(observation);
        let due = self.decisions.pop_front_if(|decision| decision.frame == frame);
        let Some(decision) = due else {
            // The partner engages the helper in a joint lift in this frame, which replaces any action.
            return Ok(Action::Wait { frames: 1 });
        };
        self.thought = decision.thought.or(self.thought.take());
        Ok(decision.action.map(Target::Entity))
    }

    fn perception(&self) -> Option<String> {
        self.agent.perception()
    }

    fn isolation(&self) -> Option<String> {
        self.agent.isolation()
    }

    fn weights(&self) -> Option<String> {
        self.agent.weights()
    }

    fn recording(&self) -> Option<String> {
        self.agent.recording()
    }

    fn thought(&self) -> Thought {
        self.thought.clone().unwrap_or_else(|| self.agent.thought())
    }

    fn memory_view(&self) -> Option<MemoryView> {
        self.agent.memory_view()
    }
}

#[cfg(test)]
mod tests;
