//! Elementwise operations, compiled for the widest vectors, and copies of rows: nearest-neighbor
//! upsampling and neighbors in sequences.

use std::ops::Range;

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

/// Concatenates the channels of the previous, the same and the next row of sequences of `length` rows;
/// zeros stand for rows outside of a sequence.
///
/// # Panics
/// If the rows are not whole sequences.
pub(crate) fn concat_neighbors(rows: &Tensor, length: usize, out: &mut [f32]) {
    let channels = rows.shape.channels;
    assert!(rows.shape.pixels().is_multiple_of(length), "rows are not sequences of {length}");
    out.fill(0.0);
    let sequences = rows.data.chunks_exact(length * channels);
    for (sequence, out) in sequences.zip(out.chunks_exact_mut(3 * length * channels)) {
        for (from, to) in neighbor_ranges(length, channels) {
            out[to].copy_from_slice(&sequence[from]);
        }
    }
}

/// Adds the gradient of the rows of [`concat_neighbors`], given the gradient of its output.
pub(crate) fn add_neighbor_gradients(gradient: &[f32], length: usize, rows: &mut Tensor) {
    let channels = rows.shape.channels;
    let sequences = rows.data.chunks_exact_mut(length * channels);
    for (sequence, gradient) in sequences.zip(gradient.chunks_exact(3 * length * channels)) {
        for (from, to) in neighbor_ranges(length, channels) {
            sequence[from].iter_mut().zip(&gradient[to]).for_each(|(sum, g)| *sum += g);
        }
    }
}

/// Returns, for each row of a sequence, the range of the row and the ranges of its copies in the
/// output of [`concat_neighbors`].
fn neighbor_ranges(
    length: usize,
    channels: usize,
) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
    let range = move |k: usize| k * channels..(k + 1) * channels;
    (0..length).flat_map(move |row| {
        // This row is the next row of its predecessor, and the previous row of its successor.
        let next_of = row.checked_sub(1).map(|before| 3 * before + 2);
        let previous_of = Some(3 * (row + 1)).filter(|_| row + 1 < length);
        let copies = [next_of, Some(3 * row + 1), previous_of].into_iter().flatten();
        copies.map(move |copy| (range(row), range(copy)))
    })
}
