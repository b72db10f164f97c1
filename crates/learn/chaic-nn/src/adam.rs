//! AdamW optimizer (Loshchilov and Hutter 2019).

use serde::{Deserialize, Serialize};

use crate::network::Network;

/// Hyperparameters of AdamW.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AdamWConfig {
    /// Decay rate of the first moment.
    pub beta1: f32,
    /// Decay rate of the second moment.
    pub beta2: f32,
    /// Added to the denominator.
    pub epsilon: f32,
    /// Decoupled weight decay of convolution weights, relative to the learning rate.
    pub weight_decay: f32,
    /// Maximum L2 norm of the whole gradient. Gradients with a larger norm are scaled down to this
    /// norm.
    #[serde(alias = "clip_norm")]
    pub max_grad_norm: f32,
}

impl Default for AdamWConfig {
    fn default() -> AdamWConfig {
        AdamWConfig {
            beta1: 0.9,
            beta2: 0.99,
            epsilon: 1e-8,
            weight_decay: 0.02,
            max_grad_norm: 10.0,
        }
    }
}

/// State of AdamW.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdamW {
    /// Number of steps taken.
    pub steps: u64,
    /// Exponential moving average of the gradients (first moment).
    pub exp_avg: Vec<f32>,
    /// Exponential moving average of the squared gradients (second moment).
    pub exp_avg_sq: Vec<f32>,
    /// `beta1` and `beta2` to the power of `steps`: below 1 after the first step.
    pub beta_powers: [f64; 2],
}

impl AdamW {
    /// Creates the state before the first step.
    pub fn new(n_parameters: usize) -> AdamW {
        AdamW {
            steps: 0,
            exp_avg: vec![0.0; n_parameters],
            exp_avg_sq: vec![0.0; n_parameters],
            beta_powers: [1.0; 2],
        }
    }

    /// Applies one AdamW update; returns the gradient norm before clipping.
    pub fn step(
        &mut self,
        config: &AdamWConfig,
        learning_rate: f32,
        network: &Network,
        parameters: &mut [f32],
        gradient: &[f32],
    ) -> f32 {
        let norm =
            gradient.iter().map(|g| f64::from(*g) * f64::from(*g)).sum::<f64>().sqrt() as f32;
        let factor = if norm > config.max_grad_norm { config.max_grad_norm / norm } else { 1.0 };
        self.steps += 1;
        self.beta_powers[0] *= f64::from(config.beta1);
        self.beta_powers[1] *= f64::from(config.beta2);
        let [correction1, correction2] = self.beta_powers.map(|p| (1.0 / (1.0 - p)) as f32);
        for parameter in network.parameters() {
            let decay =
                if parameter.has_weight_decay { learning_rate * config.weight_decay } else { 0.0 };
            for k in parameter.range.clone() {
                let g = gradient[k] * factor;
                self.exp_avg[k] += (1.0 - config.beta1) * (g - self.exp_avg[k]);
                self.exp_avg_sq[k] += (1.0 - config.beta2) * (g * g - self.exp_avg_sq[k]);
                let denominator = (self.exp_avg_sq[k] * correction2).sqrt() + config.epsilon;
                parameters[k] -= decay * parameters[k]
                    + learning_rate * (self.exp_avg[k] * correction1) / denominator;
            }
        }
        norm
    }
}
