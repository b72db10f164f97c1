//! Helper processes: values of `--helper`, options of the sandbox, and `chaic helper`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use chaic_core::observation::Grants;
use chaic_env::rules::RuleSetName;
use chaic_sandbox::Launcher;
use chaic_subprocess::environment::check_name;
use chaic_subprocess::{Confinement, ConfinementOptions, HelperProgram, Limits, Refusal};
use clap::{Args, Subcommand};

use crate::output::print_warning;
use crate::suggest::with_suggestion;

/// Default name of a helper process.
const DEFAULT_PROCESS_NAME: &str = "exec";
/// Default name of a policy.
const DEFAULT_POLICY_NAME: &str = "policy";

/// Value of `--helper`: names of built-in helpers, or one helper that is not built in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HelperArgument {
    /// Names, separated by commas.
    Names(Vec<String>),
    /// `exec:COMMAND` or `NAME=exec:COMMAND`.
    Exec {
        /// Name of the helper.
        name: String,
        /// Command line for `sh -c`.
        line: String,
    },
    /// `policy:FILE` or `NAME=policy:FILE`.
    Policy {
        /// Name of the helper.
        name: String,
        /// Weights file, or folder with one per task.
        file: PathBuf,
    },
}

impl HelperArgument {
    /// Returns the names of the helpers.
    pub fn names(&self) -> Vec<String> {
        match self {
            HelperArgument::Names(names) => names.clone(),
            HelperArgument::Exec { name, .. } | HelperArgument::Policy { name, .. } => {
                vec![name.clone()]
            }
        }
    }
}

/// Splits `KIND:REST` or `NAME=KIND:REST` into the name and the rest.
fn split_kind<'a>(text: &'a str, kind: &str, default_name: &'a str) -> Option<(&'a str, &'a str)> {
    let named = text.split_once(&format!("={kind}")).filter(|(name, _)| !name.contains([',', ':']));
    named.or_else(|| Some((default_name, text.strip_prefix(kind)?)))
}

/// Helpers of one `--helper`.
#[derive(Clone, Debug, PartialEq)]
pub struct HelperList(pub Vec<HelperArgument>);

/// Parses one value of `--helper`: names, the last of which may be a process or a policy.
pub fn helpers(text: &str) -> Result<HelperList, String> {
    // A command may contain commas, so only commas before the command separate helpers.
    let kind = KINDS.iter().filter_map(|kind| text.find(kind)).min();
    let last = kind.and_then(|at| text[..at].rfind(','));
    let Some(last) = last else { return Ok(HelperList(vec![helper(text)?])) };
    Ok(match helper(&text[last + 1..])? {
        HelperArgument::Names(_) => HelperList(vec![names(text)]),
        external => HelperList(vec![names(&text[..last]), external]),
    })
}

/// Prefixes of helpers that are not built in.
const KINDS: [&str; 2] = ["policy:", "exec:"];

fn names(text: &str) -> HelperArgument {
    HelperArgument::Names(text.split(',').map(str::to_owned).collect())
}

/// Parses one process or policy, or a list of names.
fn helper(text: &str) -> Result<HelperArgument, String> {
    if let Some((name, file)) = split_kind(text, KINDS[0], DEFAULT_POLICY_NAME) {
        check_path(file)?;
        return Ok(HelperArgument::Policy { name: name.to_owned(), file: file.into() });
    }
    let Some((name, line)) = split_kind(text, KINDS[1], DEFAULT_PROCESS_NAME) else {
        return Ok(names(text));
    };
    if is_blank(line) {
        return Err(
            "no command; write exec:COMMAND, for example exec:\"python3 helper.py\"".to_owned()
        );
    }
    Ok(HelperArgument::Exec { name: name.to_owned(), line: line.to_owned() })
}

/// Checks the path of a policy.
fn check_path(file: &str) -> Result<(), String> {
    if is_blank(file) {
        let example = "policy:runs/clone/policy.safetensors";
        return Err(format!("no file after the colon; write policy:FILE, for example {example}"));
    }
    // A path may contain commas.
    let mut after_commas = file.match_indices(',').map(|(at, _)| &file[at + 1..]);
    let is_helper = |rest: &&str| KINDS.iter().any(|kind| split_kind(rest, kind, "").is_some());
    match after_commas.find(is_helper) {
        Some(further) if !Path::new(file).exists() => Err(format!(
            "no file `{file}`; a policy or a process is the last of its list, so write --helper \
             {further} for another"
        )),
        _ => Ok(()),
    }
}

/// Returns whether a path or command is empty.
fn is_blank(text: &str) -> bool {
    text.trim().is_empty()
}

/// Grants and limits of helper processes.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Helper processes")]
pub struct ExecArguments {
    /// Grants of helper processes, separated by commas: ids, goal_place, goal, progress, behavior,
    /// positions, task, state; docs/grants.md [default: none].
    #[arg(long, value_name = "NAMES", value_parser = grants)]
    pub exec_grants: Option<Grants>,
    /// Time limit of one decision, seconds [default: 30].
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub exec_decision_s: Option<Duration>,
    /// Time limit of the start, and of a briefing, seconds [default: 120].
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub exec_start_s: Option<Duration>,
    /// Time limit of start, briefing and decisions of an episode together, seconds [default: 3600].
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub exec_episode_s: Option<Duration>,
    /// Memory limit of all processes of a helper together, MiB; with --exec-trust of each process
    /// [default: 8192].
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    pub exec_memory_mib: Option<u64>,
    /// Environment variable to pass on besides PATH, HOME and others of docs/subprocess-helpers.md;
    /// repeatable. Only its name is recorded.
    #[arg(long, value_name = "NAME", value_parser = variable)]
    pub exec_env: Vec<String>,
    /// File or folder that helper processes may read, besides system folders, installed programs and the
    /// files in COMMAND; repeatable.
    #[arg(long, value_name = "PATH")]
    pub exec_read: Vec<PathBuf>,
    /// Run helper processes without a sandbox, with all rights of your user.
    #[arg(long, conflicts_with = "exec_read")]
    pub exec_trust: bool,
}

impl ExecArguments {
    /// Checks that there is a helper process if one of these options is given.
    ///
    /// # Errors
    /// If there is none.
    pub fn check_used(&self, n_processes: usize) -> Result<(), Refusal> {
        if n_processes == 0 && *self != ExecArguments::default() {
            let text = "no helper is a process, so no --exec option has an effect; name one, for \
                        example --helper exec:\"python3 helper.py\"";
            return Err(Refusal(text.to_owned()));
        }
        Ok(())
    }

    /// Returns the helper process with this name and command line.
    pub fn command(&self, name: &str, line: &str) -> HelperProgram {
        let default = Limits::default();
        HelperProgram {
            name: name.to_owned(),
            line: line.to_owned(),
            grants: self.exec_grants.unwrap_or(Grants::NONE),
            limits: Limits {
                start: self.exec_start_s.unwrap_or(default.start),
                decision: self.exec_decision_s.unwrap_or(default.decision),
                episode: self.exec_episode_s.unwrap_or(default.episode),
                memory_mib: self.exec_memory_mib.unwrap_or(default.memory_mib),
                ..default
            },
            environment: self.exec_env.clone(),
            confinement: None,
        }
    }

    /// Confines a helper process as the options request, and warns if parts of the sandbox are missing.
    ///
    /// # Errors
    /// If a path to read is missing, or the sandbox cannot be started.
    pub fn confine(
        &self,
        command: &mut HelperProgram,
        launcher: &Launcher,
        masked: &[PathBuf],
    ) -> Result<(), Refusal> {
        let options = ConfinementOptions {
            is_trusted: self.exec_trust,
            readable: self.exec_read.clone(),
            masked: masked.to_vec(),
        };
        let HelperProgram { name, line, limits, .. } = &*command;
        let confinement = Confinement::new(launcher, line, limits, &options)?;
        if let Some(missing) = confinement.warning() {
            print_warning(&format!("{name} runs in {missing}"));
        }
        command.confinement = Some(confinement);
        Ok(())
    }
}

/// `chaic helper`.
#[derive(Debug, Subcommand)]
pub enum HelperCommand {
    /// Test whether a command follows the protocol of helper processes.
    Check(HelperCheckArguments),
    /// Run a built-in helper as such a process, on standard input and output.
    Serve(HelperServeArguments),
}

/// `chaic helper check`.
#[derive(Args, Debug)]
pub struct HelperCheckArguments {
    /// Shell command that starts the helper, such as `python3 helper.py`.
    #[arg(value_name = "COMMAND", value_parser = command_line)]
    pub line: String,
    #[command(flatten)]
    pub exec: ExecArguments,
}

/// `chaic helper serve`.
#[derive(Args, Debug)]
pub struct HelperServeArguments {
    /// Built-in helper; `chaic list helpers` prints them.
    #[arg(value_name = "NAME")]
    pub name: String,
    /// Rule set: paper, or compat for the behavior of the original's code.
    #[arg(long, value_name = "NAME", default_value = "paper")]
    pub rules: RuleSetName,
}

fn command_line(text: &str) -> Result<String, String> {
    if is_blank(text) {
        return Err("no command; write one, for example \"python3 helper.py\"".to_owned());
    }
    Ok(text.to_owned())
}

fn grants(text: &str) -> Result<Grants, String> {
    Grants::from_names(text.split(',')).map_err(|name| {
        let known: Vec<_> = Grants::NONE.named().iter().map(|(name, _)| *name).collect();
        let message = format!("no grant `{name}`; the grants are {}", known.join(", "));
        with_suggestion(message, &name, known)
    })
}

fn variable(text: &str) -> Result<String, String> {
    check_name(text).map(|()| text.to_owned())
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|s| (0.001..=86_400.0).contains(s));
    let seconds =
        seconds.ok_or_else(|| format!("no time `{text}`; write seconds, from 0.001 to 86400"))?;
    Ok(Duration::from_secs_f64(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_names_may_end_with_a_process_or_a_policy() {
        let policy = || HelperArgument::Policy { name: "mine".to_owned(), file: "a,b".into() };
        let exec =
            |name: &str| HelperArgument::Exec { name: name.to_owned(), line: "a,b=c".to_owned() };
        for (text, expected) in [
            ("none,rhp", vec![names("none,rhp")]),
            ("none,rhp,mine=policy:a,b", vec![names("none,rhp"), policy()]),
            ("mine=policy:a,b", vec![policy()]),
            ("none,exec:a,b=c", vec![names("none"), exec(DEFAULT_PROCESS_NAME)]),
            ("x=exec:a,b=c", vec![exec("x")]),
        ] {
            assert_eq!(helpers(text), Ok(HelperList(expected)), "{text}");
        }
        for (text, problem) in [
            ("none,exec:", "no command"),
            ("policy:", "no file after the colon"),
            ("none,mine=policy:", "no file after the colon"),
            ("none,m=policy:a.st,v=policy:b.st", "so write --helper v=policy:b.st for another"),
            ("m=policy:a.st,exec:b", "so write --helper exec:b for another"),
        ] {
            let refused = helpers(text).expect_err(text);
            assert!(refused.contains(problem), "{text}: {refused}");
        }
        assert!(command_line(" ").is_err() && command_line("true").is_ok());
    }

    #[test]
    fn options_of_helper_processes_need_one() {
        let none = ExecArguments::default();
        assert_eq!(none.check_used(0), Ok(()));
        let some = ExecArguments { exec_read: vec!["nofile".into()], ..none };
        assert_eq!(some.check_used(1), Ok(()));
        let refused = some.check_used(0).expect_err("no process").to_string();
        assert!(refused.contains("no helper is a process"), "{refused}");
    }
}
