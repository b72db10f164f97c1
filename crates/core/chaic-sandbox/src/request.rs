//! Requests to the stages of the sandbox.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

use serde::{Deserialize, Serialize};

use crate::isolation::IsolationPart;
use crate::policy::Policy;

/// First argument of a program that is started as a stage of the sandbox; the second is the
/// request.
pub const STAGE_ARGUMENT: &str = "__chaic-sandbox";

/// Exit status of a stage that cannot set up the sandbox; the reason is on its standard error.
#[cfg(target_os = "linux")]
pub(crate) const SETUP_FAILED: u8 = 125;

/// The two processes between the caller and the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Stage {
    /// Enters namespaces, starts the inner stage and watches it.
    Outer,
    /// Builds the root folder, drops rights and becomes the shell.
    Inner,
}

/// Mode of a sandbox.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Mode {
    /// No restrictions: the outer stage only monitors, and ends remaining processes.
    Trusted,
    /// The command runs in the caller's file system. It loses only the rights that a process can
    /// drop itself.
    Process,
    /// All restrictions, with namespaces and a private root folder.
    Namespaces,
}

/// Request to a stage: the JSON text of its second argument.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Request {
    /// The stage.
    pub stage: Stage,
    /// Program and arguments that start a stage.
    pub launcher: Vec<OsString>,
    /// Rights of the command.
    pub policy: Policy,
    /// Parts that must be enforced; otherwise the command does not start.
    pub required: Vec<IsolationPart>,
    /// Mode of the sandbox.
    pub mode: Mode,
    /// Process that started the outer stage, which ends with it.
    pub parent: u32,
    /// Shell command; `None` to only report the enforced parts.
    pub line: Option<String>,
    /// Private folder in [`Mode::Process`]; set by the outer stage.
    pub scratch: Option<PathBuf>,
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
