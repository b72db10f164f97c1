//! Minds in another process: `chaic eval --helper exec:COMMAND`.
//!
//! **What it is**: a [`SubprocessAgent`] starts a command for each episode, sends it what its agent is
//! told and perceives, and takes its actions. [`message`] says what is sent, [`frame`] how it is cut
//! into frames on standard input and output; docs/subprocess-helpers.md describes both for those who
//! write such a helper in another language. [`commands`] hands a run its helpers, [`serve`] lets any
//! mind of ours be such a process, [`conformance`] tries what a process does.
//!
//! **What it is not**: it knows no world, no ids that weren't granted, and decides nothing.
//!
//! **Invariants**
//! - What goes over the pipe is the agent's briefing and its observations, and nothing else.
//! - A process that is silent, broken, greedy or talks nonsense ends its own episode, by a message
//!   that says what it did, and never hangs or ends a run.
//! - A command runs in a sandbox (`chaic-sandbox`) unless its user trusts it, and the record says which.
//! - No process outlives its episode. On Linux nothing that it started does, either; elsewhere, what left its
//!   process group may.
//! - A process inherits environment variables of an allow-list only, so no API keys.
//! - A command is run because the user named it, never because a run's folder did.

pub mod agent;
pub mod commands;
pub mod confinement;
pub mod conformance;
pub mod environment;
pub mod frame;
pub mod message;
pub mod serve;

mod pipe;
pub mod pool;
mod process;

pub use agent::SubprocessAgent;
pub use commands::{Command, Commands, Limits, Refusal};
pub use confinement::{Confinement, ConfinementOptions};
pub use pool::Pool;
