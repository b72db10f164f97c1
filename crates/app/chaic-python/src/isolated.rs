//! Python helpers in processes of their own, in the sandbox of `chaic-subprocess`.

use std::ffi::OsString;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use chaic_core::observation::{Grants, Senses};
use chaic_core::{Action, Agent, AgentError};
use chaic_sandbox::Launcher;
use chaic_subprocess::serve::serve as serve_agent;
use chaic_subprocess::{Command, Confinement, ConfinementOptions, Limits, Pool, SubprocessAgent};
use pyo3::prelude::*;
use serde::Deserialize;

use crate::agent::{PyAgent, breakdown};
use crate::error::{failure, mistake};
use crate::options::senses;

/// How to isolate the helpers of a run, as Python gives it.
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

/// A helper whose processes run in the sandbox and serve one episode after the other.
pub struct IsolatedHelper {
    command: Arc<Command>,
    pool: Arc<Pool>,
}

impl IsolatedHelper {
    /// Confines each helper.
    pub fn all(
        options: &IsolationOptions,
        names: &[String],
        grants: Grants,
        run: &Path,
    ) -> PyResult<Vec<IsolatedHelper>> {
        let launcher = Launcher::new(options.launcher.iter().map(OsString::from));
        let confinement = ConfinementOptions {
            is_trusted: false,
            readable: options.readable.clone(),
            masked: vec![run.to_owned()],
        };
        let decision = Duration::try_from_secs_f64(options.decision_s).map_err(mistake)?;
        let usual = Limits::default();
        let limits = Limits { decision, episode: usual.episode.max(decision), ..usual };
        let confine = |(name, line): (&String, &String)| {
            let confined = Confinement::new(&launcher, line, &limits, &confinement);
            let command = Command {
                name: name.clone(),
                line: line.clone(),
                grants,
                limits,
                environment: Vec::new(),
                confinement: Some(confined.map_err(mistake)?),
            };
            Ok(IsolatedHelper { command: Arc::new(command), pool: Arc::default() })
        };
        names.iter().zip(&options.commands).map(confine).collect()
    }

    /// A mind for one episode.
    pub fn mind(&self, stop: &'static AtomicBool) -> Box<dyn Agent> {
        let (command, pool) = (Arc::clone(&self.command), Arc::clone(&self.pool));
        Box::new(SubprocessAgent::pooled(command, pool, stop))
    }
}

/// A fresh helper for each briefing.
struct FreshAgent {
    make: Py<PyAny>,
    senses: Senses,
    agent: Result<PyAgent, AgentError>,
}

impl Agent for FreshAgent {
    fn senses(&self) -> Senses {
        self.senses
    }

    fn reset(&mut self, briefing: &chaic_core::Briefing) {
        let stop: &'static AtomicBool = &NEVER;
        let made =
            Python::attach(|py| self.make.call0(py).map_err(|error| breakdown(py, &error, stop)));
        self.agent = made.map(|object| PyAgent::new(object, self.senses, stop));
        if let Ok(agent) = &mut self.agent {
            agent.reset(briefing);
        }
    }

    fn act(&mut self, observation: &chaic_core::Observation) -> Result<Action, AgentError> {
        self.agent.as_mut().map_err(|error| error.clone())?.act(observation)
    }
}

/// The process of a helper ends with its pipe.
static NEVER: AtomicBool = AtomicBool::new(false);

/// Serves fresh helpers of `make` on the standard input and the descriptor `output`, until the input is closed.
#[pyfunction]
pub fn serve(
    py: Python<'_>,
    make: Py<PyAny>,
    images: Vec<String>,
    image_size: u32,
    output: u32,
) -> PyResult<()> {
    let senses = senses(&images, image_size)?;
    let path = format!("/dev/fd/{output}");
    let mut output = File::options().write(true).open(path).map_err(failure)?;
    let agent = Err(AgentError::Broken("a mind that was not briefed".to_owned()));
    let mut mind = FreshAgent { make, senses, agent };
    let served =
        py.detach(|| serve_agent("python", &mut mind, &mut std::io::stdin().lock(), &mut output));
    served.map_err(failure)
}
