//! Batch normalization: each channel is scaled to mean 0 and variance 1 over a batch, then by a
//! learned scale and shift.

use crate::tensor::Shape;

/// Added to variances.
pub const EPSILON: f32 = 1e-5;

/// What a forward pass leaves for the backward pass and for running statistics.
#[derive(Clone, Debug, Default)]
pub struct Statistics {
    /// Mean of each channel.
    pub mean: Vec<f32>,
    /// Variance of each channel, with n.
    pub variance: Vec<f32>,
}

impl Statistics {
    /// Of maps, shape [pixels, channels].
    pub fn of(map: &[f32], shape: Shape) -> Statistics {
        let channels = shape.channels;
        let n = shape.pixels() as f64;
        let mean: Vec<f32> =
            sums(map, channels, |x, _| x).into_iter().map(|s| (s / n) as f32).collect();
        let squares = sums(map, channels, |x, c| (x - mean[c]) * (x - mean[c]));
        let variance = squares.into_iter().map(|s| (s / n) as f32).collect();
        Statistics { mean, variance }
    }

    /// One over the standard deviation of each channel.
    pub fn inverse_deviation(&self) -> Vec<f32> {
        self.variance.iter().map(|v| 1.0 / (v + EPSILON).sqrt()).collect()
    }
}

/// Sums of `of` over pixels, for each channel: in 32 bits over some pixels, these in 64 bits.
fn sums(map: &[f32], channels: usize, of: impl Fn(f32, usize) -> f32) -> Vec<f64> {
    const AT_ONCE: usize = 64;
    let mut sums = vec![0.0; channels];
    let mut some = vec![0.0; channels];
    for pixels in map.chunks(AT_ONCE * channels) {
        some.fill(0.0);
        for pixel in pixels.chunks_exact(channels) {
            for (c, (sum, x)) in some.iter_mut().zip(pixel).enumerate() {
                *sum += of(*x, c);
            }
        }
        sums.iter_mut().zip(&some).for_each(|(sum, x)| *sum += f64::from(*x));
    }
    sums
}

/// Normalizes, scales and shifts maps into `out`.
pub fn forward(
    map: &[f32],
    statistics: &Statistics,
    (scale, shift): (&[f32], &[f32]),
    out: &mut [f32],
) {
    let inverse = statistics.inverse_deviation();
    let channels = scale.len();
    let factor: Vec<f32> = scale.iter().zip(&inverse).map(|(s, i)| s * i).collect();
    let offset: Vec<f32> =
        (0..channels).map(|c| shift[c] - statistics.mean[c] * factor[c]).collect();
    for (out, map) in out.chunks_exact_mut(channels).zip(map.chunks_exact(channels)) {
        for c in 0..channels {
            out[c] = map[c] * factor[c] + offset[c];
        }
    }
}

/// Adds the gradient by scale and shift, and writes that by the maps in place of that by the result.
pub fn backward(
    map: &[f32],
    shape: Shape,
    statistics: &Statistics,
    scale: &[f32],
    gradient: &mut [f32],
    (by_scale, by_shift): (&mut [f32], &mut [f32]),
) {
    let channels = shape.channels;
    let inverse = statistics.inverse_deviation();
    let mean = &statistics.mean;
    const AT_ONCE: usize = 64;
    let (mut scales, mut shifts) = (vec![0.0_f64; channels], vec![0.0_f64; channels]);
    let (mut some_scales, mut some_shifts) = (vec![0.0; channels], vec![0.0; channels]);
    let chunks = map.chunks(AT_ONCE * channels).zip(gradient.chunks(AT_ONCE * channels));
    for (map, gradient) in chunks {
        some_scales.fill(0.0);
        some_shifts.fill(0.0);
        for (x, g) in map.chunks_exact(channels).zip(gradient.chunks_exact(channels)) {
            for c in 0..channels {
                some_scales[c] += g[c] * ((x[c] - mean[c]) * inverse[c]);
                some_shifts[c] += g[c];
            }
        }
        for c in 0..channels {
            scales[c] += f64::from(some_scales[c]);
            shifts[c] += f64::from(some_shifts[c]);
        }
    }
    let n = shape.pixels() as f64;
    let part = |sums: &[f64]| -> Vec<f32> { sums.iter().map(|s| (s / n) as f32).collect() };
    let (mean_scale, mean_shift) = (part(&scales), part(&shifts));
    for c in 0..channels {
        by_scale[c] += scales[c] as f32;
        by_shift[c] += shifts[c] as f32;
    }
    let factor: Vec<f32> = scale.iter().zip(&inverse).map(|(s, i)| s * i).collect();
    for (x, g) in map.chunks_exact(channels).zip(gradient.chunks_exact_mut(channels)) {
        for c in 0..channels {
            let normal = (x[c] - mean[c]) * inverse[c];
            g[c] = factor[c] * (g[c] - mean_shift[c] - normal * mean_scale[c]);
        }
    }
}
