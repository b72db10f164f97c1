//! The command `chaic`.

use std::process::ExitCode;

use chaic_sandbox::{Launcher, run_stage};

fn main() -> ExitCode {
    // This program is also what sandboxes of helpers in other processes start.
    if let Some(status) = run_stage(std::env::args_os()) {
        return ExitCode::from(status);
    }
    ExitCode::from(chaic::run(std::env::args_os(), &Launcher::this_program()))
}
