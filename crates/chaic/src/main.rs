//! The command `chaic`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(chaic::run(std::env::args_os()))
}
