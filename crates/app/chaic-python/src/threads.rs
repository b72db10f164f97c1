//! Parallel work without the interpreter lock, also in forked processes.
//!
//! A forked process has no running threads of its parent, so work on the parent's pool would never finish. Each
//! forked process therefore has its own pool.

use std::process;
use std::sync::{Mutex, OnceLock, PoisonError};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::runtime_error;

/// Process that loaded the module.
static LOADED_BY: OnceLock<u32> = OnceLock::new();
/// Thread pool of this forked process, with the process id. A pool of a parent process is not used.
static FORKED_POOL: Mutex<Option<(u32, &'static ThreadPool)>> = Mutex::new(None);

/// Stores the id of this process when the module is loaded.
pub fn remember_process() {
    LOADED_BY.get_or_init(process::id);
}

fn is_forked() -> bool {
    LOADED_BY.get().is_some_and(|id| *id != process::id())
}

/// Runs work without the interpreter lock.
///
/// # Errors
/// `RuntimeError` if a forked process can't start threads.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    if !is_forked() {
        return Ok(py.detach(work));
    }
    let id = process::id();
    let mut forked_pool = FORKED_POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let pool = match *forked_pool {
        Some((owner, pool)) if owner == id => pool,
        _ => {
            let built = ThreadPoolBuilder::new().build().map_err(runtime_error)?;
            let pool: &'static ThreadPool = Box::leak(Box::new(built));
            *forked_pool = Some((id, pool));
            pool
        }
    };
    drop(forked_pool);
    Ok(py.detach(|| pool.install(work)))
}

/// Returns an error in a forked process.
///
/// # Errors
/// `RuntimeError` in such a process.
pub fn refuse_fork() -> PyResult<()> {
    if is_forked() {
        return Err(runtime_error(
            "this process was forked from one that had loaded chaic; start it with spawn instead",
        ));
    }
    Ok(())
}
