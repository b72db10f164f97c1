//! Writing to the terminal. Whoever reads may have gone (`chaic ... | head`): that's no error.
//!
//! **Invariant:** everything that the command prints goes through here, and no control character of a
//! model's answer, an episode, a trace or a name gets to the terminal.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::Path;

use anyhow::{Context as _, Result};

/// Writes text to the standard output.
///
/// # Errors
/// If it can't be written, unless nobody reads any more.
pub fn say(text: &str) -> Result<()> {
    say_to_reader(text).map(|_| ())
}

/// Like [`say`], for who has much to say: returns whether anybody reads on.
///
/// # Errors
/// Those of [`say`].
pub fn say_to_reader(text: &str) -> Result<bool> {
    let mut out = io::stdout().lock();
    match out.write_all(printable(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        other => other.map(|()| true).context("can't write to the standard output"),
    }
}

/// So many of what has a regular plural: `1 task`, `2 tasks`.
pub fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Writes a line to the standard error; where nobody hears it, nothing can be done.
pub fn complain(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", printable(line));
}

/// A text without control characters, but for line ends and tabs, and without those that change the
/// direction of writing. Each is written as JSON does, `\u001b` for example, so that JSON stays the
/// same JSON.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_control) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_control(c) {
            let _ = write!(shown, "\\u{:04x}", u32::from(c));
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

fn is_control(c: char) -> bool {
    // Unicode Standard Annex 9: marks, embeddings, overrides and isolates of bidirectional text.
    let is_bidi = matches!(
        c,
        '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    );
    is_bidi || c.is_control() && c != '\n' && c != '\t'
}

/// A path as a shell takes it for one word.
pub fn quoted_path(path: &Path) -> String {
    quoted(&path.display().to_string()).into_owned()
}

/// An argument as a shell takes it for one word.
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
        for (text, shown) in [
            ("Grüße,\n\tund 日本", "Grüße,\n\tund 日本"),
            ("\u{1b}[2J\u{1b}]0;title\u{7}", "\\u001b[2J\\u001b]0;title\\u0007"),
            ("fine\rERROR", "fine\\u000dERROR"),
            ("\u{9b}31m \u{7f}\0", "\\u009b31m \\u007f\\u0000"),
            ("abc\u{202e}fed\u{2069}", "abc\\u202efed\\u2069"),
        ] {
            assert_eq!(printable(text), shown);
            let all: String = text.chars().filter(|c| *c != '\n' && *c != '\t').collect();
            let json = serde_json::to_string(&all).expect("a text is JSON");
            let read: String = serde_json::from_str(&printable(&json)).expect("it still is");
            assert_eq!(read, all, "JSON means the same");
        }
    }

    #[test]
    fn a_shell_takes_what_is_quoted_for_one_word() {
        assert_eq!(quoted("http://127.0.0.1:8000/v1"), "http://127.0.0.1:8000/v1");
        assert_eq!(quoted(""), "''");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("$(x)'s"), "'$(x)'\\''s'");
    }
}
