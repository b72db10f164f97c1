//! The built-in minds and their parts, for Python code that uses or replaces one of them.

use std::sync::Mutex;

use chaic_agents::decision::Plan;
use chaic_agents::memory::Memory;
use chaic_agents::memory::egocentric::{CHANNELS, EgocentricMap};
use chaic_agents::policies::External;
use chaic_agents::{Mind as PlanMind, PlannerRules};
use chaic_core::geom::rotate_yaw;
use chaic_core::observation::{Grants, Senses};
use chaic_core::{Agent, AgentError};
use chaic_env::minds::{self, Helper};
use chaic_env::rules::RuleSet;
use chaic_vision::trained::TrainedDetector;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::action::to_object;
use crate::error::{failure, mistake, no_such, of_env, poisoned};
use crate::observation::{Briefing, Observation, plain};
use crate::options::sight;

fn planner_rules() -> PlannerRules {
    RuleSet::PAPER.planner
}

/// The names of what somebody is granted.
fn names(grants: Grants) -> Vec<&'static str> {
    grants.named().into_iter().filter(|(_, is_given)| *is_given).map(|(name, _)| name).collect()
}

/// A built-in helper, asked from Python: what it would do with an observation.
#[pyclass(module = "chaic._chaic")]
pub struct Mind {
    agent: Mutex<Box<dyn Agent>>,
    grants: Grants,
}

#[pymethods]
impl Mind {
    /// The helper of this name, like `"rhp"`, which sees by ground truth (`"gt"`), the detector (`"learned"`,
    /// `"learned:FILE"`) or with faults (`"noisy"`, `"noisy:FILE"`), and tells what others do by what it is granted (`"gt"`) or
    /// the behavior network (`"learned"`, `"learned:FILE"`).
    #[new]
    #[pyo3(signature = (name, perception="gt", behavior="gt"))]
    fn new(name: &str, perception: &str, behavior: &str) -> PyResult<Mind> {
        let helpers = minds::Seeing { sight: sight(perception, behavior)? };
        let found = minds::find(&helpers, name, planner_rules()).map_err(|e| of_env(&e))?;
        let Some(Helper { mind, grants }) = found else {
            return Err(mistake("\"none\" is nobody"));
        };
        Ok(Mind { agent: Mutex::new(mind), grants })
    }

    /// The grants that it needs.
    #[getter]
    fn grants(&self) -> Vec<&'static str> {
        names(self.grants)
    }

    /// Begins an episode.
    fn reset(&mut self, briefing: &Bound<'_, Briefing>) -> PyResult<()> {
        self.agent.get_mut().map_err(poisoned)?.reset(&briefing.get().0);
        Ok(())
    }

    /// Which images it wants: `image_size`, `rgb`, `depth`, `ids`, `film`.
    fn senses<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.agent.get_mut().map_err(poisoned)?.senses())
    }

    /// What it does next.
    fn act<'py>(
        &mut self,
        py: Python<'py>,
        observation: &Bound<'py, Observation>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let agent = self.agent.get_mut().map_err(poisoned)?;
        let observation = &observation.get().0;
        let action = py.detach(|| agent.act(observation)).map_err(failure)?;
        to_object(py, &action)
    }

    /// What it thinks, in words.
    fn thought(&mut self) -> PyResult<String> {
        Ok(self.agent.get_mut().map_err(poisoned)?.thought().plan)
    }
}

/// What a plan's numbers are: which kind it is (`Plan::KINDS`), and of the thing that it is about the class (its
/// number, or -1), and the place in the own body's frame, metres to the right and ahead (0 if it is about none).
pub const PLAN: [&str; N_KINDS + 3] = {
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

fn plan_numbers(plan: &Plan, memory: &Memory) -> [f32; PLAN.len()] {
    let subject = plan.subject();
    let mut numbers = [0.0; PLAN.len()];
    numbers[plan.kind()] = 1.0;
    numbers[N_KINDS] = subject.map_or(-1.0, |it| it.class.index() as f32);
    if let Some(thing) = subject.and_then(|it| memory.things.get(it.track)) {
        let pose = memory.pose;
        let in_body = rotate_yaw(thing.position_in_world - pose.position, -pose.yaw_rad);
        [numbers[N_KINDS + 1], numbers[N_KINDS + 2]] = [in_body.x, -in_body.z];
    }
    numbers
}

/// Perception, memory and execution of the built-in helpers, with the choice of plans left to the caller.
#[pyclass(module = "chaic._chaic")]
pub struct Planner {
    mind: Mutex<PlanMind<External>>,
    grants: Grants,
    briefing: Option<chaic_core::Briefing>,
}

impl Planner {
    fn mind(&mut self) -> PyResult<&mut PlanMind<External>> {
        self.mind.get_mut().map_err(poisoned)
    }

    /// The next action, or `None` if a plan is to be chosen first.
    fn go_on<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let mind = self.mind()?;
        match py.detach(|| mind.proceed()) {
            Ok(action) => to_object(py, &action).map(Some),
            Err(AgentError::Halted(_)) if !mind.policy().valid().is_empty() => Ok(None),
            Err(error) => Err(failure(error)),
        }
    }
}

#[pymethods]
impl Planner {
    /// One that sees by images of this size, `perception` and `behavior` being as `Mind` has them. Ids from ground
    /// truth (`"gt"`) need the grant `"ids"`.
    #[new]
    #[pyo3(signature = (perception="gt", image_size=512, behavior="gt"))]
    fn new(perception: &str, image_size: u32, behavior: &str) -> PyResult<Planner> {
        let sight = sight(perception, behavior)?;
        crate::options::senses(&[], image_size)?;
        let mind = PlanMind::seeing(External::default(), planner_rules(), &*sight);
        let senses = Senses { image_size, ..mind.senses() };
        let mind = Mutex::new(mind.with_senses(senses));
        Ok(Planner { mind, grants: sight.grants(Grants::PLANNER), briefing: None })
    }

    /// The grants that it needs.
    #[getter]
    fn grants(&self) -> Vec<&'static str> {
        names(self.grants)
    }

    /// The images that it needs.
    #[getter]
    fn images(&mut self) -> PyResult<Vec<&'static str>> {
        let senses = self.mind()?.senses();
        let all = [("rgb", senses.rgb), ("depth", senses.depth), ("ids", senses.ids)];
        Ok(all.into_iter().filter(|(_, wanted)| *wanted).map(|(name, _)| name).collect())
    }

    /// Begins an episode.
    fn reset(&mut self, briefing: &Bound<'_, Briefing>) -> PyResult<()> {
        self.mind()?.reset(&briefing.get().0);
        self.briefing = Some(briefing.get().0.clone());
        Ok(())
    }

    /// Takes in what is perceived: the next action of the plan that is followed, or `None` if a plan is to be
    /// chosen (`plans`, `choose`).
    fn attend<'py>(
        &mut self,
        py: Python<'py>,
        observation: &Bound<'py, Observation>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let observation = &observation.get().0;
        let mind = self.mind()?;
        py.detach(|| mind.attend(observation));
        self.go_on(py)
    }

    /// Takes in what is perceived, and decides nothing: for those who want the memory alone.
    fn look(&mut self, py: Python<'_>, observation: &Bound<'_, Observation>) -> PyResult<()> {
        let observation = &observation.get().0;
        let mind = self.mind()?;
        py.detach(|| mind.attend(observation));
        Ok(())
    }

    /// The plans to choose among, in words, those of one kind nearest first; empty while one is followed.
    fn plans(&mut self) -> PyResult<Vec<String>> {
        Ok(self.mind()?.policy().valid().iter().map(ToString::to_string).collect())
    }

    /// The same plans as numbers (`PLAN`), float32 [plans, 14].
    fn plan_numbers<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let mind = self.mind()?;
        let rows: Vec<Vec<f32>> = match mind.memory() {
            Some(memory) => {
                let valid = mind.policy().valid().iter();
                valid.map(|plan| plan_numbers(plan, memory).to_vec()).collect()
            }
            None => Vec::new(),
        };
        if rows.is_empty() {
            return PyArray1::from_vec(py, Vec::new()).reshape([0, PLAN.len()]);
        }
        PyArray2::from_vec2(py, &rows).map_err(failure)
    }

    /// What is remembered, seen from above with the own body in the middle, ahead upward: uint8
    /// [channels, side, side], the channels of `MAP`.
    #[pyo3(signature = (side=64, cell_m=0.25))]
    fn semantic_map<'py>(
        &mut self,
        py: Python<'py>,
        side: usize,
        cell_m: f32,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        if !(1..=1024).contains(&side) || !(0.01..=10.0).contains(&cell_m) {
            return Err(mistake("side is 1 to 1024, cell_m 0.01 to 10 metres"));
        }
        let map = EgocentricMap { side, cell_m };
        let mut out = vec![0; map.len()];
        let Planner { mind, briefing, .. } = self;
        let mind = mind.get_mut().map_err(poisoned)?;
        if let (Some(memory), Some(briefing)) = (mind.memory(), briefing.as_ref()) {
            map.draw(memory, briefing, &mut out);
        }
        PyArray1::from_vec(py, out).reshape([CHANNELS.len(), side, side])
    }

    /// Chooses one of the plans: its first action, or `None` if it can't be followed and another is to be chosen.
    fn choose<'py>(
        &mut self,
        py: Python<'py>,
        index: usize,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let policy = self.mind()?.policy_mut();
        let n = policy.valid().len();
        if !policy.tell(index) {
            return Err(no_such("plan", index, n));
        }
        self.go_on(py)
    }

    /// What it remembers: things with `name`, `class`, `position` in the world (metres), `last_seen` and whether
    /// it `is_present` as far as it knows.
    fn things<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let list = PyList::empty(py);
        let Some(memory) = self.mind()?.memory() else { return Ok(list) };
        for thing in memory.things.iter() {
            let row = PyDict::new(py);
            row.set_item("name", thing.track.to_string())?;
            row.set_item("class", thing.class.name())?;
            row.set_item("position", thing.position_in_world.to_array())?;
            row.set_item("last_seen", thing.last_seen)?;
            row.set_item("is_present", thing.is_present)?;
            list.append(row)?;
        }
        Ok(list)
    }
}

/// The detector that comes with chaic: which things are in an image of color and depth.
#[pyclass(frozen, module = "chaic._chaic")]
pub struct Detector(TrainedDetector);

#[pymethods]
impl Detector {
    /// The one that comes with chaic, or the one of this file of weights.
    #[new]
    #[pyo3(signature = (weights=None))]
    fn new(weights: Option<&[u8]>) -> PyResult<Detector> {
        match weights {
            None => Ok(Detector(TrainedDetector::built_in())),
            Some(bytes) => TrainedDetector::from_bytes(bytes).map(Detector).map_err(mistake),
        }
    }

    /// What an observation of color and depth shows: dictionaries with `class` (`None` for people), `score`, and
    /// `mask`, bool [height, width].
    fn detect<'py>(
        &self,
        py: Python<'py>,
        observation: &Bound<'py, Observation>,
    ) -> PyResult<Bound<'py, PyList>> {
        let seen = &observation.get().0;
        let (Some(rgb), Some(depth_m)) = (&seen.images.rgb, &seen.images.depth_m) else {
            return Err(mistake("the observation has no color or no depth"));
        };
        if !self.0.fits(&seen.camera) {
            return Err(mistake("an image for the detector has sides of a multiple of 32 pixels"));
        }
        let found =
            py.detach(|| self.0.detect((rgb, depth_m, &seen.camera), &mut self.0.inference()));
        let (width, height) = (seen.camera.width as usize, seen.camera.height as usize);
        let list = PyList::empty(py);
        for instance in found {
            let mut mask = vec![false; width * height];
            instance.pixels.iter().for_each(|p| mask[*p as usize] = true);
            let row = PyDict::new(py);
            let class = chaic_vision::labels::class_of(instance.label);
            row.set_item("class", class.map(|class| class.name()))?;
            row.set_item("score", instance.score)?;
            row.set_item("mask", PyArray1::from_vec(py, mask).reshape([height, width])?)?;
            list.append(row)?;
        }
        Ok(list)
    }
}
