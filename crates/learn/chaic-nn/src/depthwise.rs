//! Depthwise convolutions of stride 1 with zero padding: each channel has its own square kernel.
//! Sums are chains of fused multiply-adds over the kernel, row by row.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use crate::tensor::{Shape, TensorView};

/// The number of channels must be a multiple of this value, so that it fills whole vectors on every
/// machine.
pub const CHANNEL_MULTIPLE: usize = 16;

/// Row of zeros, read above and below a map.
#[derive(Clone, Debug, Default)]
pub struct ZeroRow(Vec<f32>);

impl ZeroRow {
    fn row(&mut self, shape: Shape) -> &[f32] {
        self.0.resize(shape.width * shape.channels, 0.0);
        &self.0
    }
}

/// Buffer for one map with zero padding.
#[derive(Clone, Debug, Default)]
pub struct PaddedMap(Vec<f32>);

impl PaddedMap {
    fn fill(&mut self, map: &[f32], shape: Shape, border: usize) -> &[f32] {
        let padded_row_len = (shape.width + 2 * border) * shape.channels;
        self.0.resize((shape.height + 2 * border) * padded_row_len, 0.0);
        let (row_len, edge) = (shape.width * shape.channels, border * shape.channels);
        for (k, to) in self.0.chunks_exact_mut(padded_row_len).enumerate() {
            match k.checked_sub(border).filter(|y| *y < shape.height) {
                Some(y) => {
                    to[..edge].fill(0.0);
                    to[edge..][..row_len].copy_from_slice(&map[y * row_len..][..row_len]);
                    to[edge + row_len..].fill(0.0);
                }
                None => to.fill(0.0),
            }
        }
        &self.0
    }
}

fn check(shape: Shape, weights: &[f32], kernel_size: usize) {
    assert!(kernel_size == 3 || kernel_size == 5, "kernel size {kernel_size} is neither 3 nor 5");
    let n = kernel_size * kernel_size * shape.channels;
    assert_eq!(weights.len(), n, "the weights have the wrong length");
    assert!(shape.channels.is_multiple_of(CHANNEL_MULTIPLE), "{} channels", shape.channels);
}

/// Convolves one map with weights of shape [kernel size, kernel size, channels].
///
/// # Panics
/// If a slice does not have the length of its shape, or the kernel size is neither 3 nor 5.
pub fn forward(
    arch: Arch,
    map: TensorView<'_>,
    weights: &[f32],
    kernel_size: usize,
    out: &mut [f32],
    zeros: &mut ZeroRow,
) {
    forward_rows(arch, map, weights, kernel_size, out, 0..map.shape.height, zeros);
}

/// Computes some rows of the output of [`forward`].
///
/// # Panics
/// As [`forward`].
pub(crate) fn forward_rows(
    arch: Arch,
    map: TensorView<'_>,
    weights: &[f32],
    kernel_size: usize,
    out: &mut [f32],
    rows: Range<usize>,
    zeros: &mut ZeroRow,
) {
    let TensorView { data: map, shape } = map;
    check(shape, weights, kernel_size);
    assert_eq!(map.len(), shape.len_per_item());
    assert_eq!(out.len(), rows.len() * shape.width * shape.channels);
    let zeros = zeros.row(shape);
    let is_flipped = false;
    arch.dispatch(Forward { map, shape, weights, kernel_size, out, rows, zeros, is_flipped });
}

/// Writes the gradient of the input, given the gradient of the output.
///
/// # Panics
/// As [`forward`].
pub fn backward_input(
    arch: Arch,
    grad_output: TensorView<'_>,
    weights: &[f32],
    kernel_size: usize,
    grad_input: &mut [f32],
    zeros: &mut ZeroRow,
) {
    let TensorView { data: map, shape } = grad_output;
    check(shape, weights, kernel_size);
    assert_eq!((map.len(), grad_input.len()), (shape.len_per_item(), shape.len_per_item()));
    let (out, rows, zeros) = (grad_input, 0..shape.height, zeros.row(shape));
    let is_flipped = true;
    arch.dispatch(Forward { map, shape, weights, kernel_size, out, rows, zeros, is_flipped });
}

/// Adds the gradient of the weights, given the input and the gradient of the output.
///
/// # Panics
/// As [`forward`].
pub fn backward_weights(
    arch: Arch,
    input: TensorView<'_>,
    grad_output: &[f32],
    grad_weights: &mut [f32],
    kernel_size: usize,
    padded: &mut PaddedMap,
) {
    let TensorView { data: map, shape } = input;
    check(shape, grad_weights, kernel_size);
    assert_eq!((map.len(), grad_output.len()), (shape.len_per_item(), shape.len_per_item()));
    let map = padded.fill(map, shape, kernel_size / 2);
    arch.dispatch(BackwardWeights { map, grad_output, shape, grad_weights, kernel_size });
}

struct Forward<'a> {
    map: &'a [f32],
    shape: Shape,
    weights: &'a [f32],
    kernel_size: usize,
    out: &'a mut [f32],
    /// Output rows that `out` holds.
    rows: Range<usize>,
    /// One row of zeros.
    zeros: &'a [f32],
    /// True if the kernel is rotated by 180 degrees, as in the backward pass.
    is_flipped: bool,
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.kernel_size {
            3 => self.run::<S, 3>(simd),
            _ => self.run::<S, 5>(simd),
        }
    }
}

impl Forward<'_> {
    #[inline(always)]
    fn run<S: Simd, const SIZE: usize>(self, simd: S) {
        let Forward { map, shape, weights, out, rows, zeros, is_flipped, .. } = self;
        let Shape { height, width, channels, .. } = shape;
        let (weights, _) = S::as_simd_f32s(weights);
        let (map, _) = S::as_simd_f32s(map);
        let (zeros, _) = S::as_simd_f32s(zeros);
        let (out, _) = S::as_mut_simd_f32s(out);
        let vectors = channels / S::F32_LANES;
        let (row, border) = (width * vectors, SIZE / 2);
        for (y, out) in rows.zip(out.chunks_exact_mut(row)) {
            for v in 0..vectors {
                let mut kernel = [[simd.splat_f32s(0.0); SIZE]; SIZE];
                for (i, kernel) in kernel.as_flattened_mut().iter_mut().enumerate() {
                    let tap = if is_flipped { SIZE * SIZE - 1 - i } else { i };
                    *kernel = weights[tap * vectors + v];
                }
                let rows: [&[S::f32s]; SIZE] = std::array::from_fn(|dy| {
                    match (y + dy).checked_sub(border).filter(|y| *y < height) {
                        Some(y) => &map[y * row + v..][..row - v],
                        None => &zeros[v..],
                    }
                });
                // Output columns at which the kernel lies inside the map.
                let inner = border.min(width)..width.saturating_sub(border).max(border.min(width));
                for x in inner.clone() {
                    let mut sum = simd.splat_f32s(0.0);
                    for dy in 0..SIZE {
                        for dx in 0..SIZE {
                            let at = rows[dy][(x + dx - border) * vectors];
                            sum = simd.mul_add_f32s(at, kernel[dy][dx], sum);
                        }
                    }
                    out[x * vectors + v] = sum;
                }
                for x in (0..inner.start).chain(inner.end..width) {
                    let mut sum = simd.splat_f32s(0.0);
                    for dy in 0..SIZE {
                        for dx in border.saturating_sub(x)..SIZE.min(width + border - x) {
                            let at = rows[dy][(x + dx - border) * vectors];
                            sum = simd.mul_add_f32s(at, kernel[dy][dx], sum);
                        }
                    }
                    out[x * vectors + v] = sum;
                }
            }
        }
    }
}

struct BackwardWeights<'a> {
    /// Input with zero padding.
    map: &'a [f32],
    grad_output: &'a [f32],
    shape: Shape,
    grad_weights: &'a mut [f32],
    kernel_size: usize,
}

impl WithSimd for BackwardWeights<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.kernel_size {
            3 => self.run::<S, 3>(simd),
            _ => self.run::<S, 5>(simd),
        }
    }
}

impl BackwardWeights<'_> {
    #[inline(always)]
    fn run<S: Simd, const SIZE: usize>(self, simd: S) {
        let BackwardWeights { map, grad_output, shape, grad_weights, .. } = self;
        let Shape { width, channels, .. } = shape;
        let (out, _) = S::as_mut_simd_f32s(grad_weights);
        let (map, _) = S::as_simd_f32s(map);
        let (grad_output, _) = S::as_simd_f32s(grad_output);
        let vectors = channels / S::F32_LANES;
        let row = (width + SIZE - 1) * vectors;
        for (y, grad_row) in grad_output.chunks_exact(width * vectors).enumerate() {
            for dy in 0..SIZE {
                let map = &map[(y + dy) * row..][..row];
                for v in 0..vectors {
                    let taps = dy * SIZE * vectors + v;
                    let mut sums: [S::f32s; SIZE] =
                        std::array::from_fn(|dx| out[taps + dx * vectors]);
                    for x in 0..width {
                        let g = grad_row[x * vectors + v];
                        for (dx, sum) in sums.iter_mut().enumerate() {
                            *sum = simd.mul_add_f32s(map[(x + dx) * vectors + v], g, *sum);
                        }
                    }
                    for (dx, sum) in sums.into_iter().enumerate() {
                        out[taps + dx * vectors] = sum;
                    }
                }
            }
        }
    }
}
