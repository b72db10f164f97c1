//! How fast worlds are stepped.

use std::time::Duration;

use chaic_core::action::Hand;
use chaic_core::rng::Stream;
use chaic_core::{Action, ResolvedAction, TaskId};
use chaic_env::EnvError;
use chaic_episodes::{Split, episodes};
use chaic_world::{Rules, Setup, World};
use serde::Serialize;

use super::{Clock, Machine};
use chaic_eval::{EvalError, Result};

/// How fast the world of a task is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorldSpeed {
    /// The task.
    pub task: TaskId,
    /// The episode that was played, over and over.
    pub episode: String,
    /// People who acted.
    pub agents: usize,
    /// Things in the world.
    pub things: usize,
    /// Frames that passed.
    pub frames: u64,
    /// Actions that were chosen.
    pub actions: u64,
    /// Wall time, seconds.
    pub seconds: f64,
    /// Processor time, seconds.
    pub cpu_seconds: Option<f64>,
    /// Frames per second of wall time; 30 are a second of walking.
    pub frames_per_second: f64,
    /// The same of processor time.
    pub frames_per_cpu_second: Option<f64>,
    /// Which machine and build.
    pub machine: Machine,
}

/// Lets partner and helper act at random in the first test episode of a task, on one thread, for at
/// least so many seconds. Nothing is drawn. `progress` is told how much of the time has passed, 0 to 1.
///
/// # Errors
/// If the episode can't be had.
pub fn measure_world(
    task: TaskId,
    seconds: f32,
    progress: &mut dyn FnMut(f32),
) -> Result<WorldSpeed> {
    /// Rounds of decisions between two looks at the clock.
    const ROUNDS: u32 = 200;
    let episode = episodes(&Split::Test, task).next();
    let episode = episode
        .ok_or_else(|| EvalError::Options(format!("there is no test episode of {task}")))??;
    let refused = |problem| EnvError::Setup { id: episode.id().to_owned(), problem };
    let mut setup = episode.setup().clone();
    setup.people.truncate(2);
    let begin = World::new(setup, Rules::paper()).map_err(refused)?;
    let mut world = begin.clone();
    let mut luck = Stream::new(episode.seed(), "bench world", 0);
    let (mut frames, mut actions, mut passed) = (0, 0, 0.0);
    let clock = Clock::start();
    while passed < 1.0 {
        for _ in 0..ROUNDS {
            if world.is_over() {
                world = begin.clone();
            }
            for agent in world.waiting() {
                let action = random_action(world.setup(), &mut luck);
                world.submit(agent, action).expect("the agent waits");
                actions += 1;
            }
            let before = world.state().frame;
            world.advance();
            frames += u64::from(world.state().frame - before);
            world.drain_events();
        }
        passed = clock.elapsed().as_secs_f32() / seconds;
        progress(passed.min(1.0));
    }
    let (wall, cpu) =
        (clock.elapsed().as_secs_f64(), clock.cpu().as_ref().map(Duration::as_secs_f64));
    Ok(WorldSpeed {
        task,
        episode: episode.id().to_owned(),
        agents: begin.setup().people.len(),
        things: begin.setup().things.len(),
        frames,
        actions,
        seconds: wall,
        cpu_seconds: cpu,
        frames_per_second: frames as f64 / wall,
        frames_per_cpu_second: cpu.map(|cpu| frames as f64 / cpu),
        machine: Machine::this(),
    })
}

/// The mix of `benches/world.rs` of `chaic-episodes`: half of all actions are steps, a quarter turns;
/// the rest are interactions with things of the episode.
fn random_action(setup: &Setup, luck: &mut Stream) -> ResolvedAction {
    let hand = if luck.chance(0.5) { Hand::Left } else { Hand::Right };
    let thing = |luck: &mut Stream| Setup::entity(luck.below(setup.things.len()));
    match luck.below(16) {
        0..8 => Action::MoveForward,
        8..10 => Action::TurnLeft,
        10..12 => Action::TurnRight,
        12 => Action::PickUp { object: thing(luck), hand },
        13 => Action::PutOn { place: thing(luck), hand },
        14 => Action::RemoveObstacle { obstacle: thing(luck), hand },
        _ => Action::PutIn,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_has_a_world_to_step() {
        for task in TaskId::paper() {
            let speed = measure_world(task, 0.001, &mut |_| {}).expect("bundled");
            assert!(speed.agents == 2 && speed.frames >= speed.actions / 4, "{speed:?}");
        }
    }
}
