//! Networks that choose and value, whatever they read, and the steps in which they learn.

use chaic_core::geom::math;
use chaic_nn::{AdamRules, Network, Pass};
use chaic_training::Learner;

/// A network that gives each of some choices a logit, and says numbers of the state, like its value.
pub trait ActorCritic: Sync {
    /// What it reads.
    type Seen: Sync;

    /// Its layers and the numbers that are learned.
    fn network(&self) -> &Network;

    /// What it says of what was seen.
    fn forward<'a>(
        &self,
        numbers: &[f32],
        seen: impl Iterator<Item = &'a Self::Seen> + Clone,
        pass: &mut Pass,
    ) -> Vec<Said>
    where
        Self::Seen: 'a;

    /// Adds the gradient by all numbers, from that by what was last said, to `by_numbers`.
    fn backward(&self, numbers: &[f32], by: &[BySaid], pass: &mut Pass, by_numbers: &mut [f32]);
}

/// What a network says of a decision.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Said {
    /// The logarithm of each choice's probability.
    pub log_probabilities: Vec<f32>,
    /// What it says of the state, choices apart: of a policy, the return that is expected.
    pub of_state: Vec<f32>,
}

impl Said {
    /// The return that a policy expects.
    pub fn value(&self) -> f32 {
        self.of_state[0]
    }

    /// The entropy of the choices, nats.
    pub fn entropy(&self) -> f32 {
        -self.log_probabilities.iter().map(|l| l * math::exp(*l)).sum::<f32>()
    }

    /// The choice that a number in 0..1 falls on.
    pub fn sample(&self, unit: f32) -> usize {
        let mut left = unit;
        for (k, l) in self.log_probabilities.iter().enumerate() {
            left -= math::exp(*l);
            if left < 0.0 {
                return k;
            }
        }
        self.most_likely()
    }

    /// The likeliest choice, of equal ones the first.
    pub fn most_likely(&self) -> usize {
        let mut best = 0;
        for (k, l) in self.log_probabilities.iter().enumerate() {
            if *l > self.log_probabilities[best] {
                best = k;
            }
        }
        best
    }
}

/// The gradient of a loss by what a network says of a decision.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BySaid {
    /// By each choice's logit.
    pub logits: Vec<f32>,
    /// By what it says of the state.
    pub of_state: Vec<f32>,
}

/// Takes a step along the mean gradient of a batch of samples, whose parts are worked on side by side. `gradient` gives
/// that of one sample, times the share of it that is its third argument, and adds what it was like to the fourth;
/// that is given back for each part.
pub fn step<M: ActorCritic, S: Sync, T: Default + Send>(
    model: &M,
    (learner, adam, rate): (&mut Learner, &AdamRules, f32),
    batch: &[&S],
    seen_of: impl Fn(&S) -> &M::Seen + Sync,
    gradient: impl Fn(&S, &Said, f32, &mut T) -> BySaid + Sync,
) -> Vec<T> {
    let n_parts = learner.shards();
    let of_part = batch.len().div_ceil(n_parts);
    // The learner takes the mean over parts.
    let share = n_parts as f32 / batch.len() as f32;
    let work = |k: usize, numbers: &[f32], pass: &mut Pass, by: &mut [f32]| {
        let from = (k * of_part).min(batch.len());
        let samples = &batch[from..(from + of_part).min(batch.len())];
        let mut told = T::default();
        if samples.is_empty() {
            return Some(told);
        }
        let said = model.forward(numbers, samples.iter().map(|s| seen_of(s)), pass);
        let by_said: Vec<BySaid> = samples
            .iter()
            .zip(&said)
            .map(|(s, said)| gradient(s, said, share, &mut told))
            .collect();
        model.backward(numbers, &by_said, pass, by);
        Some(told)
    };
    learner.step(model.network(), (adam, rate), work).expect("no shard stops")
}

/// Logarithms of the probabilities that logits stand for.
pub fn log_softmax(logits: &[f32]) -> Vec<f32> {
    let most = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let sum: f32 = logits.iter().map(|l| math::exp(l - most)).sum();
    let log_sum = most + math::ln(sum);
    logits.iter().map(|l| l - log_sum).collect()
}
