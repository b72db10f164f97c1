//! Work beside Python: without its lock, and in processes that were forked.
//!
//! A process that forks takes its threads along in memory only: whoever waits in the child for a thread of the
//! parent's waits forever. So children have a pool of threads of their own.

use std::process;
use std::sync::{Mutex, OnceLock, PoisonError};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::failure;

/// The process that loaded the module.
static LOADED_BY: OnceLock<u32> = OnceLock::new();
/// The last child's pool; those of its forebears are never touched again.
static OF_CHILD: Mutex<Option<(u32, &'static ThreadPool)>> = Mutex::new(None);

/// Remembers which process this is; once, when the module is loaded.
pub fn remember_process() {
    LOADED_BY.get_or_init(process::id);
}

fn is_forked() -> bool {
    LOADED_BY.get().is_some_and(|id| *id != process::id())
}

/// Lets other Python threads run meanwhile.
///
/// # Errors
/// `RuntimeError` if a forked process gets no threads.
pub fn beside<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    if !is_forked() {
        return Ok(py.detach(work));
    }
    let id = process::id();
    let mut of_child = OF_CHILD.lock().unwrap_or_else(PoisonError::into_inner);
    let pool = match *of_child {
        Some((of, pool)) if of == id => pool,
        _ => {
            let built = ThreadPoolBuilder::new().build().map_err(failure)?;
            let pool: &'static ThreadPool = Box::leak(Box::new(built));
            *of_child = Some((id, pool));
            pool
        }
    };
    drop(of_child);
    Ok(py.detach(|| pool.install(work)))
}

/// Refuses what can't be done in a process that was forked.
///
/// # Errors
/// `RuntimeError` in such a process.
pub fn refuse_fork() -> PyResult<()> {
    if is_forked() {
        return Err(failure(
            "this process was forked from one that had loaded chaic; start it by spawn instead",
        ));
    }
    Ok(())
}
