//! Helpers and partners whose plans are chosen by a language model.
//!
//! **What it is**: a [`policy::LanguagePolicy`] for the planning agents of `chaic-agents`. The
//! agent's memory becomes a [`prompt_context`], which fills [`templates`] in six parts. A
//! [`client`] gets an answer from an [`endpoint`], limited by the [`rate_limiter`] and its budget,
//! or from a [`record`]. [`answer`] parses the number of a listed plan. [`language`] provides the
//! helpers of a run, and [`show`] prints requests and answers.
//!
//! **What it is not**: it knows no world and no hidden goal, executes no actions, and holds no task
//! rules. Offline commands do not need it; only the command line depends on it.
//!
//! **Invariants**
//! - A prompt contains only the memory, briefing and grants of its agent.
//! - The result of any answer is one of the listed plans.
//! - A key is in the request header only: in no file, message, log or error.
//! - The user [names](endpoint_preset) endpoint and key; a run folder never selects them.
//! - Each request and its reply are on disk before the plan is executed. The record replays the
//!   same episodes offline, bit for bit.
//! - Clocks serve time limits, waits and latencies only. Latency affects a result only if the
//!   settings charge for thinking, and then a replay uses the recorded latency.

pub mod endpoint_preset;
pub mod error;
pub mod key;
pub mod settings;

pub mod exchange;
pub mod prompt_context;
pub mod prompt_track;
pub mod templates;
pub mod tokens;

pub mod answer;
pub mod images;

pub mod endpoint;
pub mod rate_limiter;
pub mod record;

mod retry_after;

pub mod client;
pub mod policy;
pub mod session;

pub mod check;
pub mod language;
pub mod show;

pub use error::{LlmError, Result};
pub use language::LanguageHelpers;
pub use settings::Settings;
