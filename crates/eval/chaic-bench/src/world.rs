//! Throughput of world stepping.

use std::time::Duration;

use chaic_core::action::Hand;
use chaic_core::rng::RngStream;
use chaic_core::{Action, ResolvedAction, TaskId};
use chaic_env::EnvError;
use chaic_episodes::{Split, episodes};
use chaic_world::{Rules, Setup, World};
use serde::Serialize;

use super::{Machine, Stopwatch};
use chaic_eval::{EvalError, Result};

/// Result of a world benchmark.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorldSpeed {
    /// Task of the episode.
    pub task: TaskId,
    /// Name of the episode, which is played repeatedly.
    pub episode: String,
    /// Number of people who acted.
    pub agents: usize,
    /// Number of objects in the world.
    pub things: usize,
    /// Number of frames.
    pub frames: u64,
    /// Number of actions.
    pub actions: u64,
    /// Wall time, seconds.
    pub seconds: f64,
    /// CPU time, seconds.
    pub cpu_seconds: Option<f64>,
    /// Frames per second of wall time; 30 are a second of walking.
    pub frames_per_second: f64,
    /// Frames per second of CPU time.
    pub frames_per_cpu_second: Option<f64>,
    /// Machine and build.
    pub machine: Machine,
}

/// Runs the first test episode of a task with random actions of partner and helper, on one thread,
/// for at least `seconds`. Nothing is rendered. `progress` receives the fraction of the duration
/// that has passed, 0 to 1.
///
/// # Errors
/// If the episode cannot be read.
pub fn measure_world(
    task: TaskId,
    seconds: f32,
    progress: &mut dyn FnMut(f32),
) -> Result<WorldSpeed> {
    /// Number of rounds of decisions between two readings of the clock.
    const ROUNDS: u32 = 200;
    let episode = episodes(&Split::Test, task).next();
    let episode =
        episode.ok_or_else(|| EvalError::Options(format!("{task} has no test episode")))??;
    let error = |problem| EnvError::Setup { id: episode.id().to_owned(), problem };
    let mut setup = episode.setup().clone();
    setup.people.truncate(2);
    let initial = World::new(setup, Rules::paper()).map_err(error)?;
    let mut world = initial.clone();
    let mut rng = RngStream::new(episode.seed(), "bench world", 0);
    let (mut frames, mut actions, mut fraction) = (0, 0, 0.0);
    let clock = Stopwatch::start();
    while fraction < 1.0 {
        for _ in 0..ROUNDS {
            if world.is_over() {
                world = initial.clone();
            }
            for agent in world.waiting() {
                let action = random_action(world.setup(), &mut rng);
                world.submit(agent, action).expect("the agent waits");
                actions += 1;
            }
            let before = world.state().frame;
            world.advance();
            frames += u64::from(world.state().frame - before);
            world.drain_events();
        }
        fraction = clock.elapsed().as_secs_f32() / seconds;
        progress(fraction.min(1.0));
    }
    let (wall, cpu) =
        (clock.elapsed().as_secs_f64(), clock.cpu().as_ref().map(Duration::as_secs_f64));
    Ok(WorldSpeed {
        task,
        episode: episode.id().to_owned(),
        agents: initial.setup().people.len(),
        things: initial.setup().things.len(),
        frames,
        actions,
        seconds: wall,
        cpu_seconds: cpu,
        frames_per_second: frames as f64 / wall,
        frames_per_cpu_second: cpu.map(|cpu| frames as f64 / cpu),
        machine: Machine::current(),
    })
}

/// Draws an action from the same distribution as `benches/world.rs` of `chaic-episodes`: half of
/// all actions are steps, a quarter turns, and the others interactions with objects.
fn random_action(setup: &Setup, rng: &mut RngStream) -> ResolvedAction {
    let hand = if rng.chance(0.5) { Hand::Left } else { Hand::Right };
    let object = |rng: &mut RngStream| Setup::entity(rng.below(setup.things.len()));
    match rng.below(16) {
        0..8 => Action::MoveForward,
        8..10 => Action::TurnLeft,
        10..12 => Action::TurnRight,
        12 => Action::PickUp { object: object(rng), hand },
        13 => Action::PutOn { place: object(rng), hand },
        14 => Action::RemoveObstacle { obstacle: object(rng), hand },
        _ => Action::PutIn,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_can_be_measured() {
        for task in TaskId::paper() {
            let speed = measure_world(task, 0.001, &mut |_| {}).expect("bundled");
            assert!(speed.agents == 2 && speed.frames >= speed.actions / 4, "{speed:?}");
        }
    }
}
