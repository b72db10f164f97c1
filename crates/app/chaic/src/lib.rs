//! The command `chaic`. It parses options, calls the other crates and prints results. It contains no other
//! logic.
//!
//! **What it is not**: an interface for programs. Programs use the crates of the lower layers. This library
//! exists for other programs that ship the same command, such as chaic's Python package.

// All output goes through `output`, which escapes control characters.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod commands;
mod exit;
mod interrupt;
mod output;
mod suggest;

use std::ffi::OsString;

use anyhow::Result;
use chaic_eval::EvalError;
use chaic_sandbox::Launcher;
use clap::{ColorChoice, FromArgMatches as _, ValueEnum as _};

use crate::arguments::{Arguments, Command, ModelEvaluation, PerceptionEvaluation};
use crate::exit::ExitStatus;
use crate::output::OutputFormat;

/// Runs the command with these arguments, the first of which is its name, and returns its exit code
/// (docs/reference/exit-codes.md).
///
/// It installs a handler for Ctrl-C, so a process should call it once and then end. `launcher` starts the sandboxes
/// of helper processes.
pub fn run(arguments: impl IntoIterator<Item = OsString>, launcher: &Launcher) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let color = color_choice(&arguments);
    let parsed = arguments::command()
        .color(color)
        .try_get_matches_from(arguments)
        .and_then(|matches| Arguments::from_arg_matches(&matches));
    let Arguments { output, command } = match parsed {
        Ok(parsed) => parsed,
        Err(message) => {
            // If this fails, there is no other place to report it.
            let _ = message.print();
            return if message.use_stderr() { exit::USAGE } else { exit::OK };
        }
    };
    output::configure(output.quiet, color);
    let result = check_format(output.format, &command)
        .and_then(|()| run_command(command, output.format, launcher));
    match result {
        Ok(status) => status.code(),
        Err(error) => {
            output::print_error(&format!("error: {}", suggest::message(&error)));
            exit::code_of(&error)
        }
    }
}

/// Returns the value of `--color`, which also applies to messages of the parser itself.
fn color_choice(arguments: &[OsString]) -> ColorChoice {
    let words: Vec<&str> = arguments.iter().filter_map(|argument| argument.to_str()).collect();
    let value = words.iter().enumerate().find_map(|(k, word)| match word.strip_prefix("--color") {
        Some("") => words.get(k + 1).copied(),
        Some(value) => value.strip_prefix('='),
        None => None,
    });
    value.and_then(|value| ColorChoice::from_str(value, false).ok()).unwrap_or_default()
}

/// Refuses formats that a command does not write.
fn check_format(format: OutputFormat, command: &Command) -> Result<()> {
    let is_report = matches!(command, Command::Report(_));
    if matches!(format, OutputFormat::Markdown | OutputFormat::Csv) && !is_report {
        let text = format!(
            "--format {} is for `chaic report` only; the formats are text and json",
            format.name()
        );
        return Err(EvalError::Options(text).into());
    }
    Ok(())
}

fn run_command(command: Command, format: OutputFormat, launcher: &Launcher) -> Result<ExitStatus> {
    match command {
        Command::Eval(arguments) => match &arguments.model {
            None => commands::eval::run(&arguments.run, format, launcher),
            Some(ModelEvaluation::Detection(arguments)) => {
                commands::perception::evaluate_detection(arguments, format)
            }
            Some(ModelEvaluation::Behavior(arguments)) => {
                commands::perception::evaluate_behavior(arguments, format)
            }
            Some(ModelEvaluation::Tracks(arguments)) => {
                commands::perception::evaluate_tracks(arguments, format)
            }
            Some(ModelEvaluation::Opponent(arguments)) => {
                commands::opponent::evaluate(arguments, format)
            }
        },
        Command::Merge(arguments) => commands::merge::run(&arguments, format),
        Command::Episodes(command) => commands::episodes::run(&command, format),
        Command::Import(command) => commands::import::run(&command, format),
        Command::Helper(command) => commands::helper::run(&command, format, launcher),
        Command::Llm(command) => commands::llm::run(&command, format),
        Command::Report(arguments) => commands::report::run(&arguments, format),
        Command::Show(arguments) => commands::show::run(&arguments, format),
        Command::List(command) => commands::list::run(&command, format),
        Command::Explain(arguments) => commands::explain::run(&arguments, format),
        Command::Replay(arguments) => commands::replay::run(&arguments, format),
        Command::View(arguments) => commands::view::run(&arguments, format),
        Command::Play(arguments) => commands::play::run(&arguments, format),
        Command::Study(command) => commands::study::run(&command, format, launcher),
        Command::Render(arguments) => commands::render::run(&arguments, format),
        Command::Scene(command) => commands::scene::run(&command, format),
        Command::Collect(command) => commands::collect::run(&command, format),
        Command::Train(command) => commands::train::run(&command, format),
        Command::Export(command) => commands::export::run(&command, format),
        Command::Verify(arguments) => commands::verify::run(&arguments, format),
        Command::Fidelity(arguments) => commands::fidelity::run(&arguments, format),
        Command::Bench(command) => commands::bench::run(&command, format),
        Command::Doctor => commands::doctor::run(format, launcher),
        Command::Submit(command) => commands::submit::run(&command, format, launcher),
        Command::Leaderboard(command) => commands::leaderboard::run(&command, format),
        Command::Completions(arguments) => commands::shell::completions(&arguments, format),
        Command::Man(arguments) => commands::shell::man(&arguments, format),
        Command::EvalPerception(PerceptionEvaluation::Detection(arguments)) => {
            commands::perception::evaluate_detection(&arguments, format)
        }
        Command::EvalPerception(PerceptionEvaluation::Behavior(arguments))
        | Command::EvalBehavior(arguments) => {
            commands::perception::evaluate_behavior(&arguments, format)
        }
        Command::EvalOpponent(arguments) => commands::opponent::evaluate(&arguments, format),
    }
}
