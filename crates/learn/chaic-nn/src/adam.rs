//! AdamW (Loshchilov and Hutter 2019): steps by running means of gradients, with weight decay apart.

use serde::{Deserialize, Serialize};

use crate::network::Network;

/// How steps are taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AdamRules {
    /// How fast the mean of gradients forgets.
    pub beta1: f32,
    /// How fast the mean of their squares forgets.
    pub beta2: f32,
    /// Added to the root of the mean square.
    pub epsilon: f32,
    /// By how much weights of convolutions shrink in a step, times the rate.
    pub weight_decay: f32,
    /// Gradients longer than this, as one vector, are shortened to it.
    pub clip_norm: f32,
}

impl Default for AdamRules {
    fn default() -> AdamRules {
        AdamRules { beta1: 0.9, beta2: 0.99, epsilon: 1e-8, weight_decay: 0.02, clip_norm: 10.0 }
    }
}

/// What AdamW remembers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Adam {
    /// Steps taken.
    pub steps: u64,
    /// Running mean of gradients.
    pub mean: Vec<f32>,
    /// Running mean of their squares.
    pub square: Vec<f32>,
    /// `beta1` and `beta2` to the power of `steps`: below 1 after the first step.
    pub powers: [f64; 2],
}

impl Adam {
    /// Before the first step.
    pub fn new(n_numbers: usize) -> Adam {
        Adam {
            steps: 0,
            mean: vec![0.0; n_numbers],
            square: vec![0.0; n_numbers],
            powers: [1.0; 2],
        }
    }

    /// Takes a step, and tells the length of the gradient before it was shortened.
    pub fn step(
        &mut self,
        rules: &AdamRules,
        rate: f32,
        network: &Network,
        numbers: &mut [f32],
        gradient: &[f32],
    ) -> f32 {
        let length =
            gradient.iter().map(|g| f64::from(*g) * f64::from(*g)).sum::<f64>().sqrt() as f32;
        let shrink = if length > rules.clip_norm { rules.clip_norm / length } else { 1.0 };
        self.steps += 1;
        self.powers[0] *= f64::from(rules.beta1);
        self.powers[1] *= f64::from(rules.beta2);
        let [by1, by2] = self.powers.map(|p| (1.0 / (1.0 - p)) as f32);
        for parameter in network.parameters() {
            let decay = if parameter.decays { rate * rules.weight_decay } else { 0.0 };
            for k in parameter.range.clone() {
                let g = gradient[k] * shrink;
                self.mean[k] += (1.0 - rules.beta1) * (g - self.mean[k]);
                self.square[k] += (1.0 - rules.beta2) * (g * g - self.square[k]);
                let root = (self.square[k] * by2).sqrt() + rules.epsilon;
                numbers[k] -= decay * numbers[k] + rate * (self.mean[k] * by1) / root;
            }
        }
        length
    }
}
