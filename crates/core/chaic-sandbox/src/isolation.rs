//! Which restrictions a sandbox enforces.

use std::fmt;

use serde::{Deserialize, Serialize};

/// One layer of the sandbox.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// User, pid, mount, network, IPC, UTS and cgroup namespaces with a private root folder.
    Namespaces,
    /// Landlock: no file outside the readable and private folders can be opened.
    Landlock,
    /// A filter of system calls: no ptrace, mounts, new namespaces, io_uring, sockets other than local ones.
    Seccomp,
    /// Limits on memory and tasks, summed over all processes of the command.
    Limits,
}

impl Part {
    /// All parts.
    pub const ALL: [Part; 4] = [Part::Namespaces, Part::Landlock, Part::Seccomp, Part::Limits];

    /// Name in records and messages.
    pub fn name(self) -> &'static str {
        match self {
            Part::Namespaces => "namespaces",
            Part::Landlock => "landlock",
            Part::Seccomp => "seccomp",
            Part::Limits => "limits",
        }
    }
}

/// A part that the system does not offer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissingPart {
    /// The part.
    pub part: Part,
    /// Why it is missing.
    pub reason: String,
}

/// The restrictions under which a command runs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Isolation {
    /// None, by the user's choice: the command has all rights of its user.
    Trusted,
    /// A sandbox; empty if no part is missing.
    Sandboxed(Vec<MissingPart>),
}

impl Isolation {
    /// Returns the isolation of a system that offers no part.
    pub(crate) fn nothing(reason: &str) -> Isolation {
        let missing = |part| MissingPart { part, reason: reason.to_owned() };
        Isolation::Sandboxed(Part::ALL.map(missing).to_vec())
    }

    /// Adds namespaces to the missing parts.
    pub(crate) fn without_namespaces(self, reason: String) -> Isolation {
        let mut missing = match self {
            Isolation::Trusted => return Isolation::Trusted,
            Isolation::Sandboxed(missing) => missing,
        };
        missing.insert(0, MissingPart { part: Part::Namespaces, reason });
        Isolation::Sandboxed(missing)
    }

    /// Returns the parts that are enforced.
    pub(crate) fn enforced(&self) -> Vec<Part> {
        let Isolation::Sandboxed(missing) = self else { return Vec::new() };
        let is_there = |part: &Part| missing.iter().all(|m| m.part != *part);
        Part::ALL.into_iter().filter(is_there).collect()
    }
}

impl fmt::Display for Isolation {
    /// Writes the record that traces and reports carry, such as `sandbox without landlock`.
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
