//! The command `chaic`.

use std::process::ExitCode;

use chaic_sandbox::{Launcher, run_stage};

fn main() -> ExitCode {
    // A sandbox of a helper process starts this program again, for one stage of the sandbox.
    if let Some(status) = run_stage(std::env::args_os()) {
        return ExitCode::from(status);
    }
    ExitCode::from(chaic::run(std::env::args_os(), &Launcher::this_program()))
}
