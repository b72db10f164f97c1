//! Terminal output: results on standard output; progress, warnings and errors on standard error.
//!
//! A closed pipe (`chaic ... | head`) is not an error.
//!
//! **Invariant:** all output of the command goes through this module. No control character of a model's answer, an
//! episode, a trace or a name reaches the terminal.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, Result};
use clap::{ColorChoice, ValueEnum};
use serde::Serialize;

/// Format of a result on standard output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum OutputFormat {
    /// Text for people.
    #[default]
    #[value(alias = "table")]
    Text,
    /// JSON for programs.
    Json,
    /// Markdown; `chaic report` only.
    #[value(name = "md")]
    Markdown,
    /// Comma-separated values; `chaic report` only.
    Csv,
}

impl OutputFormat {
    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            OutputFormat::Text => "text",
            OutputFormat::Json => "json",
            OutputFormat::Markdown => "md",
            OutputFormat::Csv => "csv",
        }
    }
}

/// Set by `--quiet`: no progress is printed.
static IS_QUIET: AtomicBool = AtomicBool::new(false);
/// Set if standard error is colored.
static IS_COLORED: AtomicBool = AtomicBool::new(false);

/// Applies `--quiet` and `--color` to the rest of the process.
pub fn configure(is_quiet: bool, color: ColorChoice) {
    let is_colored = match color {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => {
            let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
            let is_dumb = std::env::var_os("TERM").is_some_and(|value| value == "dumb");
            io::stderr().is_terminal() && !is_set("NO_COLOR") && !is_dumb
        }
    };
    IS_QUIET.store(is_quiet, Ordering::Relaxed);
    IS_COLORED.store(is_colored, Ordering::Relaxed);
}

/// Returns whether `--quiet` was given.
pub fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Writes text to standard output.
///
/// # Errors
/// If it cannot be written. A closed pipe is not an error.
pub fn print(text: &str) -> Result<()> {
    print_while_read(text).map(|_| ())
}

/// Like [`print`]; returns whether the reader still reads, so that long output can stop early.
///
/// # Errors
/// Those of [`print`].
pub fn print_while_read(text: &str) -> Result<bool> {
    let mut out = io::stdout().lock();
    match out.write_all(printable(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        result => result.map(|()| true).context("can't write to the standard output"),
    }
}

/// Writes the result of a command in the requested format; formats other than JSON print `text`.
///
/// # Errors
/// Those of [`print`].
pub fn print_result(format: OutputFormat, json: &impl Serialize, text: &str) -> Result<()> {
    match format {
        OutputFormat::Json => print(&(serde_json::to_string_pretty(json)? + "\n")),
        _ => print(text),
    }
}

/// Returns a path for JSON. Bytes that are not UTF-8 are replaced, since JSON has no way to write them.
pub fn json_path(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// Formats a count with a regular plural: `1 task`, `2 tasks`.
pub fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// Writes a line of progress to standard error, unless `--quiet` was given.
pub fn print_progress(line: &str) {
    if !is_quiet() {
        print_error(line);
    }
}

/// Writes a warning to standard error.
pub fn print_warning(text: &str) {
    print_error(&format!("warning: {text}"));
}

/// Writes a line to standard error. If that fails, there is no other place to report it.
///
/// `error:` and `warning:` at the start are colored if standard error is.
pub fn print_error(line: &str) {
    /// Labels at the start of lines, with their ANSI codes for bold red and bold yellow.
    const LABELS: [(&str, &str); 2] = [("error:", "\u{1b}[1;31m"), ("warning:", "\u{1b}[1;33m")];
    let line = printable(line);
    let mut err = io::stderr().lock();
    let label = LABELS.iter().find_map(|(label, color)| {
        Some((label, color, line.strip_prefix(label)?))
            .filter(|_| IS_COLORED.load(Ordering::Relaxed))
    });
    let _ = match label {
        Some((label, color, rest)) => writeln!(err, "{color}{label}\u{1b}[0m{rest}"),
        None => writeln!(err, "{line}"),
    };
}

/// Returns a text without control characters, except for line ends and tabs, and without characters that change
/// the direction of writing.
///
/// Such characters are escaped as in JSON, for example `\u001b`, so that JSON output stays valid.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_control) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_control(c) {
            let _ = write!(escaped, "\\u{:04x}", u32::from(c));
        } else {
            escaped.push(c);
        }
    }
    Cow::Owned(escaped)
}

fn is_control(c: char) -> bool {
    // Unicode Standard Annex 9: marks, embeddings, overrides and isolates of bidirectional text.
    let is_bidi = matches!(
        c,
        '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    );
    is_bidi || c.is_control() && c != '\n' && c != '\t'
}

/// Quotes a path as one word of a shell command.
pub fn quoted_path(path: &Path) -> String {
    quoted(&path.display().to_string()).into_owned()
}

/// Quotes an argument as one word of a shell command.
pub fn quoted(argument: &str) -> Cow<'_, str> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,@%+".contains(c);
    if !argument.is_empty() && argument.chars().all(is_plain) {
        return Cow::Borrowed(argument);
    }
    Cow::Owned(format!("'{}'", argument.replace('\'', "'\\''")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_control_character_is_printed() {
        for (text, expected) in [
            ("Grüße,\n\tund 日本", "Grüße,\n\tund 日本"),
            ("\u{1b}[2J\u{1b}]0;title\u{7}", "\\u001b[2J\\u001b]0;title\\u0007"),
            ("fine\rERROR", "fine\\u000dERROR"),
            ("\u{9b}31m \u{7f}\0", "\\u009b31m \\u007f\\u0000"),
            ("abc\u{202e}fed\u{2069}", "abc\\u202efed\\u2069"),
        ] {
            assert_eq!(printable(text), expected);
            let value: String = text.chars().filter(|c| *c != '\n' && *c != '\t').collect();
            let json = serde_json::to_string(&value).expect("a string serializes");
            let parsed: String = serde_json::from_str(&printable(&json)).expect("it is still JSON");
            assert_eq!(parsed, value, "JSON keeps its meaning");
        }
    }

    #[test]
    fn quoted_arguments_are_one_word_for_a_shell() {
        assert_eq!(quoted("http://127.0.0.1:8000/v1"), "http://127.0.0.1:8000/v1");
        assert_eq!(quoted(""), "''");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("$(x)'s"), "'$(x)'\\''s'");
    }
}
