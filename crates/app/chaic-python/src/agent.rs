//! Python objects as the minds of a run.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_agents::PlannerRules;
use chaic_agents::sight::GROUND_TRUTH;
use chaic_core::observation::{Grants, Senses};
use chaic_core::{Action, Agent, AgentError};
use chaic_env::minds::{Helper, Helpers, NONE, Seeing};
use chaic_env::{RunKey, Track};
use chaic_eval::EvalError;
use chaic_eval::metrics::FormulaSet;
use chaic_eval::report::{Format, Report, write_files};
use chaic_eval::run::{Access, Progress, Run, RunRequest, Shard};
use chaic_sandbox::Isolation;
use pyo3::exceptions::{PyKeyboardInterrupt, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::depythonize;
use serde::Deserialize;

use crate::action::of_object;
use crate::error::{failure, mistake};
use crate::isolated::{IsolatedHelper, IsolationOptions};
use crate::observation::{Briefing, Observation};
use crate::options::{grants, senses, sight};
use crate::threads::refuse_fork;

/// Longest traceback that is kept, characters: what comes last tells most.
const MAX_TRACEBACK: usize = 4000;

/// A Python object with `reset(briefing)` and `act(observation)`.
pub struct PyAgent {
    object: Py<PyAny>,
    senses: Senses,
    /// Why it couldn't be briefed, if it couldn't.
    broken: Option<AgentError>,
    stop: &'static AtomicBool,
}

impl PyAgent {
    /// A mind that is the Python object; Ctrl-C in it raises `stop`.
    pub fn new(object: Py<PyAny>, senses: Senses, stop: &'static AtomicBool) -> PyAgent {
        PyAgent { object, senses, broken: None, stop }
    }
}

/// What a Python exception comes to: Ctrl-C stops the run, all else is a breakdown of the mind.
pub fn breakdown(py: Python<'_>, error: &PyErr, stop: &AtomicBool) -> AgentError {
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
    fn senses(&self) -> Senses {
        self.senses
    }

    fn reset(&mut self, briefing: &chaic_core::Briefing) {
        self.broken = Python::attach(|py| {
            let briefing = Briefing(briefing.clone());
            let told = self.object.call_method1(py, "reset", (briefing,));
            told.err().map(|error| breakdown(py, &error, self.stop))
        });
    }

    fn act(&mut self, observation: &chaic_core::Observation) -> Result<Action, AgentError> {
        if let Some(error) = &self.broken {
            return Err(error.clone());
        }
        let observation = Observation(observation.clone());
        Python::attach(|py| {
            let chosen = self.object.bind(py).call_method1("act", (observation,));
            let action = chosen.and_then(|chosen| of_object(&chosen));
            action.map_err(|error| breakdown(py, &error, self.stop))
        })
    }

    fn isolation(&self) -> Option<String> {
        Some(Isolation::Trusted.to_string())
    }
}

/// Helpers of Python's, besides the built-in ones.
struct PyHelpers {
    built_in: Seeing,
    /// The name, and what makes a fresh one for each episode.
    own: Vec<(String, Py<PyAny>)>,
    grants: Grants,
    senses: Senses,
    /// The own helpers' processes, in their order; empty for helpers within this process.
    isolated: Vec<IsolatedHelper>,
    /// Stops the run.
    stop: &'static AtomicBool,
}

impl PyHelpers {
    fn is_own(&self, name: &str) -> Option<&Py<PyAny>> {
        self.own.iter().find(|(own, _)| own == name).map(|(_, make)| make)
    }

    fn isolated(&self, name: &str) -> Option<Helper> {
        let helpers = self.own.iter().zip(&self.isolated);
        let (_, helper) = helpers.into_iter().find(|((own, _), _)| own == name)?;
        Some(Helper { mind: helper.mind(self.stop), grants: self.grants })
    }
}

/// A mind that breaks down at once.
struct Unmade(AgentError);

impl Agent for Unmade {
    fn senses(&self) -> Senses {
        Senses::NONE
    }

    fn reset(&mut self, _: &chaic_core::Briefing) {}

    fn act(&mut self, _: &chaic_core::Observation) -> Result<Action, AgentError> {
        Err(self.0.clone())
    }

    fn isolation(&self) -> Option<String> {
        Some(Isolation::Trusted.to_string())
    }
}

impl Helpers for PyHelpers {
    fn names(&self) -> Vec<String> {
        let own = self.own.iter().map(|(name, _)| name.clone());
        self.built_in.names().into_iter().chain(own).collect()
    }

    /// Only to know what it is granted and asks for: nothing of Python's is made.
    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        if let Some(helper) = self.isolated(name) {
            return Some(helper);
        }
        match self.is_own(name) {
            None => self.built_in.make(name, rules),
            Some(_) => {
                let nobody = AgentError::Broken("no mind was made".to_owned());
                Some(Helper { mind: Box::new(Unmade(nobody)), grants: self.grants })
            }
        }
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        let make = self.is_own(&key.helper).filter(|_| self.isolated.is_empty());
        let Some(make) = make else { return self.make(&key.helper, rules) };
        let made =
            Python::attach(|py| make.call0(py).map_err(|error| breakdown(py, &error, self.stop)));
        let mind: Box<dyn Agent> = match made {
            Ok(object) => Box::new(PyAgent::new(object, self.senses, self.stop)),
            Err(error) => Box::new(Unmade(error)),
        };
        Some(Helper { mind, grants: self.grants })
    }
}

/// Keywords of a run, by the names of the command's options.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Keywords {
    tasks: Option<Vec<String>>,
    split: Option<String>,
    episodes: Option<PathBuf>,
    first: Option<u32>,
    seeds: Option<u32>,
    rules: Option<chaic_env::rules::RuleSetName>,
    set: Vec<String>,
    traces: Option<bool>,
    perception: Option<String>,
    behavior: Option<String>,
    track: Option<Track>,
}

impl Keywords {
    fn request(self, helpers: Vec<String>) -> PyResult<RunRequest> {
        let tasks: Option<Result<Vec<_>, _>> =
            self.tasks.map(|tasks| tasks.iter().map(|task| task.parse()).collect());
        Ok(RunRequest {
            tasks: tasks.transpose().map_err(mistake)?,
            helpers: Some(helpers),
            split: self.split.map(|split| split.parse().map_err(mistake)).transpose()?,
            episodes: self.episodes,
            first: self.first,
            seeds: self.seeds,
            rules: self.rules,
            set: self.set,
            no_traces: self.traces == Some(false),
            perception: self.perception.filter(|name| name != GROUND_TRUTH),
            behavior: self.behavior.filter(|name| name != GROUND_TRUTH),
            track: self.track,
            ..RunRequest::default()
        })
    }
}

/// Writes report and figures into a run's folder, if it is whole; the report as a table.
fn leave_report(run: &Run) -> Result<String, EvalError> {
    let report = Report {
        options: run.options(),
        results: run.results(),
        planned: run.planned(),
        granted: Some(run.granted()),
        formulas: FormulaSet::Paper,
    };
    let extent = run.extent();
    if extent.finished == extent.total {
        write_files(run.folder(), &report)?;
    }
    Ok(if extent.finished > 0 { report.text(Format::Table) } else { String::new() })
}

/// Joins the shards of a run in a new folder; its report.
#[pyfunction]
pub fn merge(py: Python<'_>, out: PathBuf, runs: Vec<PathBuf>) -> PyResult<String> {
    let merged = py.detach(|| leave_report(&chaic_eval::run::merge(&out, &runs)?));
    merged.map_err(failure)
}

/// Plays a run into a folder, which the command reads as its own, and gives the text of its report; `None` if it
/// was stopped (`go_on` returned false).
///
/// `helpers` are names with what makes a fresh helper for each episode, or `None` for a built-in one; `granted` and
/// (`images`, `image_size`) are what the own ones get. `isolation` has how to run these in processes of
/// their own.
#[pyfunction]
#[pyo3(signature = (helpers, out, *, granted, images, image_size, jobs, resume, shard, isolation, go_on, options))]
#[allow(clippy::too_many_arguments)]
pub fn evaluate(
    py: Python<'_>,
    helpers: Vec<(String, Option<Py<PyAny>>)>,
    out: PathBuf,
    granted: Vec<String>,
    images: Vec<String>,
    image_size: u32,
    jobs: usize,
    resume: bool,
    shard: Option<&str>,
    isolation: Option<&Bound<'_, PyDict>>,
    go_on: &Bound<'_, PyAny>,
    options: &Bound<'_, PyDict>,
) -> PyResult<Option<String>> {
    refuse_fork()?;
    let wrong = |error: pythonize::PythonizeError| PyTypeError::new_err(error.to_string());
    let mut keywords: Keywords = depythonize(options).map_err(wrong)?;
    let track = keywords.track.unwrap_or_default();
    keywords.perception = track.sight_or(keywords.perception);
    keywords.behavior = track.sight_or(keywords.behavior);
    let names: Vec<String> = helpers.iter().map(|(name, _)| name.clone()).collect();
    let or_true = |name: &Option<String>| name.clone().unwrap_or_else(|| GROUND_TRUTH.to_owned());
    let seen_by = sight(&or_true(&keywords.perception), &or_true(&keywords.behavior))?;
    let built_in = Seeing { sight: seen_by };
    let own: Vec<_> = helpers.into_iter().filter_map(|(name, make)| Some((name, make?))).collect();
    let taken = |name: &String| name == NONE || built_in.names().contains(name);
    if let Some((name, _)) = own.iter().find(|(name, _)| taken(name)) {
        return Err(mistake(format!("{name:?} is a built-in helper; call yours otherwise")));
    }
    let grants = grants(&granted)?;
    let senses = senses(&images, image_size)?;
    let request = keywords.request(names)?;
    // Threads of the run may outlive this call: the flag is one byte for good.
    let stop: &'static AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
    let isolation: Option<IsolationOptions> =
        isolation.map(|options| depythonize(options)).transpose().map_err(wrong)?;
    let own_names: Vec<String> = own.iter().map(|(name, _)| name.clone()).collect();
    let isolated = isolation.map_or(Ok(Vec::new()), |options| {
        IsolatedHelper::all(&options, &own_names, grants, &out)
    })?;
    let helpers = PyHelpers { built_in, own, grants, senses, isolated, stop };
    let shard = shard.map_or(Ok(Shard::WHOLE), |shard| shard.parse().map_err(mistake))?;
    let access = if resume { Access::Resume } else { Access::Begin };
    let go_on = go_on.clone().unbind();
    let mut problem: Option<PyErr> = None;
    let played = py.detach(|| {
        let (mut run, _) = Run::open(&out, access, &request, &helpers)?;
        let mut tell = |progress: &Progress| {
            let told = Python::attach(|py| {
                py.check_signals()?;
                let Progress::Finished(finished) = progress else { return Ok(true) };
                let key = &finished.result.key;
                let tr = finished.result.summary().map(|s| s.done / s.total.max(f64::MIN_POSITIVE));
                go_on.bind(py).call1((&key.helper, &key.episode, key.seed, tr))?.is_truthy()
            });
            match told {
                Ok(true) => {}
                Ok(false) => stop.store(true, Ordering::Relaxed),
                Err(error) => {
                    stop.store(true, Ordering::Relaxed);
                    problem.get_or_insert(error);
                }
            }
        };
        let is_whole = run.play_shard(shard, jobs, &helpers, stop, &mut tell)?;
        if !is_whole {
            return Ok(None);
        }
        leave_report(&run).map(Some)
    });
    match (played, problem) {
        (_, Some(error)) => Err(error),
        (Err(error), None) => Err(failure(error)),
        (Ok(text), None) => Ok(text),
    }
}
