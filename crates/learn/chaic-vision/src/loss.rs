//! Training loss of the detector: cross entropy of labels and smooth L1 of offsets, weighted so
//! that small objects count as much as large ones.

use chaic_nn::Tensor;

use serde::{Deserialize, Serialize};

use crate::detector::{N_OFFSETS, STRIDE};
use crate::features::ImageCrop;
use crate::labels::{BACKGROUND, half_extents_m};
use crate::views::LabeledView;

/// Weights of the loss.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LossConfig {
    /// Area of an object whose pixels have the weight of background pixels, pixels. Pixels of
    /// smaller objects have more weight, pixels of larger objects less.
    #[serde(alias = "even_px")]
    pub reference_area_px: f32,
    /// Exponent of the ratio of areas.
    #[serde(alias = "power")]
    pub area_exponent: f32,
    /// Minimum and maximum weight of an object's pixel.
    #[serde(alias = "weights")]
    pub weight_range: [f32; 2],
    /// Coefficient of the offset loss, relative to the label loss.
    #[serde(alias = "offset")]
    pub offset_coef: f32,
    /// Objects with fewer visible pixels have zero weight.
    #[serde(alias = "least_px")]
    pub min_px: u32,
}

impl LossConfig {
    /// Values of the bundled detector.
    pub const TRAINING: LossConfig = LossConfig {
        reference_area_px: 8000.0,
        area_exponent: 0.75,
        weight_range: [0.5, 40.0],
        offset_coef: 0.5,
        min_px: 24,
    };
}

impl Default for LossConfig {
    fn default() -> LossConfig {
        LossConfig::TRAINING
    }
}

/// Targets of a crop, at half its resolution.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CropTargets {
    /// Label of each pixel.
    pub labels: Vec<u8>,
    /// Weight of each pixel.
    pub weights: Vec<f32>,
    /// Offsets to the center of the visible part of the object, shape [pixels, 3]; 0 for the
    /// background.
    pub offsets: Vec<[f32; 3]>,
}

/// Raises `x` to an exponent between 0 and 1 by repeated square roots, with equal rounding on every
/// machine.
fn power(x: f32, exponent: f32) -> f32 {
    let (mut result, mut root, mut remaining) = (1.0, x, exponent);
    for _ in 0..8 {
        root = root.sqrt();
        remaining *= 2.0;
        if remaining >= 1.0 {
            result *= root;
            remaining -= 1.0;
        }
    }
    result
}

impl CropTargets {
    /// Appends the targets of a crop.
    pub fn add(&mut self, view: &LabeledView, crop: ImageCrop, config: &LossConfig) {
        let width = view.camera.width as usize;
        let focal = view.camera.focal_px();
        let half = [view.camera.width, view.camera.height].map(|n| 0.5 * n as f32);
        // Points are in the camera's frame: x right, y up, z towards the camera.
        let point = |k: usize| {
            let depth = view.depth_m[k];
            let u = (k % width) as f32 + 0.5 - half[0];
            let v = (k / width) as f32 + 0.5 - half[1];
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
                let k = (crop.origin[1] + j) * width + crop.origin[0] + i;
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
                    weight = if config.reference_area_px > n as f32 {
                        power(config.reference_area_px / n as f32, config.area_exponent)
                    } else {
                        1.0 / power(n as f32 / config.reference_area_px, config.area_exponent)
                    };
                    weight = weight.clamp(config.weight_range[0], config.weight_range[1]);
                    if n < config.min_px {
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

/// Loss of a forward pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loss {
    /// Weighted mean of the cross entropy.
    pub labels: f64,
    /// Weighted mean of the offset loss.
    pub offsets: f64,
    /// Weighted fraction of pixels with the correct label.
    pub accuracy: f64,
    /// Weighted fraction of object pixels with the correct label.
    pub object_accuracy: f64,
}

/// Returns the exponential of a non-positive number by repeated squaring, with equal rounding on
/// every machine.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    // (1 + x / 1024) ^ 1024 has an error of 0.05 % at -1, and less near 0.
    let mut y = (1.0 + x.max(-80.0) * (1.0 / 1024.0)).max(0.0);
    for _ in 0..10 {
        y *= y;
    }
    y
}

/// Logistic function.
pub(crate) fn sigmoid(x: f32) -> f32 {
    let e = exp(-x.abs());
    if x < 0.0 { e / (1.0 + e) } else { 1.0 / (1.0 + e) }
}

/// Replaces logits by probabilities.
pub(crate) fn softmax(values: &mut [f32]) {
    let max = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    values.iter_mut().for_each(|x| *x = exp(*x - max));
    let sum: f32 = values.iter().sum();
    values.iter_mut().for_each(|x| *x /= sum);
}

/// Natural logarithm of a positive number: inverts [`exp`] by Newton's method.
pub(crate) fn ln(x: f32) -> f32 {
    let mut y = (x.to_bits() as f32 / 8_388_608.0 - 126.94) * std::f32::consts::LN_2;
    for _ in 0..2 {
        let e = exp(-y.abs());
        let e = if y > 0.0 { 1.0 / e } else { e };
        y += (x - e) / e;
    }
    y
}

/// Computes the loss of the head's output and its gradient.
pub fn loss(
    head: &Tensor,
    targets: &CropTargets,
    config: &LossConfig,
    gradient: &mut Tensor,
) -> Loss {
    let channels = head.shape.channels;
    let n_labels = channels - N_OFFSETS;
    let total_weight: f32 = targets.weights.iter().sum::<f32>().max(1.0);
    let normalizer = 1.0 / total_weight;
    let mut loss = Loss::default();
    let mut object_weight = 1e-9;
    for (k, label) in targets.labels.iter().enumerate() {
        let weight = targets.weights[k] * normalizer;
        let (row, offset) = head.data[k * channels..][..channels].split_at(n_labels);
        let (out, gradient) = gradient.data[k * channels..][..channels].split_at_mut(n_labels);
        let max = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let mut sum = 0.0;
        for (out, x) in out.iter_mut().zip(row) {
            *out = exp(x - max);
            sum += *out;
        }
        let target = usize::from(*label);
        let is_correct = row[target] >= max;
        loss.labels += f64::from(weight * (ln(sum) + max - row[target]));
        loss.accuracy += f64::from(weight) * f64::from(u8::from(is_correct));
        let scale = weight / sum;
        out.iter_mut().for_each(|x| *x *= scale);
        out[target] -= weight;
        gradient.fill(0.0);
        if *label == BACKGROUND {
            continue;
        }
        object_weight += f64::from(weight);
        loss.object_accuracy += f64::from(weight) * f64::from(u8::from(is_correct));
        for (axis, gradient) in gradient.iter_mut().enumerate() {
            // Smooth L1: quadratic within 0.1, linear beyond.
            const SMOOTH: f32 = 0.1;
            let error = offset[axis] - targets.offsets[k][axis];
            let size = error.abs();
            let value =
                if size < SMOOTH { 0.5 * size * size / SMOOTH } else { size - 0.5 * SMOOTH };
            loss.offsets += f64::from(weight * value);
            *gradient = config.offset_coef * weight * (error / SMOOTH).clamp(-1.0, 1.0);
        }
    }
    loss.object_accuracy /= object_weight;
    loss
}
