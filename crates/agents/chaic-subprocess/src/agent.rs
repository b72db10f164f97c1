//! A mind whose decisions are made in another process.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_core::agent::Thought;
use chaic_core::observation::Senses;
use chaic_core::{Action, Agent, AgentError, Briefing, Observation};
use chaic_sandbox::Isolation;

use crate::commands::Command;
use crate::message::{MAX_SEES, PROTOCOL, ToEnv, ToMind, cut, observation_frame, plain};
use crate::pool::Pool;
use crate::process::Process;

/// A mind in another process. The process ends with its episode, or serves the next one from a [`Pool`].
pub struct SubprocessAgent {
    command: Arc<Command>,
    pool: Option<Arc<Pool>>,
    stop: &'static AtomicBool,
    state: State,
}

enum State {
    Idle,
    Running {
        process: Box<Process>,
        senses: Senses,
        thought: Thought,
    },
    /// It couldn't be started or briefed.
    Lost(AgentError),
}

impl SubprocessAgent {
    /// A mind that runs this command for each of its episodes. `stop` raised ends its waiting.
    pub fn new(command: Arc<Command>, stop: &'static AtomicBool) -> SubprocessAgent {
        SubprocessAgent { command, pool: None, stop, state: State::Idle }
    }

    /// A mind whose process comes from a pool and goes back there, unless it failed.
    pub fn pooled(
        command: Arc<Command>,
        pool: Arc<Pool>,
        stop: &'static AtomicBool,
    ) -> SubprocessAgent {
        SubprocessAgent { command, pool: Some(pool), stop, state: State::Idle }
    }

    /// Ends the episode: the process goes back to the pool, or ends.
    fn finish(&mut self) {
        let state = std::mem::replace(&mut self.state, State::Idle);
        if let (Some(pool), State::Running { process, .. }) = (&self.pool, state) {
            pool.put(*process);
        }
    }

    /// Takes a process from the pool, or starts one.
    fn process(&self) -> Result<Process, AgentError> {
        if let Some(process) = self.pool.as_ref().and_then(|pool| pool.take()) {
            return Ok(process);
        }
        SubprocessAgent::start(&self.command, self.stop).map(|(process, _)| process)
    }

    /// Starts a process and makes its acquaintance; what it calls itself.
    pub(crate) fn start(
        command: &Arc<Command>,
        stop: &'static AtomicBool,
    ) -> Result<(Process, String), AgentError> {
        let mut process = Process::start(command, stop)?;
        let hello =
            ToMind::Hello { protocol: PROTOCOL, chaic: chaic_env::CHAIC_VERSION.to_owned() };
        match process.ask(plain(&hello), command.limits.start)? {
            ToEnv::Hello { protocol: PROTOCOL, name } => Ok((process, name)),
            ToEnv::Hello { protocol, .. } => Err(AgentError::Broken(format!(
                "`{}` speaks version {protocol} of the protocol, this chaic speaks {PROTOCOL}",
                command.label()
            ))),
            other => Err(unexpected(command, "hello", &other)),
        }
    }

    /// Briefs a process; what it wants to perceive.
    pub(crate) fn brief(
        process: &mut Process,
        command: &Command,
        briefing: &Briefing,
    ) -> Result<Senses, AgentError> {
        let reset = ToMind::Reset { briefing: Box::new(briefing.clone()) };
        match process.ask(plain(&reset), command.limits.start)? {
            ToEnv::Ready { senses } => {
                let refused = |text| AgentError::Broken(format!("`{}` {text}", command.label()));
                senses.check_counts().map(|()| senses).map_err(refused)
            }
            other => Err(unexpected(command, "reset", &other)),
        }
    }

    /// Shows a process what its agent sees; what it answers.
    pub(crate) fn ask(
        process: &mut Process,
        command: &Command,
        observation: &Observation,
    ) -> Result<(Action, Option<Thought>), AgentError> {
        match process.ask(observation_frame(observation), command.limits.decision)? {
            ToEnv::Act { action, thought } => Ok((
                action,
                thought.map(|Thought { plan, mood, noticed, mut sees }| {
                    sees.truncate(MAX_SEES);
                    sees.iter_mut().for_each(|thing| thing.name = cut(&thing.name));
                    Thought {
                        plan: cut(&plan),
                        mood: mood.as_deref().map(cut),
                        noticed: noticed.as_deref().map(cut),
                        sees,
                    }
                }),
            )),
            other => Err(unexpected(command, "observe", &other)),
        }
    }
}

fn unexpected(command: &Command, asked: &str, answer: &ToEnv) -> AgentError {
    let kind = match answer {
        ToEnv::Hello { .. } => "hello",
        ToEnv::Ready { .. } => "ready",
        ToEnv::Act { .. } => "act",
        ToEnv::Failed { .. } => "failed",
    };
    AgentError::Broken(format!("`{}` answered `{asked}` with `{kind}`", command.label()))
}

impl Agent for SubprocessAgent {
    fn senses(&self) -> Senses {
        match &self.state {
            State::Running { senses, .. } => *senses,
            State::Idle | State::Lost(_) => Senses::NONE,
        }
    }

    fn reset(&mut self, briefing: &Briefing) {
        // The process of the last episode is free or gone before another one begins.
        self.finish();
        let begun = self.process().and_then(|mut process| {
            let senses = SubprocessAgent::brief(&mut process, &self.command, briefing)?;
            Ok((process, senses))
        });
        self.state = match begun {
            Ok((process, senses)) => {
                let process = Box::new(process);
                State::Running { process, senses, thought: Thought::default() }
            }
            Err(error) => State::Lost(error),
        };
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        match &mut self.state {
            State::Idle => Err(AgentError::Broken("a mind that was not briefed".to_owned())),
            State::Lost(error) => Err(error.clone()),
            State::Running { process, thought, .. } => {
                match SubprocessAgent::ask(process, &self.command, observation) {
                    Ok((action, thinks)) => {
                        *thought = thinks.unwrap_or_default();
                        Ok(action)
                    }
                    Err(error) => {
                        self.state = State::Lost(error.clone());
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
            State::Idle | State::Lost(_) => Thought::default(),
        }
    }
}

impl Drop for SubprocessAgent {
    fn drop(&mut self) {
        self.finish();
    }
}
