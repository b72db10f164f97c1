//! Numbers of a network while they are learned, by several threads side by side.

use std::thread;

use chaic_nn::simd::widest;
use chaic_nn::{Adam, AdamRules, Network, Pass};

/// Share of a step's numbers in the slow mean.
const AVERAGE_RATE: f32 = 0.002;

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

    /// All that is needed to go on, as bytes.
    pub fn checkpoint(&self) -> Vec<u8> {
        let lists = [&self.numbers, &self.average, &self.adam.mean, &self.adam.square];
        let mut bytes = self.adam.steps.to_le_bytes().to_vec();
        for x in lists.into_iter().flatten() {
            bytes.extend_from_slice(&x.to_le_bytes());
        }
        bytes
    }

    /// Goes on from a checkpoint; `false` if it is of another network.
    pub fn resume(&mut self, rules: &AdamRules, bytes: &[u8]) -> bool {
        let n = self.numbers.len();
        let Some((steps, rest)) = bytes.split_first_chunk::<8>() else { return false };
        let numbers: Vec<f32> =
            rest.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        if rest.len() != 16 * n {
            return false;
        }
        let list = |k: usize| numbers[k * n..][..n].to_vec();
        (self.numbers, self.average) = (list(0), list(1));
        let steps = u64::from_le_bytes(*steps);
        self.adam = Adam::resumed(rules, steps, list(2), list(3));
        true
    }

    /// Takes a step along the mean of the gradients that `work` adds to zeros for each part of the
    /// batch; tells what `work` tells.
    pub fn step<L: Send>(
        &mut self,
        network: &Network,
        (rules, rate): (&AdamRules, f32),
        work: impl Fn(usize, &[f32], &mut Pass, &mut [f32]) -> L + Sync,
    ) -> Vec<L> {
        let (numbers, work) = (&self.numbers[..], &work);
        let told: Vec<L> = thread::scope(|scope| {
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
            workers.into_iter().map(|w| w.join().expect("it doesn't panic")).collect()
        });
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
        told
    }
}

/// The rate of a step: it rises to `rate` for `warm_up` steps, and falls to a hundredth along a parabola
/// until the last one.
pub fn rate_at(step: u64, (rate, warm_up, steps): (f32, u64, u64)) -> f32 {
    let rise = ((step + 1) as f32 / warm_up as f32).min(1.0);
    let left = 1.0 - (step as f32 / steps as f32).min(1.0);
    rate * rise * (0.01 + 0.99 * left * left)
}
