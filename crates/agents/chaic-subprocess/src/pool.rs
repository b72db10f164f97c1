//! Pool of processes that serve several episodes, for commands that start slowly.

use std::sync::{Mutex, PoisonError};

use crate::process::HelperProcess;

/// Idle processes of one command. Each starts a new episode at its next briefing, as the protocol requires.
#[derive(Default)]
pub struct Pool {
    idle: Mutex<Vec<HelperProcess>>,
}

impl Pool {
    /// Takes an idle process that still runs.
    pub(crate) fn take(&self) -> Option<HelperProcess> {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(mut process) = idle.pop() {
            if !process.has_ended() {
                return Some(process);
            }
        }
        None
    }

    /// Returns a process that did not fail in its episode.
    pub(crate) fn put(&self, mut process: HelperProcess) {
        process.reset_waiting_time();
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(process);
    }
}
