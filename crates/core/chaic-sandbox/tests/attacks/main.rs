//! Promise: no attack of a hostile command succeeds in the sandbox.
//!
//! Each attack of [`list`] runs in the sandbox, where it must fail, and trusted, where it must
//! succeed if docs/threat-model.md says so. An attack that never succeeds proves nothing. The
//! program is its own test runner, because it is also the stage of the sandbox.

#[cfg(target_os = "linux")]
mod list;
#[cfg(target_os = "linux")]
mod runner;

#[cfg(target_os = "linux")]
fn main() -> std::process::ExitCode {
    if let Some(status) = chaic_sandbox::run_stage(std::env::args_os()) {
        return status.into();
    }
    runner::main()
}

#[cfg(not(target_os = "linux"))]
fn main() {}
