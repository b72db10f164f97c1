//! Registry of helpers in other processes.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::PlannerRules;
use chaic_env::helper_registry::{Helper, HelperRegistry, check_new_name};
use chaic_env::{EnvError, RunKey};
use serde::{Deserialize, Serialize};

use crate::agent::SubprocessAgent;
use crate::limits::{Limits, Refusal};
use crate::program::HelperProgram;

/// Entry of a helper in the run folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordedCommand {
    name: String,
    command: String,
    /// Names of added environment variables, never their values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    environment: Vec<String>,
    /// Absent if an older version started the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limits: Option<RecordedLimits>,
}

impl RecordedCommand {
    /// Returns whether both entries start the same process; their limits may differ.
    fn is_same_process(&self, other: &RecordedCommand) -> bool {
        let RecordedCommand { name, command, environment, .. } = other;
        (&self.name, &self.command, &self.environment) == (name, command, environment)
    }
}

/// Limits that options set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordedLimits {
    decision_s: f64,
    start_s: f64,
    episode_s: f64,
    memory_mib: u64,
}

impl RecordedLimits {
    fn new(limits: &Limits) -> RecordedLimits {
        RecordedLimits {
            decision_s: limits.decision.as_secs_f64(),
            start_s: limits.start.as_secs_f64(),
            episode_s: limits.episode.as_secs_f64(),
            memory_mib: limits.memory_mib,
        }
    }

    /// Returns the options that set these limits, with their values.
    fn options(&self) -> [(&'static str, String); 4] {
        [
            ("--exec-decision-s", self.decision_s.to_string()),
            ("--exec-start-s", self.start_s.to_string()),
            ("--exec-episode-s", self.episode_s.to_string()),
            ("--exec-memory-mib", self.memory_mib.to_string()),
        ]
    }

    /// Checks that the limits of a resumed run are these.
    fn check(&self, given: &RecordedLimits, run: &Path) -> Result<(), Refusal> {
        let mut options = self.options().into_iter().zip(given.options());
        match options.find(|(recorded, given)| recorded != given) {
            None => Ok(()),
            Some(((option, recorded), (_, given))) => Err(Refusal(format!(
                "{} was started with {option} {recorded}, not {given}; give {option} {recorded} to resume \
                 it, or choose another --out",
                run.display()
            ))),
        }
    }
}

/// File with the commands of a run, for readers. Its content is never executed.
pub const FILE: &str = "commands.json";

/// Largest file that is read, bytes.
const MAX_FILE: u64 = 1 << 20;

fn io(error: chaic_files::FileError) -> EnvError {
    EnvError::Registry(error.into())
}

/// Registry that adds helpers in other processes to another registry.
pub struct CommandRegistry<'a> {
    commands: Vec<Arc<HelperProgram>>,
    fallback: &'a dyn HelperRegistry,
    stop: &'static AtomicBool,
}

impl<'a> CommandRegistry<'a> {
    /// Adds commands to the helpers of another registry. Setting `stop` ends all waiting.
    ///
    /// # Errors
    /// [`Refusal`] if a name is invalid or taken.
    pub fn new(
        fallback: &'a dyn HelperRegistry,
        commands: Vec<HelperProgram>,
        stop: &'static AtomicBool,
    ) -> chaic_env::Result<CommandRegistry<'a>> {
        let mut taken = fallback.names();
        for HelperProgram { name, .. } in &commands {
            check_new_name(name, &taken, "mine=exec:COMMAND").map_err(Refusal)?;
            taken.push(name.clone());
        }
        let commands = commands.into_iter().map(Arc::new).collect();
        Ok(CommandRegistry { commands, fallback, stop })
    }

    fn find(&self, name: &str) -> Option<&Arc<HelperProgram>> {
        self.commands.iter().find(|c| c.name == name)
    }

    /// Checks that a run to resume was started with the same commands and limits.
    ///
    /// # Errors
    /// [`Refusal`] with the command to name again, or with the limit that differs.
    pub fn check_resumed(&self, run: &Path) -> chaic_env::Result<()> {
        self.entries(run).map(drop)
    }

    /// Returns the entries for the folder of a run. Those of a resumed run have its recorded limits,
    /// or none if an older version started it, since its first episodes may have had others.
    fn entries(&self, run: &Path) -> chaic_env::Result<Vec<RecordedCommand>> {
        let entry = |c: &Arc<HelperProgram>| RecordedCommand {
            name: c.name.clone(),
            command: c.line.clone(),
            environment: c.environment.clone(),
            limits: Some(RecordedLimits::new(&c.limits)),
        };
        let mut entries: Vec<RecordedCommand> = self.commands.iter().map(entry).collect();
        let path = run.join(FILE);
        if !path.exists() {
            return Ok(entries);
        }
        let bytes = chaic_files::read_bounded(&path, MAX_FILE).map_err(io)?;
        let recorded: Vec<RecordedCommand> = serde_json::from_slice(&bytes)
            .map_err(|e| EnvError::Registry(format!("{}: {e}", path.display()).into()))?;
        for recorded in recorded {
            let Some(entry) = entries.iter_mut().find(|e| e.is_same_process(&recorded)) else {
                let RecordedCommand { name, command, environment, .. } = recorded;
                return Err(Refusal(format!(
                    "{} was started with the command {name}=exec:{command}{}; a command is only run if you \
                     name it: repeat all --helper options, or choose another --out",
                    run.display(),
                    environment.iter().map(|e| format!(" --exec-env {e}")).collect::<String>(),
                ))
                .into());
            };
            if let (Some(limits), Some(given)) = (&recorded.limits, &entry.limits) {
                limits.check(given, run)?;
            }
            entry.limits = recorded.limits;
        }
        Ok(entries)
    }
}

impl HelperRegistry for CommandRegistry<'_> {
    fn names(&self) -> Vec<String> {
        self.fallback
            .names()
            .into_iter()
            .chain(self.commands.iter().map(|c| c.name.clone()))
            .collect()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        let Some(command) = self.find(name) else { return self.fallback.make(name, rules) };
        let agent = Box::new(SubprocessAgent::new(Arc::clone(command), self.stop));
        Some(Helper { agent, grants: command.grants })
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        match self.find(&key.helper) {
            Some(_) => self.make(&key.helper, rules),
            None => self.fallback.make_for(key, rules),
        }
    }

    fn attach_run(&self, run: &Path) -> chaic_env::Result<()> {
        self.fallback.attach_run(run)?;
        let entries = self.entries(run)?;
        if entries.is_empty() {
            return Ok(());
        }
        let text =
            serde_json::to_vec_pretty(&entries).expect("names and commands serialize to JSON");
        chaic_files::write_atomically(&run.join(FILE), &text).map_err(io)
    }

    fn fallback(&self) -> Option<&dyn HelperRegistry> {
        Some(self.fallback)
    }
}
