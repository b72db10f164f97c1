//! Interface of actor-critic networks, and their data-parallel optimizer step.

use chaic_core::geom::math;
use chaic_nn::{AdamWConfig, Network, TrainingPass};
use chaic_training::Learner;

/// Network that computes one logit per action, and state outputs such as the value estimate.
pub trait ActorCritic: Sync {
    /// Input of the network.
    type Observation: Sync;

    /// Returns layers and parameter layout.
    fn network(&self) -> &Network;

    /// Evaluates a batch of observations.
    fn forward<'a>(
        &self,
        parameters: &[f32],
        observations: impl Iterator<Item = &'a Self::Observation> + Clone,
        pass: &mut TrainingPass,
    ) -> Vec<ActorCriticOutput>
    where
        Self::Observation: 'a;

    /// Backpropagates `grad_outputs` of the last forward pass and accumulates parameter gradients
    /// into `grad_parameters`.
    fn backward(
        &self,
        parameters: &[f32],
        grad_outputs: &[OutputGrad],
        pass: &mut TrainingPass,
        grad_parameters: &mut [f32],
    );
}

/// Outputs of an actor-critic network for one observation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActorCriticOutput {
    /// Log-probability of each action.
    pub log_probs: Vec<f32>,
    /// Outputs of the state head. A policy has one of them: the value estimate.
    pub values: Vec<f32>,
}

impl ActorCriticOutput {
    /// Returns the value estimate.
    pub fn value(&self) -> f32 {
        self.values[0]
    }

    /// Returns the entropy of the action distribution, nats.
    pub fn entropy(&self) -> f32 {
        -self.log_probs.iter().map(|l| l * math::exp(*l)).sum::<f32>()
    }

    /// Samples an action from the distribution, given a uniform number in 0..1.
    pub fn sample(&self, unit: f32) -> usize {
        let mut remaining = unit;
        for (k, l) in self.log_probs.iter().enumerate() {
            remaining -= math::exp(*l);
            if remaining < 0.0 {
                return k;
            }
        }
        self.argmax()
    }

    /// Samples an action from the softmax of the logits divided by `temperature`, given a uniform
    /// number in 0..1.
    pub fn sample_at(&self, temperature: f32, unit: f32) -> usize {
        if temperature == 1.0 {
            return self.sample(unit);
        }
        let logits: Vec<f32> = self.log_probs.iter().map(|l| l / temperature).collect();
        let output = ActorCriticOutput { log_probs: log_softmax(&logits), values: Vec::new() };
        output.sample(unit)
    }

    /// Returns the index of the most probable action; the lowest index wins ties.
    pub fn argmax(&self) -> usize {
        let mut best = 0;
        for (k, l) in self.log_probs.iter().enumerate() {
            if *l > self.log_probs[best] {
                best = k;
            }
        }
        best
    }
}

/// Gradient of a loss with respect to the outputs for one observation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OutputGrad {
    /// Gradient with respect to the logits.
    pub logits: Vec<f32>,
    /// Gradient with respect to the outputs of the state head.
    pub values: Vec<f32>,
}

/// Settings of an optimizer step.
#[derive(Clone, Copy, Debug)]
pub struct Optimizer<'a> {
    /// Hyperparameters.
    pub adam: &'a AdamWConfig,
    /// Learning rate.
    pub learning_rate: f32,
}

/// Number of samples per forward pass. A shard accumulates the gradients of its micro-batches. The
/// activations of one micro-batch fit into the CPU cache.
const MICRO_BATCH: usize = 16;

/// Takes one data-parallel optimizer step along the mean gradient of a batch.
///
/// `gradient(sample, output, weight, stats)` returns the output gradient of one sample times
/// `weight`, and adds its statistics to `stats`. The step is taken only if `accepts` returns true
/// for the statistics of all shards, which are returned.
pub fn optimizer_step<M: ActorCritic, S: Sync, T: Default + Send>(
    model: &M,
    learner: &mut Learner,
    optimizer: Optimizer<'_>,
    batch: &[&S],
    observation_of: impl Fn(&S) -> &M::Observation + Sync,
    gradient: impl Fn(&S, &ActorCriticOutput, f32, &mut T) -> OutputGrad + Sync,
    accepts: impl FnOnce(&[T]) -> bool,
) -> Vec<T> {
    let Optimizer { adam, learning_rate } = optimizer;
    let n_shards = learner.n_shards();
    let shard_size = batch.len().div_ceil(n_shards);
    // The learner averages over shards.
    let weight = n_shards as f32 / batch.len() as f32;
    let shard_gradient =
        |k: usize, parameters: &[f32], pass: &mut TrainingPass, grad_parameters: &mut [f32]| {
            let start = (k * shard_size).min(batch.len());
            let samples = &batch[start..(start + shard_size).min(batch.len())];
            let mut stats = T::default();
            for samples in samples.chunks(MICRO_BATCH) {
                let observations = samples.iter().map(|s| observation_of(s));
                let outputs = model.forward(parameters, observations, pass);
                let grad_outputs: Vec<OutputGrad> = samples
                    .iter()
                    .zip(&outputs)
                    .map(|(sample, output)| gradient(sample, output, weight, &mut stats))
                    .collect();
                model.backward(parameters, &grad_outputs, pass, grad_parameters);
            }
            Some(stats)
        };
    learner
        .step_if(model.network(), adam, learning_rate, shard_gradient, accepts)
        .expect("no shard returns None")
}

/// Returns the log-probabilities of a softmax over logits.
pub fn log_softmax(logits: &[f32]) -> Vec<f32> {
    let max = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let sum: f32 = logits.iter().map(|l| math::exp(l - max)).sum();
    let log_sum = max + math::ln(sum);
    logits.iter().map(|l| l - log_sum).collect()
}
