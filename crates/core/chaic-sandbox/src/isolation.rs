//! Restrictions that a sandbox enforces.

use std::fmt;

use serde::{Deserialize, Serialize};

/// One layer of the sandbox.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IsolationPart {
    /// User, pid, mount, network, IPC, UTS and cgroup namespaces with a private root folder.
    Namespaces,
    /// Landlock: only files in the readable and private folders can be opened.
    Landlock,
    /// A filter of system calls: no ptrace, mounts, new namespaces, io_uring, or non-local sockets.
    Seccomp,
    /// Limits on memory and tasks, summed over all processes of the command.
    Limits,
}

impl IsolationPart {
    /// All parts.
    pub const ALL: [IsolationPart; 4] = [
        IsolationPart::Namespaces,
        IsolationPart::Landlock,
        IsolationPart::Seccomp,
        IsolationPart::Limits,
    ];

    /// Name in records and messages.
    pub fn name(self) -> &'static str {
        match self {
            IsolationPart::Namespaces => "namespaces",
            IsolationPart::Landlock => "landlock",
            IsolationPart::Seccomp => "seccomp",
            IsolationPart::Limits => "limits",
        }
    }
}

/// A part that the system does not support.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissingPart {
    /// The part.
    pub part: IsolationPart,
    /// Reason, as reported by the system.
    pub reason: String,
}

/// Restrictions of a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Isolation {
    /// No restrictions, by the user's choice: the command has all rights of its user.
    Trusted,
    /// A sandbox with its missing parts.
    Sandboxed(Vec<MissingPart>),
}

impl Isolation {
    /// Returns the isolation of a system that supports no part.
    pub(crate) fn unsupported(reason: &str) -> Isolation {
        let missing = |part| MissingPart { part, reason: reason.to_owned() };
        Isolation::Sandboxed(IsolationPart::ALL.map(missing).to_vec())
    }

    /// Adds namespaces to the missing parts.
    pub(crate) fn without_namespaces(self, reason: String) -> Isolation {
        let mut missing = match self {
            Isolation::Trusted => return Isolation::Trusted,
            Isolation::Sandboxed(missing) => missing,
        };
        missing.insert(0, MissingPart { part: IsolationPart::Namespaces, reason });
        Isolation::Sandboxed(missing)
    }

    /// Returns the parts that are enforced.
    pub(crate) fn enforced(&self) -> Vec<IsolationPart> {
        let Isolation::Sandboxed(missing) = self else { return Vec::new() };
        let is_enforced = |part: &IsolationPart| missing.iter().all(|m| m.part != *part);
        IsolationPart::ALL.into_iter().filter(is_enforced).collect()
    }
}

impl fmt::Display for Isolation {
    /// Writes the text for traces and reports, such as `sandbox without landlock`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Isolation::Trusted => f.write_str("trusted"),
            Isolation::Sandboxed(missing) if missing.is_empty() => f.write_str("sandbox"),
            Isolation::Sandboxed(missing) => {
                let names: Vec<_> = missing.iter().map(|m| m.part.name()).collect();
                write!(f, "sandbox without {}", names.join(", "))
            }
        }
    }
}
