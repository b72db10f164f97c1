//! Ctrl-C: the first asks to finish, the second ends at once.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::exit;
use crate::output::complain;

/// Raised by the first Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);

/// The flag that the first Ctrl-C raises. Call it once.
///
/// # Errors
/// If the system refuses the handler.
pub fn stop_flag() -> Result<&'static AtomicBool, ctrlc::Error> {
    ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(exit::INTERRUPTED.into());
        }
        complain("stopping; press Ctrl-C again to stop at once");
    })?;
    Ok(&STOP)
}
