//! Launcher of sandboxed commands.

use std::ffi::OsString;
use std::io;
use std::process::{Command, Stdio};

use crate::isolation::{Isolation, IsolationPart};
use crate::policy::Policy;
use crate::request::{Mode, Request, STAGE_ARGUMENT, Stage};

/// A sandbox that cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum SandboxError {
    /// The stage program cannot be started.
    #[error("can't start the sandbox: {0}")]
    Start(#[from] io::Error),
    /// The stage ended without a report.
    #[error("the sandbox reported no enforced parts: {0}")]
    Probe(String),
}

/// Program that starts the stages of a sandbox; it calls [`run_stage`] first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Launcher {
    program: Vec<OsString>,
}

impl Launcher {
    /// Uses the running program, whose `main` must call [`run_stage`] first.
    pub fn this_program() -> Launcher {
        // The path also works after the file was replaced by a newer build.
        Launcher { program: vec!["/proc/self/exe".into()] }
    }

    /// Uses another program with arguments before those of the stage, for example an interpreter.
    pub fn new(program: impl IntoIterator<Item = OsString>) -> Launcher {
        Launcher { program: program.into_iter().collect() }
    }

    /// Starts an empty sandbox and returns what the system enforces for this policy.
    ///
    /// # Errors
    /// If the program of the launcher cannot be started or does not call [`run_stage`].
    pub fn probe(&self, policy: &Policy) -> Result<Isolation, SandboxError> {
        if cfg!(not(target_os = "linux")) {
            return Ok(Isolation::unsupported("the sandbox requires Linux"));
        }
        match self.try_probe(policy, Mode::Namespaces)? {
            Ok(isolation) => Ok(isolation),
            Err(reason) => match self.try_probe(policy, Mode::Process)? {
                Ok(isolation) => Ok(isolation.without_namespaces(reason)),
                Err(second) => Ok(Isolation::unsupported(&second)),
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
        let message = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        if !output.status.success() {
            return Ok(Err(message));
        }
        serde_json::from_slice(&output.stdout)
            .map(Ok)
            .map_err(|e| SandboxError::Probe(format!("{e}; {message}")))
    }

    /// Returns a process that runs a shell command line under a policy and enforces the parts in
    /// `isolation`, none for [`Isolation::Trusted`]. The caller sets up its standard streams and
    /// environment. SIGTERM, or the end of the caller, ends the process and all processes of the
    /// command.
    pub fn command(&self, policy: &Policy, isolation: &Isolation, line: &str) -> Command {
        let required = isolation.enforced();
        let mode = match isolation {
            Isolation::Trusted => Mode::Trusted,
            Isolation::Sandboxed(_) if required.contains(&IsolationPart::Namespaces) => {
                Mode::Namespaces
            }
            Isolation::Sandboxed(_) => Mode::Process,
        };
        self.stage(policy, mode, required, Some(line))
    }

    fn stage(
        &self,
        policy: &Policy,
        mode: Mode,
        required: Vec<IsolationPart>,
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

/// Runs a stage of the sandbox if the arguments request one, and returns the exit status of the
/// program. Returns `None` for all other arguments.
pub fn run_stage(arguments: impl IntoIterator<Item = OsString>) -> Option<u8> {
    let mut arguments = arguments.into_iter().skip(1);
    if arguments.next()? != STAGE_ARGUMENT {
        return None;
    }
    #[cfg(target_os = "linux")]
    {
        let request = arguments.next().and_then(|json| serde_json::from_str(json.to_str()?).ok());
        Some(request.map_or(crate::request::SETUP_FAILED, |request| crate::linux::run(&request)))
    }
    #[cfg(not(target_os = "linux"))]
    Some(125)
}
