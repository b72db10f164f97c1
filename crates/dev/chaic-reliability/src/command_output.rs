//! Exit code and output of commands.

/// Exit code of a command that reports findings on its standard output.
const FINDINGS: i32 = 1;
/// Exit code of a program that panicked.
const PANICKED: i32 = 101;

/// Exit code and output of a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CommandOutput {
    /// Exit code; `None` after a signal.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl CommandOutput {
    /// Returns the problem that no command may have: a panic, or an exit code without one line of
    /// explanation. Findings on the standard output explain exit code 1 only.
    pub fn problem(&self) -> Option<String> {
        let n_errors = self.stderr.lines().filter(|line| line.starts_with("error:")).count();
        if self.code == Some(PANICKED) || self.stderr.contains("panicked") {
            return Some(format!("panic: {}", self.stderr.trim()));
        }
        let has_findings =
            self.code == Some(FINDINGS) && n_errors == 0 && !self.stdout.trim().is_empty();
        let is_explained = self.code == Some(0) || n_errors == 1 || has_findings;
        (!is_explained).then(|| format!("exit code {:?}, {n_errors} error lines", self.code))
    }
}
