//! The Python module `chaic._chaic`, which the package `chaic` (python/chaic) is built on.
//!
//! **What it is**: a door. It turns Python's arguments into calls of the crates, and what they give into
//! NumPy arrays, numbers and dictionaries. Long calls let other Python threads run.
//!
//! **What it is not**: it holds no rules, spaces or wrappers; those that follow the field's interfaces are
//! Python code.
//!
//! **Invariants**
//! - A user's mistake is a `ValueError`, `TypeError` or `IndexError` with one sentence; nothing panics.
//! - An object that one thread works with tells another one so (`RuntimeError`), in place of waiting.
//! - A forked process has threads of its own (`threads`), or is told to be spawned.
//! - The module draws no random numbers and keeps no state of its own but those threads.

mod action;
mod agent;
mod batch;
mod episode;
mod error;
mod isolated;
mod mind;
mod observation;
mod options;
mod threads;
mod world;

use std::ffi::OsString;

use chaic_sandbox::{Launcher, run_stage};
use pyo3::prelude::*;

/// Runs the command `chaic` with these arguments, the first of which is its name; returns its exit code.
/// `launcher` is a program with arguments that passes its further arguments to `run_sandbox_stage`.
#[pyfunction]
fn run_command(py: Python<'_>, arguments: Vec<OsString>, launcher: Vec<OsString>) -> u8 {
    py.detach(|| chaic::run(arguments, &Launcher::new(launcher)))
}

/// Runs a stage of a sandbox with these arguments, the first of which is a program's name; returns the exit
/// code, or `None` if they are not those of a stage.
#[pyfunction]
fn run_sandbox_stage(arguments: Vec<OsString>) -> Option<u8> {
    run_stage(arguments)
}

#[pymodule]
mod _chaic {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::agent::{evaluate, merge};
    #[pymodule_export]
    use super::batch::Batch;
    #[pymodule_export]
    use super::episode::{Episode, classes, encode_png, episode_ids, tasks};
    #[pymodule_export]
    use super::isolated::serve;
    #[pymodule_export]
    use super::mind::{Detector, Mind, Planner};
    #[pymodule_export]
    use super::observation::{Briefing, Observation};
    #[pymodule_export]
    use super::world::{Snapshot, World};
    #[pymodule_export]
    use super::{run_command, run_sandbox_stage};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::threads::remember_process();
        module.add("__version__", chaic_env::CHAIC_VERSION)?;
        module.add("ACTIONS", super::action::ACTIONS)?;
        module.add("OWN", super::action::OWN)?;
        module.add("PLAN", super::mind::PLAN)?;
        module.add("MAP", chaic_agents::memory::egocentric::CHANNELS)?;
        let weights = super::observation::plain(module.py(), &chaic_env::RewardWeights::STANDARD)?;
        module.add("REWARD", weights)
    }
}
