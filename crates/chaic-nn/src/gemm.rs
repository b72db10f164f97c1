//! Matrix products, the same bits on any machine: each number of the result is a chain of fused
//! multiply-adds in the order of the inner dimension, whatever the vectors' width and the blocks.

use pulp::{Arch, Simd, WithSimd};

/// Columns of the left matrix that are packed at once, so that a panel of the right one stays in the
/// first-level cache.
const INNER_BLOCK: usize = 192;
/// Rows of the left matrix that are packed at once.
const ROW_BLOCK: usize = 64;

/// A matrix in a slice: element (i, j) is `data[i * row_stride + j * column_stride]`.
#[derive(Clone, Copy, Debug)]
pub struct Matrix<'a> {
    /// Its numbers, others between them perhaps.
    pub data: &'a [f32],
    /// How many rows.
    pub rows: usize,
    /// How many columns.
    pub columns: usize,
    /// From a row to the next.
    pub row_stride: usize,
    /// From a column to the next.
    pub column_stride: usize,
}

impl<'a> Matrix<'a> {
    /// Row by row, shape [rows, columns].
    pub fn row_major(data: &'a [f32], rows: usize, columns: usize) -> Matrix<'a> {
        Matrix { data, rows, columns, row_stride: columns, column_stride: 1 }
    }

    /// With rows for columns.
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

/// Working space of products, kept so that they allocate nothing.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    left: Vec<f32>,
    right: Vec<f32>,
}

/// Adds `left` times `right` to `out`, which is row by row, shape [left.rows, right.columns].
///
/// # Panics
/// If the shapes don't fit, or a slice is too short for its shape.
pub fn add_product(
    arch: Arch,
    out: &mut [f32],
    left: Matrix<'_>,
    right: Matrix<'_>,
    workspace: &mut Workspace,
) {
    assert_eq!(left.columns, right.rows, "inner dimensions differ");
    assert_eq!(out.len(), left.rows * right.columns, "the result has another shape");
    if out.is_empty() || left.columns == 0 {
        return;
    }
    arch.dispatch(Product { out, left, right, workspace });
}

struct Product<'a> {
    out: &'a mut [f32],
    left: Matrix<'a>,
    right: Matrix<'a>,
    workspace: &'a mut Workspace,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // As many accumulators as registers hold beside a row of the panel and a number of the left.
        let columns = |vectors: usize| {
            let panel = vectors * S::F32_LANES;
            self.right.columns.div_ceil(panel) * panel
        };
        match S::F32_LANES {
            // Panels of two vectors where those of three would be empty for a good part.
            16.. if 5 * columns(2) < 4 * columns(3) => self.run::<S, 8, 2>(simd),
            16.. => self.run::<S, 8, 3>(simd),
            _ => self.run::<S, 4, 3>(simd),
        }
    }
}

impl Product<'_> {
    #[inline(always)]
    fn run<S: Simd, const ROWS: usize, const VECTORS: usize>(self, simd: S) {
        let Product { out, left, right, workspace } = self;
        let panel = VECTORS * S::F32_LANES;
        let n = right.columns;
        for inner in (0..left.columns).step_by(INNER_BLOCK) {
            let depth = INNER_BLOCK.min(left.columns - inner);
            pack_right(&mut workspace.right, right, (inner, depth), panel);
            for top in (0..left.rows).step_by(ROW_BLOCK) {
                let height = ROW_BLOCK.min(left.rows - top);
                if left.column_stride != 1 || !height.is_multiple_of(ROWS) {
                    pack_left::<ROWS>(&mut workspace.left, left, (top, height), (inner, depth));
                }
                let out = &mut out[top * n..][..height * n];
                let panels = workspace.right.chunks_exact(depth * panel);
                for (k, right) in panels.enumerate() {
                    let tiles = out.chunks_mut(ROWS * n).enumerate();
                    for (t, out) in tiles {
                        let place = (k * panel, n);
                        let n_rows = ROWS.min(height - t * ROWS);
                        if left.column_stride == 1 && n_rows == ROWS {
                            let first = (top + t * ROWS) * left.row_stride + inner;
                            let rows: [&[f32]; ROWS] = std::array::from_fn(|i| {
                                &left.data[first + i * left.row_stride..][..depth]
                            });
                            tile::<S, ROWS, VECTORS>(simd, Rows(rows), right, out, place);
                        } else {
                            let packed = &workspace.left[t * depth * ROWS..][..depth * ROWS];
                            let packed = Packed(packed.as_chunks::<ROWS>().0);
                            tile::<S, ROWS, VECTORS>(simd, packed, right, out, place);
                        }
                    }
                }
            }
        }
    }
}

/// So many rows of the left matrix, column by column.
trait Left<const ROWS: usize> {
    fn at(&self, k: usize) -> [f32; ROWS];
}

/// Rows where they are.
struct Rows<'a, const ROWS: usize>([&'a [f32]; ROWS]);

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

/// Packs `depth` columns of so many rows, tile by tile of `ROWS`: shape [tiles, depth, ROWS], with
/// zeros beyond the last row.
#[inline(always)]
fn pack_left<const ROWS: usize>(
    packed: &mut Vec<f32>,
    left: Matrix<'_>,
    (top, height): (usize, usize),
    (inner, depth): (usize, usize),
) {
    packed.resize(height.div_ceil(ROWS) * depth * ROWS, 0.0);
    for (tile, packed) in packed.chunks_exact_mut(depth * ROWS).enumerate() {
        let first = top + tile * ROWS;
        let n_rows = ROWS.min(top + height - first);
        if n_rows < ROWS {
            packed.fill(0.0);
        }
        if left.column_stride == 1 {
            for i in 0..n_rows {
                let row = &left.data[(first + i) * left.row_stride + inner..][..depth];
                for (packed, x) in packed.as_chunks_mut::<ROWS>().0.iter_mut().zip(row) {
                    packed[i] = *x;
                }
            }
        } else if left.row_stride == 1 && n_rows == ROWS {
            for (k, packed) in packed.as_chunks_mut::<ROWS>().0.iter_mut().enumerate() {
                let column = &left.data[(inner + k) * left.column_stride + first..];
                packed.copy_from_slice(&column[..ROWS]);
            }
        } else {
            for (k, packed) in packed.as_chunks_mut::<ROWS>().0.iter_mut().enumerate() {
                for (i, packed) in packed.iter_mut().take(n_rows).enumerate() {
                    *packed = left.at(first + i, inner + k);
                }
            }
        }
    }
}

/// Packs `depth` rows, panel by panel of so many columns: shape [panels, depth, panel], with zeros
/// beyond the last column.
#[inline(always)]
fn pack_right(
    packed: &mut Vec<f32>,
    right: Matrix<'_>,
    (inner, depth): (usize, usize),
    panel: usize,
) {
    packed.resize(right.columns.div_ceil(panel) * depth * panel, 0.0);
    for (k, packed) in packed.chunks_exact_mut(depth * panel).enumerate() {
        let first = k * panel;
        let width = panel.min(right.columns - first);
        if width < panel {
            packed.fill(0.0);
        }
        for (i, packed) in packed.chunks_exact_mut(panel).enumerate() {
            let at = (inner + i) * right.row_stride + first * right.column_stride;
            if right.column_stride == 1 {
                packed[..width].copy_from_slice(&right.data[at..][..width]);
            } else {
                let row = right.data[at..].iter().step_by(right.column_stride);
                packed[..width].iter_mut().zip(row).for_each(|(packed, x)| *packed = *x);
            }
        }
    }
}

/// Adds the product of a packed tile and a packed panel to the rows `out` of the result, from a
/// column on, which are `n` numbers long.
#[inline(always)]
fn tile<S: Simd, const ROWS: usize, const VECTORS: usize>(
    simd: S,
    left: impl Left<ROWS>,
    right: &[f32],
    out: &mut [f32],
    (column, n): (usize, usize),
) {
    let width = (VECTORS * S::F32_LANES).min(n - column);
    let is_whole = width == VECTORS * S::F32_LANES;
    let mut sums = [[simd.splat_f32s(0.0); VECTORS]; ROWS];
    for (sums, row) in sums.iter_mut().zip(out.chunks_exact(n)) {
        let row = &row[column..][..width];
        if is_whole {
            sums.copy_from_slice(S::as_simd_f32s(row).0);
            continue;
        }
        for (v, sum) in sums.iter_mut().enumerate() {
            let from = (v * S::F32_LANES).min(width);
            *sum = simd.partial_load_f32s(&row[from..width.min(from + S::F32_LANES)]);
        }
    }
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
    for (sums, row) in sums.iter().zip(out.chunks_exact_mut(n)) {
        let row = &mut row[column..][..width];
        if is_whole {
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
    use chaic_protocol::rng::Stream;

    /// The definition.
    fn by_hand(out: &mut [f32], left: Matrix<'_>, right: Matrix<'_>) {
        for (i, row) in out.chunks_exact_mut(right.columns).enumerate() {
            for (j, sum) in row.iter_mut().enumerate() {
                for k in 0..left.columns {
                    *sum = left.at(i, k).mul_add(right.at(k, j), *sum);
                }
            }
        }
    }

    #[test]
    fn products_are_the_same_bits_as_by_hand_at_every_width_and_layout() {
        let mut rng = Stream::new(1, "gemm", 0);
        let sizes =
            [(1, 1, 1), (13, 7, 33), (96, 193, 32), (100, 400, 50), (5, 25, 224), (31, 3, 1)];
        for (m, k, n) in sizes {
            let mut numbers =
                |n: usize| -> Vec<f32> { (0..n).map(|_| rng.range(-1.0, 1.0)).collect() };
            let (a, b, c) = (numbers(m * k), numbers(k * n), numbers(m * n));
            let lefts = [Matrix::row_major(&a, m, k), Matrix::row_major(&a, k, m).transposed()];
            let rights = [Matrix::row_major(&b, k, n), Matrix::row_major(&b, n, k).transposed()];
            for (left, right) in lefts.into_iter().flat_map(|l| rights.map(|r| (l, r))) {
                let mut expected = c.clone();
                by_hand(&mut expected, left, right);
                for (name, arch) in widths() {
                    let mut out = c.clone();
                    add_product(arch, &mut out, left, right, &mut Workspace::default());
                    assert!(out == expected, "{m} x {k} x {n}, {name}");
                }
            }
        }
    }
}
