//! Python helpers in sandboxed processes (`chaic-subprocess`).

use std::ffi::OsString;
use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{Action, Agent, AgentError};
use chaic_sandbox::Launcher;
use chaic_subprocess::serve::serve as serve_agent;
use chaic_subprocess::{
    Confinement, ConfinementOptions, HelperProgram, Limits, Pool, SubprocessAgent,
};
use pyo3::prelude::*;
use serde::Deserialize;

use crate::agent::{PyAgent, agent_error};
use crate::error::{runtime_error, value_error};
use crate::options::sensors;

/// Isolation of a run's helpers, from Python.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IsolationOptions {
    /// Shell command of each helper's process, in the order of the helpers.
    commands: Vec<String>,
    /// Files and folders that the processes can read.
    readable: Vec<PathBuf>,
    /// Program and arguments that start a stage of the sandbox.
    launcher: Vec<String>,
    /// Time limit of a decision, seconds.
    decision_s: f64,
}

/// Helper with sandboxed processes that each serve several episodes.
pub struct IsolatedHelper {
    command: Arc<HelperProgram>,
    pool: Arc<Pool>,
}

impl IsolatedHelper {
    /// Creates all helpers of a run. Their processes cannot read the folders `masked`.
    pub fn create_all(
        options: &IsolationOptions,
        names: &[String],
        grants: Grants,
        masked: &[PathBuf],
    ) -> PyResult<Vec<IsolatedHelper>> {
        let launcher = Launcher::new(options.launcher.iter().map(OsString::from));
        let confinement = ConfinementOptions {
            is_trusted: false,
            readable: options.readable.clone(),
            masked: masked.to_vec(),
        };
        let decision = Duration::try_from_secs_f64(options.decision_s).map_err(value_error)?;
        let default = Limits::default();
        // The limit applies to each action, as for helpers in this process. Processes have more time to start.
        let start = default.start.max(decision);
        let limits = Limits { start, decision, episode: Duration::MAX, ..default };
        let create = |(name, line): (&String, &String)| {
            let confined = Confinement::new(&launcher, line, &limits, &confinement);
            let command = HelperProgram {
                name: name.clone(),
                line: line.clone(),
                grants,
                limits,
                environment: Vec::new(),
                confinement: Some(confined.map_err(value_error)?),
            };
            Ok(IsolatedHelper { command: Arc::new(command), pool: Arc::default() })
        };
        names.iter().zip(&options.commands).map(create).collect()
    }

    /// Returns an agent for one episode.
    pub fn agent(&self, stop: &'static AtomicBool) -> Box<dyn Agent> {
        let (command, pool) = (Arc::clone(&self.command), Arc::clone(&self.pool));
        Box::new(SubprocessAgent::pooled(command, pool, stop))
    }
}

/// Agent that creates a new Python helper for each briefing.
struct FreshAgent {
    maker: Py<PyAny>,
    sensors: SensorConfig,
    agent: Result<PyAgent, AgentError>,
}

impl Agent for FreshAgent {
    fn sensors(&self) -> SensorConfig {
        self.sensors
    }

    fn reset(&mut self, briefing: &chaic_core::Briefing) {
        let stop: &'static AtomicBool = &NEVER;
        let created = Python::attach(|py| {
            self.maker.call0(py).map_err(|error| agent_error(py, &error, stop))
        });
        self.agent = created.map(|object| PyAgent::new(object, self.sensors, stop));
        if let Ok(agent) = &mut self.agent {
            agent.reset(briefing);
        }
    }

    fn act(&mut self, observation: &chaic_core::Observation) -> Result<Action, AgentError> {
        self.agent.as_mut().map_err(|error| error.clone())?.act(observation)
    }
}

/// Stop flag that is never set: the process of a helper ends with its pipe.
static NEVER: AtomicBool = AtomicBool::new(false);

/// Serves helpers that `maker` creates on standard input and the descriptor `output`, until the input is closed.
#[pyfunction]
pub fn serve(
    py: Python<'_>,
    maker: Py<PyAny>,
    images: Vec<String>,
    image_size: u32,
    output: u32,
) -> PyResult<()> {
    let sensors = sensors(&images, image_size)?;
    let path = format!("/dev/fd/{output}");
    let mut output = File::options().write(true).open(path).map_err(runtime_error)?;
    let agent = Err(AgentError::Broken("the agent was not briefed".to_owned()));
    let mut agent = FreshAgent { maker, sensors, agent };
    let served =
        py.detach(|| serve_agent("python", &mut agent, &mut std::io::stdin().lock(), &mut output));
    served.map_err(runtime_error)
}
