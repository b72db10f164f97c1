//! Runs an untrusted shell command with as few rights as the Linux kernel can leave it.
//!
//! **What it is**: [`Launcher`] starts the current program again as the sandbox's *outer* process. That
//! process enters new namespaces and starts the *inner* process, which builds a private root folder, gives
//! up all rights and becomes the shell. The outer process stays outside, watches memory and tasks, and ends
//! everything when the command or its parent ends.
//!
//! ```text
//! chaic ──► outer (watches, relays the exit status) ──► inner = PID 1 of the namespace: sh ──► command
//! ```
//!
//! **What it is not**: it knows no episodes, helpers or protocols, and does not decide which folders a
//! command needs.
//!
//! **Invariants**
//! - A program that uses [`Launcher::this_program`] calls [`run_stage`] first in its `main`.
//! - No process of a sandboxed command outlives the outer process (`PR_SET_PDEATHSIG` and the pid namespace),
//!   and the outer process ends within [some milliseconds](Launcher::command) of its caller's end.
//! - What [`Launcher::probe`] reports as enforced, every later start enforces, or the start fails.

mod isolation;
mod launcher;
#[cfg(target_os = "linux")]
mod linux;
mod policy;

pub use isolation::{Isolation, MissingPart, Part};
pub use launcher::{Launcher, STAGE_ARGUMENT, SandboxError, run_stage};
pub use policy::{Policy, PolicyError};
