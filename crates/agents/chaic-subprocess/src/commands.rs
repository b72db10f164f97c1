//! Registry of helpers in other processes.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::PlannerRules;
use chaic_env::helper_registry::{Helper, HelperRegistry, check_new_name};
use chaic_env::{EnvError, RunKey};
use serde::{Deserialize, Serialize};

use crate::agent::SubprocessAgent;
use crate::limits::Refusal;
use crate::program::HelperProgram;

/// Entry of a helper in the run folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordedCommand {
    name: String,
    command: String,
    /// Names of added environment variables, never their values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    environment: Vec<String>,
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

    /// Checks that a run to resume was started with the same commands.
    ///
    /// # Errors
    /// [`Refusal`] with the command to name again.
    pub fn check_resumed(&self, run: &Path) -> chaic_env::Result<()> {
        let path = run.join(FILE);
        if !path.exists() {
            return Ok(());
        }
        let bytes = chaic_files::read_bounded(&path, MAX_FILE).map_err(io)?;
        let recorded: Vec<RecordedCommand> = serde_json::from_slice(&bytes)
            .map_err(|e| EnvError::Registry(format!("{}: {e}", path.display()).into()))?;
        let named = self.recorded();
        match recorded.iter().find(|entry| !named.contains(entry)) {
            None => Ok(()),
            Some(RecordedCommand { name, command, environment }) => Err(Refusal(format!(
                "{} was started with the command {name}=exec:{command}{}; a command is only run if you \
                 name it: repeat all --helper options, or choose another --out",
                run.display(),
                environment.iter().map(|e| format!(" --exec-env {e}")).collect::<String>(),
            ))
            .into()),
        }
    }

    fn recorded(&self) -> Vec<RecordedCommand> {
        let recorded = |c: &Arc<HelperProgram>| RecordedCommand {
            name: c.name.clone(),
            command: c.line.clone(),
            environment: c.environment.clone(),
        };
        self.commands.iter().map(recorded).collect()
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
        self.check_resumed(run)?;
        if self.commands.is_empty() {
            return Ok(());
        }
        let text = serde_json::to_vec_pretty(&self.recorded())
            .expect("names and commands serialize to JSON");
        chaic_files::write_atomically(&run.join(FILE), &text).map_err(io)
    }

    fn fallback(&self) -> Option<&dyn HelperRegistry> {
        Some(self.fallback)
    }
}
