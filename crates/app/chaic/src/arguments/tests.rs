//! Promise: every numeric option has a range, which its help states.

use std::any::TypeId;

use clap::{Arg, Command, CommandFactory as _};

use super::Arguments;

/// Returns whether an option takes a number.
fn is_numeric(option: &Arg) -> bool {
    let of_option = option.get_value_parser().type_id();
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
    types.into_iter().any(|of_number| of_option == of_number)
}

/// Returns how the command refuses this value of an option.
fn refusal(root: &Command, path: &[String], option: &str, value: &str) -> String {
    let line = path.iter().map(String::as_str);
    let given = format!("--{option}={value}");
    let parsed = root.clone().try_get_matches_from(line.chain([given.as_str()]));
    parsed.expect_err("options that are needed are missing").to_string()
}

/// Checks the numeric options of a command and of those below it; returns how many there are.
fn check(root: &Command, command: &Command, path: &[String]) -> usize {
    let mut n_checked = 0;
    // Those of exec.rs state their ranges by units.
    let all = command
        .get_arguments()
        .filter(|a| is_numeric(a) && !a.get_id().as_str().starts_with("exec_"));
    for option in all {
        let name = option.get_long().expect("numbers are options with names");
        let help = option.get_help().expect("options have help").to_string();
        let what = format!("{} --{name}: {help}", path.join(" "));
        for value in ["-1", "4294967296", "18446744073709551615", "1e308", "nan", "inf"] {
            let refused = refusal(root, path, name, value);
            assert!(refused.contains("invalid value"), "{what}: {value}: {refused}");
        }
        let range = ["-1", "18446744073709551615"].iter().find_map(|value| {
            let refused = refusal(root, path, name, value);
            let (_, rest) = refused.split_once(" is not in ")?;
            let (lower, upper) = rest.lines().next()?.split_once("..=")?;
            Some(format!("{lower} to {upper}"))
        });
        // Seconds have a parser of their own.
        let range = range.unwrap_or_else(|| "0.001 to 3600".to_owned());
        assert!(help.contains(&range), "{what} lacks {range}");
        n_checked += 1;
    }
    for inner in command.get_subcommands() {
        n_checked += check(root, inner, &[path, &[inner.get_name().to_owned()]].concat());
    }
    n_checked
}

#[test]
fn numeric_options_have_ranges_that_their_help_states() {
    let mut root = Arguments::command();
    root.build();
    let n_checked = check(&root, &root, &["chaic".to_owned()]);
    assert!(n_checked >= 40, "{n_checked} options");
}
