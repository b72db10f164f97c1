//! Ctrl-C: the first asks the command to stop, the second ends the process.

use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, Result, anyhow};

use crate::exit;
use crate::output::print_error;

/// Set by the first Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);

/// Installs the handler and returns the flag that the first Ctrl-C sets. Call it once.
///
/// # Errors
/// If the system refuses the handler.
pub fn stop_flag() -> Result<&'static AtomicBool> {
    ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(exit::INTERRUPTED.into());
        }
        print_error("stopping; press Ctrl-C again to stop at once");
    })
    .map_err(|error| match error {
        ctrlc::Error::System(cause) => anyhow!(cause),
        other => anyhow!(other),
    })
    .context("can't listen for Ctrl-C")?;
    Ok(&STOP)
}
