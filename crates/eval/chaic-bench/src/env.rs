//! How fast environments are stepped: worlds, partners and what the helpers see, all together.

use chaic_core::action::Hand;
use chaic_core::observation::{Grants, Senses};
use chaic_core::rng::Stream;
use chaic_core::{Action, Target, TaskId};
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EnvBatch, EpisodeConfig, Flow, ImagesMut, Minds, Seat};
use chaic_episodes::{Episode, Split, episodes};
use chaic_render::{Appearance, Channels};
use serde::Serialize;

use super::{Clock, Machine};
use chaic_eval::{EvalError, Result};

/// What is measured.
#[derive(Clone, Debug)]
pub struct EnvBench {
    /// The tasks, by turns.
    pub tasks: Vec<TaskId>,
    /// How many environments are stepped together.
    pub envs: usize,
    /// Side of the helpers' images, pixels.
    pub size: u32,
    /// Side of the partners' images, pixels.
    pub minds_size: u32,
    /// What the helpers look at.
    pub channels: Channels,
    /// Threads.
    pub threads: usize,
    /// Least time of measuring, seconds.
    pub seconds: f32,
}

/// How fast environments are.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnvSpeed {
    /// How many are stepped together.
    pub envs: usize,
    /// Side of the helpers' images, pixels.
    pub size: u32,
    /// Side of the partners' images, pixels.
    pub minds_size: u32,
    /// What the helpers look at, in words.
    pub channels: String,
    /// Threads.
    pub threads: usize,
    /// Decisions of the helpers.
    pub steps: u64,
    /// Frames that passed, of all environments.
    pub frames: u64,
    /// Episodes that ended and were followed by another one.
    pub episodes: u64,
    /// Wall time, seconds.
    pub seconds: f64,
    /// Decisions of the helpers per second of wall time.
    pub steps_per_second: f64,
    /// Frames per second of wall time.
    pub frames_per_second: f64,
    /// Which machine and build.
    pub machine: Machine,
}

impl EnvBench {
    /// Lets helpers act at random beside the rule-based partners in training episodes. `progress` is
    /// told how much of the time has passed, 0 to 1.
    ///
    /// # Errors
    /// If episodes can't be had, or threads.
    pub fn measure(&self, progress: &mut dyn FnMut(f32)) -> Result<EnvSpeed> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build();
        let pool = pool.map_err(|problem| EvalError::Options(format!("no threads: {problem}")))?;
        // Progress bars aren't shared between threads.
        let (sender, passed) = std::sync::mpsc::channel();
        std::thread::scope(|scope| {
            let work = scope.spawn(move || {
                pool.install(|| {
                    self.play(&mut |part| {
                        let _ = sender.send(part);
                    })
                })
            });
            passed.iter().for_each(progress);
            work.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    }

    fn play(&self, progress: &mut dyn FnMut(f32)) -> Result<EnvSpeed> {
        let bundled = self.episodes()?;
        let Channels { rgb, depth, ids } = self.channels;
        let senses = Senses { image_size: self.size, rgb, depth, ids, film: None };
        let env = |k: usize| {
            let helper = Some(Seat::of_caller(Grants::IDS, senses));
            Env::new(self.config(&bundled, k), Minds { helper, partner: None })
        };
        let envs: std::result::Result<Vec<Env>, _> = (0..self.envs).map(env).collect();
        let mut batch = EnvBatch::new(envs?)?;
        let [n_rgb, n_depth, n_ids] = batch.layout().lengths();
        let (mut rgb, mut depth_m, mut ids) = (vec![0; n_rgb], vec![0.0; n_depth], vec![0; n_ids]);
        let mut luck = Stream::new(0, "bench env", 0);
        let (mut steps, mut frames, mut n_ended, mut passed) = (0, 0, 0, 0.0);
        let clock = Clock::start();
        while passed < 1.0 {
            let before: u64 = n_frames(&batch);
            let flows = batch.advance(None);
            frames += n_frames(&batch) - before;
            for (k, flow) in flows.into_iter().enumerate() {
                match flow {
                    Ok(Flow::Waits) => {}
                    Ok(Flow::Ended | Flow::Stopped) => {
                        n_ended += 1;
                        batch.reset(k, self.config(&bundled, self.envs + n_ended))?;
                    }
                    Err(broken) => return Err(EvalError::Options(broken.to_string())),
                }
            }
            let buffers = ImagesMut {
                rgb: (n_rgb > 0).then_some(&mut rgb),
                depth_m: (n_depth > 0).then_some(&mut depth_m),
                ids: (n_ids > 0).then_some(&mut ids),
            };
            for slot in batch.observe(buffers)? {
                batch.submit(slot, random_action(self.size, &mut luck));
                steps += 1;
            }
            passed = clock.elapsed().as_secs_f32() / self.seconds;
            progress(passed.min(1.0));
        }
        let seconds = clock.elapsed().as_secs_f64();
        Ok(EnvSpeed {
            envs: self.envs,
            size: self.size,
            minds_size: self.minds_size,
            channels: super::render::name_of(self.channels),
            threads: self.threads,
            steps,
            frames,
            episodes: n_ended as u64,
            seconds,
            steps_per_second: steps as f64 / seconds,
            frames_per_second: frames as f64 / seconds,
            machine: Machine::this(),
        })
    }

    fn episodes(&self) -> Result<Vec<Episode>> {
        let mut all = Vec::new();
        for task in &self.tasks {
            for episode in episodes(&Split::Train, *task) {
                all.push(episode?);
            }
        }
        // Tasks by turns.
        let n_each = (all.len() / self.tasks.len().max(1)).max(1);
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by_key(|k| (k % n_each, k / n_each));
        Ok(order.into_iter().map(|k| all[k].clone()).collect())
    }

    fn config<'a>(&self, bundled: &'a [Episode], number: usize) -> EpisodeConfig<'a> {
        EpisodeConfig {
            episode: &bundled[number % bundled.len()],
            seed: (number / bundled.len()) as u32,
            rules: RuleSet::PAPER,
            helper: "bench",
            partner: None,
            image_size: Some(self.minds_size),
            appearance: Appearance::Canonical,
        }
    }
}

fn n_frames(batch: &EnvBatch) -> u64 {
    batch.envs().iter().map(|env| u64::from(env.world().state().frame)).sum()
}

/// The mix of the world's bench, with pixels for targets.
fn random_action(size: u32, luck: &mut Stream) -> Action {
    let hand = if luck.chance(0.5) { Hand::Left } else { Hand::Right };
    let mut pixel = || luck.below(size as usize) as u32;
    let target = Target::Pixel { column: pixel(), row: pixel() };
    match luck.below(16) {
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
        let bench = EnvBench {
            tasks: TaskId::paper().collect(),
            envs: 8,
            size: 32,
            minds_size: 32,
            channels: Channels::ALL,
            threads: 2,
            seconds: 0.5,
        };
        let mut parts = Vec::new();
        let speed = bench.measure(&mut |part| parts.push(part)).expect("bundled episodes");
        assert!(speed.steps >= 8 && speed.frames > 0, "{speed:?}");
        assert_eq!(parts.last(), Some(&1.0));
    }
}
