//! Parallel environments.

use chaic_core::observation::{Observation, SensorConfig};
use chaic_core::{Action, AgentError, AgentId, Frame};
use chaic_render::ImagesMut;
use rayon::prelude::*;

use crate::config::EpisodeConfig;
use crate::env::{AdvanceOutcome, Env, EnvSnapshot};
use crate::error::{EnvError, Result};

/// Address of an external agent in a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SlotId {
    /// Index of the environment.
    pub env: usize,
    /// Agent in it.
    pub agent: AgentId,
}

/// Layout of a batch's images in the caller's buffers: row-major, in the order of [`EnvBatch::slots`].
///
/// Shapes: color u8 [slots, size, size, 3], depth f32 meters [slots, size, size], ids u16
/// [slots, size, size]. Each is present if the sensors and grants of the slots have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageLayout {
    /// Number of slots.
    pub slots: usize,
    /// Side of each image, pixels.
    pub size: u32,
    /// True if color is present.
    pub rgb: bool,
    /// True if depth is present.
    pub depth: bool,
    /// True if instance ids are present.
    pub ids: bool,
}

impl ImageLayout {
    /// Returns the number of pixels of one image.
    pub fn pixels(&self) -> usize {
        self.size as usize * self.size as usize
    }

    /// Returns the lengths of the buffers for color, depth and ids; 0 for absent ones.
    ///
    /// ```
    /// use chaic_env::ImageLayout;
    /// let layout = ImageLayout { slots: 3, size: 2, rgb: true, depth: true, ids: false };
    /// assert_eq!(layout.lengths(), [36, 12, 0]);
    /// ```
    pub fn lengths(&self) -> [usize; 3] {
        let n = self.slots * self.pixels();
        let len = |is_present: bool, per_pixel| if is_present { per_pixel * n } else { 0 };
        [len(self.rgb, 3), len(self.depth, 1), len(self.ids, 1)]
    }

    fn check(&self, images: &ImagesMut<'_>) -> Result<()> {
        let [rgb, depth, ids] = self.lengths();
        let checked = [
            ("color", images.rgb.as_ref().map_or(0, |b| b.len()), rgb),
            ("depth", images.depth_m.as_ref().map_or(0, |b| b.len()), depth),
            ("ids", images.ids.as_ref().map_or(0, |b| b.len()), ids),
        ];
        match checked.into_iter().find(|(_, found, expected)| found != expected) {
            None => Ok(()),
            Some((image, found, expected)) => Err(EnvError::Buffer { image, found, expected }),
        }
    }
}

/// Environments that run in parallel on all cores and write the images of all waiting agents into the
/// caller's buffers.
///
/// Each environment is independent of the others and of their number. All external agents have the same
/// image size and kinds of images.
pub struct EnvBatch {
    envs: Vec<Env>,
    slots: Vec<SlotId>,
    layout: ImageLayout,
}

impl EnvBatch {
    /// Creates a batch.
    ///
    /// # Errors
    /// [`EnvError::Batch`] if there is no external agent, or if external agents have different sensors.
    pub fn new(envs: Vec<Env>) -> Result<EnvBatch> {
        let slots: Vec<SlotId> = envs
            .iter()
            .enumerate()
            .flat_map(|(env, e)| e.external_agents().map(move |agent| SlotId { env, agent }))
            .collect();
        let layout = layout(&envs, &slots)?;
        Ok(EnvBatch { envs, slots, layout })
    }

    /// Returns the external agents, in the order of environments and agents.
    pub fn slots(&self) -> &[SlotId] {
        &self.slots
    }

    /// Returns the layout of images in the caller's buffers.
    pub fn layout(&self) -> ImageLayout {
        self.layout
    }

    /// Returns the environments.
    pub fn envs(&self) -> &[Env] {
        &self.envs
    }

    /// Starts another episode in one environment, see [`Env::reset`].
    ///
    /// # Errors
    /// As [`EnvBatch::reset_many`].
    pub fn reset(&mut self, env: usize, config: EpisodeConfig<'_>) -> Result<()> {
        self.reset_many(vec![(env, config)])
    }

    /// Starts other episodes in some environments, on all cores. Of two episodes for one environment the
    /// later counts.
    ///
    /// # Errors
    /// [`EnvError::Batch`] if the batch has no such environment; no environment is reset then. Those of
    /// [`Env::reset`]; other environments may be reset then.
    pub fn reset_many(&mut self, work: Vec<(usize, EpisodeConfig<'_>)>) -> Result<()> {
        let n = self.envs.len();
        let mut configs: Vec<Option<EpisodeConfig<'_>>> = (0..n).map(|_| None).collect();
        for (env, config) in work {
            let Some(slot) = configs.get_mut(env) else {
                return Err(EnvError::Batch(format!("there is no environment {env} of {n}")));
            };
            *slot = Some(config);
        }
        let work = self.envs.par_iter_mut().zip(configs);
        work.filter_map(|(env, config)| Some((env, config?)))
            .try_for_each(|(env, config)| env.reset(config))
    }

    /// Restores a snapshot in one environment, see [`Env::restore`].
    ///
    /// # Errors
    /// Those of [`Env::restore`], and [`EnvError::Batch`] if the batch has no such environment.
    pub fn restore(&mut self, env: usize, snapshot: &EnvSnapshot) -> Result<()> {
        let n = self.envs.len();
        let missing = || EnvError::Batch(format!("there is no environment {env} of {n}"));
        self.envs.get_mut(env).ok_or_else(missing)?.restore(snapshot)
    }

    /// Runs all environments as [`Env::advance`] does, and returns their outcomes in order.
    pub fn advance(
        &mut self,
        until: Option<Frame>,
    ) -> Vec<std::result::Result<AdvanceOutcome, AgentError>> {
        self.envs.par_iter_mut().map(|env| env.advance(until)).collect()
    }

    /// Advances all environments, and renders the images of the agents that wait then and have not
    /// been observed in this turn. Both parts of an environment are one task, so no core waits for the
    /// slowest environment twice. Returns the outcomes in order.
    ///
    /// Equal to [`advance`](EnvBatch::advance) and [`observe`](EnvBatch::observe), if the caller passes
    /// the same buffers each time.
    ///
    /// # Errors
    /// [`EnvError::Buffer`] if the length of a buffer differs from the [layout](EnvBatch::layout);
    /// nothing is changed then.
    pub fn advance_and_observe(
        &mut self,
        until: Option<Frame>,
        images: ImagesMut<'_>,
    ) -> Result<Vec<std::result::Result<AdvanceOutcome, AgentError>>> {
        let work = self.split(images)?;
        let run = |EnvWork { env, slots, images }: EnvWork<'_>| {
            let outcome = env.advance(until)?;
            for (slot, images) in slots.iter().zip(images) {
                if env.is_waiting(slot.agent) && env.observed(slot.agent).is_none() {
                    env.observe_into(slot.agent, images);
                }
            }
            Ok(outcome)
        };
        Ok(work.into_par_iter().map(run).collect())
    }

    /// Renders the images of all waiting agents on all cores into the caller's buffers. Other parts of
    /// the buffers do not change. Returns the indices of the waiting agents in [`EnvBatch::slots`].
    ///
    /// # Errors
    /// [`EnvError::Buffer`] if the length of a buffer differs from the [layout](EnvBatch::layout);
    /// nothing is written then.
    pub fn observe(&mut self, images: ImagesMut<'_>) -> Result<Vec<usize>> {
        let work = self.split(images)?;
        work.into_par_iter().for_each(|EnvWork { env, slots, images }| {
            for (slot, images) in slots.iter().zip(images) {
                if env.is_waiting(slot.agent) {
                    env.observe_into(slot.agent, images);
                }
            }
        });
        Ok(self.waiting())
    }

    /// Returns the indices of the waiting agents in [`EnvBatch::slots`].
    pub fn waiting(&self) -> Vec<usize> {
        let is_waiting = |slot: &SlotId| self.envs[slot.env].is_waiting(slot.agent);
        (0..self.slots.len()).filter(|k| is_waiting(&self.slots[*k])).collect()
    }

    /// Gives each environment its slots and its part of the buffers.
    fn split<'a>(&'a mut self, images: ImagesMut<'a>) -> Result<Vec<EnvWork<'a>>> {
        self.layout.check(&images)?;
        let n = self.layout.pixels();
        // An absent kind of image may have an empty buffer.
        let mut rgb = images.rgb.filter(|_| self.layout.rgb);
        let mut depth_m = images.depth_m.filter(|_| self.layout.depth);
        let mut ids = images.ids.filter(|_| self.layout.ids);
        let mut remaining = &self.slots[..];
        let mut work = Vec::with_capacity(self.envs.len());
        for env in &mut self.envs {
            let (slots, others) = remaining.split_at(env.external_agents().count());
            remaining = others;
            let images: Vec<ImagesMut<'_>> = slots
                .iter()
                .map(|_| ImagesMut {
                    rgb: take(&mut rgb, 3 * n),
                    depth_m: take(&mut depth_m, n),
                    ids: take(&mut ids, n),
                })
                .collect();
            work.push(EnvWork { env, slots, images });
        }
        Ok(work)
    }

    /// Returns the last [rendered](EnvBatch::observe) observation of a slot, without images; `None` if the
    /// agent does not wait.
    pub fn observation(&self, slot: usize) -> Option<&Observation> {
        let SlotId { env, agent } = *self.slots.get(slot)?;
        self.envs[env].observed(agent)
    }

    /// Sets the next action of a slot, see [`Env::submit`].
    pub fn submit(&mut self, slot: usize, action: Action) -> bool {
        let Some(SlotId { env, agent }) = self.slots.get(slot).copied() else { return false };
        self.envs[env].submit(agent, action)
    }

    /// Sets the next actions of some slots, on all cores. Of two actions for one slot the first counts.
    ///
    /// Equal to [`submit`](EnvBatch::submit) of each slot in order. Faster if pixels need a rendered view.
    /// Returns whether each action was set.
    pub fn submit_many(&mut self, actions: &[(usize, Action)]) -> Vec<bool> {
        let mut by_env: Vec<Vec<(usize, AgentId, Action)>> = vec![Vec::new(); self.envs.len()];
        for (k, (slot, action)) in actions.iter().enumerate() {
            if let Some(SlotId { env, agent }) = self.slots.get(*slot).copied() {
                by_env[env].push((k, agent, *action));
            }
        }
        let submit = |(env, chosen): (&mut Env, Vec<(usize, AgentId, Action)>)| {
            let mut accepted = Vec::new();
            for (k, agent, action) in chosen {
                if env.submit(agent, action) {
                    accepted.push(k);
                }
            }
            accepted
        };
        let accepted: Vec<Vec<usize>> = self.envs.par_iter_mut().zip(by_env).map(submit).collect();
        let mut is_set = vec![false; actions.len()];
        accepted.into_iter().flatten().for_each(|k| is_set[k] = true);
        is_set
    }
}

/// An environment with its slots and their parts of the buffers.
struct EnvWork<'a> {
    env: &'a mut Env,
    slots: &'a [SlotId],
    images: Vec<ImagesMut<'a>>,
}

/// Takes the next `n` elements of a buffer, if there is one.
fn take<'a, T>(buffer: &mut Option<&'a mut [T]>, n: usize) -> Option<&'a mut [T]> {
    let (taken, remaining) = buffer.take()?.split_at_mut(n);
    *buffer = Some(remaining);
    Some(taken)
}

fn layout(envs: &[Env], slots: &[SlotId]) -> Result<ImageLayout> {
    let sensors = |id: &SlotId| {
        let slot = &envs[id.env].slots()[id.agent.index()];
        let ids = slot.sensors.ids && slot.grants.ids;
        SensorConfig { ids, ..slot.sensors }
    };
    let first = slots.first().map(sensors).ok_or_else(|| {
        EnvError::Batch("no environment of the batch has an external agent".to_owned())
    })?;
    if let Some(other) = slots.iter().find(|slot| sensors(slot) != first) {
        return Err(EnvError::Batch(format!(
            "the {} of environment {} has sensors {:?}, others have {first:?}; use the same sensors in \
             all environments of a batch",
            other.agent,
            other.env,
            sensors(other),
        )));
    }
    let SensorConfig { image_size: size, rgb, depth, ids, frame_history: _ } = first;
    Ok(ImageLayout { slots: slots.len(), size, rgb, depth, ids })
}
