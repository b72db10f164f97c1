//! Writing to the terminal. Whoever reads may have gone (`chaic ... | head`): that's no error.

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
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        other => other.map(|()| true).context("can't write to the standard output"),
    }
}

/// A path as a word of a shell's command line.
pub fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./:=@%+,".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text;
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// So many of what has a regular plural: `1 task`, `2 tasks`.
pub fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Writes a line to the standard error; where nobody hears it, nothing can be done.
pub fn complain(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_a_quoted_path_as_one_word() {
        for (path, word) in [
            ("runs/quick-2", "runs/quick-2"),
            ("my runs/a", "'my runs/a'"),
            ("a'b", r"'a'\''b'"),
            ("$HOME;ls", "'$HOME;ls'"),
            ("", "''"),
        ] {
            assert_eq!(quoted(Path::new(path)), word);
        }
    }
}
