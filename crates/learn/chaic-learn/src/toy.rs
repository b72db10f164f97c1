//! Tasks with a known best return, to test the learner.

use chaic_core::Frame;
use chaic_core::geom::math;
use chaic_core::rng::RngStream;

use crate::actor_critic::ActorCritic as _;
use crate::candidate_scorer::{CandidateScorer, CandidateSet};
use crate::decision_memory::{DecisionMemory, N_MEMORY_PLAN_FEATURES};
use crate::ppo::{Trajectory, Transition};

/// Task with a few actions, all of which are always allowed.
pub trait ToyTask {
    /// Number of state features.
    const N_STATE_FEATURES: usize;
    /// Number of actions.
    const N_ACTIONS: usize;
    /// Number of earlier decisions that the policy reads.
    const MEMORY: usize = 0;

    /// Starts an episode.
    fn new(rng: &mut RngStream) -> Self;

    /// Returns the state features.
    fn state(&self) -> Vec<f32>;

    /// Takes an action; returns the reward and whether the episode continues.
    fn step(&mut self, action: usize) -> (f32, bool);
}

/// Cart-pole (Barto, Sutton and Anderson 1983) as Gymnasium's `CartPole-v1`: reward 1 per step for
/// up to 500 steps. A mean return of 475 counts as solved.
pub struct CartPole {
    x: [f32; 4],
    steps: u32,
}

impl ToyTask for CartPole {
    const N_STATE_FEATURES: usize = 4;
    const N_ACTIONS: usize = 2;

    fn new(rng: &mut RngStream) -> CartPole {
        CartPole { x: std::array::from_fn(|_| 0.1 * rng.unit() - 0.05), steps: 0 }
    }

    fn state(&self) -> Vec<f32> {
        self.x.to_vec()
    }

    fn step(&mut self, action: usize) -> (f32, bool) {
        const GRAVITY: f32 = 9.8;
        const CART_KG: f32 = 1.0;
        const POLE_KG: f32 = 0.1;
        const HALF_POLE_M: f32 = 0.5;
        const STEP_S: f32 = 0.02;
        let [x, v, angle, angular_velocity] = self.x;
        let force = if action == 1 { 10.0 } else { -10.0 };
        let (sin, cos) = (math::sin(angle), math::cos(angle));
        let total_kg = CART_KG + POLE_KG;
        let push =
            (force + POLE_KG * HALF_POLE_M * angular_velocity * angular_velocity * sin) / total_kg;
        let angular_acceleration = (GRAVITY * sin - cos * push)
            / (HALF_POLE_M * (4.0 / 3.0 - POLE_KG * cos * cos / total_kg));
        let acceleration = push - POLE_KG * HALF_POLE_M * angular_acceleration * cos / total_kg;
        self.x = [
            x + STEP_S * v,
            v + STEP_S * acceleration,
            angle + STEP_S * angular_velocity,
            angular_velocity + STEP_S * angular_acceleration,
        ];
        self.steps += 1;
        let is_upright = self.x[0].abs() <= 2.4 && self.x[2].abs() <= 12.0_f32.to_radians();
        (1.0, is_upright && self.steps < 500)
    }
}

/// Maze of square cells. Only the goal gives a reward, so the best return is gamma to the power of
/// the length of the shortest path.
pub struct Maze {
    position: [usize; 2],
    steps: u32,
}

impl Maze {
    /// Cells along each side.
    pub const SIDE: usize = 6;
    /// Length of the shortest path from start to goal, steps.
    pub const SHORTEST: u32 = 14;
    /// Maximum length of an episode, steps.
    const MAX_STEPS: u32 = 100;

    /// Returns whether a cell is part of the wall: the second row without its last cell.
    fn is_wall([i, j]: [usize; 2]) -> bool {
        j == 1 && i + 1 < Maze::SIDE
    }
}

impl ToyTask for Maze {
    const N_STATE_FEATURES: usize = Maze::SIDE * Maze::SIDE;
    const N_ACTIONS: usize = 4;

    fn new(_: &mut RngStream) -> Maze {
        Maze { position: [0, 0], steps: 0 }
    }

    fn state(&self) -> Vec<f32> {
        let mut state = vec![0.0; Maze::N_STATE_FEATURES];
        state[Maze::SIDE * self.position[1] + self.position[0]] = 1.0;
        state
    }

    fn step(&mut self, action: usize) -> (f32, bool) {
        let [i, j] = self.position;
        let last = Maze::SIDE - 1;
        let next_position = match action {
            0 => [i.saturating_sub(1), j],
            1 => [(i + 1).min(last), j],
            2 => [i, j.saturating_sub(1)],
            _ => [i, (j + 1).min(last)],
        };
        if !Maze::is_wall(next_position) {
            self.position = next_position;
        }
        self.steps += 1;
        let is_at_goal = self.position == [0, 4];
        (f32::from(u8::from(is_at_goal)), !is_at_goal && self.steps < Maze::MAX_STEPS)
    }
}

/// Recall of a cue: the first state shows which of two actions is right, and only the choice in the
/// last state counts. Policies without memory have a mean return of 0.5.
pub struct CueRecall {
    cue: usize,
    steps: u32,
}

impl CueRecall {
    /// Length of an episode, steps.
    const STEPS: u32 = 4;
}

impl ToyTask for CueRecall {
    const N_STATE_FEATURES: usize = 2;
    const N_ACTIONS: usize = 2;
    const MEMORY: usize = 4;

    fn new(rng: &mut RngStream) -> CueRecall {
        CueRecall { cue: usize::from(rng.chance(0.5)), steps: 0 }
    }

    fn state(&self) -> Vec<f32> {
        let is_last = f32::from(u8::from(self.steps + 1 == CueRecall::STEPS));
        let cue = if self.steps == 0 { self.cue as f32 * 2.0 - 1.0 } else { 0.0 };
        vec![cue, is_last]
    }

    fn step(&mut self, action: usize) -> (f32, bool) {
        self.steps += 1;
        let is_last = self.steps == CueRecall::STEPS;
        (f32::from(u8::from(is_last && action == self.cue)), !is_last)
    }
}

/// Creates a network for a task.
pub fn network<T: ToyTask>(width: usize) -> CandidateScorer {
    let n_memory = if T::MEMORY > 0 { N_MEMORY_PLAN_FEATURES } else { 0 };
    CandidateScorer::new(T::N_STATE_FEATURES, T::N_ACTIONS + n_memory, width, 1)
}

/// Encodes a decision between all actions, each by a one-hot vector.
fn encode<T: ToyTask>(task: &T, memory: &mut DecisionMemory, step: Frame) -> CandidateSet {
    let n = T::N_ACTIONS;
    let mut encoded = CandidateSet {
        state: task.state(),
        candidates: (0..n * n).map(|k| f32::from(u8::from(k % (n + 1) == 0))).collect(),
        n_candidates: n,
        memory: Vec::new(),
    };
    memory.add_to(&mut encoded, step);
    encoded
}

/// Plays episodes for `n_decisions` steps. Returns all trajectories, of which the last may be
/// truncated, and the returns of the finished episodes.
pub fn collect_trajectories<T: ToyTask>(
    model: &CandidateScorer,
    parameters: &[f32],
    n_decisions: usize,
    rng: &mut RngStream,
) -> (Vec<Trajectory>, Vec<f32>) {
    let mut pass = model.pass();
    let (mut trajectories, mut returns) = (Vec::new(), Vec::new());
    let mut remaining = n_decisions;
    while remaining > 0 {
        let mut task = T::new(rng);
        let mut trajectory = Trajectory::default();
        let mut memory = DecisionMemory::new(T::MEMORY);
        let mut step = 0;
        let mut episode_return = 0.0;
        let mut continues = true;
        while remaining > 0 && continues {
            let observation = encode(&task, &mut memory, step);
            let output =
                model.forward(parameters, std::iter::once(&observation), &mut pass).remove(0);
            let action = output.sample(rng.unit());
            memory.record(Some(action), step);
            step += 1;
            let (reward, has_next) = task.step(action);
            (episode_return, continues) = (episode_return + reward, has_next);
            remaining -= 1;
            trajectory.transitions.push(Transition {
                observation,
                action,
                log_prob: output.log_probs[action],
                value: output.value(),
                reward,
                duration: 1.0,
            });
        }
        if continues {
            // Truncated: the value estimate of the next state replaces the remaining return.
            let next = encode(&task, &mut memory, step);
            let output = model.forward(parameters, std::iter::once(&next), &mut pass).remove(0);
            trajectory.bootstrap_value = output.value();
        } else {
            returns.push(episode_return);
        }
        trajectories.push(trajectory);
    }
    (trajectories, returns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ppo::{PpoConfig, Schedule, update};
    use chaic_training::Learner;
    use std::sync::atomic::AtomicBool;

    /// Returns a rollout after training for some iterations.
    fn train<T: ToyTask>(
        config: &PpoConfig,
        iterations: u64,
        n_decisions: usize,
    ) -> (Vec<Trajectory>, Vec<f32>) {
        let model = network::<T>(32);
        let mut learner = Learner::new(&model.network, 1, config.shards);
        let rollout = |iteration: u64, learner: &Learner| {
            let mut rng = RngStream::new(1, "toy", iteration);
            collect_trajectories::<T>(&model, &learner.parameters, n_decisions, &mut rng)
        };
        for iteration in 0..iterations {
            let (trajectories, _) = rollout(iteration, &learner);
            let progress_remaining = 1.0 - iteration as f32 / iterations as f32;
            let schedule = Schedule { seed: 1, iteration, progress_remaining };
            let stop = AtomicBool::new(false);
            update(config, &model, &mut learner, &trajectories, None, schedule, &stop).unwrap();
        }
        rollout(iterations, &learner)
    }

    #[test]
    fn cart_pole_is_solved() {
        let config = PpoConfig {
            gamma: 0.98,
            gae_lambda: 0.8,
            n_epochs: 10,
            batch_size: 128,
            learning_rate: 2e-3,
            anneal_lr: true,
            ..PpoConfig::default()
        };
        let (_, returns) = train::<CartPole>(&config, 25, 2048);
        let mean_return = returns.iter().sum::<f32>() / returns.len() as f32;
        assert!(mean_return > 475.0, "{mean_return}");
    }

    #[test]
    fn earlier_decisions_are_remembered() {
        let config = PpoConfig {
            gamma: 0.98,
            ent_coef: 0.01,
            batch_size: 64,
            learning_rate: 2e-3,
            ..PpoConfig::default()
        };
        let (_, returns) = train::<CueRecall>(&config, 20, 512);
        let mean_return = returns.iter().sum::<f32>() / returns.len() as f32;
        assert!(mean_return > 0.95, "{mean_return}");
    }

    #[test]
    fn the_shortest_path_through_a_maze_is_found() {
        let config = PpoConfig {
            gamma: 0.9,
            ent_coef: 0.02,
            batch_size: 128,
            learning_rate: 3e-3,
            anneal_lr: true,
            ..PpoConfig::default()
        };
        let (trajectories, _) = train::<Maze>(&config, 30, 1024);
        let ended = &trajectories[..trajectories.len() - 1];
        let steps = ended.iter().map(|t| t.transitions.len()).sum::<usize>() as f32;
        let mean = steps / ended.len() as f32;
        assert!(mean < 1.1 * Maze::SHORTEST as f32, "{mean} steps");
    }
}
