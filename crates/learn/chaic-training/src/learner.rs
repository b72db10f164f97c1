//! Numbers of a network while they are learned, by several threads side by side.

use std::thread;

use chaic_nn::simd::widest;
use chaic_nn::{Adam, AdamRules, Network, Pass};

use crate::checkpoint::{Checkpoint, CheckpointError};

/// Share of a step's numbers in the slow mean.
const AVERAGE_RATE: f32 = 0.002;

/// Sections of a checkpoint.
const PARAMETERS: &str = "learner.parameters";
const AVERAGE: &str = "learner.average";
const EXP_AVG: &str = "adam.exp_avg";
const EXP_AVG_SQ: &str = "adam.exp_avg_sq";
const OPTIMIZER_STEPS: &str = "adam.steps";
const BETA_POWERS: &str = "adam.beta_powers";
/// Largest number of optimizer steps in a checkpoint: what a training reaches in years, and far from overflow.
const MAX_OPTIMIZER_STEPS: u64 = 1 << 48;

/// What is learned, and all that is needed to go on.
pub struct Learner {
    /// The numbers of the network.
    pub numbers: Vec<f32>,
    /// A slow mean of them, which is what is shipped.
    pub average: Vec<f32>,
    /// How steps are taken.
    pub adam: Adam,
    /// Of each part of a batch: working space, and the gradient.
    passes: Vec<(Pass, Vec<f32>)>,
}

/// State of weights and optimizer at one step.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnerState {
    numbers: Vec<f32>,
    average: Vec<f32>,
    adam: Adam,
}

impl Learner {
    /// Before the first step. Batches have so many parts, which are worked on side by side.
    pub fn new(network: &Network, seed: u64, shards: usize) -> Learner {
        let numbers = network.begin(seed);
        let adam = Adam::new(numbers.len());
        let pass = || (Pass::new(network, widest()), vec![0.0; numbers.len()]);
        let passes = (0..shards).map(|_| pass()).collect();
        Learner { average: numbers.clone(), numbers, adam, passes }
    }

    /// Parts of a batch that are worked on side by side.
    pub fn shards(&self) -> usize {
        self.passes.len()
    }

    /// Takes these numbers before the first step.
    pub fn begin_with(&mut self, numbers: Vec<f32>) {
        self.average.clone_from(&numbers);
        self.numbers = numbers;
    }

    /// Returns a copy of the state of weights and optimizer, for [`Learner::set_state`].
    pub fn state(&self) -> LearnerState {
        let (numbers, average) = (self.numbers.clone(), self.average.clone());
        LearnerState { numbers, average, adam: self.adam.clone() }
    }

    /// Goes back to a state of the same network.
    pub fn set_state(&mut self, state: LearnerState) {
        let LearnerState { numbers, average, adam } = state;
        (self.numbers, self.average, self.adam) = (numbers, average, adam);
    }

    /// Adds the state of weights and optimizer to a checkpoint.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        checkpoint.insert_floats(PARAMETERS, self.numbers.clone());
        checkpoint.insert_floats(AVERAGE, self.average.clone());
        checkpoint.insert_floats(EXP_AVG, self.adam.mean.clone());
        checkpoint.insert_floats(EXP_AVG_SQ, self.adam.square.clone());
        checkpoint.insert_integers(OPTIMIZER_STEPS, vec![self.adam.steps]);
        checkpoint.insert_doubles(BETA_POWERS, self.adam.powers.to_vec());
    }

    /// Restores the state of weights and optimizer from a checkpoint; on an error nothing changes.
    ///
    /// # Errors
    /// [`CheckpointError::Section`] if a section is missing, has another length, or holds what no optimizer
    /// reaches.
    pub fn load(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        let floats = |name: &str| checkpoint.floats(name, self.numbers.len()).map(<[f32]>::to_vec);
        let (numbers, average) = (floats(PARAMETERS)?, floats(AVERAGE)?);
        let (mean, square) = (floats(EXP_AVG)?, floats(EXP_AVG_SQ)?);
        if square.iter().any(|x| *x < 0.0) {
            return Err(CheckpointError::section(EXP_AVG_SQ, "has a negative value"));
        }
        let steps = checkpoint.integer(OPTIMIZER_STEPS)?;
        if steps > MAX_OPTIMIZER_STEPS {
            return Err(CheckpointError::section(OPTIMIZER_STEPS, format!("is {steps}")));
        }
        let powers: Option<[f64; 2]> = checkpoint.doubles(BETA_POWERS)?.try_into().ok();
        let is_reached = |powers: &[f64; 2]| match steps {
            0 => *powers == [1.0; 2],
            _ => powers.iter().all(|p| (0.0..1.0).contains(p)),
        };
        let Some(powers) = powers.filter(is_reached) else {
            return Err(CheckpointError::section(BETA_POWERS, "has impossible values"));
        };
        (self.numbers, self.average) = (numbers, average);
        self.adam = Adam { steps, mean, square, powers };
        Ok(())
    }

    /// Applies one optimizer step along the mean of the gradients that `work` adds to zeros, one for each shard
    /// of the batch; returns the results of `work`. Returns `None` and changes nothing if `work` returns `None`
    /// for any shard.
    pub fn step<L: Send>(
        &mut self,
        network: &Network,
        (rules, rate): (&AdamRules, f32),
        work: impl Fn(usize, &[f32], &mut Pass, &mut [f32]) -> Option<L> + Sync,
    ) -> Option<Vec<L>> {
        let (numbers, work) = (&self.numbers[..], &work);
        let results: Option<Vec<L>> = thread::scope(|scope| {
            let workers: Vec<_> = self
                .passes
                .iter_mut()
                .enumerate()
                .map(|(shard, (pass, by))| {
                    scope.spawn(move || {
                        by.fill(0.0);
                        work(shard, numbers, pass, by)
                    })
                })
                .collect();
            // All are joined, whatever the first one returned.
            let results: Vec<Option<L>> =
                workers.into_iter().map(|w| w.join().expect("it doesn't panic")).collect();
            results.into_iter().collect()
        });
        let results = results?;
        let part = 1.0 / self.passes.len() as f32;
        let (first, rest) = self.passes.split_first_mut().expect("there are parts");
        for (_, by) in rest {
            first.1.iter_mut().zip(by.iter()).for_each(|(sum, g)| *sum += g);
        }
        first.1.iter_mut().for_each(|g| *g *= part);
        self.adam.step(rules, rate, network, &mut self.numbers, &first.1);
        // Of the last eighth of the steps, or the mean would keep what the network began with.
        let share = AVERAGE_RATE.max(8.0 / (self.adam.steps as f32 + 8.0));
        for (mean, x) in self.average.iter_mut().zip(&self.numbers) {
            *mean += share * (x - *mean);
        }
        Some(results)
    }
}

/// The rate of a step: it rises to `rate` for `warm_up` steps, and falls to a hundredth along a parabola
/// until the last one.
pub fn rate_at(step: u64, (rate, warm_up, steps): (f32, u64, u64)) -> f32 {
    let rise = ((step + 1) as f32 / warm_up as f32).min(1.0);
    let left = 1.0 - (step as f32 / steps as f32).min(1.0);
    rate * rise * (0.01 + 0.99 * left * left)
}
