//! Dense convolutions, as matrix products of patches and weights.

use std::ops::Range;

use pulp::Arch;

use crate::gemm::{Matrix, Workspace, add_product};
use crate::tensor::Shape;

/// Kernel and stride of a convolution, with zeros around the map so that a stride of 1 keeps its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernel {
    /// Its side; odd.
    pub side: usize,
    /// Every how many rows and columns it is applied.
    pub stride: usize,
}

impl Kernel {
    /// A matrix for each pixel.
    pub const POINTWISE: Kernel = Kernel { side: 1, stride: 1 };

    /// The shape of what becomes of maps of this one.
    pub fn out_shape(&self, shape: Shape, channels: usize) -> Shape {
        let [height, width] = [shape.height, shape.width].map(|n| n.div_ceil(self.stride));
        Shape { n: shape.n, height, width, channels }
    }

    /// Numbers under the kernel.
    pub fn patch(&self, channels: usize) -> usize {
        self.side * self.side * channels
    }
}

/// Working space of convolutions.
#[derive(Clone, Debug, Default)]
pub struct Patches {
    patches: Vec<f32>,
    product: Workspace,
}

/// Adds the convolution of maps of this shape with weights of shape [side, side, channels, out
/// channels] to `out`.
///
/// # Panics
/// If a slice has another length than its shape.
pub fn forward(
    arch: Arch,
    (map, shape): (&[f32], Shape),
    (weights, kernel): (&[f32], Kernel),
    (out, channels): (&mut [f32], usize),
    space: &mut Patches,
) {
    let Patches { patches, product } = space;
    let depth = kernel.patch(shape.channels);
    let weights = Matrix::row_major(weights, depth, channels);
    if kernel == Kernel::POINTWISE {
        let map = Matrix::row_major(map, shape.pixels(), depth);
        add_product(arch, out, map, weights, product);
        return;
    }
    let n = kernel.out_shape(shape, channels).of_one() / channels;
    for (map, out) in map.chunks_exact(shape.of_one()).zip(out.chunks_exact_mut(n * channels)) {
        gather(map, shape, kernel, 0..kernel.out_shape(shape, 1).height, patches);
        add_product(arch, out, Matrix::row_major(patches, n, depth), weights, product);
    }
}

/// Adds the convolution of one map to some rows of the result: those that `rows` names, shape [rows,
/// out width, out channels].
///
/// # Panics
/// As [`forward`].
pub(crate) fn forward_rows(
    arch: Arch,
    (map, shape): (&[f32], Shape),
    (weights, kernel): (&[f32], Kernel),
    (out, channels, rows): (&mut [f32], usize, Range<usize>),
    space: &mut Patches,
) {
    let Patches { patches, product } = space;
    let depth = kernel.patch(shape.channels);
    let weights = Matrix::row_major(weights, depth, channels);
    let n = rows.len() * kernel.out_shape(shape, channels).width;
    if kernel == Kernel::POINTWISE {
        let row = shape.width * shape.channels;
        let map = &map[rows.start * row..rows.end * row];
        add_product(arch, out, Matrix::row_major(map, n, depth), weights, product);
        return;
    }
    gather(map, shape, kernel, rows, patches);
    add_product(arch, out, Matrix::row_major(patches, n, depth), weights, product);
}

/// Adds the gradient by the maps, from that by the result.
///
/// # Panics
/// As [`forward`].
pub fn backward_map(
    arch: Arch,
    (out, shape): (&mut [f32], Shape),
    (weights, kernel): (&[f32], Kernel),
    (gradient, channels): (&[f32], usize),
    space: &mut Patches,
) {
    let Patches { patches, product } = space;
    let depth = kernel.patch(shape.channels);
    let weights = Matrix::row_major(weights, depth, channels).transposed();
    if kernel == Kernel::POINTWISE {
        let gradient = Matrix::row_major(gradient, shape.pixels(), channels);
        add_product(arch, out, gradient, weights, product);
        return;
    }
    let n = kernel.out_shape(shape, channels).of_one() / channels;
    for (out, gradient) in
        out.chunks_exact_mut(shape.of_one()).zip(gradient.chunks_exact(n * channels))
    {
        patches.clear();
        patches.resize(n * depth, 0.0);
        add_product(arch, patches, Matrix::row_major(gradient, n, channels), weights, product);
        scatter(patches, shape, kernel, out);
    }
}

/// Adds the gradient by the weights, from maps and the gradient by the result.
///
/// # Panics
/// As [`forward`].
pub fn backward_weights(
    arch: Arch,
    (map, shape): (&[f32], Shape),
    (out, kernel): (&mut [f32], Kernel),
    (gradient, channels): (&[f32], usize),
    space: &mut Patches,
) {
    let Patches { patches, product } = space;
    let depth = kernel.patch(shape.channels);
    if kernel == Kernel::POINTWISE {
        let map = Matrix::row_major(map, shape.pixels(), depth).transposed();
        let gradient = Matrix::row_major(gradient, shape.pixels(), channels);
        add_product(arch, out, map, gradient, product);
        return;
    }
    let n = kernel.out_shape(shape, channels).of_one() / channels;
    for (map, gradient) in map.chunks_exact(shape.of_one()).zip(gradient.chunks_exact(n * channels))
    {
        gather(map, shape, kernel, 0..kernel.out_shape(shape, 1).height, patches);
        let patches = Matrix::row_major(patches, n, depth).transposed();
        add_product(arch, out, patches, Matrix::row_major(gradient, n, channels), product);
    }
}

/// For each place of the kernel in these rows of the result, whether and where each of its rows begins on the map: calls
/// `visit` with the index of the run in the patches, and on the map, and its length.
fn runs(
    shape: Shape,
    kernel: Kernel,
    rows: Range<usize>,
    mut visit: impl FnMut(usize, usize, usize),
) {
    let Shape { height, width, channels, .. } = shape;
    let Kernel { side, stride } = kernel;
    let border = side / 2;
    let out = kernel.out_shape(shape, 1);
    let mut at = 0;
    for y in rows {
        for x in 0..out.width {
            let first = (x * stride).saturating_sub(border);
            let last = (x * stride + side - border).min(width);
            let skipped = (first + border - x * stride) * channels;
            for dy in 0..side {
                let row = (y * stride + dy).checked_sub(border).filter(|row| *row < height);
                if let Some(row) = row {
                    let from = (row * width + first) * channels;
                    visit(at + skipped, from, (last - first) * channels);
                }
                at += side * channels;
            }
        }
    }
}

/// The numbers under the kernel at each of its places, shape [places, side, side, channels].
fn gather(map: &[f32], shape: Shape, kernel: Kernel, rows: Range<usize>, patches: &mut Vec<f32>) {
    let places = rows.len() * kernel.out_shape(shape, 1).width;
    patches.clear();
    patches.resize(places * kernel.patch(shape.channels), 0.0);
    runs(shape, kernel, rows, |to, from, n| patches[to..][..n].copy_from_slice(&map[from..][..n]));
}

/// Adds patches to where [`gather`] takes them from.
fn scatter(patches: &[f32], shape: Shape, kernel: Kernel, map: &mut [f32]) {
    let rows = 0..kernel.out_shape(shape, 1).height;
    runs(shape, kernel, rows, |from, to, n| {
        map[to..][..n].iter_mut().zip(&patches[from..][..n]).for_each(|(to, from)| *to += from);
    });
}
