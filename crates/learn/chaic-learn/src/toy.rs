//! Tasks whose best return is known: a check of the learner, not of helpers.

use chaic_core::geom::math;
use chaic_core::rng::Stream;

use crate::actor_critic::ActorCritic as _;
use crate::choice_network::{ChoiceNetwork, Decision};
use crate::ppo::{Trajectory, Transition};

/// A task with a few actions, all of them allowed.
pub trait Toy {
    /// Numbers of a state.
    const N_STATE: usize;
    /// How many actions there are.
    const N_ACTIONS: usize;

    /// Begins an episode.
    fn begin(rng: &mut Stream) -> Self;

    /// What is seen.
    fn state(&self) -> Vec<f32>;

    /// Acts: the reward, and whether the episode goes on.
    fn step(&mut self, action: usize) -> (f32, bool);
}

/// A pole on a cart (Barto, Sutton and Anderson 1983), as `CartPole-v1` of Gymnasium: a point a step for up to 500
/// steps; 475 on average counts as solved.
pub struct CartPole {
    x: [f32; 4],
    steps: u32,
}

impl Toy for CartPole {
    const N_STATE: usize = 4;
    const N_ACTIONS: usize = 2;

    fn begin(rng: &mut Stream) -> CartPole {
        CartPole { x: std::array::from_fn(|_| 0.1 * rng.unit() - 0.05), steps: 0 }
    }

    fn state(&self) -> Vec<f32> {
        self.x.to_vec()
    }

    fn step(&mut self, action: usize) -> (f32, bool) {
        const GRAVITY: f32 = 9.8;
        const CART_KG: f32 = 1.0;
        const POLE_KG: f32 = 0.1;
        const HALF_M: f32 = 0.5;
        const STEP_S: f32 = 0.02;
        let [x, v, angle, turn] = self.x;
        let force = if action == 1 { 10.0 } else { -10.0 };
        let (sin, cos) = (math::sin(angle), math::cos(angle));
        let all_kg = CART_KG + POLE_KG;
        let pushed = (force + POLE_KG * HALF_M * turn * turn * sin) / all_kg;
        let bent =
            (GRAVITY * sin - cos * pushed) / (HALF_M * (4.0 / 3.0 - POLE_KG * cos * cos / all_kg));
        let sped = pushed - POLE_KG * HALF_M * bent * cos / all_kg;
        self.x = [x + STEP_S * v, v + STEP_S * sped, angle + STEP_S * turn, turn + STEP_S * bent];
        self.steps += 1;
        let stands = self.x[0].abs() <= 2.4 && self.x[2].abs() <= 12.0_f32.to_radians();
        (1.0, stands && self.steps < 500)
    }
}

/// A way through a square of cells with a wall to be gone around: nothing but the goal is worth anything, and the best
/// return is the discount to the power of the steps of the shortest way.
pub struct Maze {
    at: [usize; 2],
    steps: u32,
}

impl Maze {
    /// Cells along each side.
    pub const SIDE: usize = 6;
    /// Steps of the shortest way.
    pub const SHORTEST: u32 = 14;
    /// Steps until it is over.
    const MOST: u32 = 100;

    /// A wall in the second row that leaves its last cell free.
    fn is_wall([i, j]: [usize; 2]) -> bool {
        j == 1 && i + 1 < Maze::SIDE
    }
}

impl Toy for Maze {
    const N_STATE: usize = Maze::SIDE * Maze::SIDE;
    const N_ACTIONS: usize = 4;

    fn begin(_: &mut Stream) -> Maze {
        Maze { at: [0, 0], steps: 0 }
    }

    fn state(&self) -> Vec<f32> {
        let mut state = vec![0.0; Maze::N_STATE];
        state[Maze::SIDE * self.at[1] + self.at[0]] = 1.0;
        state
    }

    fn step(&mut self, action: usize) -> (f32, bool) {
        let [i, j] = self.at;
        let last = Maze::SIDE - 1;
        let to = match action {
            0 => [i.saturating_sub(1), j],
            1 => [(i + 1).min(last), j],
            2 => [i, j.saturating_sub(1)],
            _ => [i, (j + 1).min(last)],
        };
        if !Maze::is_wall(to) {
            self.at = to;
        }
        self.steps += 1;
        let is_there = self.at == [0, 4];
        (f32::from(u8::from(is_there)), !is_there && self.steps < Maze::MOST)
    }
}

/// A network for a toy.
pub fn network<T: Toy>(width: usize) -> ChoiceNetwork {
    ChoiceNetwork::new((T::N_STATE, T::N_ACTIONS), width, 1)
}

/// Plays episodes until there are so many decisions; what was got in each that came to its end. The last one may be
/// cut off.
pub fn play<T: Toy>(
    model: &ChoiceNetwork,
    numbers: &[f32],
    n_decisions: usize,
    rng: &mut Stream,
) -> (Vec<Trajectory>, Vec<f32>) {
    let mut pass = model.pass();
    let (mut trajectories, mut returns) = (Vec::new(), Vec::new());
    let mut left = n_decisions;
    let mut one_hot = vec![0.0; T::N_ACTIONS * T::N_ACTIONS];
    (0..T::N_ACTIONS).for_each(|k| one_hot[k * T::N_ACTIONS + k] = 1.0);
    while left > 0 {
        let mut toy = T::begin(rng);
        let mut trajectory = Trajectory::default();
        let mut got = 0.0;
        let mut goes_on = true;
        while left > 0 && goes_on {
            let decision =
                Decision { state: toy.state(), choices: one_hot.clone(), n_choices: T::N_ACTIONS };
            let said = model.forward(numbers, std::iter::once(&decision), &mut pass).remove(0);
            let choice = said.sample(rng.unit());
            let (reward, on) = toy.step(choice);
            (got, goes_on) = (got + reward, on);
            left -= 1;
            trajectory.transitions.push(Transition {
                decision,
                choice,
                log_probability: said.log_probabilities[choice],
                value: said.value(),
                reward,
                duration: 1.0,
            });
        }
        if goes_on {
            // Cut off: what would have followed is what the network expects.
            trajectory.value_after = trajectory.transitions.last().map_or(0.0, |last| last.value);
        } else {
            returns.push(got);
        }
        trajectories.push(trajectory);
    }
    (trajectories, returns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ppo::{PpoRules, improve};
    use chaic_training::Learner;
    use std::sync::atomic::AtomicBool;

    /// What is played after so many iterations of so many decisions.
    fn learn<T: Toy>(
        rules: &PpoRules,
        iterations: u64,
        n_decisions: usize,
    ) -> (Vec<Trajectory>, Vec<f32>) {
        let model = network::<T>(32);
        let mut learner = Learner::new(&model.network, 1, rules.shards);
        let played = |iteration: u64, learner: &Learner| {
            let mut rng = Stream::new(1, "toy", iteration);
            play::<T>(&model, &learner.numbers, n_decisions, &mut rng)
        };
        for iteration in 0..iterations {
            let (trajectories, _) = played(iteration, &learner);
            let rest = 1.0 - iteration as f32 / iterations as f32;
            let (named, never) = ((1, iteration, rest), AtomicBool::new(false));
            improve(rules, &model, &mut learner, &trajectories, named, &never).unwrap();
        }
        played(iterations, &learner)
    }

    #[test]
    fn a_pole_is_learned_to_be_balanced() {
        let rules = PpoRules {
            discount: 0.98,
            trace: 0.8,
            epochs: 10,
            batch: 128,
            rate: 2e-3,
            rate_falls: true,
            ..PpoRules::default()
        };
        let (_, returns) = learn::<CartPole>(&rules, 25, 2048);
        let got = returns.iter().sum::<f32>() / returns.len() as f32;
        assert!(got > 475.0, "{got}");
    }

    #[test]
    fn the_shortest_way_through_a_maze_is_found() {
        let rules = PpoRules {
            discount: 0.9,
            entropy: 0.02,
            batch: 128,
            rate: 3e-3,
            rate_falls: true,
            ..PpoRules::default()
        };
        let (trajectories, _) = learn::<Maze>(&rules, 30, 1024);
        let ended = &trajectories[..trajectories.len() - 1];
        let steps = ended.iter().map(|t| t.transitions.len()).sum::<usize>() as f32;
        let mean = steps / ended.len() as f32;
        assert!(mean < 1.1 * Maze::SHORTEST as f32, "{mean} steps");
    }
}
