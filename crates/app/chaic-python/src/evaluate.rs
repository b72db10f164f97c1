//! Runs with helpers that are Python objects.

use std::ffi::CString;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use chaic_agents::PlannerRules;
use chaic_agents::perception_factory::{GROUND_TRUTH, PerceptionFactory};
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{Action, Agent, AgentError};
use chaic_env::helper_registry::{BuiltInWithPerception, Helper, HelperRegistry, check_new_name};
use chaic_env::{CHAIC_VERSION, RunKey, Track};
use chaic_eval::EvalError;
use chaic_eval::metrics::FormulaSet;
use chaic_eval::report::{Format, Report, write_files};
use chaic_eval::run::{FolderMode, JobEvent, Run, RunFolder, RunOptions, RunRequest, Shard};
use chaic_learn::helpers::PolicyRegistry;
use chaic_sandbox::Isolation;
use pyo3::exceptions::{PyTypeError, PyUserWarning};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::depythonize;
use serde::Deserialize;

use crate::agent::{PyAgent, agent_error};
use crate::error::{runtime_error, value_error};
use crate::isolated::{IsolatedHelper, IsolationOptions};
use crate::options::{Names, check_integers, grants, perception, sensors};
use crate::threads::refuse_fork;

/// Registry of Python helpers and built-in ones.
struct PyHelperRegistry<'a> {
    built_in: PolicyRegistry<'a>,
    /// Name of each Python helper, and a callable that creates one for each episode.
    makers: Vec<(String, Py<PyAny>)>,
    grants: Grants,
    sensors: SensorConfig,
    /// Time limit of one action of a Python helper, seconds.
    limit_s: f64,
    /// Processes of the Python helpers, in their order; empty for helpers in this process.
    isolated: Vec<IsolatedHelper>,
    /// Flag that stops the run.
    stop: &'static AtomicBool,
}

impl PyHelperRegistry<'_> {
    fn maker(&self, name: &str) -> Option<&Py<PyAny>> {
        self.makers.iter().find(|(known, _)| known == name).map(|(_, maker)| maker)
    }

    /// Returns an agent in a process of its own; `None` if the helpers are not isolated.
    fn isolated(&self, name: &str) -> Option<Box<dyn Agent>> {
        let mut helpers = self.makers.iter().zip(&self.isolated);
        let (_, helper) = helpers.find(|((known, _), _)| known == name)?;
        Some(helper.agent(self.stop))
    }
}

/// Agent that fails at its first action.
struct FailedAgent {
    error: AgentError,
    sensors: SensorConfig,
    isolation: Option<String>,
}

impl FailedAgent {
    fn in_this_process(error: AgentError, sensors: SensorConfig) -> FailedAgent {
        FailedAgent { error, sensors, isolation: Some(Isolation::Trusted.to_string()) }
    }
}

impl Agent for FailedAgent {
    fn sensors(&self) -> SensorConfig {
        self.sensors
    }

    fn reset(&mut self, _: &chaic_core::Briefing) {}

    fn act(&mut self, _: &chaic_core::Observation) -> Result<Action, AgentError> {
        Err(self.error.clone())
    }

    fn isolation(&self) -> Option<String> {
        self.isolation.clone()
    }
}

impl HelperRegistry for PyHelperRegistry<'_> {
    fn names(&self) -> Vec<String> {
        let own = self.makers.iter().map(|(name, _)| name.clone());
        self.built_in.names().into_iter().chain(own).collect()
    }

    /// Returns an agent from which only grants, sensors and isolation are read. Creates no Python
    /// object.
    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        if self.maker(name).is_none() {
            return self.built_in.make(name, rules);
        }
        let error = AgentError::Broken("the helper was not created".to_owned());
        let mut agent = FailedAgent::in_this_process(error, self.sensors);
        if let Some(isolated) = self.isolated(name) {
            agent.isolation = isolated.isolation();
        }
        Some(Helper { agent: Box::new(agent), grants: self.grants })
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        let Some(maker) = self.maker(&key.helper) else { return self.make(&key.helper, rules) };
        if let Some(agent) = self.isolated(&key.helper) {
            return Some(Helper { agent, grants: self.grants });
        }
        let created = Python::attach(|py| {
            maker.call0(py).map_err(|error| agent_error(py, &error, self.stop))
        });
        let agent: Box<dyn Agent> = match created {
            Ok(object) => Box::new(PyAgent::new(object, self.sensors, self.stop)),
            Err(error) => Box::new(FailedAgent::in_this_process(error, SensorConfig::NONE)),
        };
        Some(Helper { agent, grants: self.grants })
    }

    fn limit_s(&self, name: &str) -> Option<f64> {
        self.maker(name).map(|_| self.limit_s)
    }

    fn fallback(&self) -> Option<&dyn HelperRegistry> {
        Some(&self.built_in)
    }
}

/// Options of a run from Python.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Keywords {
    tasks: Option<Vec<String>>,
    split: Option<String>,
    episodes: Option<PathBuf>,
    n_episodes: Option<u32>,
    seeds: Option<u32>,
    rules: Option<String>,
    set: Names,
    traces: Option<bool>,
    perception: Option<String>,
    behavior: Option<String>,
    track: Option<String>,
}

impl Keywords {
    fn track(&self) -> PyResult<Option<Track>> {
        self.track.as_deref().map(|name| name.parse().map_err(value_error)).transpose()
    }

    fn request(self, helpers: Vec<String>) -> PyResult<RunRequest> {
        let track = self.track()?;
        let tasks: Option<Result<Vec<_>, _>> =
            self.tasks.map(|tasks| tasks.iter().map(|task| task.parse()).collect());
        Ok(RunRequest {
            tasks: tasks.transpose().map_err(value_error)?,
            helpers: Some(helpers),
            split: self.split.map(|split| split.parse().map_err(value_error)).transpose()?,
            episodes: self.episodes,
            n_episodes: self.n_episodes,
            seeds: self.seeds,
            rules: self.rules.map(|name| name.parse().map_err(value_error)).transpose()?,
            rule_overrides: self.set.into_vec(),
            no_traces: self.traces == Some(false),
            perception: self.perception,
            behavior: self.behavior,
            track,
            ..RunRequest::default()
        })
    }
}

/// Returns the object detection and behavior recognition of a run: as given, or as recorded in a run that is resumed.
fn run_perception(
    keywords: &Keywords,
    recorded: Option<&RunOptions>,
) -> PyResult<Arc<dyn PerceptionFactory>> {
    let recorded_perception = recorded.and_then(|options| options.perception.as_deref());
    let recorded_behavior = recorded.and_then(|options| options.behavior.as_deref());
    perception(
        keywords.perception.as_deref().or(recorded_perception).unwrap_or(GROUND_TRUTH),
        keywords.behavior.as_deref().or(recorded_behavior).unwrap_or(GROUND_TRUTH),
    )
}

/// Writes report and figures into the folder of a complete run; returns the report as a table.
fn write_report(run: &Run) -> Result<String, EvalError> {
    let report = Report {
        version: CHAIC_VERSION,
        options: run.options(),
        results: run.results(),
        planned: run.planned(),
        granted: Some(run.granted()),
        formulas: FormulaSet::Paper,
    };
    let progress = run.progress();
    if progress.finished == progress.total {
        write_files(run.folder(), &report)?;
        chaic_page::write_report(run.folder(), &report, &chaic_page::no_language)?;
    }
    Ok(if progress.finished > 0 { report.text(Format::Table) } else { String::new() })
}

/// Merges the shards of a run in a new folder; returns the report. Warns if episode runs are missing.
#[pyfunction]
pub fn merge(py: Python<'_>, out: PathBuf, runs: Vec<PathBuf>) -> PyResult<String> {
    let merged = py.detach(|| {
        let run = chaic_eval::run::merge(&out, &runs)?;
        let progress = run.progress();
        Ok((write_report(&run)?, progress.total - progress.finished))
    });
    let (report, n_missing) = merged.map_err(|error| from_eval(&error))?;
    if n_missing > 0 {
        let problem =
            format!("{n_missing} episode runs are missing; merge the other shards as well");
        let problem = CString::new(problem).expect("the text has no zero byte");
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &problem, 1)?;
    }
    Ok(report)
}

/// Plays a run into a folder as `chaic eval` does, and returns the text of its report; `None` if it was stopped
/// (`on_result` returned false).
///
/// `helpers` are names, each with a callable that creates a helper for each episode, or `None` for a built-in
/// helper. `granted`, `images`, `image_size` and `limit_s` apply to the Python helpers; the run records the last one,
/// which the caller enforces. `isolation` describes how to run them in processes of their own.
#[pyfunction]
#[pyo3(signature = (helpers, out, *, granted, images, image_size, jobs, resume, shard, limit_s, isolation, on_result, options))]
#[allow(clippy::too_many_arguments)]
pub fn evaluate(
    py: Python<'_>,
    helpers: Vec<(String, Option<Py<PyAny>>)>,
    out: PathBuf,
    granted: Vec<String>,
    images: Vec<String>,
    #[pyo3(from_py_with = crate::options::image_size)] image_size: u32,
    #[pyo3(from_py_with = crate::error::n_jobs)] jobs: u32,
    resume: bool,
    shard: Option<&str>,
    limit_s: f64,
    isolation: Option<&Bound<'_, PyDict>>,
    on_result: &Bound<'_, PyAny>,
    options: &Bound<'_, PyDict>,
) -> PyResult<Option<String>> {
    refuse_fork()?;
    let wrong = |error: pythonize::PythonizeError| PyTypeError::new_err(error.to_string());
    check_integers(options, &["n_episodes", "seeds"], &(1..=u32::MAX))?;
    let mut keywords: Keywords = depythonize(options).map_err(wrong)?;
    // `Run::open` reports a damaged record.
    let recorded = if resume { RunFolder::read(&out).ok() } else { None };
    let recorded: Option<RunOptions> = recorded.map(|(_, options)| options);
    // The record of a resumed run already contains the perception that its track requires.
    let track = keywords.track()?.filter(|_| recorded.is_none()).unwrap_or_default();
    keywords.perception = track.perception_or(keywords.perception);
    keywords.behavior = track.perception_or(keywords.behavior);
    let names: Vec<String> = helpers.iter().map(|(name, _)| name.clone()).collect();
    let perception = run_perception(&keywords, recorded.as_ref())?;
    let with_perception = BuiltInWithPerception { perception: Arc::clone(&perception) };
    let built_in = PolicyRegistry::bundled(&with_perception, perception);
    let makers: Vec<_> =
        helpers.into_iter().filter_map(|(name, maker)| Some((name, maker?))).collect();
    for (name, _) in &makers {
        check_new_name(name, &built_in.names(), r#"{"mine": MyHelper}"#).map_err(value_error)?;
    }
    let grants = grants(&granted)?;
    let sensors = sensors(&images, image_size)?;
    let masked: Vec<PathBuf> = [out.clone()].into_iter().chain(keywords.episodes.clone()).collect();
    let request = keywords.request(names)?;
    // Threads of the run may outlive this call, so the flag (one byte) is leaked.
    let stop: &'static AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
    let isolation: Option<IsolationOptions> =
        isolation.map(|options| depythonize(options)).transpose().map_err(wrong)?;
    let own_names: Vec<String> = makers.iter().map(|(name, _)| name.clone()).collect();
    let isolated = isolation.map_or(Ok(Vec::new()), |options| {
        IsolatedHelper::create_all(&options, &own_names, grants, &masked)
    })?;
    let helpers = PyHelperRegistry { built_in, makers, grants, sensors, limit_s, isolated, stop };
    let shard = shard.map_or(Ok(Shard::WHOLE), |shard| shard.parse().map_err(value_error))?;
    let access = if resume { FolderMode::Resume } else { FolderMode::New };
    let on_result = on_result.clone().unbind();
    let mut problem: Option<PyErr> = None;
    let mut play = || {
        let (mut run, _) = Run::open(&out, access, &request, &helpers)?;
        let mut on_event = |event: &JobEvent| {
            let keeps_on = Python::attach(|py| {
                let JobEvent::Finished(finished) = event else { return Ok(true) };
                let key = &finished.result.key;
                let tr = finished.result.summary().map(|s| s.done / s.total.max(f64::MIN_POSITIVE));
                on_result.bind(py).call1((&key.helper, &key.episode, key.seed, tr))?.is_truthy()
            });
            match keeps_on {
                Ok(true) => {}
                Ok(false) => stop.store(true, Ordering::Relaxed),
                Err(error) => {
                    stop.store(true, Ordering::Relaxed);
                    problem.get_or_insert(error);
                }
            }
        };
        let is_complete = run.play_shard(shard, jobs as usize, &helpers, stop, &mut on_event)?;
        if !is_complete {
            return Ok(None);
        }
        write_report(&run).map(Some)
    };
    let (played, interrupt) = py.detach(|| with_signals(stop, &mut play));
    match (played, problem.or(interrupt)) {
        (_, Some(error)) => Err(error),
        (Err(error), None) => Err(from_eval(&error)),
        (Ok(text), None) => Ok(text),
    }
}

/// Calls a function in another thread, and meanwhile handles the signals of this thread: Ctrl-C sets `stop`. Returns
/// the result, and the exception that a signal raised.
fn with_signals<T: Send>(
    stop: &AtomicBool,
    function: &mut (dyn FnMut() -> T + Send),
) -> (T, Option<PyErr>) {
    /// Interval of the checks.
    const INTERVAL: Duration = Duration::from_millis(100);
    let caller = thread::current();
    let mut interrupt = None;
    let result = thread::scope(|scope| {
        let called = scope.spawn(move || {
            let result = function();
            caller.unpark();
            result
        });
        while !called.is_finished() {
            thread::park_timeout(INTERVAL);
            if let Err(error) = Python::attach(|py| py.check_signals()) {
                stop.store(true, Ordering::Relaxed);
                interrupt.get_or_insert(error);
            }
        }
        called.join()
    });
    (result.unwrap_or_else(|panic| std::panic::resume_unwind(panic)), interrupt)
}

/// Converts an error of a run.
fn from_eval(error: &EvalError) -> PyErr {
    if error.is_usage() { value_error(error) } else { runtime_error(error) }
}
