//! Starting sandboxed commands.

use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use serde::{Deserialize, Serialize};

use crate::isolation::{Isolation, Part};
use crate::policy::Policy;

/// First argument of a program that is started as a stage of the sandbox; the second is the request.
pub const STAGE_ARGUMENT: &str = "__chaic-sandbox";

/// Exit status of a stage that cannot set the sandbox up; the reason is on its standard error.
#[cfg(target_os = "linux")]
pub(crate) const SETUP_FAILED: u8 = 125;

/// Why there is no sandbox.
#[derive(Debug, thiserror::Error)]
pub enum SandboxError {
    /// The stage program cannot be started.
    #[error("can't start the sandbox: {0}")]
    Start(#[from] io::Error),
    /// The stage ended without a report.
    #[error("the sandbox gives no report of what it enforces: {0}")]
    Probe(String),
}

/// The two processes between the caller and the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Stage {
    /// Enters namespaces, starts the inner stage and watches it.
    Outer,
    /// Builds the root folder, gives up rights and becomes the shell.
    Inner,
}

/// Strength of a sandbox.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Mode {
    /// Nothing: the outer stage only watches, and ends what the command leaves behind.
    Trusted,
    /// The command runs in the caller's file system, with the rights that a process can give up itself.
    Process,
    /// Everything, with namespaces and a root folder of its own.
    Namespaces,
}

/// Task of a stage: the JSON text of its second argument.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Request {
    /// The stage.
    pub stage: Stage,
    /// The program and arguments that start a stage.
    pub launcher: Vec<OsString>,
    /// Rights of the command.
    pub policy: Policy,
    /// Parts that must be enforced, or the command does not start.
    pub required: Vec<Part>,
    /// Strength of the sandbox.
    pub mode: Mode,
    /// Process that started the outer stage; it ends with that one.
    pub parent: u32,
    /// The shell command; `None` to only report what is enforced.
    pub line: Option<String>,
    /// Private folder in [`Mode::Process`]; set by the outer stage.
    pub scratch: Option<PathBuf>,
}

/// Program that starts the stages of a sandbox: it calls [`run_stage`] first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Launcher {
    program: Vec<OsString>,
}

impl Launcher {
    /// Uses the running program, whose `main` must call [`run_stage`] first.
    pub fn this_program() -> Launcher {
        // Also right after the file was replaced by a newer build.
        Launcher { program: vec!["/proc/self/exe".into()] }
    }

    /// Uses another program with arguments before the stage's own, for example an interpreter.
    pub fn new(program: impl IntoIterator<Item = OsString>) -> Launcher {
        Launcher { program: program.into_iter().collect() }
    }

    /// Returns what the system enforces for this policy, by starting an empty sandbox.
    ///
    /// # Errors
    /// If the program of the launcher cannot be started or is not one that calls [`run_stage`].
    pub fn probe(&self, policy: &Policy) -> Result<Isolation, SandboxError> {
        if cfg!(not(target_os = "linux")) {
            return Ok(Isolation::nothing("there is a sandbox on Linux only"));
        }
        match self.try_probe(policy, Mode::Namespaces)? {
            Ok(isolation) => Ok(isolation),
            Err(reason) => match self.try_probe(policy, Mode::Process)? {
                Ok(isolation) => Ok(isolation.without_namespaces(reason)),
                Err(second) => Ok(Isolation::nothing(&second)),
            },
        }
    }

    fn try_probe(
        &self,
        policy: &Policy,
        mode: Mode,
    ) -> Result<Result<Isolation, String>, SandboxError> {
        let mut probe = self.stage(policy, mode, Vec::new(), None);
        let output = probe.stdin(Stdio::null()).output()?;
        let complaint = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        if !output.status.success() {
            return Ok(Err(complaint));
        }
        serde_json::from_slice(&output.stdout)
            .map(Ok)
            .map_err(|e| SandboxError::Probe(format!("{e}; {complaint}")))
    }

    /// Returns a process that runs a shell command line under a policy, enforcing what [`Launcher::probe`]
    /// returned; nothing for [`Isolation::Trusted`]. The caller sets up its standard streams and environment.
    /// SIGTERM ends the process with all that the command started, as does the end of the caller.
    pub fn command(&self, policy: &Policy, isolation: &Isolation, line: &str) -> Command {
        let required = isolation.enforced();
        let mode = match isolation {
            Isolation::Trusted => Mode::Trusted,
            Isolation::Sandboxed(_) if required.contains(&Part::Namespaces) => Mode::Namespaces,
            Isolation::Sandboxed(_) => Mode::Process,
        };
        self.stage(policy, mode, required, Some(line))
    }

    fn stage(
        &self,
        policy: &Policy,
        mode: Mode,
        required: Vec<Part>,
        line: Option<&str>,
    ) -> Command {
        let request = Request {
            stage: Stage::Outer,
            launcher: self.program.clone(),
            policy: policy.clone(),
            required,
            mode,
            parent: std::process::id(),
            line: line.map(str::to_owned),
            scratch: None,
        };
        request.command()
    }
}

impl Request {
    /// Returns a process for the stage of this request.
    pub fn command(&self) -> Command {
        let json = serde_json::to_string(self).expect("a request is plain data");
        let (program, arguments) = self.launcher.split_first().expect("a launcher has a program");
        let mut command = Command::new(program);
        command.args(arguments).arg(STAGE_ARGUMENT).arg(json);
        command
    }
}

/// Runs a stage of the sandbox if these are the arguments of one, and returns the exit status of the
/// program. Returns `None` for all other arguments.
pub fn run_stage(arguments: impl IntoIterator<Item = OsString>) -> Option<u8> {
    let mut arguments = arguments.into_iter().skip(1);
    if arguments.next()? != STAGE_ARGUMENT {
        return None;
    }
    #[cfg(target_os = "linux")]
    {
        let request = arguments.next().and_then(|json| serde_json::from_str(json.to_str()?).ok());
        Some(request.map_or(SETUP_FAILED, |request| crate::linux::run(&request)))
    }
    #[cfg(not(target_os = "linux"))]
    Some(125)
}
