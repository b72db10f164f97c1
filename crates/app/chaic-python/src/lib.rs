//! Native module `chaic._chaic` of the Python package `chaic` (python/chaic).
//!
//! **What it is**: a binding. It converts Python arguments to calls of the crates, and their results to NumPy
//! arrays, numbers and dictionaries. Long calls release the interpreter lock.
//!
//! **What it is not**: it holds no rules, spaces or wrappers. The Gymnasium and PettingZoo interfaces are
//! Python code.
//!
//! **Invariants**
//! - A user's mistake raises `ValueError`, `TypeError` or `IndexError` with one sentence; nothing panics.
//! - An object in use by one thread raises `RuntimeError` in another one, and never blocks it.
//! - A forked process has its own thread pool (`threads`), or an error asks to spawn it instead.
//! - The module draws no random numbers and has no global state except these thread pools.

mod action;
mod agent;
mod batch;
mod episode;
mod error;
mod evaluate;
mod isolated;
mod observation;
mod options;
mod planning_agent;
mod reward;
mod threads;
mod world;

use std::ffi::OsString;

use chaic_sandbox::{Launcher, run_stage};
use pyo3::prelude::*;

/// Runs the command `chaic` and returns its exit code. The first argument is the name of the program.
/// `launcher` is a program with arguments that passes its further arguments to `run_sandbox_stage`.
#[pyfunction]
fn run_command(py: Python<'_>, arguments: Vec<OsString>, launcher: Vec<OsString>) -> u8 {
    py.detach(|| chaic::run(arguments, &Launcher::new(launcher)))
}

/// Runs a stage of a sandbox and returns its exit code; `None` if the arguments are not those of a stage. The
/// first argument is the name of the program.
#[pyfunction]
fn run_sandbox_stage(arguments: Vec<OsString>) -> Option<u8> {
    run_stage(arguments)
}

#[pymodule]
mod _chaic {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::batch::Batch;
    #[pymodule_export]
    use super::episode::{Episode, classes, encode_png, episode_ids, tasks};
    #[pymodule_export]
    use super::evaluate::{evaluate, merge};
    #[pymodule_export]
    use super::isolated::serve;
    #[pymodule_export]
    use super::observation::{Briefing, Observation};
    #[pymodule_export]
    use super::planning_agent::{Detector, Planner, PlanningAgent};
    #[pymodule_export]
    use super::reward::weigh_reward;
    #[pymodule_export]
    use super::world::{Snapshot, World};
    #[pymodule_export]
    use super::{run_command, run_sandbox_stage};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::threads::remember_process();
        module.add("__version__", chaic_env::CHAIC_VERSION)?;
        module.add("ACTIONS", super::action::ACTIONS)?;
        module.add("PROPRIOCEPTION", super::action::PROPRIOCEPTION)?;
        module.add("PLAN_FEATURES", super::planning_agent::PLAN_FEATURES)?;
        module.add("MAP", chaic_agents::memory::egocentric::CHANNELS)?;
        module.add("REWARD", super::reward::standard_weights())
    }
}
