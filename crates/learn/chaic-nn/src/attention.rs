//! Multi-head scaled dot-product attention within groups of rows (Vaswani et al. 2017).

use chaic_core::geom::math;

/// Attention layer of one batch. Each row attends to the rows of its own group. All arrays have
/// shape [rows, channels]; each head covers `channels / n_heads` neighboring channels.
pub(crate) struct Attention<'a> {
    pub query: &'a [f32],
    pub key: &'a [f32],
    pub value: &'a [f32],
    pub channels: usize,
    pub n_heads: usize,
    /// Numbers of consecutive rows per group.
    pub groups: &'a [usize],
}

/// Gradients of the inputs of an attention layer, shape [rows, channels].
#[derive(Clone, Debug, Default)]
pub(crate) struct AttentionGrad {
    pub query: Vec<f32>,
    pub key: Vec<f32>,
    pub value: Vec<f32>,
}

impl Attention<'_> {
    /// Calls `f(first row, number of rows, first channel, offset of the weights)` for each group
    /// and head.
    fn for_each_head(&self, mut f: impl FnMut(usize, usize, usize, usize)) {
        let head_channels = self.channels / self.n_heads;
        let (mut first_row, mut first_weight) = (0, 0);
        for n in self.groups {
            for head in 0..self.n_heads {
                f(first_row, *n, head * head_channels, first_weight);
                first_weight += n * n;
            }
            first_row += n;
        }
    }

    /// Returns the index range of the channels that one head reads in a row.
    fn head(&self, row: usize, first_channel: usize) -> std::ops::Range<usize> {
        let start = row * self.channels + first_channel;
        start..start + self.channels / self.n_heads
    }

    /// Returns the factor of the dot products, 1 / sqrt(channels per head).
    fn scale(&self) -> f32 {
        1.0 / ((self.channels / self.n_heads) as f32).sqrt()
    }

    /// Computes the output, and the weights for the backward pass: for each group and head, shape
    /// [rows, rows].
    pub fn forward(&self, out: &mut [f32], weights: &mut Vec<f32>) {
        weights.clear();
        weights.resize(self.groups.iter().map(|n| n * n * self.n_heads).sum(), 0.0);
        out.fill(0.0);
        let scale = self.scale();
        self.for_each_head(|first_row, n, channel, first_weight| {
            for i in 0..n {
                let weights = &mut weights[first_weight + i * n..][..n];
                let query = &self.query[self.head(first_row + i, channel)];
                for (j, weight) in weights.iter_mut().enumerate() {
                    *weight = scale * dot(query, &self.key[self.head(first_row + j, channel)]);
                }
                softmax(weights);
                let out = &mut out[self.head(first_row + i, channel)];
                for (j, weight) in weights.iter().enumerate() {
                    add_scaled(out, *weight, &self.value[self.head(first_row + j, channel)]);
                }
            }
        });
    }

    /// Computes the gradients of the inputs, given the weights of the forward pass and the gradient
    /// of the output.
    pub fn backward(&self, weights: &[f32], grad_out: &[f32], grad: &mut AttentionGrad) {
        for (values, input) in [
            (&mut grad.query, self.query),
            (&mut grad.key, self.key),
            (&mut grad.value, self.value),
        ] {
            values.clear();
            values.resize(input.len(), 0.0);
        }
        let scale = self.scale();
        let mut grad_weights = Vec::new();
        self.for_each_head(|first_row, n, channel, first_weight| {
            for i in 0..n {
                let weights = &weights[first_weight + i * n..][..n];
                let grad_out = &grad_out[self.head(first_row + i, channel)];
                grad_weights.clear();
                for (j, weight) in weights.iter().enumerate() {
                    let range = self.head(first_row + j, channel);
                    grad_weights.push(dot(grad_out, &self.value[range.clone()]));
                    add_scaled(&mut grad.value[range], *weight, grad_out);
                }
                let mean = dot(weights, &grad_weights);
                let query = self.head(first_row + i, channel);
                for (j, weight) in weights.iter().enumerate() {
                    let grad_score = scale * weight * (grad_weights[j] - mean);
                    let key = self.head(first_row + j, channel);
                    add_scaled(&mut grad.query[query.clone()], grad_score, &self.key[key.clone()]);
                    add_scaled(&mut grad.key[key], grad_score, &self.query[query.clone()]);
                }
            }
        });
    }
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Adds `factor * from` to `to`.
fn add_scaled(to: &mut [f32], factor: f32, from: &[f32]) {
    to.iter_mut().zip(from).for_each(|(to, x)| *to += factor * x);
}

/// Replaces logits by their softmax.
fn softmax(logits: &mut [f32]) {
    let max = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    logits.iter_mut().for_each(|x| *x = math::exp(*x - max));
    let sum: f32 = logits.iter().sum();
    logits.iter_mut().for_each(|x| *x /= sum);
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::rng::RngStream;

    fn output(rows: &[f32], groups: &[usize]) -> Vec<f32> {
        let attention =
            Attention { query: rows, key: rows, value: rows, channels: 4, n_heads: 2, groups };
        let mut out = vec![0.0; rows.len()];
        attention.forward(&mut out, &mut Vec::new());
        out
    }

    #[test]
    fn rows_attend_to_their_own_group_in_any_order() {
        let mut rng = RngStream::new(1, "rows", 0);
        let rows: Vec<f32> = (0..20).map(|_| rng.range(-2.0, 2.0)).collect();
        let both = output(&rows, &[2, 3]);
        assert_eq!(both[..8], output(&rows[..8], &[2]));
        assert_eq!(both[8..], output(&rows[8..], &[3]));
        let swapped = [&rows[4..8], &rows[..4]].concat();
        let expected = [&both[4..8], &both[..4]].concat();
        let close = |a: &f32, b: &f32| (a - b).abs() < 1e-6;
        assert!(output(&swapped, &[2]).iter().zip(&expected).all(|(a, b)| close(a, b)));
        // A row alone attends to itself.
        assert_eq!(output(&rows[..4], &[1]), rows[..4]);
    }
}
