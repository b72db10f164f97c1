//! What the detector learns by: cross entropy of labels, and how far offsets are off, with small things
//! weighing as much as large ones.

use chaic_nn::Tensor;

use serde::{Deserialize, Serialize};

use crate::detector::{N_OFFSETS, STRIDE};
use crate::features::Crop;
use crate::labels::{BACKGROUND, half_extents_m};
use crate::views::LabelledView;

/// How much counts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LossRules {
    /// A pixel of a thing that so many pixels show counts as much as one of the background; of smaller
    /// things more, of larger ones less.
    pub even_px: f32,
    /// By which power of the pixels.
    pub power: f32,
    /// At most and at least.
    pub weights: [f32; 2],
    /// Of offsets beside labels.
    pub offset: f32,
    /// Things that fewer pixels show aren't asked for.
    pub least_px: u32,
}

impl LossRules {
    /// What the detector is trained with.
    pub const TRAINING: LossRules =
        LossRules { even_px: 8000.0, power: 0.75, weights: [0.5, 40.0], offset: 0.5, least_px: 24 };
}

impl Default for LossRules {
    fn default() -> LossRules {
        LossRules::TRAINING
    }
}

/// What the network is to say of a part of an image, at half its resolution.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Targets {
    /// The label of each pixel.
    pub labels: Vec<u8>,
    /// How much each counts.
    pub weights: Vec<f32>,
    /// Offsets to the middle of what is seen of the thing, shape [pixels, 3]; 0 of the background.
    pub offsets: Vec<[f32; 3]>,
}

/// `weight` to a power between 0 and 1 by repeated roots, which every machine rounds alike.
fn power(x: f32, exponent: f32) -> f32 {
    let (mut result, mut root, mut rest) = (1.0, x, exponent);
    for _ in 0..8 {
        root = root.sqrt();
        rest *= 2.0;
        if rest >= 1.0 {
            result *= root;
            rest -= 1.0;
        }
    }
    result
}

impl Targets {
    /// Adds those of a crop.
    pub fn add(&mut self, view: &LabelledView, crop: Crop, rules: &LossRules) {
        let width = view.camera.width as usize;
        let focal = view.camera.focal_px();
        let middle = 0.5 * width as f32;
        // Points in the camera's frame: x right, y up, z towards the eye.
        let point = |k: usize| {
            let depth = view.depth_m[k];
            let (u, v) = ((k % width) as f32 + 0.5 - middle, (k / width) as f32 + 0.5 - middle);
            [u / focal * depth, -v / focal * depth, -depth]
        };
        let mut counts = vec![0u32; view.labels.len()];
        let mut sums = vec![[0.0_f64; 3]; view.labels.len()];
        for (k, id) in view.ids.iter().enumerate() {
            let id = usize::from(*id);
            if view.labels.get(id).is_some_and(|label| *label != BACKGROUND) {
                counts[id] += 1;
                let p = point(k);
                (0..3).for_each(|axis| sums[id][axis] += f64::from(p[axis]));
            }
        }
        let half_extents = half_extents_m();
        let [columns, rows] = crop.size;
        for j in (0..rows).step_by(STRIDE) {
            for i in (0..columns).step_by(STRIDE) {
                let k = (crop.at[1] + j) * width + crop.at[0] + i;
                let id = usize::from(view.ids[k]);
                let label = view.labels.get(id).copied().unwrap_or(BACKGROUND);
                let n = counts.get(id).copied().unwrap_or(0);
                let (mut weight, mut offset) = (1.0, [0.0; 3]);
                if label != BACKGROUND {
                    let scale = 1.0 / half_extents[usize::from(label)];
                    let p = point(k);
                    for axis in 0..3 {
                        let mean = (sums[id][axis] / f64::from(n)) as f32;
                        offset[axis] = (mean - p[axis]) * scale;
                    }
                    weight = if rules.even_px > n as f32 {
                        power(rules.even_px / n as f32, rules.power)
                    } else {
                        1.0 / power(n as f32 / rules.even_px, rules.power)
                    };
                    weight = weight.clamp(rules.weights[0], rules.weights[1]);
                    if n < rules.least_px {
                        weight = 0.0;
                    }
                }
                self.labels.push(label);
                self.weights.push(weight);
                self.offsets.push(offset);
            }
        }
    }
}

/// What a pass is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loss {
    /// Weighted mean of the cross entropy.
    pub labels: f64,
    /// Weighted mean of how far offsets are off.
    pub offsets: f64,
    /// Weighted share of pixels with the right label, and of those of things.
    pub right: f64,
    /// Of pixels that belong to things.
    pub right_of_things: f64,
}

/// The exponential of what is not above 0: by squaring, alike on every machine.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    // (1 + x / 1024) ^ 1024, which is 0.05 % off at -1 and less where it matters more.
    let mut y = (1.0 + x.max(-80.0) * (1.0 / 1024.0)).max(0.0);
    for _ in 0..10 {
        y *= y;
    }
    y
}

/// Natural logarithm of a positive number: the inverse of [`exp`] by Newton's steps.
pub(crate) fn ln(x: f32) -> f32 {
    let mut y = (x.to_bits() as f32 / 8_388_608.0 - 126.94) * std::f32::consts::LN_2;
    for _ in 0..2 {
        let e = exp(-y.abs());
        let e = if y > 0.0 { 1.0 / e } else { e };
        y += (x - e) / e;
    }
    y
}

/// The loss of what the head made, with its gradient.
pub fn loss(head: &Tensor, targets: &Targets, rules: &LossRules, gradient: &mut Tensor) -> Loss {
    let channels = head.shape.channels;
    let n_labels = channels - N_OFFSETS;
    let whole: f32 = targets.weights.iter().sum::<f32>().max(1.0);
    let part = 1.0 / whole;
    let mut loss = Loss::default();
    let mut things = 1e-9;
    for (k, label) in targets.labels.iter().enumerate() {
        let weight = targets.weights[k] * part;
        let (row, offset) = head.data[k * channels..][..channels].split_at(n_labels);
        let (out, gradient) = gradient.data[k * channels..][..channels].split_at_mut(n_labels);
        let most = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let mut sum = 0.0;
        for (out, x) in out.iter_mut().zip(row) {
            *out = exp(x - most);
            sum += *out;
        }
        let own = usize::from(*label);
        let is_right = row[own] >= most;
        loss.labels += f64::from(weight * (ln(sum) + most - row[own]));
        loss.right += f64::from(weight) * f64::from(u8::from(is_right));
        let scale = weight / sum;
        out.iter_mut().for_each(|x| *x *= scale);
        out[own] -= weight;
        gradient.fill(0.0);
        if *label == BACKGROUND {
            continue;
        }
        things += f64::from(weight);
        loss.right_of_things += f64::from(weight) * f64::from(u8::from(is_right));
        for (axis, gradient) in gradient.iter_mut().enumerate() {
            // Smooth: a square within 0.1, straight beyond.
            const WITHIN: f32 = 0.1;
            let error = offset[axis] - targets.offsets[k][axis];
            let size = error.abs();
            let value =
                if size < WITHIN { 0.5 * size * size / WITHIN } else { size - 0.5 * WITHIN };
            loss.offsets += f64::from(weight * value);
            *gradient = rules.offset * weight * (error / WITHIN).clamp(-1.0, 1.0);
        }
    }
    loss.right_of_things /= things;
    loss
}
