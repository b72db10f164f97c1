//! One episode under way.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use chaic_core::geom::Camera;
use chaic_core::{AgentError, AgentId};
use chaic_env::trace::Record;
use chaic_env::{Env, EnvSnapshot, Flow, RewardTerms};
use chaic_render::{Channels, View, floor_plan};
use chaic_world::Event;
use numpy::{PyArray1, PyArray3, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use pythonize::depythonize;

use crate::action;
use crate::episode::{Episode, encode_png};
use crate::error::{failure, mistake, of_env, poisoned};
use crate::observation::{Briefing, Observation, arrays, plain};
use crate::options::{Options, senses};
use crate::threads::beside;

/// What an agent knows of itself as numbers, and which actions its hands don't rule out.
type OwnArrays<'py> = (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<bool>>);

/// How a play that came to its end or a stop says so.
pub fn name_of(flow: Flow) -> &'static str {
    match flow {
        Flow::Waits => "waits",
        Flow::Ended => "ended",
        Flow::Stopped => "stopped",
    }
}

/// Terms of a reward as a dictionary.
pub fn reward<'py>(py: Python<'py>, terms: Option<RewardTerms>) -> PyResult<Bound<'py, PyAny>> {
    plain(py, &terms)
}

/// The score so far.
pub fn score<'py>(py: Python<'py>, env: &Env) -> PyResult<Bound<'py, PyAny>> {
    let end = env.score();
    let score = PyDict::new(py);
    score.set_item("frame", end.frame)?;
    score.set_item("done", end.done)?;
    score.set_item("total", end.total)?;
    score.set_item("complete", end.complete)?;
    Ok(score.into_any())
}

/// An episode under way: a world, the minds in it, and the seats of the caller's (agents 0, the partner, and 1,
/// the helper).
#[pyclass(module = "chaic._chaic")]
pub struct World {
    env: Mutex<Env>,
    options: Options,
    episode: Arc<chaic_episodes::Episode>,
    events: Vec<Event>,
}

/// An episode as it stood, with the minds in it.
#[pyclass(module = "chaic._chaic")]
pub struct Snapshot(Mutex<EnvSnapshot>);

impl World {
    fn env(&mut self) -> PyResult<&mut Env> {
        self.env.get_mut().map_err(poisoned)
    }

    fn agent(&mut self, agent: u8) -> PyResult<AgentId> {
        let n = self.env()?.seats().len();
        if usize::from(agent) < n {
            return Ok(AgentId(agent));
        }
        Err(mistake(format!("there is no agent {agent}; the world has {n}")))
    }
}

#[pymethods]
impl World {
    /// An episode from its beginning. Keywords: `helper` and `partner` (`"caller"`, or who else: a
    /// built-in helper or `"none"`; `"rules"` for the task's own partner), `rules`, `set`, `grants` (docs/grants.md)
    /// and `images` (of `"rgb"`, `"depth"`, `"ids"`) and `image_size` of the caller's seats, `minds_image_size` of all others (as in
    /// scored runs unless said), `appearance`,
    /// `perception` and `behavior` of a built-in helper as `Mind` has them.
    #[new]
    #[pyo3(signature = (episode, seed=0, **options))]
    fn new(
        py: Python<'_>,
        episode: &Bound<'_, Episode>,
        seed: u32,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<World> {
        let options = Options::new(options)?;
        let episode = Arc::clone(&episode.get().0);
        let minds = options.minds()?;
        let env = beside(py, || Env::new(options.config(&episode, seed), minds))?;
        let env = Mutex::new(env.map_err(|error| of_env(&error))?);
        Ok(World { env, options, episode, events: Vec::new() })
    }

    /// Begins another episode, or this one anew.
    #[pyo3(signature = (episode=None, seed=0))]
    fn reset(
        &mut self,
        py: Python<'_>,
        episode: Option<&Bound<'_, Episode>>,
        seed: u32,
    ) -> PyResult<()> {
        let episode = episode.map_or_else(|| Arc::clone(&self.episode), |e| Arc::clone(&e.get().0));
        let World { env, options, .. } = self;
        let env = env.get_mut().map_err(poisoned)?;
        let config = options.config(&episode, seed);
        beside(py, || env.reset(config))?.map_err(|error| of_env(&error))?;
        self.episode = episode;
        self.events.clear();
        Ok(())
    }

    /// The episode that is played.
    #[getter]
    fn episode(&self) -> Episode {
        Episode(Arc::clone(&self.episode))
    }

    /// Frames that have passed; there are 30 to a second.
    #[getter]
    fn frame(&mut self) -> PyResult<u32> {
        Ok(self.env()?.world().state().frame)
    }

    /// How many frames the episode has.
    #[getter]
    fn horizon(&mut self) -> PyResult<u32> {
        Ok(self.env()?.world().setup().horizon)
    }

    /// Whether it is over.
    #[getter]
    fn is_over(&mut self) -> PyResult<bool> {
        Ok(self.env()?.world().is_over())
    }

    /// Plays on until a choice of the caller's is needed (`"waits"`), the episode has `"ended"`, or the first frame
    /// at or after `until` in which somebody decides has come (`"stopped"`).
    #[pyo3(signature = (until=None))]
    fn advance(&mut self, py: Python<'_>, until: Option<u32>) -> PyResult<&'static str> {
        let World { env, events, .. } = self;
        let env = env.get_mut().map_err(poisoned)?;
        let flow = beside(py, || {
            env.run(&AtomicBool::new(false), until, &mut |record| -> Result<(), AgentError> {
                if let Record::Event(told) = record {
                    events.push(told.event);
                }
                Ok(())
            })
        })?;
        flow.map(name_of).map_err(failure)
    }

    /// The agents whose choices are the caller's and needed now.
    fn waiting(&mut self) -> PyResult<Vec<usize>> {
        Ok(self.env()?.waiting().map(AgentId::index).collect())
    }

    /// What an agent is told before the episode.
    #[pyo3(signature = (agent=1))]
    fn briefing(&mut self, agent: u8) -> PyResult<Briefing> {
        let agent = self.agent(agent)?;
        Ok(Briefing(self.env()?.briefing(agent)))
    }

    /// What an agent that waits perceives.
    #[pyo3(signature = (agent=1))]
    fn observe(&mut self, py: Python<'_>, agent: u8) -> PyResult<Observation> {
        let id = self.agent(agent)?;
        let env = self.env()?;
        let seen = beside(py, || env.observe(id).cloned())?;
        seen.map(Observation).ok_or_else(|| failure(not_waiting(agent)))
    }

    /// Chooses for an agent that waits: a string or dictionary as in docs/subprocess-helpers.md, or a row of
    /// `ACTIONS` with the column and row of a pixel. It acts once all who wait have chosen.
    #[pyo3(signature = (action, agent=1))]
    fn submit(&mut self, py: Python<'_>, action: &Bound<'_, PyAny>, agent: u8) -> PyResult<()> {
        let id = self.agent(agent)?;
        let action = match action.extract::<[i64; 3]>() {
            Ok(row) => action::of_row(row)?,
            Err(_) => action::of_object(action)?,
        };
        let env = self.env()?;
        match beside(py, || env.submit(id, action))? {
            true => Ok(()),
            false => Err(failure(not_waiting(agent))),
        }
    }

    /// Chooses for the agent that alone waits and plays on, in one call for learners: whether somebody waits, and of
    /// what came of it the share that was delivered, metres of approach, and whether it failed.
    #[pyo3(signature = (action, agent=1))]
    fn step(
        &mut self,
        py: Python<'_>,
        action: &Bound<'_, PyAny>,
        agent: u8,
    ) -> PyResult<(bool, f64, f64, bool)> {
        self.submit(py, action, agent)?;
        let waits = self.advance(py, None)? == name_of(Flow::Waits);
        let terms = self.env()?.reward(AgentId(agent)).unwrap_or_default();
        Ok((waits, terms.delivered, terms.approached_m, terms.is_invalid))
    }

    /// What is done and what was wanted; TR is their ratio.
    fn progress(&mut self) -> PyResult<(f64, f64)> {
        Ok(self.env()?.world().progress())
    }

    /// What an agent that waits knows of itself, as numbers (`OWN`), and which of `ACTIONS` its hands don't
    /// rule out.
    #[pyo3(signature = (agent=1))]
    fn own<'py>(&mut self, py: Python<'py>, agent: u8) -> PyResult<OwnArrays<'py>> {
        let id = self.agent(agent)?;
        let env = self.env()?;
        let horizon = env.world().setup().horizon.max(1) as f32;
        let seen = beside(py, || env.observe(id).map(|seen| (seen.frame, seen.own.clone())))?;
        let (frame, own) = seen.ok_or_else(|| failure(not_waiting(agent)))?;
        let numbers = action::own_numbers(&own, frame as f32 / horizon);
        Ok((PyArray1::from_slice(py, &numbers), PyArray1::from_slice(py, &action::mask(&own))))
    }

    /// What has come of the caller's last choice for an agent, as the terms of a reward: `delivered`,
    /// `approached_m`, `is_invalid`; `None` before the first one.
    #[pyo3(signature = (agent=1))]
    fn reward<'py>(&mut self, py: Python<'py>, agent: u8) -> PyResult<Bound<'py, PyAny>> {
        let id = self.agent(agent)?;
        reward(py, self.env()?.reward(id))
    }

    /// The score so far: `frame`, `done`, `total`, `complete`; TR is `done / total`.
    fn score<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        score(py, self.env()?)
    }

    /// What happened since this was last asked (docs/reference/trace.md).
    fn take_events<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let events = PyList::empty(py);
        for event in std::mem::take(&mut self.events) {
            events.append(plain(py, &event)?)?;
        }
        Ok(events.into_any())
    }

    /// A number that differs between different states of the world, and is the same for equal ones.
    fn digest(&mut self) -> PyResult<String> {
        Ok(self.env()?.digest().to_string())
    }

    /// All of it as it stands, to go on from later or more than once.
    fn snapshot(&mut self) -> PyResult<Snapshot> {
        let snapshot = self.env()?.snapshot().map_err(|error| of_env(&error))?;
        Ok(Snapshot(Mutex::new(snapshot)))
    }

    /// Goes back, or on, to a snapshot of the same episode.
    fn restore(&mut self, snapshot: &Bound<'_, Snapshot>) -> PyResult<()> {
        let mut snapshot = snapshot.try_borrow_mut()?;
        let snapshot = snapshot.0.get_mut().map_err(poisoned)?;
        self.env()?.restore(snapshot).map_err(|error| of_env(&error))?;
        self.events.clear();
        Ok(())
    }

    /// What somebody sees: an agent, or a camera (a dictionary like [`Observation.camera`]). Arrays by name: `rgb`,
    /// `depth`, `ids`. This is for onlookers; an agent perceives what it is granted.
    #[pyo3(signature = (agent=None, camera=None, image_size=512, images=None))]
    fn render<'py>(
        &mut self,
        py: Python<'py>,
        agent: Option<u8>,
        camera: Option<&Bound<'py, PyAny>>,
        image_size: u32,
        images: Option<Vec<String>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let kinds = images.unwrap_or_else(|| vec!["rgb".to_owned()]);
        let senses = senses(&kinds, image_size)?;
        let channels = Channels { rgb: senses.rgb, depth: senses.depth, ids: senses.ids };
        let id = self.agent(agent.unwrap_or(0))?;
        let env = self.env()?;
        let view = match camera {
            Some(camera) => {
                let camera: Camera = depythonize(camera).map_err(mistake)?;
                senses_of_size(&camera)?;
                View::of_camera(camera, channels)
            }
            None => View::of_agent(env.world(), id, image_size, channels),
        };
        let (scene, world) = (env.observer().scene(), env.world());
        let mut drawn = beside(py, || scene.render(world, std::slice::from_ref(&view)))?;
        let drawn = drawn.pop().unwrap_or_default();
        let (rgb, depth, ids) = arrays(py, &drawn, &view.camera)?;
        let named = PyDict::new(py);
        if let Some(rgb) = rgb {
            named.set_item("rgb", rgb)?;
        }
        if let Some(depth) = depth {
            named.set_item("depth", depth)?;
        }
        if let Some(ids) = ids {
            named.set_item("ids", ids)?;
        }
        Ok(named)
    }

    /// Seen from above, uint8 [height, width, 3].
    #[pyo3(signature = (width=640))]
    fn plan<'py>(&mut self, py: Python<'py>, width: u32) -> PyResult<Bound<'py, PyArray3<u8>>> {
        if !(16..=8192).contains(&width) {
            return Err(mistake(format!("width is {width}, expected 16 to 8192")));
        }
        let env = self.env()?;
        let (scene, world) = (env.observer().scene(), env.world());
        let picture = beside(py, || floor_plan::draw_scene_plan(scene, world, width))?;
        let shape = [picture.height() as usize, picture.width() as usize, 3];
        PyArray1::from_vec(py, picture.into_raw()).reshape(shape)
    }

    /// Shows the world from above: in a notebook in its cell, elsewhere in the browser.
    fn show(slf: Bound<'_, Self>) -> PyResult<()> {
        slf.py().import("chaic.pictures")?.call_method1("show", (slf,))?;
        Ok(())
    }

    /// The picture that notebooks show: all from above.
    fn _repr_png_<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        encode_png(py, self.plan(py, 640)?.readonly())
    }

    fn __repr__(&mut self) -> PyResult<String> {
        let frame = self.frame()?;
        Ok(format!("World({:?}, frame={frame})", self.episode.id()))
    }
}

fn not_waiting(agent: u8) -> String {
    format!("agent {agent} isn't asked now; `waiting()` tells who is")
}

/// Whether a camera's image is of a size that can be drawn.
fn senses_of_size(camera: &Camera) -> PyResult<()> {
    [camera.width, camera.height].into_iter().try_for_each(|side| senses(&[], side).map(|_| ()))
}
