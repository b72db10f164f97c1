//! Promises: every numeric option has a range, which its help states. Every command is in one group of the help, and
//! has three examples that parse. No help text has private terms.
//! A repeated task counts once.

use std::any::TypeId;

use chaic_core::TaskId;
use clap::{Arg, Command};

use super::examples::examples;
use super::{command, help, tasks};

/// Returns the commands below one, without hidden ones, by their full names.
fn visible_commands(parent: &Command, path: &str) -> Vec<(String, Command)> {
    let mut found = vec![(path.to_owned(), parent.clone())];
    let inner = parent.get_subcommands().filter(|inner| !inner.is_hide_set());
    for inner in inner.filter(|inner| inner.get_name() != "help") {
        found.extend(visible_commands(inner, &format!("{path} {}", inner.get_name())));
    }
    found
}

/// Splits a line like a shell, with single quotes only.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    for (k, part) in line.split('\'').enumerate() {
        if k % 2 == 1 {
            words.last_mut().expect("a word").push_str(part);
            continue;
        }
        for (n, word) in part.split(' ').enumerate() {
            if n > 0 {
                words.push(String::new());
            }
            words.last_mut().expect("a word").push_str(word);
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Returns whether an option takes a number.
fn is_numeric(option: &Arg) -> bool {
    let type_of_option = option.get_value_parser().type_id();
    let types = [
        TypeId::of::<u8>(),
        TypeId::of::<u16>(),
        TypeId::of::<u32>(),
        TypeId::of::<u64>(),
        TypeId::of::<usize>(),
        TypeId::of::<i64>(),
        TypeId::of::<f32>(),
        TypeId::of::<f64>(),
    ];
    types.into_iter().any(|number| type_of_option == number)
}

/// Returns the message with which the command refuses a value of an option.
fn refusal(root: &Command, path: &[String], option: &str, value: &str) -> String {
    let line = path.iter().map(String::as_str);
    let given = format!("--{option}={value}");
    let parsed = root.clone().try_get_matches_from(line.chain([given.as_str()]));
    parsed.expect_err("required options are missing").to_string()
}

/// Checks the numeric options of a command and its subcommands; returns their number.
fn check(root: &Command, command: &Command, path: &[String]) -> usize {
    let mut n_checked = 0;
    // The options of exec.rs state their ranges by units.
    let options = command
        .get_arguments()
        .filter(|a| is_numeric(a) && !a.get_id().as_str().starts_with("exec_"));
    for option in options {
        let name = option.get_long().expect("numeric options have names");
        let help = option.get_help().expect("options have help").to_string();
        let label = format!("{} --{name}: {help}", path.join(" "));
        for value in ["-1", "4294967296", "18446744073709551615", "1e308", "nan", "inf"] {
            let refused = refusal(root, path, name, value);
            assert!(refused.contains("invalid value"), "{label}: {value}: {refused}");
        }
        let range = ["-1", "18446744073709551615"].iter().find_map(|value| {
            let refused = refusal(root, path, name, value);
            let (_, rest) = refused.split_once(" is not in ")?;
            let (lower, upper) = rest.lines().next()?.split_once("..=")?;
            Some(format!("{lower} to {upper}"))
        });
        // Options in seconds have their own parser.
        let range = range.unwrap_or_else(|| "0.001 to 3600".to_owned());
        assert!(help.contains(&range), "{label} lacks {range}");
        n_checked += 1;
    }
    for inner in command.get_subcommands() {
        n_checked += check(root, inner, &[path, &[inner.get_name().to_owned()]].concat());
    }
    n_checked
}

#[test]
fn numeric_options_have_ranges_that_their_help_states() {
    let mut root = command();
    root.build();
    let n_checked = check(&root, &root, &["chaic".to_owned()]);
    assert!(n_checked >= 40, "{n_checked} options");
}

#[test]
fn every_command_is_in_one_group() {
    let root = command();
    let visible = root.get_subcommands().filter(|inner| !inner.is_hide_set());
    let mut names: Vec<&str> = visible.map(Command::get_name).chain(["help"]).collect();
    let mut grouped: Vec<&str> =
        help::GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
    names.sort_unstable();
    grouped.sort_unstable();
    assert_eq!(grouped, names);
}

#[test]
fn every_command_has_examples_that_parse() {
    let root = command();
    let commands = visible_commands(&root, "chaic");
    assert!(commands.len() > 40, "{} commands", commands.len());
    for (path, command) in &commands {
        let help = command.get_after_long_help().map(ToString::to_string).unwrap_or_default();
        assert!(help.contains("Examples:"), "{path} has no examples");
    }
    for (path, examples) in examples() {
        assert!(commands.iter().any(|(known, _)| known == path), "no command `{path}`");
        assert!(examples[0].1.starts_with(path), "{path}: the first example is another command");
        for (_, line) in examples {
            assert!(line.len() <= 96, "{path}: the help wraps {line}");
            let parsed = root.clone().try_get_matches_from(words(line));
            let is_help = |e: &clap::Error| e.kind() == clap::error::ErrorKind::DisplayHelp;
            if let Some(error) = parsed.err().filter(|e| !is_help(e)) {
                panic!("{path}: {line}: {error}");
            }
        }
    }
}

/// A served helper refuses a briefing without its grants.
#[test]
fn examples_with_a_served_helper_grant_what_it_needs() {
    let lines = examples().flat_map(|(_, examples)| examples.iter().map(|(_, line)| *line));
    let is_process = |line: &&str| line.contains("chaic helper serve ") && line.contains('\'');
    let processes: Vec<&str> = lines.filter(is_process).collect();
    assert_eq!(processes.len(), 2, "{processes:?}");
    for line in processes {
        assert!(line.contains("--exec-grants ids,goal_place"), "{line}");
    }
}

#[test]
fn help_has_standard_terms_and_short_lines() {
    for (path, mut command) in visible_commands(&command(), "chaic") {
        let help = command.render_long_help().to_string();
        let lower = help.to_lowercase();
        for word in ["usual", "somebody", "whoever", "told by", "go on with"] {
            assert!(!lower.contains(word), "{path}: {word}: {help}");
        }
        let about = command.get_about().expect("every command has a description").to_string();
        assert!(about.chars().count() <= 96, "{path}: {about}");
    }
}

#[test]
fn old_spellings_parse() {
    for line in [
        "chaic eval-perception detection --weights w --look varied --views 2",
        "chaic eval-perception behavior --perception gt",
        "chaic eval-behavior --look canonical",
        "chaic eval-opponent --weights w",
        "chaic collect detection --of validation --look varied --out d",
        "chaic collect behavior --of training --out d",
        "chaic collect opponent --of validation --out d",
        "chaic report run --format table",
        "chaic episodes list --format table",
    ] {
        let parsed = command().try_get_matches_from(words(line));
        assert!(parsed.is_ok(), "{line}: {}", parsed.expect_err("it failed"));
    }
}

/// Before a fix, `chaic export episodes` counted the episodes of a repeated task twice.
#[test]
fn a_repeated_task_counts_once() {
    let parsed = tasks("shopping,obstacle,shopping").expect("names of tasks");
    assert_eq!(parsed.0, [TaskId::Shopping, TaskId::Obstacle]);
}
