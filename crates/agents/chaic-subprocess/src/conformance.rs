//! Conformance test of a helper process against the protocol, on training episodes.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use chaic_core::observation::SensorConfig;
use chaic_core::{Action, AgentId, Briefing, TaskId};
use chaic_env::{AdvanceOutcome, AgentSlot, Env, EpisodeAgents, EpisodeConfig};
use chaic_episodes::find_episode;

use crate::agent::SubprocessAgent;
use crate::process::HelperProcess;
use crate::program::HelperProgram;

/// Decisions in each test episode.
const N_DECISIONS: usize = 12;
/// Time in which a process must exit after `bye`.
const EXIT_TIMEOUT: Duration = Duration::from_secs(2);

/// Result of testing one requirement of the protocol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Check {
    /// Requirement.
    pub requirement: &'static str,
    /// Problem, if the process violates the requirement.
    pub result: Result<(), String>,
}

/// Tests a command and passes each result to `report`.
///
/// Requirements that an earlier failure makes untestable are left out. Setting `stop` ends the test; its
/// results are then meaningless.
pub fn check(
    command: &Arc<HelperProgram>,
    stop: &'static AtomicBool,
    report: &mut dyn FnMut(&Check),
) -> Vec<Check> {
    let mut checks = Vec::new();
    let mut add = |requirement, result: Result<(), String>| {
        let is_met = result.is_ok();
        let check = Check { requirement, result };
        report(&check);
        checks.push(check);
        is_met
    };
    let tester = Tester { command, stop };
    if !add("it starts and says hello in this version of the protocol", tester.hello())
        || !add("it accepts a briefing and requests valid images", tester.sensors())
    {
        return checks;
    }
    let first = TaskId::paper().next().unwrap_or(TaskId::NoConstraint);
    let mut first_actions = Vec::new();
    let all = TaskId::paper().try_for_each(|task| {
        let actions = tester.run_new(task)?;
        if task == first {
            first_actions = actions;
        }
        Ok(())
    });
    if !add("it decides in an episode of each task, in time", all) {
        return checks;
    }
    add(
        "it decides the same for the same briefing and observations",
        tester.run_new(first).and_then(|again| same(&first_actions, &again)),
    );
    add(
        "it starts again after a second briefing in the same process",
        tester.run_reused(first).and_then(|again| same(&first_actions, &again)),
    );
    add("it exits after `bye`", tester.exits(true));
    add("it exits when its standard input is closed", tester.exits(false));
    checks
}

/// Tests of one command.
struct Tester<'a> {
    command: &'a Arc<HelperProgram>,
    stop: &'static AtomicBool,
}

/// Returns an error as text.
fn text(problem: impl ToString) -> String {
    problem.to_string()
}

/// Compares the actions of two runs of one episode.
fn same(once: &[Action], again: &[Action]) -> Result<(), String> {
    match once.iter().zip(again).position(|(a, b)| a != b) {
        None if once.len() == again.len() => Ok(()),
        None => Err(format!("{} decisions, then {}", once.len(), again.len())),
        Some(k) => Err(format!("decision {k} was {:?}, then {:?}", once[k], again[k])),
    }
}

impl Tester<'_> {
    fn start(&self) -> Result<HelperProcess, String> {
        SubprocessAgent::start(self.command, self.stop).map(|(process, _)| process).map_err(text)
    }

    fn hello(&self) -> Result<(), String> {
        let (_, name) = SubprocessAgent::start(self.command, self.stop).map_err(text)?;
        if name.is_empty() { Err("it has no name".to_owned()) } else { Ok(()) }
    }

    fn sensors(&self) -> Result<(), String> {
        let env = env(TaskId::NoConstraint, SensorConfig::NONE, self.command)?;
        let sensors = self.brief(&mut self.start()?, &env.briefing(AgentId::HELPER))?;
        sensors.check().map_err(|problem| format!("it {problem}"))
    }

    fn brief(
        &self,
        process: &mut HelperProcess,
        briefing: &Briefing,
    ) -> Result<SensorConfig, String> {
        SubprocessAgent::brief(process, self.command, briefing).map_err(text)
    }

    fn run_new(&self, task: TaskId) -> Result<Vec<Action>, String> {
        self.run(&mut self.start()?, task, N_DECISIONS)
    }

    fn run_reused(&self, task: TaskId) -> Result<Vec<Action>, String> {
        let mut process = self.start()?;
        self.run(&mut process, TaskId::MovingHouse, N_DECISIONS / 2)?;
        self.run(&mut process, task, N_DECISIONS)
    }

    /// Runs an episode with the process as the helper; returns its first `n` actions.
    fn run(
        &self,
        process: &mut HelperProcess,
        task: TaskId,
        n: usize,
    ) -> Result<Vec<Action>, String> {
        let blind = env(task, SensorConfig::NONE, self.command)?;
        let sensors = self.brief(process, &blind.briefing(AgentId::HELPER))?;
        let mut env = env(task, sensors, self.command)?;
        let mut actions = Vec::new();
        while actions.len() < n && env.advance(None).map_err(text)? == AdvanceOutcome::NeedsAction {
            let observation = env.observe(AgentId::HELPER).ok_or("the helper does not wait")?;
            let (action, _) = SubprocessAgent::ask(process, self.command, observation)
                .map_err(|problem| format!("{task}, decision {}: {problem}", actions.len()))?;
            env.submit(AgentId::HELPER, action);
            actions.push(action);
        }
        Ok(actions)
    }

    fn exits(&self, send_bye: bool) -> Result<(), String> {
        let mut process = self.start()?;
        let start = Instant::now();
        if process.close(send_bye, 2 * EXIT_TIMEOUT) && start.elapsed() <= EXIT_TIMEOUT {
            return Ok(());
        }
        Err(format!("it was still running after {} s", EXIT_TIMEOUT.as_secs()))
    }
}

/// Creates an episode with an external helper.
fn env(task: TaskId, sensors: SensorConfig, command: &HelperProgram) -> Result<Env, String> {
    let episode = find_episode(&format!("{task}/train/00")).map_err(text)?;
    let config = EpisodeConfig::new(&episode, &command.name);
    let helper = Some(AgentSlot::external(command.grants, sensors));
    Env::new(config, EpisodeAgents { helper, partner: None }).map_err(text)
}
