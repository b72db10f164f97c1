//! Agents that are Python objects.

use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::observation::SensorConfig;
use chaic_core::{Action, Agent, AgentError};
use chaic_sandbox::Isolation;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::action::from_object;
use crate::observation::{Briefing, Observation};

/// Maximum length of a traceback, characters; its end is kept.
const MAX_TRACEBACK: usize = 4000;

/// Agent that is a Python object with `reset(briefing)` and `act(observation)`.
pub struct PyAgent {
    object: Py<PyAny>,
    sensors: SensorConfig,
    /// Error that `reset` of the Python object has raised.
    broken: Option<AgentError>,
    stop: &'static AtomicBool,
}

impl PyAgent {
    /// Wraps a Python object; Ctrl-C in it sets `stop`.
    pub fn new(object: Py<PyAny>, sensors: SensorConfig, stop: &'static AtomicBool) -> PyAgent {
        PyAgent { object, sensors, broken: None, stop }
    }
}

/// Converts a Python exception: Ctrl-C stops the run, any other exception fails the agent.
pub fn agent_error(py: Python<'_>, error: &PyErr, stop: &AtomicBool) -> AgentError {
    if error.is_instance_of::<PyKeyboardInterrupt>(py) {
        stop.store(true, Ordering::Relaxed);
        return AgentError::Halted("stopped".to_owned());
    }
    let traceback = error.traceback(py).and_then(|t| t.format().ok()).unwrap_or_default();
    let text = format!("{traceback}{error}");
    let n = text.chars().count().saturating_sub(MAX_TRACEBACK);
    AgentError::Broken(text.chars().skip(n).collect())
}

impl Agent for PyAgent {
    fn sensors(&self) -> SensorConfig {
        self.sensors
    }

    fn reset(&mut self, briefing: &chaic_core::Briefing) {
        self.broken = Python::attach(|py| {
            let briefing = Briefing(briefing.clone());
            let result = self.object.call_method1(py, "reset", (briefing,));
            result.err().map(|error| agent_error(py, &error, self.stop))
        });
    }

    fn act(&mut self, observation: &chaic_core::Observation) -> Result<Action, AgentError> {
        if let Some(error) = &self.broken {
            return Err(error.clone());
        }
        let observation = Observation(observation.clone());
        Python::attach(|py| {
            let action = self.object.bind(py).call_method1("act", (observation,));
            let action = action.and_then(|action| from_object(&action));
            action.map_err(|error| agent_error(py, &error, self.stop))
        })
    }

    fn isolation(&self) -> Option<String> {
        Some(Isolation::Trusted.to_string())
    }
}
