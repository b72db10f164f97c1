//! Matrix products with equal bits on any machine. Each output element is a chain of fused
//! multiply-adds in order of the inner dimension, for any vector width and block size.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

/// Columns of the left matrix per block. With this size, a panel of the right matrix stays in the
/// L1 cache.
const INNER_BLOCK: usize = 192;
/// Rows of the left matrix that are packed together.
const ROW_BLOCK: usize = 48;

/// Strided view of a matrix: element (i, j) is `data[i * row_stride + j * column_stride]`.
#[derive(Clone, Copy, Debug)]
pub struct Matrix<'a> {
    /// Elements; strides may skip some elements.
    pub data: &'a [f32],
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Distance between rows, elements.
    pub row_stride: usize,
    /// Distance between columns, elements.
    pub column_stride: usize,
}

impl<'a> Matrix<'a> {
    /// Creates a view of a row-major matrix, shape [rows, columns].
    pub fn row_major(data: &'a [f32], rows: usize, columns: usize) -> Matrix<'a> {
        Matrix { data, rows, columns, row_stride: columns, column_stride: 1 }
    }

    /// Returns the transposed view.
    pub fn transposed(self) -> Matrix<'a> {
        Matrix {
            rows: self.columns,
            columns: self.rows,
            row_stride: self.column_stride,
            column_stride: self.row_stride,
            ..self
        }
    }

    fn at(&self, i: usize, j: usize) -> f32 {
        self.data[i * self.row_stride + j * self.column_stride]
    }
}

/// Initial value of the accumulators.
#[derive(Clone, Copy, Debug)]
pub enum AccumulatorInit<'a> {
    /// Current content of the output.
    Output,
    /// Zero.
    Zero,
    /// One value per column (bias).
    Row(&'a [f32]),
}

/// Right matrix in the order in which products read it: blocks of rows, each divided into panels of
/// columns. Shape [blocks, panels, rows of the block, columns of a panel], with zeros beyond the
/// last column. The panel width depends on the machine's vectors.
#[derive(Clone, Debug, Default)]
pub struct PackedMatrix {
    columns: usize,
    width: usize,
    /// Row ranges of the blocks.
    blocks: Vec<Range<usize>>,
    data: Vec<f32>,
}

impl PackedMatrix {
    /// Packs a matrix. Its rows form groups of `group_len`; a block holds whole groups or a part of
    /// one.
    ///
    /// # Panics
    /// If the number of rows is not a multiple of `group_len`.
    pub fn pack(&mut self, arch: Arch, right: Matrix<'_>, group_len: usize) {
        assert!(
            group_len > 0 && right.rows.is_multiple_of(group_len),
            "{} rows in groups of {group_len}",
            right.rows
        );
        arch.dispatch(Pack { panels: self, right, group_len });
    }

    /// Returns the number of columns of the matrix.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Returns the row range of each block with its panels.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (Range<usize>, &[f32])> {
        let row = self.columns.next_multiple_of(self.width.max(1));
        self.blocks
            .iter()
            .map(move |rows| (rows.clone(), &self.data[rows.start * row..rows.end * row]))
    }

    /// Returns the number of columns of a panel.
    pub(crate) fn width(&self) -> usize {
        self.width
    }
}

struct Pack<'a> {
    panels: &'a mut PackedMatrix,
    right: Matrix<'a>,
    group_len: usize,
}

impl WithSimd for Pack<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Pack { panels: PackedMatrix { columns, width, blocks, data }, right, group_len } = self;
        *columns = right.columns;
        *width = panel_vectors(S::F32_LANES, right.columns) * S::F32_LANES;
        let row = right.columns.next_multiple_of(*width);
        data.resize(right.rows * row, 0.0);
        blocks.clear();
        blocks.extend(split_in_blocks(right.rows, group_len));
        for block in blocks.iter() {
            let packed = &mut data[block.start * row..block.end * row];
            pack_right(packed, right, block.clone(), *width);
        }
    }
}

/// Splits rows into blocks of whole groups, or of equal parts of one group.
fn split_in_blocks(rows: usize, group_len: usize) -> impl Iterator<Item = Range<usize>> {
    let block = group_len * (INNER_BLOCK / group_len).max(1);
    let step = if block > INNER_BLOCK {
        group_len.div_ceil(group_len.div_ceil(INNER_BLOCK))
    } else {
        block
    };
    (0..rows).step_by(block).flat_map(move |start| {
        let end = rows.min(start + block);
        (start..end).step_by(step).map(move |from| from..end.min(from + step))
    })
}

/// Returns the number of SIMD vectors in a row of a panel. One panel row and one left element also
/// need registers: of 16 registers 12 hold sums, of 32 registers (AVX-512) up to 24. With 16
/// registers, tiles of 4 rows and 3 vectors would need all registers; they were half as fast on an
/// EPYC processor.
#[inline(always)]
fn panel_vectors(lanes: usize, columns: usize) -> usize {
    let padded = |vectors: usize| columns.next_multiple_of(vectors * lanes);
    match lanes {
        // Panels have two vectors if with three vectors a large part would be padding.
        16.. if 9 * padded(2) <= 8 * padded(3) => 2,
        16.. => 3,
        _ => 2,
    }
}

/// Operation on tiles of `ROWS` rows and `VECTORS` vectors.
pub(crate) trait TileKernel {
    fn run<S: Simd, const ROWS: usize, const VECTORS: usize>(self, simd: S);
}

/// Runs an operation with the tile size for this machine and these panels.
#[inline(always)]
pub(crate) fn run_in_tiles<S: Simd>(simd: S, panels: &PackedMatrix, kernel: impl TileKernel) {
    match S::F32_LANES {
        16.. if panels.width == 2 * S::F32_LANES => kernel.run::<S, 8, 2>(simd),
        16.. => kernel.run::<S, 8, 3>(simd),
        _ => kernel.run::<S, 6, 2>(simd),
    }
}

/// Reusable buffers of matrix products.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    left: Vec<f32>,
    right: PackedMatrix,
}

/// Computes `out += left * right`; `out` is row-major, shape [left.rows, right.columns].
///
/// # Panics
/// If the shapes do not match, or a slice is too short for its shape.
pub fn gemm(
    arch: Arch,
    out: &mut [f32],
    left: Matrix<'_>,
    right: Matrix<'_>,
    workspace: &mut Workspace,
) {
    assert_eq!(left.columns, right.rows, "inner dimensions differ");
    assert_eq!(out.len(), left.rows * right.columns, "the output has the wrong length");
    if out.is_empty() || left.columns == 0 {
        return;
    }
    let Workspace { left: packed, right: panels } = workspace;
    panels.pack(arch, right, right.rows);
    arch.dispatch(Product { out, left, panels, packed });
}

struct Product<'a> {
    out: &'a mut [f32],
    left: Matrix<'a>,
    panels: &'a PackedMatrix,
    packed: &'a mut Vec<f32>,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        run_in_tiles(simd, self.panels, self);
    }
}

impl TileKernel for Product<'_> {
    #[inline(always)]
    fn run<S: Simd, const ROWS: usize, const VECTORS: usize>(self, simd: S) {
        let Product { out, left, panels, packed } = self;
        let n = panels.columns;
        for (inner, block) in panels.blocks() {
            let depth = inner.len();
            for top in (0..left.rows).step_by(ROW_BLOCK) {
                let height = ROW_BLOCK.min(left.rows - top);
                if left.column_stride != 1 {
                    pack_left::<ROWS>(packed, left, top..top + height, inner.clone());
                }
                let out = &mut out[top * n..][..height * n];
                for (k, right) in block.chunks_exact(depth * panels.width).enumerate() {
                    for (t, out) in out.chunks_mut(ROWS * n).enumerate() {
                        let column = k * panels.width;
                        let mut sums = load_tile::<S, ROWS, VECTORS>(
                            simd,
                            AccumulatorInit::Output,
                            out,
                            column,
                            n,
                        );
                        if left.column_stride == 1 {
                            let mut rows: [&[f32]; ROWS] = [&[]; ROWS];
                            for (i, to) in rows.iter_mut().enumerate() {
                                let row = (top + t * ROWS + i).min(left.rows - 1);
                                *to = &left.data[row * left.row_stride + inner.start..][..depth];
                            }
                            sums = multiply_add::<S, ROWS, VECTORS>(simd, sums, Rows(rows), right);
                        } else {
                            let packed = &packed[t * depth * ROWS..][..depth * ROWS];
                            let packed = Packed(packed.as_chunks::<ROWS>().0);
                            sums = multiply_add::<S, ROWS, VECTORS>(simd, sums, packed, right);
                        }
                        store_tile::<S, ROWS, VECTORS>(simd, sums, out, column, n);
                    }
                }
            }
        }
    }
}

/// Tile of the left matrix, read column by column.
pub(crate) trait Left<const ROWS: usize> {
    fn at(&self, k: usize) -> [f32; ROWS];
}

/// Rows that are read in place, without packing.
pub(crate) struct Rows<'a, const ROWS: usize>(pub [&'a [f32]; ROWS]);

impl<const ROWS: usize> Left<ROWS> for Rows<'_, ROWS> {
    #[inline(always)]
    fn at(&self, k: usize) -> [f32; ROWS] {
        let mut column = [0.0; ROWS];
        for (x, row) in column.iter_mut().zip(&self.0) {
            *x = row[k];
        }
        column
    }
}

/// Rows packed by [`pack_left`].
struct Packed<'a, const ROWS: usize>(&'a [[f32; ROWS]]);

impl<const ROWS: usize> Left<ROWS> for Packed<'_, ROWS> {
    #[inline(always)]
    fn at(&self, k: usize) -> [f32; ROWS] {
        self.0[k]
    }
}

/// Packs a block of the left matrix in tiles of `ROWS` rows: shape [tiles, columns, ROWS], with
/// zeros beyond the last row.
#[inline(always)]
fn pack_left<const ROWS: usize>(
    packed: &mut Vec<f32>,
    left: Matrix<'_>,
    rows: Range<usize>,
    columns: Range<usize>,
) {
    let depth = columns.len();
    packed.resize(rows.len().div_ceil(ROWS) * depth * ROWS, 0.0);
    for (tile, packed) in packed.chunks_exact_mut(depth * ROWS).enumerate() {
        let first = rows.start + tile * ROWS;
        let n_rows = ROWS.min(rows.end - first);
        if n_rows < ROWS {
            packed.fill(0.0);
        }
        if left.column_stride == 1 {
            for i in 0..n_rows {
                let row = &left.data[(first + i) * left.row_stride + columns.start..][..depth];
                for (packed, x) in packed.as_chunks_mut::<ROWS>().0.iter_mut().zip(row) {
                    packed[i] = *x;
                }
            }
        } else if left.row_stride == 1 && n_rows == ROWS {
            for (k, packed) in packed.as_chunks_mut::<ROWS>().0.iter_mut().enumerate() {
                let column = &left.data[(columns.start + k) * left.column_stride + first..];
                packed.copy_from_slice(&column[..ROWS]);
            }
        } else {
            for (k, packed) in packed.as_chunks_mut::<ROWS>().0.iter_mut().enumerate() {
                for (i, packed) in packed.iter_mut().take(n_rows).enumerate() {
                    *packed = left.at(first + i, columns.start + k);
                }
            }
        }
    }
}

/// Packs rows of the right matrix in panels: shape [panels, rows, panel columns], with zeros beyond
/// the last column.
#[inline(always)]
fn pack_right(packed: &mut [f32], right: Matrix<'_>, rows: Range<usize>, panel: usize) {
    for (k, packed) in packed.chunks_exact_mut(rows.len() * panel).enumerate() {
        let first = k * panel;
        let width = panel.min(right.columns - first);
        if width < panel {
            packed.fill(0.0);
        }
        for (i, packed) in packed.chunks_exact_mut(panel).enumerate() {
            let at = (rows.start + i) * right.row_stride + first * right.column_stride;
            if right.column_stride == 1 {
                packed[..width].copy_from_slice(&right.data[at..][..width]);
            } else {
                let row = right.data[at..].iter().step_by(right.column_stride);
                packed[..width].iter_mut().zip(row).for_each(|(packed, x)| *packed = *x);
            }
        }
    }
}

/// Loads the accumulators of a tile that starts at a column. `out` holds its rows of `n` elements
/// each, at most `ROWS`.
#[inline(always)]
pub(crate) fn load_tile<S: Simd, const ROWS: usize, const VECTORS: usize>(
    simd: S,
    init: AccumulatorInit<'_>,
    out: &[f32],
    column: usize,
    n: usize,
) -> [[S::f32s; VECTORS]; ROWS] {
    let width = (VECTORS * S::F32_LANES).min(n - column);
    let mut sums = [[simd.splat_f32s(0.0); VECTORS]; ROWS];
    match init {
        AccumulatorInit::Zero => {}
        AccumulatorInit::Row(row) => {
            sums = [load::<S, VECTORS>(simd, &row[column..][..width]); ROWS]
        }
        AccumulatorInit::Output => {
            for (i, sums) in sums.iter_mut().enumerate() {
                if let Some(row) = out.get(i * n + column..i * n + column + width) {
                    *sums = load::<S, VECTORS>(simd, row);
                }
            }
        }
    }
    sums
}

/// Loads vectors from a slice, with zeros beyond its end.
#[inline(always)]
fn load<S: Simd, const VECTORS: usize>(simd: S, row: &[f32]) -> [S::f32s; VECTORS] {
    let mut sums = [simd.splat_f32s(0.0); VECTORS];
    if row.len() == VECTORS * S::F32_LANES {
        sums.copy_from_slice(S::as_simd_f32s(row).0);
    } else {
        for (v, sum) in sums.iter_mut().enumerate() {
            let from = (v * S::F32_LANES).min(row.len());
            *sum = simd.partial_load_f32s(&row[from..row.len().min(from + S::F32_LANES)]);
        }
    }
    sums
}

/// Adds the product of a left tile and a panel to the accumulators. They are passed by value, so
/// that they stay in registers.
#[inline(always)]
pub(crate) fn multiply_add<S: Simd, const ROWS: usize, const VECTORS: usize>(
    simd: S,
    mut sums: [[S::f32s; VECTORS]; ROWS],
    left: impl Left<ROWS>,
    right: &[f32],
) -> [[S::f32s; VECTORS]; ROWS] {
    let (vectors, _) = S::as_simd_f32s(right);
    for (k, right) in vectors.as_chunks::<VECTORS>().0.iter().enumerate() {
        let left = left.at(k);
        for i in 0..ROWS {
            let x = simd.splat_f32s(left[i]);
            for v in 0..VECTORS {
                sums[i][v] = simd.mul_add_f32s(x, right[v], sums[i][v]);
            }
        }
    }
    sums
}

/// Stores the accumulators of a tile; the counterpart of [`load_tile`].
#[inline(always)]
pub(crate) fn store_tile<S: Simd, const ROWS: usize, const VECTORS: usize>(
    simd: S,
    sums: [[S::f32s; VECTORS]; ROWS],
    out: &mut [f32],
    column: usize,
    n: usize,
) {
    let width = (VECTORS * S::F32_LANES).min(n - column);
    for (i, sums) in sums.iter().enumerate() {
        let Some(row) = out.get_mut(i * n + column..i * n + column + width) else { continue };
        if width == VECTORS * S::F32_LANES {
            let (row, _) = S::as_mut_simd_f32s(row);
            row.copy_from_slice(sums);
        } else {
            for (v, sum) in sums.iter().enumerate() {
                let from = (v * S::F32_LANES).min(width);
                let to = width.min(from + S::F32_LANES);
                simd.partial_store_f32s(&mut row[from..to], *sum);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::widths;
    use chaic_core::rng::RngStream;

    /// Reference implementation.
    fn reference(out: &mut [f32], left: Matrix<'_>, right: Matrix<'_>) {
        for (i, row) in out.chunks_exact_mut(right.columns).enumerate() {
            for (j, sum) in row.iter_mut().enumerate() {
                for k in 0..left.columns {
                    *sum = left.at(i, k).mul_add(right.at(k, j), *sum);
                }
            }
        }
    }

    #[test]
    fn products_are_bit_identical_to_the_reference_at_every_width_and_layout() {
        let mut rng = RngStream::new(1, "gemm", 0);
        let sizes =
            [(1, 1, 1), (13, 7, 33), (96, 193, 32), (100, 400, 50), (5, 25, 224), (31, 3, 1)];
        for (m, k, n) in sizes {
            let mut random =
                |n: usize| -> Vec<f32> { (0..n).map(|_| rng.range(-1.0, 1.0)).collect() };
            let (a, b, c) = (random(m * k), random(k * n), random(m * n));
            let lefts = [Matrix::row_major(&a, m, k), Matrix::row_major(&a, k, m).transposed()];
            let rights = [Matrix::row_major(&b, k, n), Matrix::row_major(&b, n, k).transposed()];
            for (left, right) in lefts.into_iter().flat_map(|l| rights.map(|r| (l, r))) {
                let mut expected = c.clone();
                reference(&mut expected, left, right);
                for (name, arch) in widths() {
                    let mut out = c.clone();
                    gemm(arch, &mut out, left, right, &mut Workspace::default());
                    assert!(out == expected, "{m} x {k} x {n}, {name}");
                }
            }
        }
    }
}
