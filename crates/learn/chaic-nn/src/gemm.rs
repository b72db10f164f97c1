//! Matrix products, the same bits on any machine: each number of the result is a chain of fused
//! multiply-adds in the order of the inner dimension, whatever the vectors' width and the blocks.

use std::ops::Range;

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

/// What the sums of a product begin with.
#[derive(Clone, Copy, Debug)]
pub enum Begin<'a> {
    /// What the result holds already.
    Result,
    /// Zero.
    Zero,
    /// A number for each column.
    Row(&'a [f32]),
}

/// A right matrix in the order in which products read it: blocks of rows; in each, panels of columns, as
/// wide as a few vectors of one machine; shape [blocks, panels, rows of the block, columns of a panel],
/// with zeros beyond the last column.
#[derive(Clone, Debug, Default)]
pub struct Panels {
    columns: usize,
    width: usize,
    /// The rows of each block.
    blocks: Vec<Range<usize>>,
    data: Vec<f32>,
}

impl Panels {
    /// Takes in a matrix, whose rows come in runs of so many: a block has whole runs, or a part of one.
    ///
    /// # Panics
    /// If the rows are no multiple of a run.
    pub fn pack(&mut self, arch: Arch, right: Matrix<'_>, run: usize) {
        assert!(run > 0 && right.rows.is_multiple_of(run), "{} rows in runs of {run}", right.rows);
        arch.dispatch(Pack { panels: self, right, run });
    }

    /// Columns of the matrix.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The rows of each block, and its panels one after the other.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (Range<usize>, &[f32])> {
        let row = self.columns.next_multiple_of(self.width.max(1));
        self.blocks
            .iter()
            .map(move |rows| (rows.clone(), &self.data[rows.start * row..rows.end * row]))
    }

    /// How many columns a panel has.
    pub(crate) fn width(&self) -> usize {
        self.width
    }
}

struct Pack<'a> {
    panels: &'a mut Panels,
    right: Matrix<'a>,
    run: usize,
}

impl WithSimd for Pack<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Pack { panels: Panels { columns, width, blocks, data }, right, run } = self;
        *columns = right.columns;
        *width = panel_vectors(S::F32_LANES, right.columns) * S::F32_LANES;
        let row = right.columns.next_multiple_of(*width);
        data.resize(right.rows * row, 0.0);
        blocks.clear();
        blocks.extend(in_blocks(right.rows, run));
        for block in blocks.iter() {
            let packed = &mut data[block.start * row..block.end * row];
            pack_right(packed, right, (block.start, block.len()), *width);
        }
    }
}

/// Rows in blocks: some whole runs each, or even parts of one.
fn in_blocks(rows: usize, run: usize) -> impl Iterator<Item = Range<usize>> {
    let whole = run * (INNER_BLOCK / run).max(1);
    let step = if whole > INNER_BLOCK { run.div_ceil(run.div_ceil(INNER_BLOCK)) } else { whole };
    (0..rows).step_by(whole).flat_map(move |start| {
        let end = rows.min(start + whole);
        (start..end).step_by(step).map(move |from| from..end.min(from + step))
    })
}

/// How many vectors wide panels are: as many as leave registers for a row of the panel and a number of
/// the left matrix beside the sums.
#[inline(always)]
fn panel_vectors(lanes: usize, columns: usize) -> usize {
    let padded = |vectors: usize| columns.next_multiple_of(vectors * lanes);
    match lanes {
        // Panels of two vectors where those of three would be empty for a good part.
        16.. if 9 * padded(2) <= 8 * padded(3) => 2,
        _ => 3,
    }
}

/// What can be done in tiles of so many rows and vectors.
pub(crate) trait Tiled {
    fn run<S: Simd, const ROWS: usize, const VECTORS: usize>(self, simd: S);
}

/// Runs tiles of the size that this machine and these panels ask for.
#[inline(always)]
pub(crate) fn in_tiles<S: Simd>(simd: S, panels: &Panels, work: impl Tiled) {
    match S::F32_LANES {
        16.. if panels.width == 2 * S::F32_LANES => work.run::<S, 8, 2>(simd),
        16.. => work.run::<S, 8, 3>(simd),
        _ => work.run::<S, 4, 3>(simd),
    }
}

/// Working space of products, kept so that they allocate nothing.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    left: Vec<f32>,
    right: Panels,
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
    let Workspace { left: packed, right: panels } = workspace;
    panels.pack(arch, right, right.rows);
    arch.dispatch(Product { out, left, panels, packed });
}

struct Product<'a> {
    out: &'a mut [f32],
    left: Matrix<'a>,
    panels: &'a Panels,
    packed: &'a mut Vec<f32>,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        in_tiles(simd, self.panels, self);
    }
}

impl Tiled for Product<'_> {
    #[inline(always)]
    fn run<S: Simd, const ROWS: usize, const VECTORS: usize>(self, simd: S) {
        let Product { out, left, panels, packed } = self;
        let n = panels.columns;
        for (inner, block) in panels.blocks() {
            let (inner, depth) = (inner.start, inner.len());
            for top in (0..left.rows).step_by(ROW_BLOCK) {
                let height = ROW_BLOCK.min(left.rows - top);
                if left.column_stride != 1 {
                    pack_left::<ROWS>(packed, left, (top, height), (inner, depth));
                }
                let out = &mut out[top * n..][..height * n];
                for (k, right) in block.chunks_exact(depth * panels.width).enumerate() {
                    for (t, out) in out.chunks_mut(ROWS * n).enumerate() {
                        let place = (k * panels.width, n);
                        let mut sums = begin::<S, ROWS, VECTORS>(simd, Begin::Result, out, place);
                        if left.column_stride == 1 {
                            let mut rows: [&[f32]; ROWS] = [&[]; ROWS];
                            for (i, to) in rows.iter_mut().enumerate() {
                                let row = (top + t * ROWS + i).min(left.rows - 1);
                                *to = &left.data[row * left.row_stride + inner..][..depth];
                            }
                            sums = add::<S, ROWS, VECTORS>(simd, sums, Rows(rows), right);
                        } else {
                            let packed = &packed[t * depth * ROWS..][..depth * ROWS];
                            let packed = Packed(packed.as_chunks::<ROWS>().0);
                            sums = add::<S, ROWS, VECTORS>(simd, sums, packed, right);
                        }
                        end::<S, ROWS, VECTORS>(simd, sums, out, place);
                    }
                }
            }
        }
    }
}

/// So many rows of the left matrix, column by column.
pub(crate) trait Left<const ROWS: usize> {
    fn at(&self, k: usize) -> [f32; ROWS];
}

/// Rows where they are.
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
fn pack_right(packed: &mut [f32], right: Matrix<'_>, (inner, depth): (usize, usize), panel: usize) {
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

/// The sums of a tile as they begin. `out` has its rows, of `n` numbers each, fewer than `ROWS` at the
/// end of a matrix; the tile begins at a column.
#[inline(always)]
pub(crate) fn begin<S: Simd, const ROWS: usize, const VECTORS: usize>(
    simd: S,
    begin: Begin<'_>,
    out: &[f32],
    (column, n): (usize, usize),
) -> [[S::f32s; VECTORS]; ROWS] {
    let width = (VECTORS * S::F32_LANES).min(n - column);
    let mut sums = [[simd.splat_f32s(0.0); VECTORS]; ROWS];
    match begin {
        Begin::Zero => {}
        Begin::Row(row) => sums = [load::<S, VECTORS>(simd, &row[column..][..width]); ROWS],
        Begin::Result => {
            for (i, sums) in sums.iter_mut().enumerate() {
                if let Some(row) = out.get(i * n + column..i * n + column + width) {
                    *sums = load::<S, VECTORS>(simd, row);
                }
            }
        }
    }
    sums
}

/// Vectors of these numbers, with zeros beyond the last.
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

/// The sums of a tile with the product of some rows and a panel, which has as many rows as those have
/// columns. By value, so that they stay in registers.
#[inline(always)]
pub(crate) fn add<S: Simd, const ROWS: usize, const VECTORS: usize>(
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

/// Writes the sums of a tile to where [`begin`] took them from.
#[inline(always)]
pub(crate) fn end<S: Simd, const ROWS: usize, const VECTORS: usize>(
    simd: S,
    sums: [[S::f32s; VECTORS]; ROWS],
    out: &mut [f32],
    (column, n): (usize, usize),
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
    use chaic_core::rng::Stream;

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
