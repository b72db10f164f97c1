//! Many episodes side by side.

use chaic_core::observation::{Observation, Senses};
use chaic_core::{Action, AgentError, AgentId, Frame};
use chaic_render::ImagesMut;
use rayon::prelude::*;

use crate::config::EpisodeConfig;
use crate::env::{Env, EnvSnapshot, Flow};
use crate::error::{EnvError, Result};

/// One seat of the caller's in a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Slot {
    /// Which environment of the batch.
    pub env: usize,
    /// Who sits there.
    pub agent: AgentId,
}

/// How the images of a batch lie in the caller's buffers: row-major, one image after the other in the
/// order of [`EnvBatch::slots`].
///
/// Shapes: color [slots, size, size, 3] of u8, depth [slots, size, size] of f32 metres, ids
/// [slots, size, size] of u16; each present or absent as the senses and grants of the seats have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageLayout {
    /// How many slots there are.
    pub slots: usize,
    /// Side of each image, pixels.
    pub size: u32,
    /// Whether there is color.
    pub rgb: bool,
    /// Whether there is depth.
    pub depth: bool,
    /// Whether there are instance ids.
    pub ids: bool,
}

impl ImageLayout {
    /// Pixels of one image.
    pub fn pixels(&self) -> usize {
        self.size as usize * self.size as usize
    }

    /// How many numbers the buffers for color, depth and ids have; 0 for those that are absent.
    ///
    /// ```
    /// use chaic_env::ImageLayout;
    /// let layout = ImageLayout { slots: 3, size: 2, rgb: true, depth: true, ids: false };
    /// assert_eq!(layout.lengths(), [36, 12, 0]);
    /// ```
    pub fn lengths(&self) -> [usize; 3] {
        let n = self.slots * self.pixels();
        let of = |wanted: bool, per_pixel| if wanted { per_pixel * n } else { 0 };
        [of(self.rgb, 3), of(self.depth, 1), of(self.ids, 1)]
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

/// Environments that are stepped together on all cores, with the images of all who wait written into
/// buffers of the caller's. What happens in one depends neither on the others nor on how many there
/// are.
///
/// All seats of the caller's see alike: same size, same kinds of images.
pub struct EnvBatch {
    envs: Vec<Env>,
    slots: Vec<Slot>,
    layout: ImageLayout,
}

impl EnvBatch {
    /// Joins environments.
    ///
    /// # Errors
    /// [`EnvError::Batch`] if the caller has no seat in them, or its seats see differently.
    pub fn new(envs: Vec<Env>) -> Result<EnvBatch> {
        let slots: Vec<Slot> = envs
            .iter()
            .enumerate()
            .flat_map(|(env, e)| e.callers().map(move |agent| Slot { env, agent }))
            .collect();
        let layout = layout(&envs, &slots)?;
        Ok(EnvBatch { envs, slots, layout })
    }

    /// The caller's seats, in the order of environments and agents.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// How images lie in the caller's buffers.
    pub fn layout(&self) -> ImageLayout {
        self.layout
    }

    /// The environments.
    pub fn envs(&self) -> &[Env] {
        &self.envs
    }

    /// Begins another episode in one of the environments, see [`Env::reset`].
    ///
    /// # Errors
    /// As [`EnvBatch::reset_many`].
    pub fn reset(&mut self, env: usize, config: EpisodeConfig<'_>) -> Result<()> {
        self.reset_many(vec![(env, config)])
    }

    /// Begins other episodes in some of the environments, on all cores; where one is named twice, the
    /// later of the two.
    ///
    /// # Errors
    /// Those of [`Env::reset`], and [`EnvError::Batch`] if the batch has no such environment: none is
    /// reset then.
    pub fn reset_many(&mut self, work: Vec<(usize, EpisodeConfig<'_>)>) -> Result<()> {
        let n = self.envs.len();
        let mut configs: Vec<Option<EpisodeConfig<'_>>> = (0..n).map(|_| None).collect();
        for (env, config) in work {
            let Some(of_env) = configs.get_mut(env) else {
                return Err(EnvError::Batch(format!("there is no environment {env} of {n}")));
            };
            *of_env = Some(config);
        }
        let work = self.envs.par_iter_mut().zip(configs);
        work.filter_map(|(env, config)| Some((env, config?)))
            .try_for_each(|(env, config)| env.reset(config))
    }

    /// Goes back (or on) to a snapshot of one of the environments, see [`Env::restore`].
    ///
    /// # Errors
    /// Those of [`Env::restore`], and [`EnvError::Batch`] if the batch has no such environment.
    pub fn restore(&mut self, env: usize, snapshot: &EnvSnapshot) -> Result<()> {
        let n = self.envs.len();
        let none = || EnvError::Batch(format!("there is no environment {env} of {n}"));
        self.envs.get_mut(env).ok_or_else(none)?.restore(snapshot)
    }

    /// Plays all environments on, each as [`Env::advance`] does; what came of each, in their order.
    pub fn advance(&mut self, until: Option<Frame>) -> Vec<std::result::Result<Flow, AgentError>> {
        self.envs.par_iter_mut().map(|env| env.advance(until)).collect()
    }

    /// Lets all who wait look: their images are made on all cores and written into the caller's
    /// buffers, whose parts for the others stay as they are. The indices of those who looked, into
    /// [`EnvBatch::slots`].
    ///
    /// # Errors
    /// [`EnvError::Buffer`] if a buffer doesn't have the length that the [layout](EnvBatch::layout)
    /// says, or is absent where it says that there is one; nothing is written then.
    pub fn observe(&mut self, images: ImagesMut<'_>) -> Result<Vec<usize>> {
        self.layout.check(&images)?;
        let n = self.layout.pixels();
        let ImagesMut { mut rgb, mut depth_m, mut ids } = images;
        let mut rest = &self.slots[..];
        let mut work = Vec::with_capacity(self.envs.len());
        for env in &mut self.envs {
            let (own, later) = rest.split_at(env.callers().count());
            rest = later;
            let images: Vec<ImagesMut<'_>> = own
                .iter()
                .map(|_| ImagesMut {
                    rgb: take(&mut rgb, 3 * n),
                    depth_m: take(&mut depth_m, n),
                    ids: take(&mut ids, n),
                })
                .collect();
            work.push((env, own, images));
        }
        work.into_par_iter().for_each(|(env, slots, images)| {
            for (slot, images) in slots.iter().zip(images) {
                if env.is_waiting(slot.agent) {
                    env.observe_into(slot.agent, images);
                }
            }
        });
        let is_waiting = |slot: &Slot| self.envs[slot.env].is_waiting(slot.agent);
        Ok((0..self.slots.len()).filter(|k| is_waiting(&self.slots[*k])).collect())
    }

    /// What the agent of a slot perceived when it last [looked](EnvBatch::observe), without the
    /// images; `None` if it doesn't wait.
    pub fn observation(&self, slot: usize) -> Option<&Observation> {
        let Slot { env, agent } = *self.slots.get(slot)?;
        self.envs[env].observed(agent)
    }

    /// The caller's choice for the agent of a slot, see [`Env::submit`].
    pub fn submit(&mut self, slot: usize, action: Action) -> bool {
        let Some(Slot { env, agent }) = self.slots.get(slot).copied() else { return false };
        self.envs[env].submit(agent, action)
    }
}

/// The next `n` numbers of a buffer, if there is one.
fn take<'a, T>(buffer: &mut Option<&'a mut [T]>, n: usize) -> Option<&'a mut [T]> {
    let (now, later) = buffer.take()?.split_at_mut(n);
    *buffer = Some(later);
    Some(now)
}

fn layout(envs: &[Env], slots: &[Slot]) -> Result<ImageLayout> {
    let seen = |slot: &Slot| {
        let seat = &envs[slot.env].seats()[slot.agent.index()];
        let ids = seat.senses.ids && seat.grants.ids;
        Senses { ids, ..seat.senses }
    };
    let first = slots.first().map(seen).ok_or_else(|| {
        EnvError::Batch("no environment of the batch has a seat for the caller".to_owned())
    })?;
    if let Some(other) = slots.iter().find(|slot| seen(slot) != first) {
        return Err(EnvError::Batch(format!(
            "the {} of environment {} sees {:?}, others see {first:?}; in a batch all see alike",
            other.agent,
            other.env,
            seen(other),
        )));
    }
    let Senses { image_size: size, rgb, depth, ids, film: _ } = first;
    Ok(ImageLayout { slots: slots.len(), size, rgb, depth, ids })
}
