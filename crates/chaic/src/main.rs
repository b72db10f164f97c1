//! The command `chaic`: a door to the crates, without logic of its own.

// What is printed goes through `output`, which escapes control characters.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod commands;
mod interrupt;
mod output;

use std::process::ExitCode;

use chaic_eval::EvalError;
use clap::Parser as _;

use crate::arguments::{Arguments, Command};

/// How a command ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ended {
    /// As intended.
    Well,
    /// It found something wrong, and has said what.
    WithFindings,
    /// By Ctrl-C.
    Interrupted,
}

fn main() -> ExitCode {
    let Arguments { command } = Arguments::parse();
    let ended = match command {
        Command::Eval(arguments) => commands::eval::run(&arguments),
        Command::Report(arguments) => commands::report::run(&arguments),
        Command::Verify(arguments) => commands::verify::run(&arguments),
        Command::Fidelity(arguments) => commands::fidelity::run(&arguments),
        Command::Replay(arguments) => commands::replay::run(&arguments),
        Command::Render(arguments) => commands::render::run(&arguments),
        Command::Episodes(command) => commands::episodes::run(&command),
        Command::Scene(command) => commands::scene::run(&command),
        Command::Bench(command) => commands::bench::run(&command),
        Command::Import(command) => commands::import::run(&command),
        Command::Llm(command) => commands::llm::run(&command),
    };
    match ended {
        Ok(Ended::Well) => ExitCode::SUCCESS,
        Ok(Ended::WithFindings) => ExitCode::FAILURE,
        Ok(Ended::Interrupted) => ExitCode::from(130),
        Err(error) => {
            output::complain(&format!("error: {error:#}"));
            // What was asked for can't be: as where the arguments can't even be read.
            let is_usage = error.downcast_ref().is_some_and(EvalError::is_usage);
            if is_usage { ExitCode::from(2) } else { ExitCode::FAILURE }
        }
    }
}
