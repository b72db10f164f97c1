//! Throughput of environments: worlds, partners and the helpers' observations together.

use chaic_core::action::Hand;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::rng::RngStream;
use chaic_core::{Action, Target, TaskId};
use chaic_env::{
    AdvanceOutcome, AgentSlot, Env, EnvBatch, EpisodeAgents, EpisodeConfig, ImagesMut,
};
use chaic_episodes::{Episode, Split, episodes};
use chaic_render::Channels;
use serde::Serialize;

use super::{Machine, Stopwatch};
use chaic_eval::{EvalError, Result};

/// Environments of a benchmark: rule-based partners in training episodes.
#[derive(Clone, Debug)]
pub struct EnvSetup {
    /// Tasks, used in turn.
    pub tasks: Vec<TaskId>,
    /// Number of environments.
    pub envs: usize,
    /// Side of the helpers' images, pixels.
    pub size: u32,
    /// Side of the partners' images, pixels.
    pub partner_size: u32,
    /// Channels of the helpers' images.
    pub channels: Channels,
}

/// Configuration of an environment benchmark.
#[derive(Clone, Debug)]
pub struct EnvBench {
    /// Environments that are stepped together.
    pub setup: EnvSetup,
    /// Number of threads.
    pub threads: usize,
    /// Minimum duration, seconds.
    pub seconds: f32,
}

/// Result of an environment benchmark.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnvSpeed {
    /// Number of environments that are stepped together.
    pub envs: usize,
    /// Side of the helpers' images, pixels.
    pub size: u32,
    /// Side of the partners' images, pixels.
    pub partner_size: u32,
    /// Channels of the helpers' images, for example `rgb+depth`.
    pub channels: String,
    /// Number of threads.
    pub threads: usize,
    /// Number of the helpers' decisions.
    pub steps: u64,
    /// Number of frames of all environments.
    pub frames: u64,
    /// Number of episodes that ended and were replaced by another.
    pub episodes: u64,
    /// Wall time, seconds.
    pub seconds: f64,
    /// Decisions of the helpers per second of wall time.
    pub steps_per_second: f64,
    /// Frames per second of wall time.
    pub frames_per_second: f64,
    /// Machine and build.
    pub machine: Machine,
}

impl EnvBench {
    /// Runs helpers with random actions and rule-based partners in training episodes. `progress`
    /// receives the fraction of the duration that has passed, 0 to 1.
    ///
    /// # Errors
    /// If episodes cannot be read or threads cannot be started.
    pub fn measure(&self, progress: &mut dyn FnMut(f32)) -> Result<EnvSpeed> {
        super::with_threads(self.threads, progress, |progress| self.play(progress))
    }

    fn play(&self, progress: &mut dyn FnMut(f32)) -> Result<EnvSpeed> {
        let EnvSetup { envs, size, partner_size, channels, .. } = self.setup;
        let bundled = self.setup.episodes()?;
        let all: Result<Vec<Env>> = (0..envs).map(|k| self.setup.env(&bundled, k)).collect();
        let mut batch = EnvBatch::new(all?)?;
        let [n_rgb, n_depth, n_ids] = batch.layout().lengths();
        let (mut rgb, mut depth_m, mut ids) = (vec![0; n_rgb], vec![0.0; n_depth], vec![0; n_ids]);
        let mut rng = RngStream::new(0, "bench env", 0);
        let (mut steps, mut frames, mut n_ended, mut fraction) = (0, 0, 0, 0.0);
        let clock = Stopwatch::start();
        while fraction < 1.0 {
            let before: u64 = n_frames(&batch);
            let images = ImagesMut {
                rgb: (n_rgb > 0).then_some(&mut rgb),
                depth_m: (n_depth > 0).then_some(&mut depth_m),
                ids: (n_ids > 0).then_some(&mut ids),
            };
            let outcomes = batch.advance_and_observe(None, images)?;
            frames += n_frames(&batch) - before;
            for (k, outcome) in outcomes.into_iter().enumerate() {
                match outcome {
                    Ok(AdvanceOutcome::NeedsAction) => {}
                    Ok(AdvanceOutcome::Ended | AdvanceOutcome::Stopped) => {
                        batch.reset(k, self.setup.config(&bundled, envs + n_ended))?;
                        n_ended += 1;
                    }
                    Err(error) => return Err(EvalError::Options(error.to_string())),
                }
            }
            for slot in batch.waiting() {
                batch.submit(slot, random_action(size, &mut rng));
                steps += 1;
            }
            fraction = clock.elapsed().as_secs_f32() / self.seconds;
            progress(fraction.min(1.0));
        }
        let seconds = clock.elapsed().as_secs_f64();
        Ok(EnvSpeed {
            envs,
            size,
            partner_size,
            channels: super::render::channel_names(channels),
            threads: self.threads,
            steps,
            frames,
            episodes: n_ended as u64,
            seconds,
            steps_per_second: steps as f64 / seconds,
            frames_per_second: frames as f64 / seconds,
            machine: Machine::current(),
        })
    }
}

impl EnvSetup {
    /// Returns the training episodes of the tasks, with the tasks in turn.
    pub(super) fn episodes(&self) -> Result<Vec<Episode>> {
        let mut all = Vec::new();
        for task in &self.tasks {
            let n_before = all.len();
            for episode in episodes(&Split::Train, *task) {
                all.push(episode?);
            }
            if all.len() == n_before {
                return Err(EvalError::Options(format!("{task} has no training episode")));
            }
        }
        let n_per_task = (all.len() / self.tasks.len().max(1)).max(1);
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by_key(|k| (k % n_per_task, k / n_per_task));
        Ok(order.into_iter().map(|k| all[k].clone()).collect())
    }

    /// Creates an environment whose helper is an external agent.
    pub(super) fn env(&self, bundled: &[Episode], number: usize) -> Result<Env> {
        let Channels { rgb, depth, ids } = self.channels;
        let sensors = SensorConfig { image_size: self.size, rgb, depth, ids, frame_history: None };
        let helper = Some(AgentSlot::external(Grants::IDS, sensors));
        Ok(Env::new(self.config(bundled, number), EpisodeAgents { helper, partner: None })?)
    }

    /// Returns the configuration of an episode; episodes repeat with other seeds.
    pub(super) fn config<'a>(&self, bundled: &'a [Episode], number: usize) -> EpisodeConfig<'a> {
        EpisodeConfig {
            seed: (number / bundled.len()) as u32,
            image_size: Some(self.partner_size),
            ..EpisodeConfig::new(&bundled[number % bundled.len()], "bench")
        }
    }
}

fn n_frames(batch: &EnvBatch) -> u64 {
    batch.envs().iter().map(|env| u64::from(env.world().state().frame)).sum()
}

/// Draws an action from the same distribution as the world benchmark, with pixels as targets.
pub(super) fn random_action(size: u32, rng: &mut RngStream) -> Action {
    let hand = if rng.chance(0.5) { Hand::Left } else { Hand::Right };
    let mut pixel = || rng.below(size as usize) as u32;
    let target = Target::Pixel { column: pixel(), row: pixel() };
    match rng.below(16) {
        0..8 => Action::MoveForward,
        8..10 => Action::TurnLeft,
        10..12 => Action::TurnRight,
        12 | 13 => Action::PickUp { object: target, hand },
        14 => Action::PutOn { place: target, hand },
        _ => Action::PutIn,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn environments_of_all_tasks_are_stepped_together() {
        let setup = EnvSetup {
            tasks: TaskId::paper().collect(),
            envs: 8,
            size: 32,
            partner_size: 32,
            channels: Channels::ALL,
        };
        let bench = EnvBench { setup, threads: 2, seconds: 0.5 };
        let mut fractions = Vec::new();
        let speed =
            bench.measure(&mut |fraction| fractions.push(fraction)).expect("bundled episodes");
        assert!(speed.steps >= 8 && speed.frames > 0, "{speed:?}");
        let json = serde_json::to_value(&speed).expect("its keys are strings");
        assert_eq!(json["partner_size"], 32, "{json}");
        assert_eq!(fractions.last(), Some(&1.0));
    }
}
