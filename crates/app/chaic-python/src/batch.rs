//! Worlds that are stepped together, their images in arrays of the caller's.

use std::sync::{Arc, Mutex};

use chaic_core::AgentId;
use chaic_env::{Env, EnvBatch, EpisodeConfig, Flow, ImagesMut};
use numpy::{PyArray1, PyReadonlyArray2, PyReadwriteArray2, PyReadwriteArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::action;
use crate::episode::Episode;
use crate::error::{failure, mistake, no_such, of_env, poisoned};
use crate::observation::Briefing;
use crate::options::Options;
use crate::threads::beside;
use crate::world::score;

/// Worlds that are stepped together on all cores. The caller's seats are numbered through all worlds, in the
/// order of worlds and agents: its slots.
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

/// Flows as numbers.
const WAITS: u8 = 0;
const ENDED: u8 = 1;

#[pymethods]
impl Batch {
    /// Worlds of these episodes, each with its seed, and the keywords of `World` for all of them.
    #[new]
    #[pyo3(signature = (episodes, seeds, **options))]
    fn new(
        py: Python<'_>,
        episodes: Vec<Bound<'_, Episode>>,
        seeds: Vec<u32>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Batch> {
        let options = Options::new(options)?;
        if episodes.len() != seeds.len() {
            return Err(mistake(format!("{} episodes and {} seeds", episodes.len(), seeds.len())));
        }
        let work: PyResult<Vec<_>> = episodes
            .iter()
            .zip(seeds)
            .map(|(episode, seed)| Ok((Arc::clone(&episode.get().0), seed, options.minds()?)))
            .collect();
        let work = work?;
        let envs = beside(py, || {
            let made: chaic_env::Result<Vec<Env>> = work
                .into_par_iter()
                .map(|(episode, seed, minds)| Env::new(options.config(&episode, seed), minds))
                .collect();
            EnvBatch::new(made?)
        })?;
        let envs = Mutex::new(envs.map_err(|error| of_env(&error))?);
        Ok(Batch { envs, options })
    }

    /// The world and the agent of each of the caller's seats.
    #[getter]
    fn slots(&mut self) -> PyResult<Vec<(usize, u8)>> {
        Ok(self.envs()?.slots().iter().map(|slot| (slot.env, slot.agent.0)).collect())
    }

    /// How many worlds there are.
    fn __len__(&mut self) -> PyResult<usize> {
        Ok(self.envs()?.envs().len())
    }

    /// Begins other episodes in some of the worlds, on all cores.
    fn reset(
        &mut self,
        py: Python<'_>,
        worlds: Vec<usize>,
        episodes: Vec<Bound<'_, Episode>>,
        seeds: Vec<u32>,
    ) -> PyResult<()> {
        if worlds.len() != episodes.len() || worlds.len() != seeds.len() {
            return Err(mistake("worlds, episodes and seeds are as many"));
        }
        let episodes: Vec<_> = episodes.iter().map(|e| Arc::clone(&e.get().0)).collect();
        let Batch { envs, options } = self;
        let envs = envs.get_mut().map_err(poisoned)?;
        let configs: Vec<(usize, EpisodeConfig<'_>)> = worlds
            .iter()
            .zip(episodes.iter().zip(&seeds))
            .map(|(world, (episode, seed))| (*world, options.config(episode, *seed)))
            .collect();
        beside(py, || envs.reset_many(configs))?.map_err(|error| of_env(&error))
    }

    /// Plays all worlds on until a choice of the caller's is needed or they end: 0 for each that waits, 1 for each
    /// that has ended.
    fn advance<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let envs = self.envs()?;
        let flows = beside(py, || envs.advance(None))?;
        let flows: Result<Vec<u8>, _> = flows
            .into_iter()
            .map(|flow| flow.map(|flow| if flow == Flow::Waits { WAITS } else { ENDED }))
            .collect();
        Ok(PyArray1::from_vec(py, flows.map_err(failure)?))
    }

    /// Lets all who wait look, into arrays for all slots: color (uint8 [slots, size, size, 3]), depth
    /// (float32 metres [slots, size, size]) and ids (uint16 [slots, size, size]), which the senses asked for. The
    /// slots that looked; of others, the arrays stay as they are.
    #[pyo3(signature = (rgb=None, depth=None, ids=None))]
    fn observe(
        &mut self,
        py: Python<'_>,
        mut rgb: Option<PyReadwriteArrayDyn<'_, u8>>,
        mut depth: Option<PyReadwriteArrayDyn<'_, f32>>,
        mut ids: Option<PyReadwriteArrayDyn<'_, u16>>,
    ) -> PyResult<Vec<usize>> {
        let gaps = |_| mistake("an array for images has gaps; make it C-contiguous");
        let images = ImagesMut {
            rgb: rgb.as_mut().map(|a| a.as_slice_mut()).transpose().map_err(gaps)?,
            depth_m: depth.as_mut().map(|a| a.as_slice_mut()).transpose().map_err(gaps)?,
            ids: ids.as_mut().map(|a| a.as_slice_mut()).transpose().map_err(gaps)?,
        };
        let envs = self.envs()?;
        beside(py, || envs.observe(images))?.map_err(|error| of_env(&error))
    }

    /// Writes what those who looked know of themselves: numbers (`OWN`, float32 [slots, 12]), and which of
    /// `ACTIONS` their hands don't rule out (bool [slots, 11]).
    fn own(
        &mut self,
        mut numbers: PyReadwriteArray2<'_, f32>,
        mut mask: PyReadwriteArray2<'_, bool>,
    ) -> PyResult<()> {
        let envs = self.envs()?;
        let n = envs.slots().len();
        let (mut numbers, mut mask) = (numbers.as_array_mut(), mask.as_array_mut());
        let (n_own, n_actions) = (action::OWN.len(), action::ACTIONS.len());
        if numbers.shape() != [n, n_own] || mask.shape() != [n, n_actions] {
            let problem = format!("expected arrays of shape ({n}, {n_own}) and ({n}, {n_actions})");
            return Err(mistake(problem));
        }
        for (k, slot) in envs.slots().iter().enumerate() {
            let Some(seen) = envs.observation(k) else { continue };
            let horizon = envs.envs()[slot.env].world().setup().horizon.max(1) as f32;
            let of_slot = action::own_numbers(&seen.own, seen.frame as f32 / horizon);
            of_slot.into_iter().enumerate().for_each(|(i, x)| numbers[[k, i]] = x);
            let of_slot = action::mask(&seen.own);
            of_slot.into_iter().enumerate().for_each(|(i, x)| mask[[k, i]] = x);
        }
        Ok(())
    }

    /// Chooses for all slots that wait: int64 [slots, 3], rows of kind (`ACTIONS`), column and row of a pixel.
    /// Rows of other slots aren't looked at.
    fn submit(&mut self, actions: PyReadonlyArray2<'_, i64>) -> PyResult<()> {
        let envs = self.envs()?;
        let n = envs.slots().len();
        let actions = actions.as_array();
        if actions.shape() != [n, 3] {
            let found = actions.shape();
            return Err(mistake(format!("expected actions of shape ({n}, 3), found {found:?}")));
        }
        let mut chosen = Vec::with_capacity(n);
        for (k, row) in actions.rows().into_iter().enumerate() {
            let is_waiting = {
                let slot = envs.slots()[k];
                envs.envs()[slot.env].waiting().any(|agent| agent == slot.agent)
            };
            if is_waiting {
                chosen.push((k, action::of_row([row[0], row[1], row[2]])?));
            }
        }
        for (k, action) in chosen {
            envs.submit(k, action);
        }
        Ok(())
    }

    /// Frames that have passed in each world.
    fn frames<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let envs = self.envs()?;
        let frames = envs.envs().iter().map(|env| env.world().state().frame).collect();
        Ok(PyArray1::from_vec(py, frames))
    }

    /// What has come of the last choice for each slot: the share that was delivered meanwhile, metres of approach,
    /// and whether it failed; float64 [slots, 3], zeros before the first one.
    fn rewards<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
        let envs = self.envs()?;
        let rows: Vec<Vec<f64>> = envs
            .slots()
            .iter()
            .map(|slot| {
                let terms = envs.envs()[slot.env].reward(slot.agent).unwrap_or_default();
                vec![terms.delivered, terms.approached_m, f64::from(u8::from(terms.is_invalid))]
            })
            .collect();
        numpy::PyArray2::from_vec2(py, &rows).map_err(failure)
    }

    /// What is done and what was wanted in each world, float64 [worlds, 2]; TR is their ratio.
    fn progress<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
        let envs = self.envs()?;
        let of = |env: &Env| {
            let (done, total) = env.world().progress();
            vec![done, total]
        };
        let rows: Vec<Vec<f64>> = envs.envs().iter().map(of).collect();
        numpy::PyArray2::from_vec2(py, &rows).map_err(failure)
    }

    /// The score of a world so far, as `World.score`.
    fn score<'py>(&mut self, py: Python<'py>, world: usize) -> PyResult<Bound<'py, PyAny>> {
        let envs = self.envs()?;
        let n = envs.envs().len();
        score(py, envs.envs().get(world).ok_or_else(|| no_such("world", world, n))?)
    }

    /// What the agent of a world is told before its episode.
    #[pyo3(signature = (world, agent=1))]
    fn briefing(&mut self, world: usize, agent: u8) -> PyResult<Briefing> {
        let envs = self.envs()?;
        let n = envs.envs().len();
        let env = envs.envs().get(world).ok_or_else(|| no_such("world", world, n))?;
        let n = env.seats().len();
        if usize::from(agent) >= n {
            return Err(no_such("agent", usize::from(agent), n));
        }
        Ok(Briefing(env.briefing(AgentId(agent))))
    }

    /// A number that differs between different states of a world, and is the same for equal ones.
    fn digest(&mut self, world: usize) -> PyResult<String> {
        let envs = self.envs()?;
        let n = envs.envs().len();
        let env = envs.envs().get(world).ok_or_else(|| no_such("world", world, n))?;
        Ok(env.digest().to_string())
    }
}
