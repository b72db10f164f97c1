//! Configuration file of a training.

use std::path::Path;

use chaic_files::{large_integer, read_bounded, read_user_file, toml_message};
use serde::de::DeserializeOwned;
use toml::Table;

use crate::bounds;
use crate::trainer::{Trainer, TrainingError};

/// Maximum size of a configuration file, bytes: a thousand times the size of the longest
/// configuration.
const MAX_BYTES: u64 = 1 << 22;

/// Reads a configuration file that a user named; missing keys get their defaults.
///
/// # Errors
/// [`TrainingError::Config`] if a key is unknown, a value is out of bounds, or an input file that it
/// names cannot be used.
pub fn read_config<T: Trainer>(path: &Path) -> Result<T::Config, TrainingError> {
    parse_bytes(path, &read_user_file(path, MAX_BYTES)?, parse_config::<T>)
}

/// Reads a configuration file, if given, and changes the keys that a user assigned on the command
/// line: `KEY=VALUE` with a TOML key such as `rollout.image_size` and a TOML value, or text without
/// quotes. The key may be an old name. Missing keys get their defaults. Input files that the
/// assignments replace are not read.
///
/// # Errors
/// As [`read_config`], and if an assignment is not of this form.
pub fn read_config_with<T: Trainer>(
    path: Option<&Path>,
    assignments: &[String],
) -> Result<T::Config, TrainingError> {
    if assignments.is_empty() {
        return path.map_or_else(|| Ok(T::Config::default()), read_config::<T>);
    }
    // The whole configuration is checked only after the assignments.
    let read = |path: &Path| {
        let bytes = read_user_file(path, MAX_BYTES)?;
        parse_bytes(path, &bytes, parse_values::<T>)
    };
    let config = path.map(read).transpose()?.unwrap_or_default();
    let mut table = Table::try_from(config).expect("a configuration serializes to TOML");
    for assignment in assignments {
        let invalid =
            |problem: &str| TrainingError::InvalidConfig(format!("--set {assignment}: {problem}"));
        let assigned = parse_assignment(assignment).map_err(|problem| invalid(&problem))?;
        table = assign::<T>(&table, assigned);
        if let Err(problem) = parse::<T::Config>(&table.to_string()) {
            // Bounds are checked first, because their errors name the key.
            bounds::check(&table, T::BOUNDS).map_err(TrainingError::InvalidConfig)?;
            return Err(invalid(without_line(&problem)));
        }
    }
    let config = parse_config::<T>(&table.to_string());
    config.map_err(|problem| TrainingError::InvalidConfig(without_line(&problem).to_owned()))
}

/// Parses `KEY=VALUE` as a table with one value.
fn parse_assignment(text: &str) -> Result<Table, String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE")?;
    let as_written = toml::from_str(&format!("{key} = {value}"));
    as_written.or_else(|_| match large_integer(value.trim()) {
        Some(problem) => Err(problem),
        None => parse(&format!("{key} = {}", toml::Value::from(value))),
    })
}

/// Returns the complete table of a configuration with one assignment merged into it. Old names in
/// the assignment are replaced, because the table has current names only.
fn assign<T: Trainer>(table: &Table, mut assignment: Table) -> Table {
    loop {
        let mut merged = table.clone();
        merge(&mut merged, assignment.clone());
        let problem = parse::<T::Config>(&merged.to_string()).err();
        let current = problem.as_deref().and_then(duplicate_field);
        match current.and_then(|current| with_current_key(table, &assignment, current)) {
            Some(renamed) => assignment = renamed,
            None => return merged,
        }
    }
}

/// Returns the name in a message of [`parse`] about a key that is set under two names.
fn duplicate_field(message: &str) -> Option<&str> {
    let (_, rest) = message.split_once("duplicate field `")?;
    rest.split_once('`').map(|(name, _)| name)
}

/// Renames the outermost key of an assignment that is not in `table` to `current`, which is.
fn with_current_key(table: &Table, assignment: &Table, current: &str) -> Option<Table> {
    let (key, value) = assignment.iter().next().filter(|_| assignment.len() == 1)?;
    let (key, value) = match (table.get(key), value) {
        (None, value) if table.contains_key(current) => (current.to_owned(), value.clone()),
        (Some(toml::Value::Table(table)), toml::Value::Table(inner)) => {
            (key.clone(), toml::Value::Table(with_current_key(table, inner, current)?))
        }
        _ => return None,
    };
    Some(Table::from_iter([(key, value)]))
}

/// Copies the values of one table to another, recursively.
fn merge(to: &mut Table, from: Table) {
    for (key, value) in from {
        match (to.get_mut(&key), value) {
            (Some(toml::Value::Table(to)), toml::Value::Table(from)) => merge(to, from),
            (_, value) => {
                to.insert(key, value);
            }
        }
    }
}

/// Removes the line number of a message about a text that the user has not written.
fn without_line(message: &str) -> &str {
    let after = message.strip_prefix("line ").and_then(|rest| rest.split_once(": "));
    after.map_or(message, |(_, rest)| rest)
}

/// Reads the configuration in a training folder.
///
/// # Errors
/// As [`read_config`], and if the file is a link.
pub(crate) fn read_written_config<T: Trainer>(path: &Path) -> Result<T::Config, TrainingError> {
    parse_bytes(path, &read_bounded(path, MAX_BYTES)?, parse_config::<T>)
}

fn parse_bytes<C>(
    path: &Path,
    bytes: &[u8],
    parse_text: impl FnOnce(&str) -> Result<C, String>,
) -> Result<C, TrainingError> {
    let invalid = |problem: String| TrainingError::Config { path: path.to_owned(), problem };
    let text = std::str::from_utf8(bytes).map_err(|e| invalid(e.to_string()))?;
    parse_text(text).map_err(invalid)
}

/// Parses the text of a configuration file.
///
/// # Errors
/// One line that describes the problem.
pub fn parse_config<T: Trainer>(text: &str) -> Result<T::Config, String> {
    let config = parse_values::<T>(text)?;
    // The text may hold aliases, which have no bounds; the parsed configuration holds current keys.
    check_config::<T>(&config)?;
    Ok(config)
}

/// Parses a configuration without checking it as a whole.
fn parse_values<T: Trainer>(text: &str) -> Result<T::Config, String> {
    // Bounds come first: the parser would refuse -1 without naming key and bounds.
    let table: Table = parse(text)?;
    bounds::check(&table, T::BOUNDS)?;
    Ok(with_nested_defaults::<T>(table, parse(text)?))
}

/// Gives the missing keys of inner tables the defaults of this training. The defaults of the table's
/// own type may differ: `[ppo]` alone has the defaults of Stable-Baselines3. `config` is the parsed
/// `table`.
fn with_nested_defaults<T: Trainer>(mut table: Table, mut config: T::Config) -> T::Config {
    let defaults = Table::try_from(T::Config::default()).expect("defaults serialize to TOML");
    for missing in missing_values(&table, &defaults) {
        let mut extended = table.clone();
        merge(&mut extended, missing);
        // A key that is set under its old name is refused as a duplicate, and keeps its value.
        if let Ok(extended_config) = extended.clone().try_into::<T::Config>() {
            (table, config) = (extended, extended_config);
        }
    }
    config
}

/// Returns the defaults that are missing in the inner tables of `table`, each in a table of its own.
fn missing_values(table: &Table, defaults: &Table) -> Vec<Table> {
    let mut missing = Vec::new();
    for (key, default) in defaults {
        let (Some(toml::Value::Table(inner)), toml::Value::Table(default)) =
            (table.get(key), default)
        else {
            continue;
        };
        let mut of_inner = missing_values(inner, default);
        for (name, value) in default {
            if !inner.contains_key(name) {
                of_inner.push(Table::from_iter([(name.clone(), value.clone())]));
            }
        }
        let nested = |one: Table| Table::from_iter([(key.clone(), toml::Value::Table(one))]);
        missing.extend(of_inner.into_iter().map(nested));
    }
    missing
}

/// Checks a configuration that was not read from a file.
///
/// # Errors
/// One line that describes the problem.
pub fn check_config<T: Trainer>(config: &T::Config) -> Result<(), String> {
    let table = Table::try_from(config).map_err(|e| e.to_string())?;
    bounds::check(&table, T::BOUNDS)?;
    T::check(config)
}

/// Returns the text of a configuration file, with the bounds of each number as a comment.
pub fn config_text<T: Trainer>(config: &T::Config) -> String {
    let text = toml::to_string(config).expect("a checked configuration serializes to TOML");
    bounds::annotate(&text, T::BOUNDS)
}

fn parse<R: DeserializeOwned>(text: &str) -> Result<R, String> {
    toml::from_str(text).map_err(|error| {
        let mut message = error.message().to_owned();
        // A key that occurs twice under one name is called a duplicate key.
        if message.starts_with("duplicate field") {
            message += ": it is set under its current and under its old name; remove one";
        }
        toml_message(text, error.span(), &message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_values_are_those_of_present_inner_tables() {
        let table: Table = toml::from_str("x = 1\n[a]\nb = 2\n[a.c]\nd = 3\n").unwrap();
        let defaults = "x = 0\ny = 0\n[a]\nb = 0\ne = 5\n[a.c]\nd = 0\nf = 6\n[g]\nh = 7\n";
        let mut merged = table.clone();
        let missing = missing_values(&table, &toml::from_str(defaults).unwrap());
        assert_eq!(missing.len(), 2);
        missing.into_iter().for_each(|one| merge(&mut merged, one));
        let expected = "x = 1\n[a]\nb = 2\ne = 5\n[a.c]\nd = 3\nf = 6\n";
        assert_eq!(merged, toml::from_str(expected).unwrap());
    }

    #[test]
    fn integers_beyond_64_bits_are_named() {
        let huge = "9".repeat(50);
        for literal in
            ["9223372036854775808", "-9223372036854775809", &huge, "0x1_0000000000000000"]
        {
            let problem = parse::<Table>(&format!("a = 1\n[b]\nc = {literal}\n")).unwrap_err();
            let expected = format!("line 3: {literal} exceeds 64 bits; integers are from -9223");
            assert!(problem.starts_with(&expected), "{problem}");
        }
    }

    #[test]
    fn assignments_are_toml_or_text_and_merge_into_tables() {
        let mut table: Table = toml::from_str("a = 1\n[b]\nc = 2\nd = 3\n").unwrap();
        for assignment in ["b.c=4", "b.e = [\"x\", \"y\"]", "f=../some file", "b.d=true"] {
            merge(&mut table, parse_assignment(assignment).unwrap());
        }
        let expected = "a = 1\nf = \"../some file\"\n[b]\nc = 4\nd = true\ne = [\"x\", \"y\"]\n";
        assert_eq!(table, toml::from_str(expected).unwrap());
        let large = parse_assignment("b.c=99_999_999_999_999_999_999").unwrap_err();
        assert!(large.starts_with("99_999_999_999_999_999_999 exceeds 64 bits"), "{large}");
        for wrong in ["a", "", "=3", "a b=3"] {
            let problem = parse_assignment(wrong).unwrap_err();
            assert!(!problem.is_empty() && !problem.contains('\n'), "{wrong}: {problem}");
        }
    }
}
