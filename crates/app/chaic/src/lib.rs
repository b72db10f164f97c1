//! The command `chaic`: a door to the crates, without logic of its own.
//!
//! **What it is not**: an interface for programs. Those use the crates that it uses; this library is there for
//! who carries the same command, like chaic's Python package.

// What is printed goes through `output`, which escapes control characters.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod commands;
mod exit;
mod interrupt;
mod output;

use std::ffi::OsString;

use chaic_sandbox::Launcher;
use clap::Parser as _;

use crate::arguments::{Arguments, Command};

/// Runs the command with these arguments, the first of which is its name, and returns its exit code
/// (docs/reference/exit-codes.md). It takes Ctrl-C for itself, so that a process should do it once and end.
/// `launcher` starts the sandboxes of helpers in other processes.
pub fn run(arguments: impl IntoIterator<Item = OsString>, launcher: &Launcher) -> u8 {
    let command = match Arguments::try_parse_from(arguments) {
        Ok(Arguments { command }) => command,
        Err(refusal) => {
            // Nobody is left to be told if this fails.
            let _ = refusal.print();
            return if refusal.use_stderr() { exit::USAGE } else { exit::OK };
        }
    };
    let ended = match command {
        Command::Eval(arguments) => commands::eval::run(&arguments, launcher),
        Command::Merge(arguments) => commands::merge::run(&arguments),
        Command::Report(arguments) => commands::report::run(&arguments),
        Command::Verify(arguments) => commands::verify::run(&arguments),
        Command::Fidelity(arguments) => commands::fidelity::run(&arguments),
        Command::Collect(command) => commands::collect::collect(&command),
        Command::Train(command) => commands::train::train(&command),
        Command::EvalPerception(command) => commands::perception::evaluate(&command),
        Command::EvalOpponent(arguments) => commands::opponent::evaluate(&arguments),
        Command::Export(command) => commands::export::export(&command),
        Command::Replay(arguments) => commands::replay::run(&arguments),
        Command::Render(arguments) => commands::render::run(&arguments),
        Command::Episodes(command) => commands::episodes::run(&command),
        Command::Scene(command) => commands::scene::run(&command),
        Command::Bench(command) => commands::bench::run(&command),
        Command::Import(command) => commands::import::run(&command),
        Command::Helper(command) => commands::helper::run(&command, launcher),
        Command::Llm(command) => commands::llm::run(&command),
    };
    match ended {
        Ok(ended) => ended.code(),
        Err(error) => {
            output::complain(&format!("error: {error:#}"));
            exit::of(&error)
        }
    }
}
