//! Agent whose decisions are made in another process.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_core::agent::{PartnerBelief, Thought};
use chaic_core::observation::SensorConfig;
use chaic_core::{Action, Agent, AgentError, Briefing, Observation};
use chaic_sandbox::Isolation;

use crate::message::{
    MAX_THOUGHT_ENTRIES, PROTOCOL, RequestMessage, ResponseMessage, cut, observation_frame, plain,
};
use crate::pool::Pool;
use crate::process::HelperProcess;
use crate::program::HelperProgram;

/// Agent in another process. The process ends with its episode, or serves the next one from a [`Pool`].
pub struct SubprocessAgent {
    command: Arc<HelperProgram>,
    pool: Option<Arc<Pool>>,
    stop: &'static AtomicBool,
    state: State,
}

enum State {
    Idle,
    Running {
        process: Box<HelperProcess>,
        sensors: SensorConfig,
        thought: Thought,
    },
    /// The process failed.
    Failed(AgentError),
}

impl SubprocessAgent {
    /// Creates an agent that starts the command for each episode. Setting `stop` ends all waiting.
    pub fn new(command: Arc<HelperProgram>, stop: &'static AtomicBool) -> SubprocessAgent {
        SubprocessAgent { command, pool: None, stop, state: State::Idle }
    }

    /// Creates an agent whose process comes from a pool and returns there unless it failed.
    pub fn pooled(
        command: Arc<HelperProgram>,
        pool: Arc<Pool>,
        stop: &'static AtomicBool,
    ) -> SubprocessAgent {
        SubprocessAgent { command, pool: Some(pool), stop, state: State::Idle }
    }

    /// Ends the episode: returns the process to the pool, or ends it.
    fn finish(&mut self) {
        let state = std::mem::replace(&mut self.state, State::Idle);
        if let (Some(pool), State::Running { process, .. }) = (&self.pool, state) {
            pool.put(*process);
        }
    }

    /// Takes a process from the pool, or starts one.
    fn process(&self) -> Result<HelperProcess, AgentError> {
        if let Some(process) = self.pool.as_ref().and_then(|pool| pool.take()) {
            return Ok(process);
        }
        SubprocessAgent::start(&self.command, self.stop).map(|(process, _)| process)
    }

    /// Starts a process and exchanges `hello`; returns the process and its name.
    pub(crate) fn start(
        command: &Arc<HelperProgram>,
        stop: &'static AtomicBool,
    ) -> Result<(HelperProcess, String), AgentError> {
        let mut process = HelperProcess::start(command, stop)?;
        let hello = RequestMessage::Hello {
            protocol: PROTOCOL,
            chaic: chaic_env::CHAIC_VERSION.to_owned(),
        };
        match process.ask(plain(&hello), command.limits.start)? {
            ResponseMessage::Hello { protocol: PROTOCOL, name } => Ok((process, name)),
            ResponseMessage::Hello { protocol, .. } => Err(AgentError::Broken(format!(
                "`{}` speaks version {protocol} of the protocol, this chaic speaks version {PROTOCOL}; \
                 update the helper as docs/subprocess-helpers.md describes",
                command.label()
            ))),
            other => Err(unexpected(command, "hello", &other)),
        }
    }

    /// Briefs a process; returns the sensors that it requests.
    pub(crate) fn brief(
        process: &mut HelperProcess,
        command: &HelperProgram,
        briefing: &Briefing,
    ) -> Result<SensorConfig, AgentError> {
        let reset = RequestMessage::Reset { briefing: Box::new(briefing.clone()) };
        match process.ask(plain(&reset), command.limits.start)? {
            ResponseMessage::Ready { sensors } => {
                let sensors = SensorConfig::from(sensors);
                let refused = |text| AgentError::Broken(format!("`{}` {text}", command.label()));
                sensors.check_counts().map(|()| sensors).map_err(refused)
            }
            other => Err(unexpected(command, "reset", &other)),
        }
    }

    /// Sends an observation to a process; returns its action and thought.
    pub(crate) fn ask(
        process: &mut HelperProcess,
        command: &HelperProgram,
        observation: &Observation,
    ) -> Result<(Action, Option<Thought>), AgentError> {
        match process.ask(observation_frame(observation), command.limits.decision)? {
            ResponseMessage::Act { action, thought } => Ok((action, thought.map(bounded))),
            other => Err(unexpected(command, "observe", &other)),
        }
    }
}

/// Returns the thought with shortened texts and lists.
fn bounded(thought: Thought) -> Thought {
    let Thought { plan, mode, last_observed, mut perceived, belief } = thought;
    perceived.truncate(MAX_THOUGHT_ENTRIES);
    perceived.iter_mut().for_each(|object| object.name = cut(&object.name));
    Thought {
        plan: cut(&plan),
        mode: mode.as_deref().map(cut),
        last_observed: last_observed.as_deref().map(cut),
        perceived,
        belief: belief.map(|belief| Box::new(bounded_belief(*belief))),
    }
}

fn bounded_belief(belief: PartnerBelief) -> PartnerBelief {
    let texts =
        |list: &[String]| list.iter().take(MAX_THOUGHT_ENTRIES).map(|text| cut(text)).collect();
    let chances = |list: &[(String, u16)]| {
        list.iter().take(MAX_THOUGHT_ENTRIES).map(|(name, p)| (cut(name), (*p).min(1000))).collect()
    };
    PartnerBelief {
        goals: chances(&belief.goals),
        people: chances(&belief.people),
        extra: belief.extra.into_iter().take(MAX_THOUGHT_ENTRIES).collect(),
        position_cm: belief.position_cm,
        evidence: texts(&belief.evidence),
        plan: texts(&belief.plan),
        partner_plan: texts(&belief.partner_plan),
    }
}

fn unexpected(command: &HelperProgram, request: &str, answer: &ResponseMessage) -> AgentError {
    let kind = match answer {
        ResponseMessage::Hello { .. } => "hello",
        ResponseMessage::Ready { .. } => "ready",
        ResponseMessage::Act { .. } => "act",
        ResponseMessage::Failed { .. } => "failed",
    };
    AgentError::Broken(format!("`{}` answered `{request}` with `{kind}`", command.label()))
}

impl Agent for SubprocessAgent {
    fn sensors(&self) -> SensorConfig {
        match &self.state {
            State::Running { sensors, .. } => *sensors,
            State::Idle | State::Failed(_) => SensorConfig::NONE,
        }
    }

    fn reset(&mut self, briefing: &Briefing) {
        // Release the process of the last episode before the next one starts.
        self.finish();
        let briefed = self.process().and_then(|mut process| {
            let sensors = SubprocessAgent::brief(&mut process, &self.command, briefing)?;
            Ok((process, sensors))
        });
        self.state = match briefed {
            Ok((process, sensors)) => {
                let process = Box::new(process);
                State::Running { process, sensors, thought: Thought::default() }
            }
            Err(error) => State::Failed(error),
        };
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        match &mut self.state {
            State::Idle => Err(AgentError::Broken("the agent was not briefed".to_owned())),
            State::Failed(error) => Err(error.clone()),
            State::Running { process, thought, .. } => {
                match SubprocessAgent::ask(process, &self.command, observation) {
                    Ok((action, new_thought)) => {
                        *thought = new_thought.unwrap_or_default();
                        Ok(action)
                    }
                    Err(error) => {
                        self.state = State::Failed(error.clone());
                        Err(error)
                    }
                }
            }
        }
    }

    fn isolation(&self) -> Option<String> {
        let confinement = self.command.confinement.as_ref();
        Some(confinement.map_or(Isolation::Trusted, |c| c.isolation().clone()).to_string())
    }

    fn thought(&self) -> Thought {
        match &self.state {
            State::Running { thought, .. } => thought.clone(),
            State::Idle | State::Failed(_) => Thought::default(),
        }
    }
}

impl Drop for SubprocessAgent {
    fn drop(&mut self) {
        self.finish();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_belief_is_kept_with_bounded_lists_texts_and_probabilities() {
        let many = MAX_THOUGHT_ENTRIES + 1;
        let long = "x".repeat(100_000);
        let belief = PartnerBelief {
            goals: vec![(long.clone(), 60_000); many],
            people: vec![("child".to_owned(), 700); 2],
            evidence: vec![long.clone(); many],
            plan: vec![long; many],
            position_cm: Some([120, -35]),
            ..PartnerBelief::default()
        };
        let thought = Thought { belief: Some(Box::new(belief)), ..Thought::default() };
        let kept = *bounded(thought).belief.expect("it is kept");
        assert_eq!((kept.people.len(), kept.position_cm), (2, Some([120, -35])));
        assert_eq!(kept.people[0], ("child".to_owned(), 700));
        assert_eq!(
            [kept.goals.len(), kept.evidence.len(), kept.plan.len()],
            [MAX_THOUGHT_ENTRIES; 3]
        );
        assert!(kept.goals.iter().all(|(name, p)| name.len() < 10_000 && *p == 1000));
        assert!(kept.evidence.iter().chain(&kept.plan).all(|text| text.len() < 10_000));
    }
}
