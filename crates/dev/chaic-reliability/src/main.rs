//! Measures the reliability of the command `chaic`: file faults, kills, long runs and damaged input.
//!
//! **What it is not**: a part of the command. Only this program can let file operations fail.

mod command_output;
mod commands;
mod faults;
mod folder;
mod fuzz;
mod kills;
mod process_status;
mod scenario;
mod soak;
mod trial;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use chaic_files::faults::{FaultKind, FaultPlan};
use clap::{Parser, Subcommand};

use crate::faults::FaultOptions;
use crate::fuzz::FuzzOptions;
use crate::kills::KillOptions;
use crate::soak::SoakOptions;

#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Let each file operation of a command fail in each way, and complete the command afterwards.
    Faults(FaultOptions),
    /// Kill commands at random times, and complete them.
    Kills(KillOptions),
    /// Play many episodes in one process, and sample its memory, descriptors and threads.
    Soak(SoakOptions),
    /// Give changed inputs to each parser of data from outside.
    Fuzz(FuzzOptions),
    /// Run the command `chaic` with one fault; used by the other commands.
    #[command(hide = true)]
    Chaic {
        /// Kind of the fault.
        #[arg(long, requires = "path")]
        fault: Option<FaultKind>,
        /// File or folder of the operation that fails.
        #[arg(long)]
        path: Option<PathBuf>,
        /// Number of the operation among those on this path, 0 to 1000000000.
        #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1_000_000_000))]
        at: u32,
        /// File that gets a line for each file operation.
        #[arg(long)]
        log: Option<PathBuf>,
        /// Arguments of `chaic`.
        #[arg(last = true)]
        arguments: Vec<OsString>,
    },
}

fn main() -> ExitCode {
    let ended = match Arguments::parse().command {
        Command::Faults(options) => faults::run_all(&options),
        Command::Kills(options) => kills::run_all(&options),
        Command::Soak(options) => soak::run(&options),
        Command::Fuzz(options) => fuzz::run_all(&options),
        Command::Chaic { fault, path, at, log, arguments } => {
            let plan = |(kind, path)| FaultPlan { path, index: at as usize, kind };
            let fault = fault.zip(path).map(plan);
            return commands::run_chaic(fault, log.as_deref(), arguments);
        }
    };
    exit_code(ended)
}

/// Prints an error; the exit code is 1 after an error or a failed check.
fn exit_code(ended: Result<bool>) -> ExitCode {
    match ended {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
