//! Writing to the terminal. Whoever reads may have gone (`chaic ... | head`): that's no error.

use std::io::{self, Write as _};

/// Writes text to the standard output.
///
/// # Errors
/// If it can't be written, unless nobody reads any more.
pub fn say(text: &str) -> io::Result<()> {
    say_to_reader(text).map(|_| ())
}

/// Like [`say`], for who has much to say: returns whether anybody reads on.
///
/// # Errors
/// Those of [`say`].
pub fn say_to_reader(text: &str) -> io::Result<bool> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        other => other.map(|()| true),
    }
}

/// So many of what has a regular plural: `1 task`, `2 tasks`.
pub fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Writes a line to the standard error; where nobody hears it, nothing can be done.
pub fn complain(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}
