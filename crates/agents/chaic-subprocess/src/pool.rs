//! Processes that serve one episode after the other, for commands that are slow to start.

use std::sync::{Mutex, PoisonError};

use crate::process::Process;

/// Processes of one command that wait for their next episode. They begin anew at each briefing, as the protocol
/// asks of every helper.
#[derive(Default)]
pub struct Pool {
    idle: Mutex<Vec<Process>>,
}

impl Pool {
    /// Takes a process that still runs.
    pub(crate) fn take(&self) -> Option<Process> {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(mut process) = idle.pop() {
            if !process.has_ended() {
                return Some(process);
            }
        }
        None
    }

    /// Keeps a process that answered everything in its episode.
    pub(crate) fn put(&self, mut process: Process) {
        process.begin_episode();
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(process);
    }
}
