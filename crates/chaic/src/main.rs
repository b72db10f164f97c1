//! The command `chaic`: a door to the crates, without logic of its own.

// What is printed goes through `output`, which escapes control characters.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod commands;
mod exit;
mod interrupt;
mod output;

use std::process::ExitCode;

use clap::Parser as _;

use crate::arguments::{Arguments, Command};

fn main() -> ExitCode {
    let Arguments { command } = Arguments::parse();
    let ended = match command {
        Command::Eval(arguments) => commands::eval::run(&arguments),
        Command::Report(arguments) => commands::report::run(&arguments),
        Command::Verify(arguments) => commands::verify::run(&arguments),
        Command::Fidelity(arguments) => commands::fidelity::run(&arguments),
        Command::Collect(command) => commands::collect::collect(&command),
        Command::Train(command) => commands::perception::train(&command),
        Command::EvalPerception(command) => commands::perception::evaluate(&command),
        Command::Replay(arguments) => commands::replay::run(&arguments),
        Command::Render(arguments) => commands::render::run(&arguments),
        Command::Episodes(command) => commands::episodes::run(&command),
        Command::Scene(command) => commands::scene::run(&command),
        Command::Bench(command) => commands::bench::run(&command),
        Command::Import(command) => commands::import::run(&command),
        Command::Helper(command) => commands::helper::run(&command),
        Command::Llm(command) => commands::llm::run(&command),
    };
    match ended {
        Ok(ended) => ended.into(),
        Err(error) => {
            output::complain(&format!("error: {error:#}"));
            exit::of(&error)
        }
    }
}
