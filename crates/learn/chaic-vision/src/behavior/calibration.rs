//! Calibration of the behavior network's probabilities: prior correction, then temperature scaling.
//!
//! Training batches have about equal numbers of all behaviors, so that the network learns the rare ones.
//! Its outputs are then the probabilities in such batches. What a helper sees is mostly movement, so that it
//! would report many actions that did not happen. The ratio of both frequencies corrects the probabilities
//! (Saerens et al. 2002; logit adjustment, Menon et al. 2021).
//!
//! The frequencies in play are those of all clips that [`collect`](super::collect) finds: each finished
//! action once, and a clip every 72 frames of other time. Helpers classify a clip every 15 frames, but such
//! clips overlap by five sixths, and a behavior is reported at most once in 45 frames.

use super::Behavior;
use super::clip::{Clip, ClipCounts, ClipSet, MIXED_INDEX};
use crate::loss::ln;

const N: usize = Behavior::ALL.len();

/// One value per behavior: logits or probabilities.
pub type BehaviorScores = [f32; Behavior::ALL.len()];

/// Calibration of logits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Factor of the logits before softmax (temperature scaling, Guo et al. 2017).
    pub inverse_temperature: f32,
    /// Addition to each scaled logit: logarithm of the frequency of the behavior in play, divided by that in
    /// training batches.
    pub class_bias: BehaviorScores,
}

impl Default for Calibration {
    /// Returns the identity: probabilities are those in training batches.
    fn default() -> Calibration {
        Calibration { inverse_temperature: 1.0, class_bias: [0.0; N] }
    }
}

impl Calibration {
    /// Returns the probability of each behavior.
    pub fn probabilities(&self, logits: &BehaviorScores) -> BehaviorScores {
        softmax(&std::array::from_fn(|k| self.inverse_temperature * logits[k] + self.class_bias[k]))
    }

    /// Fits a calibration to the logits of clips. `found` of the clips are the frequencies in play,
    /// `batch_fractions` those of training batches. The temperature maximizes the likelihood of the labels, with
    /// weights that make each kind of clips as frequent as in play (golden-section search). Returns the identity
    /// without clips.
    pub fn fit(
        clips: &ClipSet,
        outputs: &[BehaviorScores],
        batch_fractions: &BehaviorScores,
    ) -> Calibration {
        if clips.clips.is_empty() {
            return Calibration::default();
        }
        let class_bias = prior_correction(&clips.found, batch_fractions);
        let weights = clips.weights();
        let loss = |inverse_temperature: f32| -> f64 {
            let calibration = Calibration { inverse_temperature, class_bias };
            let clip_loss = |((clip, output), weight): ((&Clip, &BehaviorScores), &f64)| {
                let p = calibration.probabilities(output)[clip.label.index()];
                -weight * f64::from(ln(p.max(1e-6)))
            };
            clips.clips.iter().zip(outputs).zip(&weights).map(clip_loss).sum()
        };
        let (mut low, mut high) = (0.1f32, 4.0f32);
        for _ in 0..30 {
            let (a, b) = (low + 0.382 * (high - low), low + 0.618 * (high - low));
            if loss(a) < loss(b) { high = b } else { low = a }
        }
        Calibration { inverse_temperature: 0.5 * (low + high), class_bias }
    }
}

/// Returns the logarithm of the ratio of frequencies in play and in training batches, by behavior; 0 for
/// behaviors that no batch has, since the network knows nothing of them. Each count is increased by one, so
/// that a behavior without clips keeps a probability.
fn prior_correction(found: &ClipCounts, batch_fractions: &BehaviorScores) -> BehaviorScores {
    let mut counts: BehaviorScores = std::array::from_fn(|k| found[k] as f32 + 1.0);
    counts[Behavior::Moving.index()] += found[MIXED_INDEX] as f32;
    let total: f32 = counts.iter().sum();
    std::array::from_fn(|k| match batch_fractions[k] > 0.0 {
        true => ln(counts[k] / total / batch_fractions[k]),
        false => 0.0,
    })
}

/// Returns the probabilities of logits.
pub fn softmax(logits: &BehaviorScores) -> BehaviorScores {
    let mut probabilities = *logits;
    crate::loss::softmax(&mut probabilities);
    probabilities
}
