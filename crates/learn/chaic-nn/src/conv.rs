//! Dense convolutions, as matrix products of patches and weights.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use crate::gemm::{
    Begin, Matrix, Panels, Rows, Tiled, Workspace, add, add_product, begin, end, in_tiles,
};
use crate::tensor::Shape;

/// Pixels of the result that are made together, about: what they are made of stays in the second-level
/// cache. Of a map of 48 channels they take 100 KB.
pub(crate) const STRIP_PIXELS: usize = 512;

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
    weights: Panels,
    edges: Vec<f32>,
}

/// Takes in weights of shape [side, side, channels, out channels] for [`forward_rows`].
pub(crate) fn pack(
    arch: Arch,
    (weights, kernel): (&[f32], Kernel),
    (channels, out_channels): (usize, usize),
    panels: &mut Panels,
) {
    let right = Matrix::row_major(weights, kernel.patch(channels), out_channels);
    panels.pack(arch, right, kernel.side * channels);
}

/// Convolves maps of this shape with weights of shape [side, side, channels, out channels], and adds a
/// bias for each of the out channels if there is one.
///
/// # Panics
/// If a slice has another length than its shape.
pub fn forward(
    arch: Arch,
    (map, shape): (&[f32], Shape),
    (weights, bias, kernel): (&[f32], Option<&[f32]>, Kernel),
    (out, channels): (&mut [f32], usize),
    space: &mut Patches,
) {
    let Patches { weights: panels, edges, .. } = space;
    pack(arch, (weights, kernel), (shape.channels, channels), panels);
    if kernel == Kernel::POINTWISE {
        let strips = map.chunks(STRIP_PIXELS * shape.channels);
        for (map, out) in strips.zip(out.chunks_mut(STRIP_PIXELS * channels)) {
            let shape = Shape { n: 1, height: 1, width: out.len() / channels, ..shape };
            forward_rows(arch, (map, shape), (panels, bias, kernel), (out, 0..1), edges);
        }
        return;
    }
    let out_shape = kernel.out_shape(shape, channels);
    let maps = map.chunks_exact(shape.of_one());
    for (map, out) in maps.zip(out.chunks_exact_mut(out_shape.of_one())) {
        let strip = (STRIP_PIXELS / out_shape.width).max(1);
        for (k, out) in out.chunks_mut(strip * out_shape.width * channels).enumerate() {
            let rows = k * strip..(k * strip + strip).min(out_shape.height);
            forward_rows(arch, (map, shape), (panels, bias, kernel), (out, rows), edges);
        }
    }
}

/// Some rows of the convolution of one map with weights that [`pack`] took in: those that `rows` names,
/// shape [rows, out width, out channels]. `edges` is working space.
///
/// # Panics
/// As [`forward`].
pub(crate) fn forward_rows(
    arch: Arch,
    (map, shape): (&[f32], Shape),
    (weights, bias, kernel): (&Panels, Option<&[f32]>, Kernel),
    (out, rows): (&mut [f32], Range<usize>),
    edges: &mut Vec<f32>,
) {
    let width = kernel.out_shape(shape, 1).width;
    assert_eq!(out.len(), rows.len() * width * weights.columns(), "the result has another shape");
    let bias = bias.map_or(Begin::Zero, Begin::Row);
    arch.dispatch(Forward { map, shape, weights, kernel, bias, out, rows, edges });
}

struct Forward<'a> {
    map: &'a [f32],
    shape: Shape,
    weights: &'a Panels,
    kernel: Kernel,
    bias: Begin<'a>,
    out: &'a mut [f32],
    rows: Range<usize>,
    edges: &'a mut Vec<f32>,
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        in_tiles(simd, self.weights, self);
    }
}

/// What is under the rows of the kernel is taken from where it lies on the map: its pixels are
/// neighbors there. Only where the kernel reaches beyond the map is it copied, with zeros.
impl Tiled for Forward<'_> {
    #[inline(always)]
    fn run<S: Simd, const ROWS: usize, const VECTORS: usize>(self, simd: S) {
        let Forward { map, shape, weights, kernel, bias, out, rows, edges } = self;
        let windows = Windows::new(shape, kernel);
        let (run, n) = (kernel.side * shape.channels, weights.columns());
        windows.copy_edges(map, rows.clone(), edges);
        for (block, panels) in weights.blocks() {
            let kernel_rows = block.start / run..block.end.div_ceil(run);
            let part = block.start % run;
            let depth = block.len().min(run);
            for (k, panel) in panels.chunks_exact(block.len() * weights.width()).enumerate() {
                let place = (k * weights.width(), n);
                for (y, out) in rows.clone().zip(out.chunks_exact_mut(windows.n_columns * n)) {
                    let first = (0..kernel.side).find(|dy| windows.row(y, *dy).is_some());
                    let is_first = part == 0 && first.is_some_and(|dy| kernel_rows.contains(&dy));
                    let from = if is_first { bias } else { Begin::Result };
                    for (t, out) in out.chunks_mut(ROWS * n).enumerate() {
                        let mut sums = begin::<S, ROWS, VECTORS>(simd, from, out, place);
                        for dy in kernel_rows.clone() {
                            let Some(row) = windows.row(y, dy) else { continue };
                            let mut left: [&[f32]; ROWS] = [&[]; ROWS];
                            for (i, left) in left.iter_mut().enumerate() {
                                let x = (t * ROWS + i).min(windows.n_columns - 1);
                                let (from, at) = match windows.whole.contains(&x) {
                                    true => (map, windows.on_map(row, x)),
                                    false => (&edges[..], windows.edge(y - rows.start, dy, x)),
                                };
                                *left = &from[at + part..][..depth];
                            }
                            let right = (dy - kernel_rows.start) * depth * weights.width();
                            let right = &panel[right..][..depth * weights.width()];
                            sums = add::<S, ROWS, VECTORS>(simd, sums, Rows(left), right);
                        }
                        end::<S, ROWS, VECTORS>(simd, sums, out, place);
                    }
                }
            }
        }
    }
}

/// Where the kernel lies on a map when it makes a pixel of the result.
struct Windows {
    shape: Shape,
    kernel: Kernel,
    /// Columns of the result.
    n_columns: usize,
    /// Those of them at which the kernel doesn't reach beyond the map to the left or right.
    whole: Range<usize>,
}

impl Windows {
    fn new(shape: Shape, kernel: Kernel) -> Windows {
        let Kernel { side, stride } = kernel;
        let n_columns = kernel.out_shape(shape, 1).width;
        let end = (shape.width + side / 2).saturating_sub(side) / stride + 1;
        let whole = (side / 2).div_ceil(stride)..end.min(n_columns);
        Windows { shape, kernel, n_columns, whole }
    }

    /// The row of the map under a row of the kernel.
    #[inline(always)]
    fn row(&self, y: usize, dy: usize) -> Option<usize> {
        let row = (y * self.kernel.stride + dy).checked_sub(self.kernel.side / 2);
        row.filter(|row| *row < self.shape.height)
    }

    /// Where on the map what is under a row of the kernel begins.
    #[inline(always)]
    fn on_map(&self, row: usize, x: usize) -> usize {
        let column = x * self.kernel.stride - self.kernel.side / 2;
        (row * self.shape.width + column) * self.shape.channels
    }

    /// Columns of the result at which it is copied.
    #[inline(always)]
    fn n_edges(&self) -> usize {
        self.whole.start + self.n_columns - self.whole.end
    }

    /// Where among copies it begins, `y` rows after the first that is copied.
    #[inline(always)]
    fn edge(&self, y: usize, dy: usize, x: usize) -> usize {
        let k = if x < self.whole.start { x } else { self.whole.start + x - self.whole.end };
        let side = self.kernel.side;
        ((y * side + dy) * self.n_edges() + k) * side * self.shape.channels
    }

    /// Copies what is under the kernel where it reaches beyond the map to the left or right.
    fn copy_edges(&self, map: &[f32], rows: Range<usize>, edges: &mut Vec<f32>) {
        let Kernel { side, stride } = self.kernel;
        let Shape { width, channels, .. } = self.shape;
        edges.clear();
        edges.resize(rows.len() * self.n_edges() * self.kernel.patch(channels), 0.0);
        let columns =
            (0..self.whole.start).chain(self.whole.end.max(self.whole.start)..self.n_columns);
        for (y, dy, row) in rows.clone().flat_map(|y| {
            (0..side).filter_map(move |dy| Some((y - rows.start, dy, self.row(y, dy)?)))
        }) {
            for (x, dx) in columns.clone().flat_map(|x| (0..side).map(move |dx| (x, dx))) {
                let column = (x * stride + dx).checked_sub(side / 2);
                if let Some(column) = column.filter(|column| *column < width) {
                    let from = (row * width + column) * channels;
                    let to = self.edge(y, dy, x) + dx * channels;
                    edges[to..][..channels].copy_from_slice(&map[from..][..channels]);
                }
            }
        }
    }
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
    let Patches { patches, product, .. } = space;
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
    let Patches { patches, product, .. } = space;
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
        gather(map, shape, kernel, patches);
        let patches = Matrix::row_major(patches, n, depth).transposed();
        add_product(arch, out, patches, Matrix::row_major(gradient, n, channels), product);
    }
}

/// For each place of the kernel, whether and where each of its rows begins on the map: calls `visit` with
/// the index of the run in the patches, and on the map, and its length.
fn runs(shape: Shape, kernel: Kernel, mut visit: impl FnMut(usize, usize, usize)) {
    let Shape { height, width, channels, .. } = shape;
    let Kernel { side, stride } = kernel;
    let border = side / 2;
    let out = kernel.out_shape(shape, 1);
    let mut at = 0;
    for y in 0..out.height {
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
fn gather(map: &[f32], shape: Shape, kernel: Kernel, patches: &mut Vec<f32>) {
    let places = kernel.out_shape(Shape { n: 1, ..shape }, 1).pixels();
    patches.clear();
    patches.resize(places * kernel.patch(shape.channels), 0.0);
    runs(shape, kernel, |to, from, n| patches[to..][..n].copy_from_slice(&map[from..][..n]));
}

/// Adds patches to where [`gather`] takes them from.
fn scatter(patches: &[f32], shape: Shape, kernel: Kernel, map: &mut [f32]) {
    runs(shape, kernel, |from, to, n| {
        map[to..][..n].iter_mut().zip(&patches[from..][..n]).for_each(|(to, from)| *to += from);
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::widths;
    use chaic_core::rng::Stream;

    /// The definition: chains over rows of the kernel, its columns, and channels.
    fn by_hand(
        (map, shape): (&[f32], Shape),
        (weights, bias, kernel): (&[f32], &[f32], Kernel),
    ) -> Vec<f32> {
        let Kernel { side, stride } = kernel;
        let out = kernel.out_shape(shape, bias.len());
        let mut made = Vec::new();
        for (y, x) in (0..out.height).flat_map(|y| (0..out.width).map(move |x| (y, x))) {
            let mut sums = bias.to_vec();
            for (k, of_channels) in weights.chunks_exact(bias.len()).enumerate() {
                let (tap, c) = (k / shape.channels, k % shape.channels);
                let at = |x: usize, tap: usize| (x * stride + tap).checked_sub(side / 2);
                let (row, column) = (at(y, tap / side), at(x, tap % side));
                let row = row.filter(|row| *row < shape.height);
                let column = column.filter(|column| *column < shape.width);
                if let (Some(row), Some(column)) = (row, column) {
                    let x = map[(row * shape.width + column) * shape.channels + c];
                    for (sum, weight) in sums.iter_mut().zip(of_channels) {
                        *sum = x.mul_add(*weight, *sum);
                    }
                }
            }
            made.extend(sums);
        }
        made
    }

    #[test]
    fn convolutions_are_the_same_bits_as_by_hand_at_every_width() {
        let mut rng = Stream::new(1, "conv", 0);
        // Channels before and after: kernels' rows that share a block, fill it, and are parts of it.
        for (channels, n) in [(3, 5), (16, 48), (64, 20), (80, 50)] {
            for (side, stride) in [(1, 1), (3, 1), (3, 2), (5, 2), (5, 1), (1, 2)] {
                for (height, width) in [(1, 1), (2, 3), (5, 21), (9, 16)] {
                    let (kernel, shape) =
                        (Kernel { side, stride }, Shape { n: 1, height, width, channels });
                    let mut numbers =
                        |n: usize| -> Vec<f32> { (0..n).map(|_| rng.range(-1.0, 1.0)).collect() };
                    let (map, bias) = (numbers(shape.of_one()), numbers(n));
                    let weights = numbers(kernel.patch(channels) * n);
                    let expected = by_hand((&map, shape), (&weights, &bias, kernel));
                    for (name, arch) in widths() {
                        let mut out = vec![0.0; expected.len()];
                        let weights = (&weights[..], Some(&bias[..]), kernel);
                        let space = &mut Patches::default();
                        forward(arch, (&map, shape), weights, (&mut out, n), space);
                        assert!(out == expected, "{kernel:?} on {shape:?} to {n}, {name}");
                    }
                }
            }
        }
    }
}
