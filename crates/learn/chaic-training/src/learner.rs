//! Parameters of a network during training, and data-parallel optimizer steps.

use std::thread;

use chaic_nn::simd::widest;
use chaic_nn::{AdamW, AdamWConfig, Network, TrainingPass};

use crate::checkpoint::{Checkpoint, CheckpointError};

/// Weight of the new parameters in the exponential moving average, late in a training. Early in a
/// training the weight is larger.
const EMA_RATE: f32 = 0.002;

/// Sections of a checkpoint.
const PARAMETERS: &str = "learner.parameters";
const EMA_PARAMETERS: &str = "learner.average";
const EXP_AVG: &str = "adam.exp_avg";
const EXP_AVG_SQ: &str = "adam.exp_avg_sq";
const OPTIMIZER_STEPS: &str = "adam.steps";
const BETA_POWERS: &str = "adam.beta_powers";
/// Maximum number of optimizer steps in a checkpoint: more than any training reaches, and far from
/// overflow.
const MAX_OPTIMIZER_STEPS: u64 = 1 << 48;

/// Parameters, their moving average and the optimizer, with a gradient buffer per shard.
pub struct Learner {
    /// Parameters of the network.
    pub parameters: Vec<f32>,
    /// Exponential moving average of the parameters; trainers of perception and opponent models
    /// export it.
    pub ema_parameters: Vec<f32>,
    /// Optimizer.
    pub adam: AdamW,
    /// Buffers of the shards.
    shards: Vec<Shard>,
}

/// Activations and gradient of one shard of a batch.
struct Shard {
    pass: TrainingPass,
    grad_parameters: Vec<f32>,
}

/// State of parameters and optimizer at one step.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnerState {
    parameters: Vec<f32>,
    ema_parameters: Vec<f32>,
    adam: AdamW,
}

impl Learner {
    /// Creates a learner with random parameters, whose batches are split into this many shards.
    pub fn new(network: &Network, seed: u64, n_shards: usize) -> Learner {
        let parameters = network.init_parameters(seed);
        let adam = AdamW::new(parameters.len());
        let shard = |_| Shard {
            pass: TrainingPass::new(network, widest()),
            grad_parameters: vec![0.0; parameters.len()],
        };
        let shards = (0..n_shards).map(shard).collect();
        Learner { ema_parameters: parameters.clone(), parameters, adam, shards }
    }

    /// Returns the number of shards of a batch, which run in parallel.
    pub fn n_shards(&self) -> usize {
        self.shards.len()
    }

    /// Replaces the parameters before the first step.
    pub fn load_parameters(&mut self, parameters: Vec<f32>) {
        self.ema_parameters.clone_from(&parameters);
        self.parameters = parameters;
    }

    /// Returns a copy of the state of parameters and optimizer, for [`Learner::set_state`].
    pub fn state(&self) -> LearnerState {
        LearnerState {
            parameters: self.parameters.clone(),
            ema_parameters: self.ema_parameters.clone(),
            adam: self.adam.clone(),
        }
    }

    /// Restores a state of the same network.
    pub fn set_state(&mut self, state: LearnerState) {
        let LearnerState { parameters, ema_parameters, adam } = state;
        (self.parameters, self.ema_parameters, self.adam) = (parameters, ema_parameters, adam);
    }

    /// Adds the state of parameters and optimizer to a checkpoint.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        self.save_as("", checkpoint);
    }

    /// As [`Learner::save`], with a prefix to the names of the sections, so that a checkpoint holds
    /// several learners.
    pub fn save_as(&self, prefix: &str, checkpoint: &mut Checkpoint) {
        let name = |section: &str| format!("{prefix}{section}");
        checkpoint.insert_floats(&name(PARAMETERS), self.parameters.clone());
        checkpoint.insert_floats(&name(EMA_PARAMETERS), self.ema_parameters.clone());
        checkpoint.insert_floats(&name(EXP_AVG), self.adam.exp_avg.clone());
        checkpoint.insert_floats(&name(EXP_AVG_SQ), self.adam.exp_avg_sq.clone());
        checkpoint.insert_integers(&name(OPTIMIZER_STEPS), vec![self.adam.steps]);
        checkpoint.insert_doubles(&name(BETA_POWERS), self.adam.beta_powers.to_vec());
    }

    /// Restores the state of parameters and optimizer from a checkpoint; on an error nothing
    /// changes.
    ///
    /// # Errors
    /// [`CheckpointError::Section`] if a section is missing, has another length, or holds values
    /// that no optimizer can reach.
    pub fn load(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.load_as("", checkpoint)
    }

    /// Restores the state of [`Learner::save_as`]; on an error nothing changes.
    ///
    /// # Errors
    /// As [`Learner::load`].
    pub fn load_as(
        &mut self,
        prefix: &str,
        checkpoint: &Checkpoint,
    ) -> Result<(), CheckpointError> {
        let name = |section: &str| format!("{prefix}{section}");
        let floats = |section: &str| {
            checkpoint.floats(&name(section), self.parameters.len()).map(<[f32]>::to_vec)
        };
        let (parameters, ema_parameters) = (floats(PARAMETERS)?, floats(EMA_PARAMETERS)?);
        let (exp_avg, exp_avg_sq) = (floats(EXP_AVG)?, floats(EXP_AVG_SQ)?);
        if exp_avg_sq.iter().any(|x| *x < 0.0) {
            return Err(CheckpointError::section(&name(EXP_AVG_SQ), "has a negative value"));
        }
        let steps = checkpoint.integer(&name(OPTIMIZER_STEPS))?;
        if steps > MAX_OPTIMIZER_STEPS {
            return Err(CheckpointError::section(&name(OPTIMIZER_STEPS), format!("is {steps}")));
        }
        let beta_powers: Option<[f64; 2]> = checkpoint.doubles(&name(BETA_POWERS))?.try_into().ok();
        let is_reachable = |powers: &[f64; 2]| match steps {
            0 => *powers == [1.0; 2],
            _ => powers.iter().all(|p| (0.0..1.0).contains(p)),
        };
        let Some(beta_powers) = beta_powers.filter(is_reachable) else {
            return Err(CheckpointError::section(&name(BETA_POWERS), "has impossible values"));
        };
        (self.parameters, self.ema_parameters) = (parameters, ema_parameters);
        self.adam = AdamW { steps, exp_avg, exp_avg_sq, beta_powers };
        Ok(())
    }

    /// Returns a checkpoint of the learner with a step counter in a section of its own.
    pub fn checkpoint(&self, counter: &str, steps: u64) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        checkpoint.insert_integers(counter, vec![steps]);
        self.save(&mut checkpoint);
        checkpoint
    }

    /// Restores a [`Learner::checkpoint`] and returns its step counter; on an error nothing
    /// changes.
    ///
    /// # Errors
    /// As [`Learner::load`].
    pub fn restore(
        &mut self,
        checkpoint: &Checkpoint,
        counter: &str,
    ) -> Result<u64, CheckpointError> {
        let steps = checkpoint.integer(counter)?;
        self.load(checkpoint)?;
        Ok(steps)
    }

    /// Applies one optimizer step along the mean gradient of the shards.
    ///
    /// `shard_gradient(shard, parameters, pass, grad_parameters)` adds the gradient of one shard to
    /// a zeroed buffer; shards run in parallel threads. Returns the results in order of shards.
    /// Returns `None` and changes nothing if a shard returns `None`.
    pub fn step<R: Send>(
        &mut self,
        network: &Network,
        config: &AdamWConfig,
        learning_rate: f32,
        shard_gradient: impl Fn(usize, &[f32], &mut TrainingPass, &mut [f32]) -> Option<R> + Sync,
    ) -> Option<Vec<R>> {
        self.step_if(network, config, learning_rate, shard_gradient, |_| true)
    }

    /// As [`Learner::step`], but changes the parameters only if `accepts` returns true for the
    /// results.
    pub fn step_if<R: Send>(
        &mut self,
        network: &Network,
        config: &AdamWConfig,
        learning_rate: f32,
        shard_gradient: impl Fn(usize, &[f32], &mut TrainingPass, &mut [f32]) -> Option<R> + Sync,
        accepts: impl FnOnce(&[R]) -> bool,
    ) -> Option<Vec<R>> {
        let (parameters, shard_gradient) = (&self.parameters[..], &shard_gradient);
        let results: Option<Vec<R>> = thread::scope(|scope| {
            let handles: Vec<_> = self
                .shards
                .iter_mut()
                .enumerate()
                .map(|(k, shard)| {
                    scope.spawn(move || {
                        shard.grad_parameters.fill(0.0);
                        shard_gradient(k, parameters, &mut shard.pass, &mut shard.grad_parameters)
                    })
                })
                .collect();
            // All threads are joined, even if the first one returned `None`.
            let results: Vec<Option<R>> = handles
                .into_iter()
                .map(|handle| handle.join().expect("the closure does not panic"))
                .collect();
            results.into_iter().collect()
        });
        let results = results?;
        if !accepts(&results) {
            return Some(results);
        }
        let fraction = 1.0 / self.shards.len() as f32;
        let (first, other_shards) =
            self.shards.split_first_mut().expect("there is at least one shard");
        let gradient = &mut first.grad_parameters;
        for other in other_shards {
            gradient.iter_mut().zip(&other.grad_parameters).for_each(|(sum, g)| *sum += g);
        }
        gradient.iter_mut().for_each(|g| *g *= fraction);
        self.adam.step(config, learning_rate, network, &mut self.parameters, gradient);
        // Early on the average covers about the last eighth of the steps, so that the initial
        // parameters fade.
        let rate = EMA_RATE.max(8.0 / (self.adam.steps as f32 + 8.0));
        for (mean, x) in self.ema_parameters.iter_mut().zip(&self.parameters) {
            *mean += rate * (x - *mean);
        }
        Some(results)
    }
}

/// Returns the learning rate of a step: linear warm-up to `peak`, then quadratic decay to a
/// hundredth of it at the last step.
pub fn learning_rate_at(step: u64, peak: f32, warm_up: u64, total_steps: u64) -> f32 {
    let rise = ((step + 1) as f32 / warm_up as f32).min(1.0);
    let remaining = 1.0 - (step as f32 / total_steps as f32).min(1.0);
    peak * rise * (0.01 + 0.99 * remaining * remaining)
}
