//! The command `chaic`.

use std::process::ExitCode;

use chaic_sandbox::{Launcher, run_stage};

fn main() -> ExitCode {
    // Sandboxes of helper processes start this program again.
    if let Some(status) = run_stage(std::env::args_os()) {
        return ExitCode::from(status);
    }
    ExitCode::from(chaic::run(std::env::args_os(), &Launcher::this_program()))
}
