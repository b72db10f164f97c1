//! What is done number by number, compiled for the widest vectors; and each pixel twice.

use crate::tensor::{Shape, Tensor};

/// Adds one list to another.
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

/// The sum of two lists.
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

/// The positive part.
pub(crate) struct Relu<'a> {
    pub map: &'a [f32],
    pub out: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Relu<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (out, x) in self.out.iter_mut().zip(self.map) {
            *out = if *x > 0.0 { *x } else { 0.0 };
        }
    }
}

/// Leaves of a gradient what reaches through a positive part.
pub(crate) struct Mask<'a> {
    pub gradient: &'a mut [f32],
    pub made: &'a [f32],
}

impl pulp::NullaryFnOnce for Mask<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (g, made) in self.gradient.iter_mut().zip(self.made) {
            *g = if *made > 0.0 { *g } else { 0.0 };
        }
    }
}

/// Each pixel of rows, of shape [rows, width, channels], twice in each row and column.
pub(crate) fn upsample(map: &[f32], (width, channels): (usize, usize), out: &mut [f32]) {
    let rows = map.chunks_exact(width * channels);
    for (row, two) in rows.zip(out.chunks_exact_mut(4 * width * channels)) {
        let (first, second) = two.split_at_mut(2 * width * channels);
        for (pixel, two) in row.chunks_exact(channels).zip(first.chunks_exact_mut(2 * channels)) {
            two[..channels].copy_from_slice(pixel);
            two[channels..].copy_from_slice(pixel);
        }
        second.copy_from_slice(first);
    }
}

/// Adds the gradient by what [`upsample`] made to that by what it was made of.
pub(crate) fn downsample(gradient: &Tensor, out: &mut Tensor) {
    let Shape { width, channels, .. } = out.shape;
    let rows = out.data.chunks_exact_mut(width * channels);
    for (row, two) in rows.zip(gradient.data.chunks_exact(4 * width * channels)) {
        let (first, second) = two.split_at(2 * width * channels);
        let pairs = first.chunks_exact(2 * channels).zip(second.chunks_exact(2 * channels));
        for (pixel, (above, below)) in row.chunks_exact_mut(channels).zip(pairs) {
            for c in 0..channels {
                let sum = (above[c] + above[channels + c]) + (below[c] + below[channels + c]);
                pixel[c] += sum;
            }
        }
    }
}
