//! Batch of worlds with images in the caller's arrays.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use chaic_core::{AgentError, AgentId};
use chaic_env::{AdvanceOutcome, Env, EnvBatch, EpisodeConfig, ImageLayout, ImagesMut, SlotId};
use numpy::{
    Element, PyArray1, PyArray2, PyArrayDyn, PyReadwriteArrayDyn, PyUntypedArrayMethods as _,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::action;
use crate::episode::Episode;
use crate::error::{
    from_env, index_error, no_attribute, not_picklable, poisoned, readable, runtime_error,
    value_error, writable,
};
use crate::observation::Briefing;
use crate::options::Options;
use crate::reward::parse_weights;
use crate::threads::detached;
use crate::world::score;

/// Worlds that run in parallel on all cores. The agents that the caller controls are the slots of the batch, in
/// the order of worlds and agents.
#[pyclass(module = "chaic._chaic")]
pub struct Batch {
    envs: Mutex<EnvBatch>,
    options: Options,
}

impl Batch {
    fn envs(&mut self) -> PyResult<&mut EnvBatch> {
        self.envs.get_mut().map_err(poisoned)
    }
}

/// Outcomes of `advance`.
const NEEDS_ACTION: u8 = 0;
const ENDED: u8 = 1;

/// Arrays of the caller for the images of all slots.
struct ImageArrays<'py> {
    rgb: Option<PyReadwriteArrayDyn<'py, u8>>,
    depth: Option<PyReadwriteArrayDyn<'py, f32>>,
    ids: Option<PyReadwriteArrayDyn<'py, u16>>,
}

impl<'py> ImageArrays<'py> {
    /// Borrows the given arrays.
    fn new(
        rgb: Option<&Bound<'py, PyArrayDyn<u8>>>,
        depth: Option<&Bound<'py, PyArrayDyn<f32>>>,
        ids: Option<&Bound<'py, PyArrayDyn<u16>>>,
    ) -> PyResult<ImageArrays<'py>> {
        Ok(ImageArrays {
            rgb: rgb.map(|array| writable("rgb", array)).transpose()?,
            depth: depth.map(|array| writable("depth", array)).transpose()?,
            ids: ids.map(|array| writable("ids", array)).transpose()?,
        })
    }

    /// Returns the arrays as slices, after a check of their shapes.
    fn images(&mut self, layout: ImageLayout) -> PyResult<ImagesMut<'_>> {
        let (n, side) = (layout.slots, layout.size as usize);
        check_shape("rgb", self.rgb.as_ref().map(|a| a.shape()), layout.rgb, &[n, side, side, 3])?;
        let shape = [n, side, side];
        check_shape("depth", self.depth.as_ref().map(|a| a.shape()), layout.depth, &shape)?;
        check_shape("ids", self.ids.as_ref().map(|a| a.shape()), layout.ids, &shape)?;
        Ok(ImagesMut {
            rgb: slice_of(&mut self.rgb)?,
            depth_m: slice_of(&mut self.depth)?,
            ids: slice_of(&mut self.ids)?,
        })
    }
}

/// Checks that an array is given exactly if its images are requested, and has their shape.
fn check_shape(
    name: &str,
    found: Option<&[usize]>,
    is_requested: bool,
    expected: &[usize],
) -> PyResult<()> {
    match found {
        Some(_) if !is_requested => Err(value_error(format!("no images of {name} are requested"))),
        None if is_requested => Err(value_error(format!("the array {name} is missing"))),
        Some(shape) if shape != expected => {
            Err(value_error(format!("{name} has shape {shape:?}, expected {expected:?}")))
        }
        _ => Ok(()),
    }
}

fn slice_of<'a, T: Element>(
    array: &'a mut Option<PyReadwriteArrayDyn<'_, T>>,
) -> PyResult<Option<&'a mut [T]>> {
    let Some(array) = array else { return Ok(None) };
    let wrong = || value_error("an image array is not C-contiguous");
    // A slice of an array in Fortran order has the elements in another order.
    if !array.is_c_contiguous() {
        return Err(wrong());
    }
    array.as_slice_mut().map(Some).map_err(|_| wrong())
}

fn outcome_codes(
    py: Python<'_>,
    outcomes: Vec<Result<AdvanceOutcome, AgentError>>,
) -> PyResult<Bound<'_, PyArray1<u8>>> {
    let code = |outcome| if outcome == AdvanceOutcome::NeedsAction { NEEDS_ACTION } else { ENDED };
    let codes: Result<Vec<u8>, _> = outcomes.into_iter().map(|outcome| outcome.map(code)).collect();
    Ok(PyArray1::from_vec(py, codes.map_err(runtime_error)?))
}

#[pymethods]
impl Batch {
    /// Creates a world for each episode and seed; the keywords are those of `World`.
    #[new]
    #[pyo3(signature = (episodes, seeds, **options))]
    fn new(
        py: Python<'_>,
        episodes: Vec<Bound<'_, Episode>>,
        #[pyo3(from_py_with = crate::error::seeds)] seeds: Vec<u32>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Batch> {
        let options = Options::new(py, options)?;
        if episodes.len() != seeds.len() {
            return Err(value_error(format!(
                "{} episodes and {} seeds",
                episodes.len(),
                seeds.len()
            )));
        }
        let work: PyResult<Vec<_>> = episodes
            .iter()
            .zip(seeds)
            .map(|(episode, seed)| Ok((Arc::clone(&episode.get().0), seed, options.agents()?)))
            .collect();
        let work = work?;
        let envs = detached(py, || {
            let envs: chaic_env::Result<Vec<Env>> = work
                .into_par_iter()
                .map(|(episode, seed, agents)| Env::new(options.config(&episode, seed), agents))
                .collect();
            EnvBatch::new(envs?)
        })?;
        let envs = Mutex::new(envs.map_err(|error| from_env(&error))?);
        Ok(Batch { envs, options })
    }

    /// World and agent of each slot.
    #[getter]
    fn slots(&mut self) -> PyResult<Vec<(usize, u8)>> {
        Ok(self.envs()?.slots().iter().map(|slot| (slot.env, slot.agent.0)).collect())
    }

    /// Returns the number of worlds.
    fn __len__(&mut self) -> PyResult<usize> {
        Ok(self.envs()?.envs().len())
    }

    /// Starts other episodes in some worlds, on all cores.
    fn reset(
        &mut self,
        py: Python<'_>,
        #[pyo3(from_py_with = crate::error::world_indices)] worlds: Vec<usize>,
        episodes: Vec<Bound<'_, Episode>>,
        #[pyo3(from_py_with = crate::error::seeds)] seeds: Vec<u32>,
    ) -> PyResult<()> {
        if worlds.len() != episodes.len() || worlds.len() != seeds.len() {
            return Err(value_error("the numbers of worlds, episodes and seeds differ"));
        }
        let episodes: Vec<_> = episodes.iter().map(|e| Arc::clone(&e.get().0)).collect();
        let Batch { envs, options } = self;
        let envs = envs.get_mut().map_err(poisoned)?;
        let configs: Vec<(usize, EpisodeConfig<'_>)> = worlds
            .iter()
            .zip(episodes.iter().zip(&seeds))
            .map(|(world, (episode, seed))| (*world, options.config(episode, *seed)))
            .collect();
        detached(py, || envs.reset_many(configs))?.map_err(|error| from_env(&error))
    }

    /// Runs all worlds until a slot needs an action or the episode ends; returns 0 for a world that needs an action
    /// and 1 for one that has ended.
    fn advance<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let envs = self.envs()?;
        let outcomes = detached(py, || envs.advance(None))?;
        outcome_codes(py, outcomes)
    }

    /// Advances and observes in one pass, which is faster: `advance`, then `observe` of the slots that have not been
    /// observed in this turn. Returns the outcomes as `advance` does. Pass the same arrays each time.
    #[pyo3(signature = (rgb=None, depth=None, ids=None))]
    fn advance_and_observe<'py>(
        &mut self,
        py: Python<'py>,
        rgb: Option<&Bound<'py, PyArrayDyn<u8>>>,
        depth: Option<&Bound<'py, PyArrayDyn<f32>>>,
        ids: Option<&Bound<'py, PyArrayDyn<u16>>>,
    ) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let mut arrays = ImageArrays::new(rgb, depth, ids)?;
        let envs = self.envs()?;
        let images = arrays.images(envs.layout())?;
        let outcomes = detached(py, || envs.advance_and_observe(None, images))?;
        outcome_codes(py, outcomes.map_err(|error| from_env(&error))?)
    }

    /// Renders the requested images of all slots that need an action into arrays: color (uint8 [slots, size, size,
    /// 3]), depth (float32 meters [slots, size, size]) and ids (uint16 [slots, size, size]). Returns these slots;
    /// the arrays of other slots do not change.
    #[pyo3(signature = (rgb=None, depth=None, ids=None))]
    fn observe<'py>(
        &mut self,
        py: Python<'py>,
        rgb: Option<&Bound<'py, PyArrayDyn<u8>>>,
        depth: Option<&Bound<'py, PyArrayDyn<f32>>>,
        ids: Option<&Bound<'py, PyArrayDyn<u16>>>,
    ) -> PyResult<Vec<usize>> {
        let mut arrays = ImageArrays::new(rgb, depth, ids)?;
        let envs = self.envs()?;
        let images = arrays.images(envs.layout())?;
        detached(py, || envs.observe(images))?.map_err(|error| from_env(&error))
    }

    /// Writes proprioception (`PROPRIOCEPTION`, float32 [slots, 12]) and the mask of `ACTIONS` that the hands allow
    /// (bool [slots, 11]) of all observed slots.
    fn proprioception(
        &mut self,
        values: &Bound<'_, PyArray2<f32>>,
        mask: &Bound<'_, PyArray2<bool>>,
    ) -> PyResult<()> {
        let (mut values, mut mask) = (writable("values", values)?, writable("mask", mask)?);
        let envs = self.envs()?;
        let n = envs.slots().len();
        let (mut values, mut mask) = (values.as_array_mut(), mask.as_array_mut());
        let (n_values, n_actions) = (action::PROPRIOCEPTION.len(), action::ACTIONS.len());
        if values.shape() != [n, n_values] || mask.shape() != [n, n_actions] {
            let problem =
                format!("expected arrays of shape ({n}, {n_values}) and ({n}, {n_actions})");
            return Err(value_error(problem));
        }
        for (k, slot) in envs.slots().iter().enumerate() {
            let Some(observation) = envs.observation(k) else { continue };
            let horizon = envs.envs()[slot.env].world().setup().horizon.max(1) as f32;
            let elapsed_fraction = observation.frame as f32 / horizon;
            let row = action::proprioception_values(&observation.proprioception, elapsed_fraction);
            row.into_iter().enumerate().for_each(|(i, x)| values[[k, i]] = x);
            let row = action::mask(&observation.proprioception);
            row.into_iter().enumerate().for_each(|(i, x)| mask[[k, i]] = x);
        }
        Ok(())
    }

    /// Sets the next actions of all slots that need one: int64 [slots, 3], rows of kind (`ACTIONS`), column and row
    /// of a pixel. Rows of other slots are ignored.
    fn submit(&mut self, py: Python<'_>, actions: &Bound<'_, PyArray2<i64>>) -> PyResult<()> {
        let actions = readable("actions", actions)?;
        let envs = self.envs()?;
        let n = envs.slots().len();
        let actions = actions.as_array();
        if actions.shape() != [n, 3] {
            let found = actions.shape();
            return Err(value_error(format!(
                "expected actions of shape ({n}, 3), found {found:?}"
            )));
        }
        let mut submitted = Vec::with_capacity(n);
        for (k, row) in actions.rows().into_iter().enumerate() {
            let is_waiting = {
                let slot = envs.slots()[k];
                envs.envs()[slot.env].waiting().any(|agent| agent == slot.agent)
            };
            if is_waiting {
                submitted.push((k, action::from_row([row[0], row[1], row[2]])?));
            }
        }
        // The pixel of an action without an image needs a rendered view.
        detached(py, || {
            envs.submit_many(&submitted);
        })
    }

    /// Returns the number of frames that have passed in each world.
    fn frames<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let envs = self.envs()?;
        let frames = envs.envs().iter().map(|env| env.world().state().frame).collect();
        Ok(PyArray1::from_vec(py, frames))
    }

    /// Returns the reward of the last action of each slot, float64 [slots]; zeros before the first action. The
    /// names of the weights are those of `REWARD`.
    fn rewards<'py>(
        &mut self,
        py: Python<'py>,
        weights: BTreeMap<String, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let weights = parse_weights(&weights)?;
        let envs = self.envs()?;
        let reward = |slot: &SlotId| {
            let terms = envs.envs()[slot.env].reward(slot.agent);
            terms.unwrap_or_default().weighted_sum(&weights)
        };
        let rewards = envs.slots().iter().map(reward).collect();
        Ok(PyArray1::from_vec(py, rewards))
    }

    /// Returns the delivered and the wanted amount of each world, float64 [worlds, 2]; TR is their ratio.
    fn progress<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let envs = self.envs()?;
        let row = |env: &Env| {
            let (done, total) = env.world().progress();
            vec![done, total]
        };
        let rows: Vec<Vec<f64>> = envs.envs().iter().map(row).collect();
        PyArray2::from_vec2(py, &rows).map_err(runtime_error)
    }

    /// Returns the score of a world so far, as `World.score`.
    fn score<'py>(
        &mut self,
        py: Python<'py>,
        #[pyo3(from_py_with = crate::error::world_index)] world: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let envs = self.envs()?;
        let n = envs.envs().len();
        score(py, envs.envs().get(world).ok_or_else(|| index_error("world", world, n))?)
    }

    /// Returns the briefing of an agent of a world.
    #[pyo3(signature = (world, agent=1))]
    fn briefing(
        &mut self,
        #[pyo3(from_py_with = crate::error::world_index)] world: usize,
        #[pyo3(from_py_with = crate::error::agent_number)] agent: u8,
    ) -> PyResult<Briefing> {
        let envs = self.envs()?;
        let n = envs.envs().len();
        let env = envs.envs().get(world).ok_or_else(|| index_error("world", world, n))?;
        let n = env.slots().len();
        if usize::from(agent) >= n {
            return Err(index_error("agent", usize::from(agent), n));
        }
        Ok(Briefing(env.briefing(AgentId(agent))))
    }

    /// Raises `AttributeError`; the message names the new name of a renamed method.
    fn __getattr__(&self, name: &str) -> PyResult<Py<PyAny>> {
        Err(no_attribute("Batch", name, &[("own", "proprioception")]))
    }

    /// Returns the digest of the state of a world.
    fn digest(
        &mut self,
        #[pyo3(from_py_with = crate::error::world_index)] world: usize,
    ) -> PyResult<String> {
        let envs = self.envs()?;
        let n = envs.envs().len();
        let env = envs.envs().get(world).ok_or_else(|| index_error("world", world, n))?;
        Ok(env.digest().to_string())
    }

    fn __reduce__(&self) -> PyResult<Py<PyAny>> {
        Err(not_picklable("Batch", "create another one from its episodes and seeds"))
    }
}
