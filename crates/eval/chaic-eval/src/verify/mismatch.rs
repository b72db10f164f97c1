//! Difference between a trace and its re-simulation.

use std::fmt;
use std::path::PathBuf;

use chaic_core::{AgentId, Frame};

/// First difference between a trace and its re-simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
    /// Path of the trace.
    pub path: PathBuf,
    /// Frame of the difference.
    pub frame: Frame,
    /// Agent of the differing decision, if it is one.
    pub agent: Option<AgentId>,
    /// Recorded and re-simulated values.
    pub problem: String,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: frame {}", self.path.display(), self.frame)?;
        if let Some(agent) = self.agent {
            write!(f, ", {agent}")?;
        }
        write!(f, ": {}", self.problem)
    }
}
