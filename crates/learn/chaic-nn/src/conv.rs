//! Dense convolutions by im2col and matrix products.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use crate::gemm::{
    AccumulatorInit, Matrix, PackedMatrix, Rows, TileKernel, Workspace, gemm, load_tile,
    multiply_add, run_in_tiles, store_tile,
};
use crate::tensor::{Shape, TensorView};

/// Approximate number of output pixels that are computed together, so that their inputs stay in the
/// L2 cache. With 48 channels they take 100 kB.
pub(crate) const STRIP_PIXELS: usize = 512;

/// Kernel and stride of a convolution with zero padding of half the kernel size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernel {
    /// Width and height of the kernel; odd.
    pub size: usize,
    /// Stride along rows and columns.
    pub stride: usize,
}

impl Kernel {
    /// Pointwise (1x1) convolution.
    pub const POINTWISE: Kernel = Kernel { size: 1, stride: 1 };

    /// Returns the output shape for an input shape.
    pub fn out_shape(&self, shape: Shape, channels: usize) -> Shape {
        let [height, width] = [shape.height, shape.width].map(|n| n.div_ceil(self.stride));
        Shape { n: shape.n, height, width, channels }
    }

    /// Returns the number of input elements under the kernel: size * size * channels.
    pub fn patch_len(&self, channels: usize) -> usize {
        self.size * self.size * channels
    }
}

/// Reusable buffers of convolutions.
#[derive(Clone, Debug, Default)]
pub struct Im2colBuffers {
    patches: Vec<f32>,
    product: Workspace,
    weights: PackedMatrix,
    pub(crate) edges: Vec<f32>,
}

/// Packs weights of shape [size, size, channels, out channels] for [`ForwardRows`].
pub(crate) fn pack(
    arch: Arch,
    weights: &[f32],
    kernel: Kernel,
    channels: usize,
    packed: &mut PackedMatrix,
) {
    let out_channels = weights.len() / kernel.patch_len(channels);
    let right = Matrix::row_major(weights, kernel.patch_len(channels), out_channels);
    packed.pack(arch, right, kernel.size * channels);
}

/// Convolves maps with weights of shape [size, size, channels, out channels], and adds a bias per
/// output channel if there is one.
///
/// # Panics
/// If a slice does not have the length of its shape.
pub fn forward(
    arch: Arch,
    input: TensorView<'_>,
    weights: &[f32],
    bias: Option<&[f32]>,
    kernel: Kernel,
    out: &mut [f32],
    buffers: &mut Im2colBuffers,
) {
    let Im2colBuffers { weights: packed, edges, .. } = buffers;
    pack(arch, weights, kernel, input.shape.channels, packed);
    forward_packed(arch, input, packed, bias, kernel, out, edges);
}

/// Convolves maps as [`forward`], with weights of [`pack`].
///
/// # Panics
/// As [`forward`].
pub(crate) fn forward_packed(
    arch: Arch,
    input: TensorView<'_>,
    packed: &PackedMatrix,
    bias: Option<&[f32]>,
    kernel: Kernel,
    out: &mut [f32],
    edges: &mut Vec<f32>,
) {
    let (shape, channels) = (input.shape, packed.columns());
    if kernel == Kernel::POINTWISE {
        let strips = input.data.chunks(STRIP_PIXELS * shape.channels);
        for (strip, out) in strips.zip(out.chunks_mut(STRIP_PIXELS * channels)) {
            let shape = Shape { n: 1, height: 1, width: out.len() / channels, ..shape };
            let (map, rows) = (TensorView::new(strip, shape), 0..1);
            ForwardRows { map, weights: packed, bias, kernel, out, rows, edges }.run(arch);
        }
        return;
    }
    let out_shape = kernel.out_shape(shape, channels);
    let maps = input.data.chunks_exact(shape.len_per_item());
    for (map, out) in maps.zip(out.chunks_exact_mut(out_shape.len_per_item())) {
        let map = TensorView::new(map, shape);
        let strip = (STRIP_PIXELS / out_shape.width).max(1);
        for (k, out) in out.chunks_mut(strip * out_shape.width * channels).enumerate() {
            let rows = k * strip..(k * strip + strip).min(out_shape.height);
            ForwardRows { map, weights: packed, bias, kernel, out, rows, edges }.run(arch);
        }
    }
}

/// Computes some output rows of the convolution of one map.
pub(crate) struct ForwardRows<'a> {
    /// One map.
    pub map: TensorView<'a>,
    /// Weights of [`pack`].
    pub weights: &'a PackedMatrix,
    pub bias: Option<&'a [f32]>,
    pub kernel: Kernel,
    /// Output, shape [rows, out width, out channels].
    pub out: &'a mut [f32],
    /// Output rows.
    pub rows: Range<usize>,
    /// Buffer for the inputs of output columns at the left and right border.
    pub edges: &'a mut Vec<f32>,
}

impl ForwardRows<'_> {
    /// Computes the rows.
    ///
    /// # Panics
    /// As [`forward`].
    pub fn run(self, arch: Arch) {
        let width = self.kernel.out_shape(self.map.shape, 1).width;
        let len = self.rows.len() * width * self.weights.columns();
        assert_eq!(self.out.len(), len, "the output has the wrong length");
        arch.dispatch(self);
    }
}

impl WithSimd for ForwardRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        run_in_tiles(simd, self.weights, self);
    }
}

/// Input rows under the kernel are read in place, where neighboring pixels are contiguous. They are
/// copied, with zeros, only where the kernel reaches beyond the map.
impl TileKernel for ForwardRows<'_> {
    #[inline(always)]
    fn run<S: Simd, const ROWS: usize, const VECTORS: usize>(self, simd: S) {
        let ForwardRows { map, weights, kernel, bias, out, rows, edges } = self;
        let TensorView { data: map, shape } = map;
        let bias = bias.map_or(AccumulatorInit::Zero, AccumulatorInit::Row);
        let windows = Windows::new(shape, kernel);
        let (row_len, out_channels) = (kernel.size * shape.channels, weights.columns());
        windows.copy_edges(map, rows.clone(), edges);
        for (block, panels) in weights.blocks() {
            let kernel_rows = block.start / row_len..block.end.div_ceil(row_len);
            let offset = block.start % row_len;
            let depth = block.len().min(row_len);
            for (k, panel) in panels.chunks_exact(block.len() * weights.width()).enumerate() {
                let column = k * weights.width();
                for (y, out) in
                    rows.clone().zip(out.chunks_exact_mut(windows.n_columns * out_channels))
                {
                    let first_row = (0..kernel.size).find(|dy| windows.row(y, *dy).is_some());
                    let is_first =
                        offset == 0 && first_row.is_some_and(|dy| kernel_rows.contains(&dy));
                    let init = if is_first { bias } else { AccumulatorInit::Output };
                    for (t, out) in out.chunks_mut(ROWS * out_channels).enumerate() {
                        let mut sums =
                            load_tile::<S, ROWS, VECTORS>(simd, init, out, column, out_channels);
                        for dy in kernel_rows.clone() {
                            let Some(row) = windows.row(y, dy) else { continue };
                            let mut left: [&[f32]; ROWS] = [&[]; ROWS];
                            for (i, left) in left.iter_mut().enumerate() {
                                let x = (t * ROWS + i).min(windows.n_columns - 1);
                                let (from, at) = match windows.inner.contains(&x) {
                                    true => (map, windows.map_index(row, x)),
                                    false => {
                                        (&edges[..], windows.edge_index(y - rows.start, dy, x))
                                    }
                                };
                                *left = &from[at + offset..][..depth];
                            }
                            let right = (dy - kernel_rows.start) * depth * weights.width();
                            let right = &panel[right..][..depth * weights.width()];
                            sums = multiply_add::<S, ROWS, VECTORS>(simd, sums, Rows(left), right);
                        }
                        store_tile::<S, ROWS, VECTORS>(simd, sums, out, column, out_channels);
                    }
                }
            }
        }
    }
}

/// Positions of the kernel on a map.
struct Windows {
    shape: Shape,
    kernel: Kernel,
    /// Number of output columns.
    n_columns: usize,
    /// Output columns at which the kernel does not reach beyond the left or right border.
    inner: Range<usize>,
}

impl Windows {
    fn new(shape: Shape, kernel: Kernel) -> Windows {
        let Kernel { size, stride } = kernel;
        let n_columns = kernel.out_shape(shape, 1).width;
        let end = (shape.width + size / 2).saturating_sub(size) / stride + 1;
        let inner = (size / 2).div_ceil(stride)..end.min(n_columns);
        Windows { shape, kernel, n_columns, inner }
    }

    /// Returns the input row under a row of the kernel; `None` outside the map.
    #[inline(always)]
    fn row(&self, y: usize, dy: usize) -> Option<usize> {
        let row = (y * self.kernel.stride + dy).checked_sub(self.kernel.size / 2);
        row.filter(|row| *row < self.shape.height)
    }

    /// Returns the index of the first input element under a row of the kernel.
    #[inline(always)]
    fn map_index(&self, row: usize, x: usize) -> usize {
        let column = x * self.kernel.stride - self.kernel.size / 2;
        (row * self.shape.width + column) * self.shape.channels
    }

    /// Returns the number of output columns whose inputs are copied.
    #[inline(always)]
    fn n_edges(&self) -> usize {
        self.inner.start + self.n_columns - self.inner.end
    }

    /// Returns the index of a copied window row; `y` counts from the first copied output row.
    #[inline(always)]
    fn edge_index(&self, y: usize, dy: usize, x: usize) -> usize {
        let k = if x < self.inner.start { x } else { self.inner.start + x - self.inner.end };
        let size = self.kernel.size;
        ((y * size + dy) * self.n_edges() + k) * size * self.shape.channels
    }

    /// Copies the inputs under the kernel where it reaches beyond the left or right border.
    fn copy_edges(&self, map: &[f32], rows: Range<usize>, edges: &mut Vec<f32>) {
        let Kernel { size, stride } = self.kernel;
        let Shape { width, channels, .. } = self.shape;
        edges.clear();
        edges.resize(rows.len() * self.n_edges() * self.kernel.patch_len(channels), 0.0);
        let columns =
            (0..self.inner.start).chain(self.inner.end.max(self.inner.start)..self.n_columns);
        for (y, dy, row) in rows.clone().flat_map(|y| {
            (0..size).filter_map(move |dy| Some((y - rows.start, dy, self.row(y, dy)?)))
        }) {
            for (x, dx) in columns.clone().flat_map(|x| (0..size).map(move |dx| (x, dx))) {
                let column = (x * stride + dx).checked_sub(size / 2);
                if let Some(column) = column.filter(|column| *column < width) {
                    let from = (row * width + column) * channels;
                    let to = self.edge_index(y, dy, x) + dx * channels;
                    edges[to..][..channels].copy_from_slice(&map[from..][..channels]);
                }
            }
        }
    }
}

/// Adds the gradient of the input to `grad_input`, given the gradient of the output.
///
/// # Panics
/// As [`forward`].
pub fn backward_input(
    arch: Arch,
    grad_input: &mut [f32],
    shape: Shape,
    weights: &[f32],
    kernel: Kernel,
    grad_output: &[f32],
    buffers: &mut Im2colBuffers,
) {
    let Im2colBuffers { patches, product, .. } = buffers;
    let depth = kernel.patch_len(shape.channels);
    let channels = weights.len() / depth;
    let weights = Matrix::row_major(weights, depth, channels).transposed();
    if kernel == Kernel::POINTWISE {
        let grad_output = Matrix::row_major(grad_output, shape.pixels(), channels);
        gemm(arch, grad_input, grad_output, weights, product);
        return;
    }
    let n = kernel.out_shape(shape, channels).len_per_item() / channels;
    let maps = grad_input.chunks_exact_mut(shape.len_per_item());
    for (grad_input, grad_output) in maps.zip(grad_output.chunks_exact(n * channels)) {
        patches.clear();
        patches.resize(n * depth, 0.0);
        gemm(arch, patches, Matrix::row_major(grad_output, n, channels), weights, product);
        col2im(patches, shape, kernel, grad_input);
    }
}

/// Adds the gradient of the weights to `grad_weights`, given the gradient of the output.
///
/// # Panics
/// As [`forward`].
pub fn backward_weights(
    arch: Arch,
    input: TensorView<'_>,
    grad_weights: &mut [f32],
    kernel: Kernel,
    grad_output: &[f32],
    buffers: &mut Im2colBuffers,
) {
    let Im2colBuffers { patches, product, .. } = buffers;
    let shape = input.shape;
    let depth = kernel.patch_len(shape.channels);
    let channels = grad_weights.len() / depth;
    if kernel == Kernel::POINTWISE {
        let input = Matrix::row_major(input.data, shape.pixels(), depth).transposed();
        let grad_output = Matrix::row_major(grad_output, shape.pixels(), channels);
        gemm(arch, grad_weights, input, grad_output, product);
        return;
    }
    let n = kernel.out_shape(shape, channels).len_per_item() / channels;
    let maps = input.data.chunks_exact(shape.len_per_item());
    for (map, grad_output) in maps.zip(grad_output.chunks_exact(n * channels)) {
        im2col(map, shape, kernel, patches);
        let patches = Matrix::row_major(patches, n, depth).transposed();
        let grad_output = Matrix::row_major(grad_output, n, channels);
        gemm(arch, grad_weights, patches, grad_output, product);
    }
}

/// Calls `visit(patch index, map index, length)` for each contiguous run of input elements under a
/// row of the kernel, for all kernel positions.
fn runs(shape: Shape, kernel: Kernel, mut visit: impl FnMut(usize, usize, usize)) {
    let Shape { height, width, channels, .. } = shape;
    let Kernel { size, stride } = kernel;
    let border = size / 2;
    let out = kernel.out_shape(shape, 1);
    let mut patch_index = 0;
    for y in 0..out.height {
        for x in 0..out.width {
            let first = (x * stride).saturating_sub(border);
            let last = (x * stride + size - border).min(width);
            let skipped = (first + border - x * stride) * channels;
            for dy in 0..size {
                let row = (y * stride + dy).checked_sub(border).filter(|row| *row < height);
                if let Some(row) = row {
                    let from = (row * width + first) * channels;
                    visit(patch_index + skipped, from, (last - first) * channels);
                }
                patch_index += size * channels;
            }
        }
    }
}

/// Extracts patches (im2col), shape [positions, size, size, channels].
fn im2col(map: &[f32], shape: Shape, kernel: Kernel, patches: &mut Vec<f32>) {
    let positions = kernel.out_shape(Shape { n: 1, ..shape }, 1).pixels();
    patches.clear();
    patches.resize(positions * kernel.patch_len(shape.channels), 0.0);
    runs(shape, kernel, |to, from, n| patches[to..][..n].copy_from_slice(&map[from..][..n]));
}

/// Adds patches to a map (col2im), the transpose of [`im2col`].
fn col2im(patches: &[f32], shape: Shape, kernel: Kernel, map: &mut [f32]) {
    runs(shape, kernel, |from, to, n| {
        map[to..][..n].iter_mut().zip(&patches[from..][..n]).for_each(|(to, from)| *to += from);
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::widths;
    use chaic_core::rng::RngStream;

    /// Reference implementation: sums run over kernel rows, kernel columns and channels.
    fn reference(map: TensorView<'_>, weights: &[f32], bias: &[f32], kernel: Kernel) -> Vec<f32> {
        let TensorView { data: map, shape } = map;
        let Kernel { size, stride } = kernel;
        let out = kernel.out_shape(shape, bias.len());
        let mut output = Vec::new();
        for (y, x) in (0..out.height).flat_map(|y| (0..out.width).map(move |x| (y, x))) {
            let mut sums = bias.to_vec();
            for (k, tap_weights) in weights.chunks_exact(bias.len()).enumerate() {
                let (tap, c) = (k / shape.channels, k % shape.channels);
                let at = |x: usize, tap: usize| (x * stride + tap).checked_sub(size / 2);
                let (row, column) = (at(y, tap / size), at(x, tap % size));
                let row = row.filter(|row| *row < shape.height);
                let column = column.filter(|column| *column < shape.width);
                if let (Some(row), Some(column)) = (row, column) {
                    let x = map[(row * shape.width + column) * shape.channels + c];
                    for (sum, weight) in sums.iter_mut().zip(tap_weights) {
                        *sum = x.mul_add(*weight, *sum);
                    }
                }
            }
            output.extend(sums);
        }
        output
    }

    #[test]
    fn convolutions_are_bit_identical_to_the_reference_at_every_width() {
        let mut rng = RngStream::new(1, "conv", 0);
        // With these numbers of channels, kernel rows share a block, fill a block, or span several
        // blocks.
        for (channels, n) in [(3, 5), (16, 48), (64, 20), (80, 50)] {
            for (size, stride) in [(1, 1), (3, 1), (3, 2), (5, 2), (5, 1), (1, 2)] {
                for (height, width) in [(1, 1), (2, 3), (5, 21), (9, 16)] {
                    let (kernel, shape) =
                        (Kernel { size, stride }, Shape { n: 1, height, width, channels });
                    let mut random =
                        |n: usize| -> Vec<f32> { (0..n).map(|_| rng.range(-1.0, 1.0)).collect() };
                    let (map, bias) = (random(shape.len_per_item()), random(n));
                    let weights = random(kernel.patch_len(channels) * n);
                    let expected = reference(TensorView::new(&map, shape), &weights, &bias, kernel);
                    for (name, arch) in widths() {
                        let mut out = vec![0.0; expected.len()];
                        let (input, bias) = (TensorView::new(&map, shape), Some(&bias[..]));
                        let buffers = &mut Im2colBuffers::default();
                        forward(arch, input, &weights, bias, kernel, &mut out, buffers);
                        assert!(out == expected, "{kernel:?} on {shape:?} to {n}, {name}");
                    }
                }
            }
        }
    }
}
