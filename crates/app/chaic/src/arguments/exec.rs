//! Helpers in other processes: what stands behind `--helper`, and `chaic helper`.

use std::path::PathBuf;
use std::time::Duration;

use chaic_core::observation::Grants;
use chaic_env::rules::RuleSetName;
use chaic_sandbox::Launcher;
use chaic_subprocess::environment::check_name;
use chaic_subprocess::{Command, Confinement, ConfinementOptions, Limits, Refusal};
use clap::{Args, Subcommand};

use crate::output::complain;

/// What a command is called that has no name of its own.
const USUAL_NAME: &str = "exec";
/// What a policy is called that has no name of its own.
const USUAL_POLICY: &str = "policy";

/// One value of `--helper`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HelperArgument {
    /// Names, separated by commas.
    Names(Vec<String>),
    /// `exec:COMMAND` or `NAME=exec:COMMAND`.
    Exec {
        /// What it is called.
        name: String,
        /// For `sh -c`.
        line: String,
    },
    /// `policy:FILE` or `NAME=policy:FILE`.
    Policy {
        /// What it is called.
        name: String,
        /// Its weights.
        file: PathBuf,
    },
}

impl HelperArgument {
    /// The names that it adds to a run.
    pub fn names(&self) -> Vec<String> {
        match self {
            HelperArgument::Names(names) => names.clone(),
            HelperArgument::Exec { name, .. } | HelperArgument::Policy { name, .. } => {
                vec![name.clone()]
            }
        }
    }
}

/// The name and the rest of `KIND:REST` or `NAME=KIND:REST`.
fn of_kind<'a>(text: &'a str, kind: &str, usual: &'a str) -> Option<(&'a str, &'a str)> {
    let named = text.split_once(&format!("={kind}")).filter(|(name, _)| !name.contains([',', ':']));
    named.or_else(|| Some((usual, text.strip_prefix(kind)?)))
}

/// Reads one value of `--helper`.
pub fn helper(text: &str) -> Result<HelperArgument, String> {
    if let Some((name, file)) = of_kind(text, "policy:", USUAL_POLICY) {
        return Ok(HelperArgument::Policy { name: name.to_owned(), file: file.into() });
    }
    let Some((name, line)) = of_kind(text, "exec:", USUAL_NAME) else {
        return Ok(HelperArgument::Names(text.split(',').map(str::to_owned).collect()));
    };
    if line.trim().is_empty() {
        return Err(
            "no command; write exec:COMMAND, for example exec:\"python3 helper.py\"".to_owned()
        );
    }
    Ok(HelperArgument::Exec { name: name.to_owned(), line: line.to_owned() })
}

/// What helpers in other processes get, and may take.
#[derive(Args, Clone, Debug, Default)]
pub struct ExecArguments {
    /// What helpers of exec:COMMAND are granted beyond their own images and state, separated by
    /// commas: ids, goal_place, goal, progress, behavior, positions, task; docs/grants.md.
    #[arg(long, value_name = "NAMES", value_parser = grants, help_heading = "Helpers in other processes")]
    pub exec_grants: Option<Grants>,
    /// Longest time for one decision, seconds. Usual: 30.
    #[arg(long, value_name = "S", value_parser = seconds, help_heading = "Helpers in other processes")]
    pub exec_decision_s: Option<Duration>,
    /// Longest time for starting and for a briefing, seconds. Usual: 120.
    #[arg(long, value_name = "S", value_parser = seconds, help_heading = "Helpers in other processes")]
    pub exec_start_s: Option<Duration>,
    /// Longest time that an episode waits for it in all, seconds. Usual: 3600.
    #[arg(long, value_name = "S", value_parser = seconds, help_heading = "Helpers in other processes")]
    pub exec_episode_s: Option<Duration>,
    /// Memory for all of its processes together, MiB; with --exec-trust for each of them. Default: 8192.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 30), help_heading = "Helpers in other processes")]
    pub exec_memory_mib: Option<u64>,
    /// Environment variable that helpers of exec:COMMAND inherit besides the allow-list (PATH, HOME, ..;
    /// docs/subprocess-helpers.md); may be given often. Only its name is recorded.
    #[arg(long, value_name = "NAME", value_parser = variable, help_heading = "Helpers in other processes")]
    pub exec_env: Vec<String>,
    /// Let helpers of exec:COMMAND read a file or folder, besides the system's folders, the installations
    /// of programs and the files that COMMAND names; may be given often.
    #[arg(long, value_name = "PATH", help_heading = "Helpers in other processes")]
    pub exec_read: Vec<PathBuf>,
    /// Run helpers of exec:COMMAND without a sandbox, with all rights of your user.
    #[arg(long, conflicts_with = "exec_read", help_heading = "Helpers in other processes")]
    pub exec_trust: bool,
}

impl ExecArguments {
    /// A helper of this name and command line.
    pub fn command(&self, name: &str, line: &str) -> Command {
        let usual = Limits::default();
        Command {
            name: name.to_owned(),
            line: line.to_owned(),
            grants: self.exec_grants.unwrap_or(Grants::NONE),
            limits: Limits {
                start: self.exec_start_s.unwrap_or(usual.start),
                decision: self.exec_decision_s.unwrap_or(usual.decision),
                episode: self.exec_episode_s.unwrap_or(usual.episode),
                memory_mib: self.exec_memory_mib.unwrap_or(usual.memory_mib),
                ..usual
            },
            environment: self.exec_env.clone(),
            confinement: None,
        }
    }

    /// Confines a command as the options say, and warns of parts of the sandbox that are missing.
    ///
    /// # Errors
    /// If a path to read is not there, or the sandbox cannot be started.
    pub fn confine(
        &self,
        command: &mut Command,
        launcher: &Launcher,
        masked: &[PathBuf],
    ) -> Result<(), Refusal> {
        let options = ConfinementOptions {
            is_trusted: self.exec_trust,
            readable: self.exec_read.clone(),
            masked: masked.to_vec(),
        };
        let Command { name, line, limits, .. } = &*command;
        let confinement = Confinement::new(launcher, line, limits, &options)?;
        if let Some(missing) = confinement.warning() {
            complain(&format!("warning: {name} runs in {missing}"));
        }
        command.confinement = Some(confinement);
        Ok(())
    }
}

/// `chaic helper`.
#[derive(Debug, Subcommand)]
pub enum HelperCommand {
    /// Try whether a command keeps to the protocol for helpers in other processes.
    Check(HelperCheckArguments),
    /// Be such a process: a built-in helper that speaks the protocol on standard input and output.
    Serve(HelperServeArguments),
}

/// `chaic helper check`.
#[derive(Args, Debug)]
pub struct HelperCheckArguments {
    /// The command, for a shell, such as `python3 helper.py`.
    #[arg(value_name = "COMMAND")]
    pub line: String,
    #[command(flatten)]
    pub exec: ExecArguments,
}

/// `chaic helper serve`.
#[derive(Args, Debug)]
pub struct HelperServeArguments {
    /// Its name: random, rhp, oracle or follow.
    #[arg(value_name = "NAME")]
    pub name: String,
    /// paper, or compat for what the original's code does.
    #[arg(long, value_name = "NAME", default_value = "paper")]
    pub rules: RuleSetName,
}

fn grants(text: &str) -> Result<Grants, String> {
    Grants::of_names(text.split(',')).map_err(|name| {
        let all: Vec<_> = Grants::NONE.named().iter().map(|(name, _)| *name).collect();
        format!("no grant `{name}`; the grants are {}", all.join(", "))
    })
}

fn variable(text: &str) -> Result<String, String> {
    check_name(text).map(|()| text.to_owned())
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|s| (0.001..=86_400.0).contains(s));
    let seconds = seconds.ok_or_else(|| format!("no time `{text}`; write seconds, up to 86400"))?;
    Ok(Duration::from_secs_f64(seconds))
}
