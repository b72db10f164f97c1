//! Runs an untrusted shell command with minimal rights on Linux.
//!
//! **What it is**: [`Launcher`] starts the current program again as the *outer* process of the
//! sandbox. That process enters new namespaces and starts the *inner* process. The inner process
//! builds a private root folder, drops all rights and becomes the shell. The outer process monitors
//! memory and tasks, and ends all processes when the command or its parent ends.
//!
//! ```text
//! chaic ──► outer (monitors, relays the exit status) ──► inner = PID 1 of the namespace: sh ──► command
//! ```
//!
//! **What it is not**: it knows no episodes, helpers or protocols, and does not decide which
//! folders a command needs.
//!
//! **Invariants**
//! - A program that uses [`Launcher::this_program`] calls [`run_stage`] first in its `main`.
//! - No process of a sandboxed command outlives the outer process (`PR_SET_PDEATHSIG` and the pid
//!   namespace). The outer process ends within [some milliseconds](Launcher::command) of its
//!   caller's end.
//! - Every later start enforces what [`Launcher::probe`] reports as enforced, or the start fails.

mod isolation;
mod launcher;
#[cfg(target_os = "linux")]
mod linux;
mod policy;
mod request;

pub use isolation::{Isolation, IsolationPart, MissingPart};
pub use launcher::{Launcher, SandboxError, run_stage};
pub use policy::{Policy, PolicyError, named_files};
pub use request::STAGE_ARGUMENT;
