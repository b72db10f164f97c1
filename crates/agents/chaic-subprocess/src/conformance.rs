//! Whether a process keeps to the protocol: tried on real episodes, one promise after the other.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use chaic_core::observation::Senses;
use chaic_core::{Action, AgentId, Briefing, TaskId};
use chaic_env::rules::RuleSet;
use chaic_env::{Appearance, Env, EpisodeConfig, Flow, Minds, Seat};
use chaic_episodes::find_episode;

use crate::agent::SubprocessAgent;
use crate::commands::Command;
use crate::process::Process;

/// Decisions in each episode that is tried.
const N_DECISIONS: usize = 12;
/// A process that is told to end does so within this time.
const END_WITHIN: Duration = Duration::from_secs(2);

/// One promise of the protocol, and whether it was kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Check {
    /// The promise.
    pub promise: &'static str,
    /// What happened instead, if it wasn't kept.
    pub kept: Result<(), String>,
}

/// Tries a command, and tells `each` what it finds as it goes. What can't be tried because something
/// before it failed is left out. `stop` raised ends it; what was tried then says nothing.
pub fn check(
    command: &Arc<Command>,
    stop: &'static AtomicBool,
    each: &mut dyn FnMut(&Check),
) -> Vec<Check> {
    let mut checks = Vec::new();
    let mut note = |promise, kept: Result<(), String>| {
        let is_kept = kept.is_ok();
        let check = Check { promise, kept };
        each(&check);
        checks.push(check);
        is_kept
    };
    let trial = Trial { command, stop };
    if !note("it starts and says hello in this version of the protocol", trial.hello())
        || !note("it is briefed, and wants images that there are", trial.senses())
    {
        return checks;
    }
    let first = TaskId::paper().next().unwrap_or(TaskId::NoConstraint);
    let mut played = Vec::new();
    let all = TaskId::paper().try_for_each(|task| {
        let actions = trial.fresh(task)?;
        if task == first {
            played = actions;
        }
        Ok(())
    });
    if !note("it decides in an episode of each task, in time", all) {
        return checks;
    }
    note(
        "the same briefing and observations make it decide the same",
        trial.fresh(first).and_then(|again| same(&played, &again)),
    );
    note(
        "a second briefing begins anew, within the same process",
        trial.twice(first).and_then(|again| same(&played, &again)),
    );
    note("it ends when it is told to", trial.ends(true));
    note("it ends when its standard input is closed", trial.ends(false));
    checks
}

struct Trial<'a> {
    command: &'a Arc<Command>,
    stop: &'static AtomicBool,
}

fn text(problem: impl ToString) -> String {
    problem.to_string()
}

fn same(once: &[Action], again: &[Action]) -> Result<(), String> {
    match once.iter().zip(again).position(|(a, b)| a != b) {
        None if once.len() == again.len() => Ok(()),
        None => Err(format!("{} decisions, then {}", once.len(), again.len())),
        Some(k) => Err(format!("decision {k} was {:?}, then {:?}", once[k], again[k])),
    }
}

impl Trial<'_> {
    fn start(&self) -> Result<Process, String> {
        SubprocessAgent::start(self.command, self.stop).map(|(process, _)| process).map_err(text)
    }

    fn hello(&self) -> Result<(), String> {
        let (_, name) = SubprocessAgent::start(self.command, self.stop).map_err(text)?;
        if name.is_empty() { Err("it has no name".to_owned()) } else { Ok(()) }
    }

    fn senses(&self) -> Result<(), String> {
        let env = env(TaskId::NoConstraint, Senses::NONE, self.command)?;
        let senses = self.brief(&mut self.start()?, &env.briefing(AgentId::HELPER))?;
        senses.check().map_err(|problem| format!("it {problem}"))
    }

    fn brief(&self, process: &mut Process, briefing: &Briefing) -> Result<Senses, String> {
        SubprocessAgent::brief(process, self.command, briefing).map_err(text)
    }

    fn fresh(&self, task: TaskId) -> Result<Vec<Action>, String> {
        self.play(&mut self.start()?, task, N_DECISIONS)
    }

    fn twice(&self, task: TaskId) -> Result<Vec<Action>, String> {
        let mut process = self.start()?;
        self.play(&mut process, TaskId::MovingHouse, N_DECISIONS / 2)?;
        self.play(&mut process, task, N_DECISIONS)
    }

    /// Plays an episode by the process's decisions.
    fn play(&self, process: &mut Process, task: TaskId, n: usize) -> Result<Vec<Action>, String> {
        let unseeing = env(task, Senses::NONE, self.command)?;
        let senses = self.brief(process, &unseeing.briefing(AgentId::HELPER))?;
        let mut env = env(task, senses, self.command)?;
        let mut actions = Vec::new();
        while actions.len() < n && env.advance(None).map_err(text)? == Flow::Waits {
            let seen = env.observe(AgentId::HELPER).ok_or("nobody waits")?;
            let (action, _) = SubprocessAgent::ask(process, self.command, seen)
                .map_err(|problem| format!("{task}, decision {}: {problem}", actions.len()))?;
            env.submit(AgentId::HELPER, action);
            actions.push(action);
        }
        Ok(actions)
    }

    fn ends(&self, told: bool) -> Result<(), String> {
        let mut process = self.start()?;
        let began = Instant::now();
        if process.close(told, 2 * END_WITHIN) && began.elapsed() <= END_WITHIN {
            return Ok(());
        }
        Err(format!("it was there after {} s still", END_WITHIN.as_secs()))
    }
}

/// An episode with a seat for the process.
fn env(task: TaskId, senses: Senses, command: &Command) -> Result<Env, String> {
    let episode = find_episode(&format!("{task}/train/00")).map_err(text)?;
    let config = EpisodeConfig {
        episode: &episode,
        seed: 0,
        rules: RuleSet::PAPER,
        helper: &command.name,
        partner: None,
        image_size: None,
        appearance: Appearance::Canonical,
    };
    let helper = Some(Seat::of_caller(command.grants, senses));
    Env::new(config, Minds { helper, partner: None }).map_err(text)
}
