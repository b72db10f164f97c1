//! Helpers in other processes: `chaic eval --helper exec:COMMAND`.
//!
//! **What it is**: a [`SubprocessAgent`] starts a command for each episode, sends it the briefing and the
//! observations of its agent, and receives actions. [`message`] defines the messages, [`frame`] their
//! framing on standard input and output; docs/subprocess-helpers.md describes both for authors of
//! helpers in other languages. [`commands`] provides the helpers of a run, [`serve`] turns any
//! agent into such a process, and [`conformance`] tests a process against the protocol.
//!
//! **What it is not**: it knows no world, passes on no ids without a grant, and makes no decisions.
//!
//! **Invariants**
//! - The pipe carries the agent's briefing and observations only.
//! - A process that times out, fails, exceeds a limit or violates the protocol ends its own episode with a
//!   message. It never blocks or ends a run.
//! - A command runs in a sandbox (`chaic-sandbox`) unless its user trusts it, and traces record which.
//! - No process outlives its episode, except those of a pool, which serve several episodes of a run. On Linux
//!   this includes all its descendants; elsewhere, descendants that left its process group may remain.
//! - A process inherits environment variables of an allow-list only, and so no API keys.
//! - A command runs because the user named it, never because a run folder does.

pub mod agent;
pub mod commands;
pub mod confinement;
pub mod conformance;
pub mod environment;
pub mod frame;
pub mod message;
pub mod pool;
pub mod serve;

mod limits;
mod pipe;
mod process;
mod program;

pub use agent::SubprocessAgent;
pub use commands::CommandRegistry;
pub use confinement::{Confinement, ConfinementOptions};
pub use limits::{Limits, Refusal};
pub use pool::Pool;
pub use program::HelperProgram;
