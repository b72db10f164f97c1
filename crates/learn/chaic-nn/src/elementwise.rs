//! Elementwise operations, compiled for the widest vectors, and nearest-neighbor upsampling.

use crate::tensor::{Shape, Tensor};

/// Adds one slice to another.
pub(crate) struct AddTo<'a> {
    pub to: &'a mut [f32],
    pub from: &'a [f32],
}

impl pulp::NullaryFnOnce for AddTo<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (to, from) in self.to.iter_mut().zip(self.from) {
            *to += from;
        }
    }
}

/// Sum of two slices.
pub(crate) struct Sum<'a> {
    pub a: &'a [f32],
    pub b: &'a [f32],
    pub out: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Sum<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for ((out, a), b) in self.out.iter_mut().zip(self.a).zip(self.b) {
            *out = a + b;
        }
    }
}

/// ReLU.
pub(crate) struct Relu<'a> {
    pub input: &'a [f32],
    pub out: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Relu<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (out, x) in self.out.iter_mut().zip(self.input) {
            *out = if *x > 0.0 { *x } else { 0.0 };
        }
    }
}

/// Zeroes a gradient where the output of a ReLU is zero.
pub(crate) struct ReluGrad<'a> {
    pub gradient: &'a mut [f32],
    pub activation: &'a [f32],
}

impl pulp::NullaryFnOnce for ReluGrad<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (g, y) in self.gradient.iter_mut().zip(self.activation) {
            *g = if *y > 0.0 { *g } else { 0.0 };
        }
    }
}

/// Upsamples rows of shape [rows, width, channels] by 2 (nearest neighbor).
pub(crate) fn upsample(map: &[f32], width: usize, channels: usize, out: &mut [f32]) {
    let rows = map.chunks_exact(width * channels);
    for (row, row_pair) in rows.zip(out.chunks_exact_mut(4 * width * channels)) {
        let (first, second) = row_pair.split_at_mut(2 * width * channels);
        for (pixel, pixel_pair) in
            row.chunks_exact(channels).zip(first.chunks_exact_mut(2 * channels))
        {
            pixel_pair[..channels].copy_from_slice(pixel);
            pixel_pair[channels..].copy_from_slice(pixel);
        }
        second.copy_from_slice(first);
    }
}

/// Adds the gradient of the input of [`upsample`], given the gradient of its output.
pub(crate) fn downsample(gradient: &Tensor, out: &mut Tensor) {
    let Shape { width, channels, .. } = out.shape;
    let rows = out.data.chunks_exact_mut(width * channels);
    for (row, row_pair) in rows.zip(gradient.data.chunks_exact(4 * width * channels)) {
        let (first, second) = row_pair.split_at(2 * width * channels);
        let pairs = first.chunks_exact(2 * channels).zip(second.chunks_exact(2 * channels));
        for (pixel, (above, below)) in row.chunks_exact_mut(channels).zip(pairs) {
            for c in 0..channels {
                let sum = (above[c] + above[channels + c]) + (below[c] + below[channels + c]);
                pixel[c] += sum;
            }
        }
    }
}
