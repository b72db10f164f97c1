//! Where a run gets the helpers from that run in other processes.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use chaic_agents::PlannerRules;
use chaic_core::observation::Grants;
use chaic_env::minds::{Helper, Helpers, check_new_name};
use chaic_env::{EnvError, RunKey};
use serde::{Deserialize, Serialize};

use crate::agent::SubprocessAgent;
use crate::confinement::Confinement;

/// What a process may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// For its start, and for each briefing.
    pub start: Duration,
    /// For each decision.
    pub decision: Duration,
    /// For all that it is waited for in an episode.
    pub episode: Duration,
    /// Memory of all of its processes together, MiB. Without a sandbox, memory of each (Linux).
    pub memory_mib: u64,
    /// Files that its processes can write, held in memory, MiB; in a sandbox.
    pub scratch_mib: u64,
    /// Processes and threads at one time; in a sandbox.
    pub max_tasks: u32,
}

impl Default for Limits {
    /// Ours: a network is loaded within two minutes, and somebody who takes longer than half a minute
    /// for one of some hundred decisions had better say so.
    fn default() -> Limits {
        Limits {
            start: Duration::from_secs(120),
            decision: Duration::from_secs(30),
            episode: Duration::from_secs(3600),
            memory_mib: 8192,
            // An eighth of the memory: room for caches and logs.
            scratch_mib: 1024,
            // Sixteen workers of a numerical library with a thread for each of 32 cores.
            max_tasks: 512,
        }
    }
}

/// A helper in another process.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// What the helper is called in this run.
    pub name: String,
    /// The command, for `sh -c`.
    pub line: String,
    /// What it is granted.
    pub grants: Grants,
    /// What it may take.
    pub limits: Limits,
    /// Names of environment variables that it inherits beyond
    /// [`ALLOWED_VARIABLES`](crate::environment::ALLOWED_VARIABLES).
    pub environment: Vec<String>,
    /// How its processes are confined; `None` for plain processes, which this program starts itself.
    pub confinement: Option<Confinement>,
}

impl Command {
    /// Returns how messages call the command: its line, or its name if the line is long.
    pub(crate) fn label(&self) -> &str {
        /// Longer lines hide what a message says of them.
        const LONGEST: usize = 2000;
        if self.line.len() > LONGEST { &self.name } else { &self.line }
    }
}

/// What was asked for that can't be, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Refusal(pub String);

impl From<Refusal> for EnvError {
    fn from(refusal: Refusal) -> EnvError {
        EnvError::Minds(refusal.into())
    }
}

/// What a run's folder tells of such a helper.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Recorded {
    name: String,
    command: String,
    /// Names of added environment variables, never their values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    environment: Vec<String>,
}

/// The file with the commands of a run, for readers: nothing in it is ever run.
pub const FILE: &str = "commands.json";

/// Longest file that is read, bytes.
const MAX_FILE: u64 = 1 << 20;

fn io(error: chaic_files::FileError) -> EnvError {
    EnvError::Minds(error.into())
}

/// Helpers in other processes, besides those of elsewhere.
pub struct Commands<'a> {
    commands: Vec<Arc<Command>>,
    others: &'a dyn Helpers,
    stop: &'static AtomicBool,
}

impl<'a> Commands<'a> {
    /// Adds commands to the helpers of elsewhere; `stop` raised ends all waiting.
    ///
    /// # Errors
    /// [`Refusal`] if a name is none, or is taken.
    pub fn beside(
        others: &'a dyn Helpers,
        commands: Vec<Command>,
        stop: &'static AtomicBool,
    ) -> chaic_env::Result<Commands<'a>> {
        let mut taken = others.names();
        for Command { name, .. } in &commands {
            check_new_name(name, &taken, "mine=exec:COMMAND").map_err(Refusal)?;
            taken.push(name.clone());
        }
        let commands = commands.into_iter().map(Arc::new).collect();
        Ok(Commands { commands, others, stop })
    }

    fn named(&self, name: &str) -> Option<&Arc<Command>> {
        self.commands.iter().find(|c| c.name == name)
    }

    /// Refuses to go on with a run that was begun with other commands.
    ///
    /// # Errors
    /// [`Refusal`] with the command that is to be named again.
    pub fn check_begun(&self, run: &Path) -> chaic_env::Result<()> {
        let path = run.join(FILE);
        if !path.exists() {
            return Ok(());
        }
        let bytes = chaic_files::read_bounded(&path, MAX_FILE).map_err(io)?;
        let begun: Vec<Recorded> = serde_json::from_slice(&bytes)
            .map_err(|e| EnvError::Minds(format!("{}: {e}", path.display()).into()))?;
        let own = self.recorded();
        match begun.iter().find(|recorded| !own.contains(recorded)) {
            None => Ok(()),
            Some(Recorded { name, command, environment }) => Err(Refusal(format!(
                "{} was begun with the command {name}=exec:{command}{}; a command is only run if you \
                 name it: give all of --helper again, or choose another --out",
                run.display(),
                environment.iter().map(|e| format!(" --exec-env {e}")).collect::<String>(),
            ))
            .into()),
        }
    }

    fn recorded(&self) -> Vec<Recorded> {
        let recorded = |c: &Arc<Command>| Recorded {
            name: c.name.clone(),
            command: c.line.clone(),
            environment: c.environment.clone(),
        };
        self.commands.iter().map(recorded).collect()
    }
}

impl Helpers for Commands<'_> {
    fn names(&self) -> Vec<String> {
        self.others
            .names()
            .into_iter()
            .chain(self.commands.iter().map(|c| c.name.clone()))
            .collect()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        let Some(command) = self.named(name) else { return self.others.make(name, rules) };
        let mind = Box::new(SubprocessAgent::new(Arc::clone(command), self.stop));
        Some(Helper { mind, grants: command.grants })
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        match self.named(&key.helper) {
            Some(_) => self.make(&key.helper, rules),
            None => self.others.make_for(key, rules),
        }
    }

    fn attach(&self, run: &Path) -> chaic_env::Result<()> {
        self.others.attach(run)?;
        self.check_begun(run)?;
        if self.commands.is_empty() {
            return Ok(());
        }
        let text =
            serde_json::to_vec_pretty(&self.recorded()).expect("names and commands are JSON");
        chaic_files::write_whole(&run.join(FILE), &text).map_err(io)
    }

    fn others(&self) -> Option<&dyn Helpers> {
        Some(self.others)
    }
}
