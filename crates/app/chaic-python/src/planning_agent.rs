//! Built-in helpers and their parts in Python.

use std::sync::{Arc, Mutex};

use chaic_agents::PlanningAgent as CorePlanningAgent;
use chaic_agents::decision::Plan;
use chaic_agents::memory::Memory;
use chaic_agents::memory::egocentric::{CHANNELS, EgocentricMap};
use chaic_agents::policies::ExternalPolicy;
use chaic_core::geom::rotate_yaw;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{Agent, AgentError};
use chaic_env::helper_registry::{self, BuiltInWithPerception, Helper};
use chaic_learn::helpers::PolicyRegistry;
use chaic_subprocess::message::SensorRequest;
use chaic_vision::trained::TrainedDetector;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::action::to_object;
use crate::error::{
    from_env, index_error, no_attribute, not_picklable, poisoned, runtime_error, value_error,
};
use crate::observation::{Briefing, Observation, to_python};
use crate::options::{perception, rule_set};

/// Refuses behavior recognition from images: the worlds of this package record no frame history for it.
fn check_history(sensors: SensorConfig) -> PyResult<()> {
    match sensors.frame_history {
        None => Ok(()),
        Some(_) => Err(value_error(
            "behavior=\"learned\" needs images between decisions, which only helpers inside a world get: \
             World(..., helper=NAME, behavior=\"learned\")",
        )),
    }
}

/// Error of an agent that was not briefed.
fn not_reset() -> PyErr {
    runtime_error("call reset(briefing) first")
}

/// Returns the names of grants.
fn names(grants: Grants) -> Vec<&'static str> {
    grants.named().into_iter().filter(|(_, is_granted)| *is_granted).map(|(name, _)| name).collect()
}

/// Built-in helper that Python code asks for actions.
#[pyclass(module = "chaic._chaic")]
pub struct PlanningAgent {
    agent: Mutex<Box<dyn Agent>>,
    grants: Grants,
    is_reset: bool,
}

#[pymethods]
impl PlanningAgent {
    /// Creates a helper by name, such as `"rhp"`. `perception` is ground truth (`"gt"`), the detector (`"learned"`,
    /// `"learned:FILE"`) or simulated detector errors (`"noisy"`, `"noisy:FILE"`). `behavior` recognizes actions of
    /// others by grants (`"gt"`). `rules` and `set` are as in `World`.
    #[new]
    #[pyo3(signature = (name, perception="gt", behavior="gt", *, rules="paper", set=Vec::new()))]
    fn new(
        name: &str,
        perception: &str,
        behavior: &str,
        rules: &str,
        #[pyo3(from_py_with = crate::options::strings)] set: Vec<String>,
    ) -> PyResult<PlanningAgent> {
        let perception = self::perception(perception, behavior)?;
        let built_in = BuiltInWithPerception { perception: Arc::clone(&perception) };
        let helpers = PolicyRegistry::bundled(&built_in, perception);
        let rules = rule_set(rules, &set)?.planner;
        let found = helper_registry::find(&helpers, name, rules).map_err(|e| from_env(&e))?;
        let Some(Helper { agent, grants }) = found else {
            return Err(value_error("\"none\" is not a helper"));
        };
        check_history(agent.sensors())?;
        Ok(PlanningAgent { agent: Mutex::new(agent), grants, is_reset: false })
    }

    /// Required grants.
    #[getter]
    fn grants(&self) -> Vec<&'static str> {
        names(self.grants)
    }

    /// Starts an episode.
    fn reset(&mut self, briefing: &Bound<'_, Briefing>) -> PyResult<()> {
        self.agent.get_mut().map_err(poisoned)?.reset(&briefing.get().0);
        self.is_reset = true;
        Ok(())
    }

    /// Returns the requested sensors: `image_size`, `rgb`, `depth`, `ids`, `frame_history`.
    fn sensors<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &SensorRequest::from(self.agent.get_mut().map_err(poisoned)?.sensors()))
    }

    /// Returns the next action.
    fn act<'py>(
        &mut self,
        py: Python<'py>,
        observation: &Bound<'py, Observation>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if !self.is_reset {
            return Err(not_reset());
        }
        let agent = self.agent.get_mut().map_err(poisoned)?;
        let observation = &observation.get().0;
        let action = py.detach(|| agent.act(observation)).map_err(runtime_error)?;
        to_object(py, &action)
    }

    /// Returns its current plan as text.
    fn thought(&mut self) -> PyResult<String> {
        Ok(self.agent.get_mut().map_err(poisoned)?.thought().plan)
    }

    /// Raises `AttributeError`; the message names the new name of a renamed method.
    fn __getattr__(&self, name: &str) -> PyResult<Py<PyAny>> {
        Err(no_attribute("PlanningAgent", name, &[("senses", "sensors")]))
    }

    fn __reduce__(&self) -> PyResult<Py<PyAny>> {
        Err(not_picklable("PlanningAgent", "create another one with the same arguments"))
    }
}

/// Elements of a plan vector: one-hot kind (`Plan::KINDS`), class index of the plan's object (-1 for none), and its
/// position in the body frame, meters to the right and ahead (0 for none).
pub const PLAN_FEATURES: [&str; N_KINDS + 3] = {
    let mut names = ["class"; N_KINDS + 3];
    let mut k = 0;
    while k < N_KINDS {
        names[k] = Plan::KINDS[k];
        k += 1;
    }
    names[N_KINDS + 1] = "right_m";
    names[N_KINDS + 2] = "ahead_m";
    names
};
const N_KINDS: usize = Plan::KINDS.len();

fn plan_vector(plan: &Plan, memory: &Memory) -> [f32; PLAN_FEATURES.len()] {
    let subject = plan.subject();
    let mut vector = [0.0; PLAN_FEATURES.len()];
    vector[plan.kind()] = 1.0;
    vector[N_KINDS] = subject.map_or(-1.0, |it| it.class.index() as f32);
    if let Some(object) = subject.and_then(|it| memory.objects.get(it.track)) {
        let pose = memory.pose;
        let in_body = rotate_yaw(object.position_in_world - pose.position, -pose.yaw_rad);
        [vector[N_KINDS + 1], vector[N_KINDS + 2]] = [in_body.x, -in_body.z];
    }
    vector
}

/// Perception, memory and execution of the built-in helpers; the caller chooses the plans.
#[pyclass(module = "chaic._chaic")]
pub struct Planner {
    agent: Mutex<CorePlanningAgent<ExternalPolicy>>,
    grants: Grants,
    briefing: Option<chaic_core::Briefing>,
}

impl Planner {
    fn agent(&mut self) -> PyResult<&mut CorePlanningAgent<ExternalPolicy>> {
        self.agent.get_mut().map_err(poisoned)
    }

    /// Returns the agent of a running episode.
    fn briefed_agent(&mut self) -> PyResult<&mut CorePlanningAgent<ExternalPolicy>> {
        if self.briefing.is_none() {
            return Err(not_reset());
        }
        self.agent()
    }

    /// Returns the next action; `None` if the caller must choose a plan first.
    fn next_action<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let agent = self.agent()?;
        match py.detach(|| agent.next_action()) {
            Ok(action) => to_object(py, &action).map(Some),
            Err(AgentError::Halted(_)) if !agent.policy().valid().is_empty() => Ok(None),
            Err(error) => Err(runtime_error(error)),
        }
    }
}

#[pymethods]
impl Planner {
    /// Creates a planner with images of this size; `perception`, `behavior`, `rules` and `set` are as in
    /// `PlanningAgent`. Ground truth (`"gt"`) needs the grant `"ids"`.
    #[new]
    #[pyo3(signature = (perception="gt", image_size=512, behavior="gt", *, rules="paper", set=Vec::new()))]
    fn new(
        perception: &str,
        #[pyo3(from_py_with = crate::options::image_size)] image_size: u32,
        behavior: &str,
        rules: &str,
        #[pyo3(from_py_with = crate::options::strings)] set: Vec<String>,
    ) -> PyResult<Planner> {
        let perception = self::perception(perception, behavior)?;
        perception.check_image_size(image_size).map_err(value_error)?;
        let policy = ExternalPolicy::default();
        let rules = rule_set(rules, &set)?.planner;
        let agent = CorePlanningAgent::with_perception(policy, rules, &*perception);
        check_history(agent.sensors())?;
        let sensors = SensorConfig { image_size, ..agent.sensors() };
        let agent = Mutex::new(agent.with_sensors(sensors));
        Ok(Planner { agent, grants: perception.grants(Grants::PLANNER), briefing: None })
    }

    /// Required grants.
    #[getter]
    fn grants(&self) -> Vec<&'static str> {
        names(self.grants)
    }

    /// Required images.
    #[getter]
    fn images(&mut self) -> PyResult<Vec<&'static str>> {
        let sensors = self.agent()?.sensors();
        let all = [("rgb", sensors.rgb), ("depth", sensors.depth), ("ids", sensors.ids)];
        Ok(all.into_iter().filter(|(_, wanted)| *wanted).map(|(name, _)| name).collect())
    }

    /// Starts an episode.
    fn reset(&mut self, briefing: &Bound<'_, Briefing>) -> PyResult<()> {
        self.agent()?.reset(&briefing.get().0);
        self.briefing = Some(briefing.get().0.clone());
        Ok(())
    }

    /// Processes an observation; returns the next action of the current plan, or `None` if the caller must choose a
    /// plan (`plans`, `choose`).
    fn act<'py>(
        &mut self,
        py: Python<'py>,
        observation: &Bound<'py, Observation>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let observation = &observation.get().0;
        let agent = self.briefed_agent()?;
        py.detach(|| agent.observe(observation));
        self.next_action(py)
    }

    /// Updates the memory from an observation, without a decision.
    fn observe(&mut self, py: Python<'_>, observation: &Bound<'_, Observation>) -> PyResult<()> {
        let observation = &observation.get().0;
        let agent = self.briefed_agent()?;
        py.detach(|| agent.observe(observation));
        Ok(())
    }

    /// Returns the valid plans as text, those of one kind by distance; empty while a plan is executed.
    fn plans(&mut self) -> PyResult<Vec<String>> {
        Ok(self.agent()?.policy().valid().iter().map(ToString::to_string).collect())
    }

    /// Returns the valid plans as vectors (`PLAN_FEATURES`), float32 [plans, 14].
    fn plan_features<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let agent = self.agent()?;
        let rows: Vec<Vec<f32>> = match agent.memory() {
            Some(memory) => {
                let valid = agent.policy().valid().iter();
                valid.map(|plan| plan_vector(plan, memory).to_vec()).collect()
            }
            None => Vec::new(),
        };
        if rows.is_empty() {
            return PyArray1::from_vec(py, Vec::new()).reshape([0, PLAN_FEATURES.len()]);
        }
        PyArray2::from_vec2(py, &rows).map_err(runtime_error)
    }

    /// Draws the memory as an egocentric top view, heading up: uint8 [channels, side, side], with the channels of
    /// `MAP`.
    #[pyo3(signature = (side=64, cell_m=0.25))]
    fn semantic_map<'py>(
        &mut self,
        py: Python<'py>,
        #[pyo3(from_py_with = crate::error::map_side)] side: usize,
        cell_m: f32,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        if !(0.01..=10.0).contains(&cell_m) {
            return Err(value_error(format!("cell_m is {cell_m}, expected 0.01 to 10 meters")));
        }
        let map = EgocentricMap { side, cell_m };
        let mut out = vec![0; map.len()];
        let Planner { agent, briefing, .. } = self;
        let agent = agent.get_mut().map_err(poisoned)?;
        if let (Some(memory), Some(briefing)) = (agent.memory(), briefing.as_ref()) {
            map.draw(memory, briefing, &mut out);
        }
        PyArray1::from_vec(py, out).reshape([CHANNELS.len(), side, side])
    }

    /// Chooses a plan; returns its first action, or `None` if it can't be executed and another must be chosen.
    fn choose<'py>(
        &mut self,
        py: Python<'py>,
        #[pyo3(from_py_with = crate::error::plan_index)] index: usize,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let policy = self.agent()?.policy_mut();
        let n = policy.valid().len();
        if !policy.set_plan(index) {
            return Err(index_error("plan", index, n));
        }
        self.next_action(py)
    }

    /// Raises `AttributeError`; the message names the new name of a renamed method.
    fn __getattr__(&self, name: &str) -> PyResult<Py<PyAny>> {
        const RENAMED: [(&str, &str); 4] = [
            ("attend", "act"),
            ("look", "observe"),
            ("plan_numbers", "plan_features"),
            ("things", "remembered_objects"),
        ];
        Err(no_attribute("Planner", name, &RENAMED))
    }

    fn __reduce__(&self) -> PyResult<Py<PyAny>> {
        Err(not_picklable("Planner", "create another one with the same arguments"))
    }

    /// Returns the remembered objects: `name`, `class`, `position` in the world (meters), `last_seen` (frame), and
    /// `is_present` by current knowledge.
    fn remembered_objects<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let list = PyList::empty(py);
        let Some(memory) = self.agent()?.memory() else { return Ok(list) };
        for object in memory.objects.iter() {
            let row = PyDict::new(py);
            row.set_item("name", object.track.to_string())?;
            row.set_item("class", object.class.name())?;
            row.set_item("position", object.position_in_world.to_array())?;
            row.set_item("last_seen", object.last_seen)?;
            row.set_item("is_present", object.is_present)?;
            list.append(row)?;
        }
        Ok(list)
    }
}

/// Object detector for images of color and depth.
#[pyclass(frozen, module = "chaic._chaic")]
pub struct Detector(TrainedDetector);

#[pymethods]
impl Detector {
    /// Creates the built-in detector, or one with the given weights.
    #[new]
    #[pyo3(signature = (weights=None))]
    fn new(weights: Option<&[u8]>) -> PyResult<Detector> {
        match weights {
            None => Ok(Detector(TrainedDetector::built_in())),
            Some(bytes) => TrainedDetector::from_bytes(bytes).map(Detector).map_err(value_error),
        }
    }

    /// Detects objects in an observation of color and depth: dictionaries with `class` (`None` for people), `score`
    /// and `mask`, bool [height, width].
    fn detect<'py>(
        &self,
        py: Python<'py>,
        observation: &Bound<'py, Observation>,
    ) -> PyResult<Bound<'py, PyList>> {
        let observation = &observation.get().0;
        let (Some(rgb), Some(depth_m)) = (&observation.images.rgb, &observation.images.depth_m)
        else {
            return Err(value_error("the observation has no color or no depth"));
        };
        if !self.0.fits(&observation.camera) {
            return Err(value_error(
                "width and height of the image must be multiples of 32 pixels",
            ));
        }
        let detections =
            py.detach(|| self.0.detect(rgb, depth_m, &observation.camera, &mut self.0.inference()));
        let (width, height) =
            (observation.camera.width as usize, observation.camera.height as usize);
        let list = PyList::empty(py);
        for instance in detections {
            let mut mask = vec![false; width * height];
            instance.pixels.iter().for_each(|p| mask[*p as usize] = true);
            let row = PyDict::new(py);
            let class = chaic_vision::labels::class_of(instance.label());
            row.set_item("class", class.map(|class| class.name()))?;
            row.set_item("score", instance.score())?;
            row.set_item("mask", PyArray1::from_vec(py, mask).reshape([height, width])?)?;
            list.append(row)?;
        }
        Ok(list)
    }
}
