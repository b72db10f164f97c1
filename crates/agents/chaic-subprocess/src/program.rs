//! Command line, grants and limits of a helper in another process.

use chaic_core::observation::Grants;

use crate::confinement::Confinement;
use crate::limits::Limits;

/// A helper in another process.
#[derive(Clone, Debug, PartialEq)]
pub struct HelperProgram {
    /// Name of the helper in this run.
    pub name: String,
    /// Command line for `sh -c`.
    pub line: String,
    /// Grants.
    pub grants: Grants,
    /// Limits.
    pub limits: Limits,
    /// Names of environment variables that it inherits beyond
    /// [`ALLOWED_VARIABLES`](crate::environment::ALLOWED_VARIABLES).
    pub environment: Vec<String>,
    /// Confinement of its processes; `None` for plain child processes.
    pub confinement: Option<Confinement>,
}

impl HelperProgram {
    /// Returns the command's name in messages: its line, or its name if the line is long.
    pub(crate) fn label(&self) -> &str {
        /// Longer lines hide the rest of a message.
        const MAX_LEN: usize = 2000;
        if self.line.len() > MAX_LEN { &self.name } else { &self.line }
    }
}
