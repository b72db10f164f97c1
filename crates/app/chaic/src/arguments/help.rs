//! Help texts: commands in groups, and three examples for each command.

use std::fmt::Write as _;

use clap::{Command, CommandFactory as _};

use super::Arguments;
use super::examples::examples;

/// Headings of `chaic --help` with their commands. Hidden commands have no group.
pub(super) const GROUPS: [(&str, &[&str]); 6] = [
    ("Play", &["eval", "merge", "play", "study", "episodes", "import", "helper", "llm"]),
    ("Inspect", &["report", "show", "list", "explain", "replay", "view", "render", "scene"]),
    ("Learn", &["collect", "train", "export"]),
    ("Check", &["verify", "fidelity", "bench", "doctor"]),
    ("Contest", &["submit", "leaderboard"]),
    ("Shell", &["completions", "man", "help"]),
];
const EXIT_CODES: &str = "Exit codes: 0 success, 1 failure or a reported problem, 2 invalid request, \
                          130 Ctrl-C; docs/reference/exit-codes.md.";
/// Longest line of help texts, characters.
const MAX_COLUMNS: usize = 100;

/// Returns the parser of the command line with its help texts.
pub fn command() -> Command {
    let command = Arguments::command().max_term_width(MAX_COLUMNS);
    let template = root_template(&command);
    let command = with_examples(command, "chaic").help_template(template);
    let examples = command.get_after_long_help().map(ToString::to_string).unwrap_or_default();
    command.after_help(EXIT_CODES).after_long_help(format!("{examples}\n{EXIT_CODES}"))
}

/// Returns the template of the root's help, which lists commands by group.
fn root_template(command: &Command) -> String {
    let header = command.get_styles().get_header();
    let literal = command.get_styles().get_literal();
    let names = GROUPS.iter().flat_map(|(_, names)| names.iter());
    let width = names.map(|name| name.len()).max().unwrap_or_default();
    let mut text = String::from("{about-with-newline}\n{usage-heading} {usage}\n");
    for (title, names) in GROUPS {
        let _ = writeln!(text, "\n{header}{title}:{header:#}");
        for name in names {
            let about = command.find_subcommand(name).and_then(Command::get_about);
            let about =
                about.map_or_else(|| "Print the help of a command".into(), ToString::to_string);
            let _ = writeln!(text, "  {literal}{name:width$}{literal:#}  {about}");
        }
    }
    let _ = write!(text, "\n{header}Options:{header:#}\n{{options}}{{after-help}}");
    text
}

/// Adds the examples to the long help of a command and of its subcommands.
fn with_examples(command: Command, path: &str) -> Command {
    let names: Vec<String> =
        command.get_subcommands().map(|inner| inner.get_name().to_owned()).collect();
    let mut command = match examples().find(|(command, _)| *command == path) {
        Some((_, examples)) => {
            let header = command.get_styles().get_header();
            let mut text = format!("{header}Examples:{header:#}\n");
            for (purpose, line) in examples {
                let _ = writeln!(text, "  # {purpose}\n  {line}");
            }
            command.after_long_help(text)
        }
        None => command,
    };
    for name in names {
        let path = format!("{path} {name}");
        command = command.mut_subcommand(&name, |inner| with_examples(inner, &path));
    }
    command
}
