//! Depthwise convolutions of stride 1: each channel by a square kernel of its own, with zeros around
//! the map. Sums run over the kernel, row by row, in chains of fused multiply-adds.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use crate::tensor::Shape;

/// Channels of depthwise convolutions are a multiple of this: whole vectors on every machine.
pub const CHANNEL_MULTIPLE: usize = 16;

/// A row of zeros, for what lies above and below a map.
#[derive(Clone, Debug, Default)]
pub struct Zeros(Vec<f32>);

impl Zeros {
    fn of(&mut self, shape: Shape) -> &[f32] {
        self.0.resize(shape.width * shape.channels, 0.0);
        &self.0
    }
}

/// Working space: one map with zeros around it.
#[derive(Clone, Debug, Default)]
pub struct Padded(Vec<f32>);

impl Padded {
    fn fill(&mut self, map: &[f32], shape: Shape, border: usize) -> &[f32] {
        let row = (shape.width + 2 * border) * shape.channels;
        self.0.resize((shape.height + 2 * border) * row, 0.0);
        let (own, edge) = (shape.width * shape.channels, border * shape.channels);
        for (k, to) in self.0.chunks_exact_mut(row).enumerate() {
            match k.checked_sub(border).filter(|y| *y < shape.height) {
                Some(y) => {
                    to[..edge].fill(0.0);
                    to[edge..][..own].copy_from_slice(&map[y * own..][..own]);
                    to[edge + own..].fill(0.0);
                }
                None => to.fill(0.0),
            }
        }
        &self.0
    }
}

fn check(shape: Shape, weights: &[f32], side: usize) {
    assert!(side == 3 || side == 5, "kernels are 3 or 5 wide, not {side}");
    assert_eq!(weights.len(), side * side * shape.channels, "weights of another shape");
    assert!(shape.channels.is_multiple_of(CHANNEL_MULTIPLE), "{} channels", shape.channels);
}

/// Convolves one map, shape [height, width, channels], with weights of shape [side, side, channels].
///
/// # Panics
/// If a slice has another length than its shape, or `side` is neither 3 nor 5.
pub fn forward(
    arch: Arch,
    (map, shape): (&[f32], Shape),
    weights: (&[f32], usize),
    out: &mut [f32],
    zeros: &mut Zeros,
) {
    forward_rows(arch, (map, shape), weights, (out, 0..shape.height), zeros);
}

/// Some rows of what [`forward`] gives.
///
/// # Panics
/// As [`forward`].
pub(crate) fn forward_rows(
    arch: Arch,
    (map, shape): (&[f32], Shape),
    (weights, side): (&[f32], usize),
    (out, rows): (&mut [f32], Range<usize>),
    zeros: &mut Zeros,
) {
    check(shape, weights, side);
    assert_eq!(map.len(), shape.of_one());
    assert_eq!(out.len(), rows.len() * shape.width * shape.channels);
    let zeros = zeros.of(shape);
    arch.dispatch(Forward { map, shape, weights, side, out, rows, zeros, is_flipped: false });
}

/// The gradient by the map of what [`forward`] gave, from that by its result.
///
/// # Panics
/// As [`forward`].
pub fn backward_map(
    arch: Arch,
    (gradient, shape): (&[f32], Shape),
    (weights, side): (&[f32], usize),
    out: &mut [f32],
    zeros: &mut Zeros,
) {
    check(shape, weights, side);
    assert_eq!((gradient.len(), out.len()), (shape.of_one(), shape.of_one()));
    let (map, rows, zeros) = (gradient, 0..shape.height, zeros.of(shape));
    arch.dispatch(Forward { map, shape, weights, side, out, rows, zeros, is_flipped: true });
}

/// Adds the gradient by the weights, from the map and the gradient by the result.
///
/// # Panics
/// As [`forward`].
pub fn backward_weights(
    arch: Arch,
    map: &[f32],
    gradient: &[f32],
    shape: Shape,
    (out, side): (&mut [f32], usize),
    padded: &mut Padded,
) {
    check(shape, out, side);
    assert_eq!((map.len(), gradient.len()), (shape.of_one(), shape.of_one()));
    let map = padded.fill(map, shape, side / 2);
    arch.dispatch(BackwardWeights { map, gradient, shape, out, side });
}

struct Forward<'a> {
    map: &'a [f32],
    shape: Shape,
    weights: &'a [f32],
    side: usize,
    out: &'a mut [f32],
    /// Of the result, those that `out` has.
    rows: Range<usize>,
    /// One row.
    zeros: &'a [f32],
    /// Whether the kernel is turned by half a circle.
    is_flipped: bool,
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.side {
            3 => self.run::<S, 3>(simd),
            _ => self.run::<S, 5>(simd),
        }
    }
}

impl Forward<'_> {
    #[inline(always)]
    fn run<S: Simd, const SIDE: usize>(self, simd: S) {
        let Forward { map, shape, weights, out, rows, zeros, is_flipped, .. } = self;
        let Shape { height, width, channels, .. } = shape;
        let (weights, _) = S::as_simd_f32s(weights);
        let (map, _) = S::as_simd_f32s(map);
        let (zeros, _) = S::as_simd_f32s(zeros);
        let (out, _) = S::as_mut_simd_f32s(out);
        let vectors = channels / S::F32_LANES;
        let (row, border) = (width * vectors, SIDE / 2);
        for (y, out) in rows.zip(out.chunks_exact_mut(row)) {
            for v in 0..vectors {
                let mut kernel = [[simd.splat_f32s(0.0); SIDE]; SIDE];
                for (i, kernel) in kernel.as_flattened_mut().iter_mut().enumerate() {
                    let tap = if is_flipped { SIDE * SIDE - 1 - i } else { i };
                    *kernel = weights[tap * vectors + v];
                }
                let rows: [&[S::f32s]; SIDE] = std::array::from_fn(|dy| {
                    match (y + dy).checked_sub(border).filter(|y| *y < height) {
                        Some(y) => &map[y * row + v..][..row - v],
                        None => &zeros[v..],
                    }
                });
                // Where the kernel lies on the map from left to right.
                let inner = border.min(width)..width.saturating_sub(border).max(border.min(width));
                for x in inner.clone() {
                    let mut sum = simd.splat_f32s(0.0);
                    for dy in 0..SIDE {
                        for dx in 0..SIDE {
                            let at = rows[dy][(x + dx - border) * vectors];
                            sum = simd.mul_add_f32s(at, kernel[dy][dx], sum);
                        }
                    }
                    out[x * vectors + v] = sum;
                }
                for x in (0..inner.start).chain(inner.end..width) {
                    let mut sum = simd.splat_f32s(0.0);
                    for dy in 0..SIDE {
                        for dx in border.saturating_sub(x)..SIDE.min(width + border - x) {
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
    /// With zeros around it.
    map: &'a [f32],
    gradient: &'a [f32],
    shape: Shape,
    out: &'a mut [f32],
    side: usize,
}

impl WithSimd for BackwardWeights<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.side {
            3 => self.run::<S, 3>(simd),
            _ => self.run::<S, 5>(simd),
        }
    }
}

impl BackwardWeights<'_> {
    #[inline(always)]
    fn run<S: Simd, const SIDE: usize>(self, simd: S) {
        let BackwardWeights { map, gradient, shape: Shape { width, channels, .. }, out, .. } = self;
        let (out, _) = S::as_mut_simd_f32s(out);
        let (map, _) = S::as_simd_f32s(map);
        let (gradient, _) = S::as_simd_f32s(gradient);
        let vectors = channels / S::F32_LANES;
        let row = (width + SIDE - 1) * vectors;
        for (y, gradient) in gradient.chunks_exact(width * vectors).enumerate() {
            for dy in 0..SIDE {
                let map = &map[(y + dy) * row..][..row];
                for v in 0..vectors {
                    let taps = dy * SIDE * vectors + v;
                    let mut sums: [S::f32s; SIDE] =
                        std::array::from_fn(|dx| out[taps + dx * vectors]);
                    for x in 0..width {
                        let g = gradient[x * vectors + v];
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
