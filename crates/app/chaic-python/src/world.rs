//! World: one running episode in Python.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use chaic_core::geom::Camera;
use chaic_core::{AgentError, AgentId};
use chaic_env::trace::Record;
use chaic_env::{AdvanceOutcome, Env, EnvSnapshot, RewardTerms};
use chaic_render::{Channels, Projection, View, floor_plan};
use chaic_world::Event;
use numpy::{PyArray1, PyArray3, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use pythonize::depythonize;

use crate::action;
use crate::episode::{Episode, encode_png};
use crate::error::{
    ANY_NUMBER, agent_number, from_env, integer, no_attribute, not_picklable, poisoned,
    runtime_error, value_error,
};
use crate::observation::{Briefing, Observation, arrays, to_python};
use crate::options::{IMAGE_SIZES, Options, sensors, strings};
use crate::threads::detached;

/// Default width and height of the view of an agent, pixels.
const VIEW_SIZE: u32 = 512;
/// Interval of the checks for Ctrl-C in a long call.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(100);

/// Proprioception, and the mask of actions that the hands allow.
type ProprioceptionArrays<'py> = (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<bool>>);

/// Returns the name of an outcome in Python.
pub fn outcome_name(outcome: AdvanceOutcome) -> &'static str {
    match outcome {
        AdvanceOutcome::NeedsAction => "needs_action",
        AdvanceOutcome::Ended => "ended",
        AdvanceOutcome::Stopped => "stopped",
    }
}

/// Converts the terms of a reward to a dictionary.
pub fn reward<'py>(py: Python<'py>, terms: Option<RewardTerms>) -> PyResult<Bound<'py, PyAny>> {
    to_python(py, &terms)
}

/// Returns the score so far as a dictionary.
pub fn score<'py>(py: Python<'py>, env: &Env) -> PyResult<Bound<'py, PyAny>> {
    let end = env.score();
    let score = PyDict::new(py);
    score.set_item("frame", end.frame)?;
    score.set_item("delivered", end.done)?;
    score.set_item("wanted", end.total)?;
    score.set_item("complete", end.complete)?;
    Ok(score.into_any())
}

/// Running episode. Agent 0 is the partner and agent 1 the helper; the caller controls one of them or both.
///
/// Keywords of the constructor:
///
/// - `helper`: `"caller"`, `"none"` or a built-in helper, with `perception` and `behavior` as in `PlanningAgent`;
/// - `partner`: `"rules"` for the partner of the task, or `"caller"`;
/// - `grants` (docs/grants.md), `images` (of `"rgb"`, `"depth"`, `"ids"`) and `image_size` of the caller's agents;
/// - `partner_image_size`: image size of all other agents; by default that of scored runs;
/// - `rules`, `set` and `appearance`, as in `chaic eval`. `grants`, `images` and `set` are one string or several.
#[pyclass(module = "chaic._chaic")]
pub struct World {
    env: Mutex<Env>,
    options: Options,
    episode: Arc<chaic_episodes::Episode>,
    events: Vec<Event>,
}

/// Copy of a running episode with its agents.
#[pyclass(module = "chaic._chaic")]
pub struct Snapshot(Mutex<EnvSnapshot>);

impl World {
    fn env(&mut self) -> PyResult<&mut Env> {
        self.env.get_mut().map_err(poisoned)
    }

    fn agent(&mut self, agent: u8) -> PyResult<AgentId> {
        let n = self.env()?.slots().len();
        if usize::from(agent) < n {
            return Ok(AgentId(agent));
        }
        Err(value_error(format!("there is no agent {agent} of {n}")))
    }
}

#[pymethods]
impl World {
    /// Creates a world at the start of an episode.
    #[new]
    #[pyo3(signature = (episode, seed=0, **options))]
    fn new(
        py: Python<'_>,
        episode: &Bound<'_, Episode>,
        #[pyo3(from_py_with = crate::error::seed)] seed: u32,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<World> {
        let options = Options::new(py, options)?;
        let episode = Arc::clone(&episode.get().0);
        let agents = options.agents()?;
        let env = detached(py, || Env::new(options.config(&episode, seed), agents))?;
        let env = Mutex::new(env.map_err(|error| from_env(&error))?);
        Ok(World { env, options, episode, events: Vec::new() })
    }

    /// Starts another episode, or restarts the current one, with this seed; 0 is the episode's own.
    #[pyo3(signature = (episode=None, seed=0))]
    fn reset(
        &mut self,
        py: Python<'_>,
        episode: Option<&Bound<'_, Episode>>,
        #[pyo3(from_py_with = crate::error::seed)] seed: u32,
    ) -> PyResult<()> {
        let episode = episode.map_or_else(|| Arc::clone(&self.episode), |e| Arc::clone(&e.get().0));
        let World { env, options, .. } = self;
        let env = env.get_mut().map_err(poisoned)?;
        let config = options.config(&episode, seed);
        detached(py, || env.reset(config))?.map_err(|error| from_env(&error))?;
        self.episode = episode;
        self.events.clear();
        Ok(())
    }

    /// Current episode.
    #[getter]
    fn episode(&self) -> Episode {
        Episode(Arc::clone(&self.episode))
    }

    /// Number of frames that have passed, 30 per second.
    #[getter]
    fn frame(&mut self) -> PyResult<u32> {
        Ok(self.env()?.world().state().frame)
    }

    /// Number of frames of the episode.
    #[getter]
    fn horizon(&mut self) -> PyResult<u32> {
        Ok(self.env()?.world().setup().horizon)
    }

    /// True if the episode has ended.
    #[getter]
    fn is_over(&mut self) -> PyResult<bool> {
        Ok(self.env()?.world().is_over())
    }

    /// Runs the episode until an agent of the caller needs an action (`"needs_action"`), the episode has `"ended"`, or
    /// an agent waits in a frame at or after `until` (`"stopped"`). After Ctrl-C, the next call continues.
    #[pyo3(signature = (until=None))]
    fn advance(
        &mut self,
        py: Python<'_>,
        until: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<&'static str> {
        let until = until.map(|frame| integer("until", frame, &ANY_NUMBER)).transpose()?;
        let World { env, events, .. } = self;
        let env = env.get_mut().map_err(poisoned)?;
        let (stop, mut interrupt) = (AtomicBool::new(false), None);
        let mut last_check = Instant::now();
        let outcome = detached(py, || {
            env.run(&stop, until, &mut |record| -> Result<(), AgentError> {
                if let Record::Event(recorded) = record {
                    events.push(recorded.event);
                }
                if last_check.elapsed() >= SIGNAL_INTERVAL {
                    last_check = Instant::now();
                    if let Err(error) = Python::attach(|py| py.check_signals()) {
                        stop.store(true, Ordering::Relaxed);
                        interrupt = Some(error);
                    }
                }
                Ok(())
            })
        })?;
        match interrupt {
            Some(error) => Err(error),
            None => outcome.map(outcome_name).map_err(runtime_error),
        }
    }

    /// Returns the agents of the caller that need an action now.
    fn waiting(&mut self) -> PyResult<Vec<usize>> {
        Ok(self.env()?.waiting().map(AgentId::index).collect())
    }

    /// Returns the briefing of an agent.
    #[pyo3(signature = (agent=1))]
    fn briefing(
        &mut self,
        #[pyo3(from_py_with = crate::error::agent_number)] agent: u8,
    ) -> PyResult<Briefing> {
        let agent = self.agent(agent)?;
        Ok(Briefing(self.env()?.briefing(agent)))
    }

    /// Returns the observation of an agent that needs an action.
    #[pyo3(signature = (agent=1))]
    fn observe(
        &mut self,
        py: Python<'_>,
        #[pyo3(from_py_with = crate::error::agent_number)] agent: u8,
    ) -> PyResult<Observation> {
        let id = self.agent(agent)?;
        let env = self.env()?;
        let observation = detached(py, || env.observe(id).cloned())?;
        observation.map(Observation).ok_or_else(|| runtime_error(not_waiting(agent)))
    }

    /// Sets the next action of an agent that needs one: a string or dictionary as in docs/subprocess-helpers.md, or a
    /// row of kind (`ACTIONS`), column and row of a pixel. It starts once all agents have chosen.
    #[pyo3(signature = (action, agent=1))]
    fn submit(
        &mut self,
        py: Python<'_>,
        action: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = crate::error::agent_number)] agent: u8,
    ) -> PyResult<()> {
        let id = self.agent(agent)?;
        let action = match action.extract::<[i64; 3]>() {
            Ok(row) => action::from_row(row)?,
            Err(_) => action::from_object(action)?,
        };
        let env = self.env()?;
        match detached(py, || env.submit(id, action))? {
            true => Ok(()),
            false => Err(runtime_error(not_waiting(agent))),
        }
    }

    /// Submits the action of the only agent that needs one and advances, in one call for learners. Returns whether an
    /// agent needs an action, and the reward terms: delivered fraction, meters of progress, and whether it failed.
    #[pyo3(signature = (action, agent=1))]
    fn step(
        &mut self,
        py: Python<'_>,
        action: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = crate::error::agent_number)] agent: u8,
    ) -> PyResult<(bool, f64, f64, bool)> {
        self.submit(py, action, agent)?;
        let needs_action = self.advance(py, None)? == outcome_name(AdvanceOutcome::NeedsAction);
        let terms = self.env()?.reward(AgentId(agent)).unwrap_or_default();
        Ok((needs_action, terms.delivered, terms.progress_m, terms.is_invalid))
    }

    /// Returns the delivered and the wanted amount; TR is their ratio.
    fn progress(&mut self) -> PyResult<(f64, f64)> {
        Ok(self.env()?.world().progress())
    }

    /// Returns the proprioception (`PROPRIOCEPTION`) of an agent that needs an action, and the mask of `ACTIONS` that
    /// its hands allow.
    #[pyo3(signature = (agent=1))]
    fn proprioception<'py>(
        &mut self,
        py: Python<'py>,
        #[pyo3(from_py_with = crate::error::agent_number)] agent: u8,
    ) -> PyResult<ProprioceptionArrays<'py>> {
        let id = self.agent(agent)?;
        let env = self.env()?;
        let horizon = env.world().setup().horizon.max(1) as f32;
        let observed =
            detached(py, || env.observe(id).map(|o| (o.frame, o.proprioception.clone())))?;
        let (frame, proprioception) = observed.ok_or_else(|| runtime_error(not_waiting(agent)))?;
        let values = action::proprioception_values(&proprioception, frame as f32 / horizon);
        let mask = action::mask(&proprioception);
        Ok((PyArray1::from_slice(py, &values), PyArray1::from_slice(py, &mask)))
    }

    /// Returns the reward terms of the last action of an agent: `delivered`, `progress_m`, `is_invalid`; `None` before
    /// the first one.
    #[pyo3(signature = (agent=1))]
    fn reward<'py>(
        &mut self,
        py: Python<'py>,
        #[pyo3(from_py_with = crate::error::agent_number)] agent: u8,
    ) -> PyResult<Bound<'py, PyAny>> {
        let id = self.agent(agent)?;
        reward(py, self.env()?.reward(id))
    }

    /// Returns the score so far: `frame`, `delivered`, `wanted`, `complete`; TR is `delivered / wanted`.
    fn score<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        score(py, self.env()?)
    }

    /// Returns the events since the last call (docs/reference/trace.md).
    fn take_events<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let events = PyList::empty(py);
        for event in std::mem::take(&mut self.events) {
            events.append(to_python(py, &event)?)?;
        }
        Ok(events.into_any())
    }

    /// Returns the digest of the world's state.
    fn digest(&mut self) -> PyResult<String> {
        Ok(self.env()?.digest().to_string())
    }

    /// Copies the episode with its agents.
    fn snapshot(&mut self) -> PyResult<Snapshot> {
        let snapshot = self.env()?.snapshot().map_err(|error| from_env(&error))?;
        Ok(Snapshot(Mutex::new(snapshot)))
    }

    /// Replaces the state by a snapshot of the same episode.
    fn restore(&mut self, snapshot: &Bound<'_, Snapshot>) -> PyResult<()> {
        let mut snapshot = snapshot.try_borrow_mut()?;
        let snapshot = snapshot.0.get_mut().map_err(poisoned)?;
        self.env()?.restore(snapshot).map_err(|error| from_env(&error))?;
        self.events.clear();
        Ok(())
    }

    /// Renders the view of an agent, by default the helper if there is one, or of a camera (a dictionary as
    /// `Observation.camera`). `image_size` is the width and height of an agent's view, 512 by default; a camera has its
    /// own. Returns arrays by name: `rgb`, `depth`, `ids`. The method ignores grants; agents use `observe`.
    #[pyo3(signature = (agent=None, camera=None, image_size=None, images=None))]
    fn render<'py>(
        &mut self,
        py: Python<'py>,
        agent: Option<&Bound<'py, PyAny>>,
        camera: Option<&Bound<'py, PyAny>>,
        image_size: Option<&Bound<'py, PyAny>>,
        images: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if camera.is_some() && agent.is_some() {
            return Err(value_error("give an agent or a camera"));
        }
        if camera.is_some() && image_size.is_some() {
            return Err(value_error("a camera has its own width and height; give no image_size"));
        }
        let agent = agent.map(agent_number).transpose()?;
        let image_size = image_size.map(crate::options::image_size).transpose()?;
        let image_size = image_size.unwrap_or(VIEW_SIZE);
        let kinds = images.map_or_else(|| Ok(vec!["rgb".to_owned()]), strings)?;
        let channels = Channels::from(sensors(&kinds, image_size)?);
        let has_helper = self.env()?.slots().len() > AgentId::HELPER.index();
        let default = if has_helper { AgentId::HELPER } else { AgentId::PARTNER };
        let id = self.agent(agent.unwrap_or(default.0))?;
        let env = self.env()?;
        let view = match camera {
            Some(camera) => View::from_camera(parse_camera(camera)?, channels),
            None => View::from_agent(env.world(), id, image_size, channels),
        };
        let (scene, world) = (env.renderer().scene(), env.world());
        let mut rendered = detached(py, || scene.render(world, std::slice::from_ref(&view)))?;
        let images = rendered.pop().unwrap_or_default();
        let (rgb, depth, ids) = arrays(py, &images, &view.camera)?;
        let by_name = PyDict::new(py);
        if let Some(rgb) = rgb {
            by_name.set_item("rgb", rgb)?;
        }
        if let Some(depth) = depth {
            by_name.set_item("depth", depth)?;
        }
        if let Some(ids) = ids {
            by_name.set_item("ids", ids)?;
        }
        Ok(by_name)
    }

    /// Draws the top view, uint8 [height, width, 3].
    #[pyo3(signature = (width=640))]
    fn floor_plan<'py>(
        &mut self,
        py: Python<'py>,
        #[pyo3(from_py_with = crate::error::plan_width)] width: u32,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let env = self.env()?;
        let (scene, world) = (env.renderer().scene(), env.world());
        let picture = detached(py, || floor_plan::draw_scene_plan(scene, world, width))?;
        let shape = [picture.height() as usize, picture.width() as usize, 3];
        PyArray1::from_vec(py, picture.into_raw()).reshape(shape)
    }

    /// Shows the top view in the notebook or the browser.
    fn show(slf: Bound<'_, Self>) -> PyResult<()> {
        slf.py().import("chaic.pictures")?.call_method1("show", (slf,))?;
        Ok(())
    }

    /// Returns the picture for notebooks, as PNG.
    fn _repr_png_<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        encode_png(py, &self.floor_plan(py, 640)?)
    }

    /// Raises `AttributeError`; the message names the new name of a renamed method.
    fn __getattr__(&self, name: &str) -> PyResult<Py<PyAny>> {
        Err(no_attribute("World", name, &[("own", "proprioception"), ("plan", "floor_plan")]))
    }

    fn __repr__(&mut self) -> PyResult<String> {
        let frame = self.frame()?;
        Ok(format!("World({:?}, frame={frame})", self.episode.id()))
    }

    fn __reduce__(&self) -> PyResult<Py<PyAny>> {
        let instead = "pass its Episode to another process, and use snapshot() within this one";
        Err(not_picklable("World", instead))
    }
}

fn not_waiting(agent: u8) -> String {
    format!("agent {agent} needs no action now; `waiting()` lists the agents that do")
}

/// Parses a camera, and checks that it has a valid image size and a view.
fn parse_camera(camera: &Bound<'_, PyAny>) -> PyResult<Camera> {
    for side in ["width", "height"] {
        // If a side is missing, the parser below reports it.
        if let Ok(value) = camera.get_item(side) {
            integer(side, &value, &IMAGE_SIZES)?;
        }
    }
    let camera: Camera = depythonize(camera).map_err(value_error)?;
    if Projection::from_camera(&camera).is_some() {
        return Ok(camera);
    }
    Err(value_error(
        "the camera has no view: eye_in_world is finite, world_from_camera a rotation and \
         vertical_fov_rad between 0.01 and 3.1",
    ))
}
