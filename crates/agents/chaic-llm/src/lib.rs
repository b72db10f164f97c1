//! Helpers and partners whose plans a language model chooses.
//!
//! **What it is**: a [`policy::LanguagePolicy`] for the minds of `chaic-agents`. What the mind's
//! own memory holds becomes [`prompt_context`], these fill [`templates`] in six parts, an [`asker`] gets an
//! answer (from an [`endpoint`], through the [`gate`] that keeps the budget, or from a [`record`]),
//! and [`answer`] reads the number of a listed plan in it. [`language`] hands a run its helpers,
//! [`show`] prints what was asked and answered.
//!
//! **What it is not**: it knows no world and no hidden goal, moves no body, and holds no rules of
//! a task. Nothing that runs offline needs it; only the command line depends on it.
//!
//! **Invariants**
//! - A prompt holds what its mind remembers, was briefed and was granted, and nothing else.
//! - Whatever a model answers, what comes of it is one of the plans that were listed to it.
//! - A key is in a request's header and nowhere else: in no file, message, log or error.
//! - Whom to ask, and with which key, is what the user [`named`]: never what a run's folder says.
//! - Every question and its reply is on the disk before the plan is followed; with the record the
//!   same episodes play again offline, bit for bit.
//! - Clocks are read for time limits, waits and latencies only. A latency moves a result only where
//!   the settings charge for thinking, and then the recorded one does.

pub mod error;
pub mod key;
pub mod named;
pub mod settings;

pub mod exchange;
pub mod prompt_context;
pub mod templates;
pub mod tokens;

pub mod answer;
pub mod pictures;

pub mod endpoint;
pub mod gate;
pub mod record;

mod retry_after;

pub mod asker;
pub mod policy;
pub mod session;

pub mod check;
pub mod language;
pub mod show;

pub use error::{LlmError, Result};
pub use language::Language;
pub use settings::Settings;
