//! Rasterization: fills triangles span by span into a buffer of inverse depth and visibility ids,
//! with a hierarchical z-buffer for occlusion culling.
//!
//! For each pixel, the buffer holds the inverse depth and the id of the nearest surface (a
//! visibility buffer). Colors are computed later, for visible surfaces only. The inner loops are
//! SIMD over [`LANES`] pixels in plain arrays, see [`crate::view`].

use std::ops::{Deref, DerefMut};

use chaic_core::EntityId;

use crate::setup::{DepthPlane, TriangleSetup, first_center, fmax, fmin};

/// Id of a pixel without a surface.
pub(crate) const BACKGROUND: u32 = u32::MAX;
/// Rows of a tile, whose minimum inverse depth is kept per column.
pub(crate) const TILE_ROWS: usize = 8;
/// Number of neighboring pixels of a row that are filled together.
pub(crate) const LANES: usize = 16;
/// Number of rows whose spans are computed together.
const ROWS: usize = 16;

/// Packs an instance and a triangle, or the first triangle of a face, into 32 bits.
pub(crate) fn visibility_id(instance: usize, triangle: usize) -> u32 {
    debug_assert!(instance < 0xffff && triangle < 0x1_0000);
    (instance as u32) << 16 | triangle as u32
}

/// Unpacks the instance and triangle of [`visibility_id`].
pub(crate) fn unpack_visibility_id(id: u32) -> (usize, usize) {
    ((id >> 16) as usize, (id & 0xffff) as usize)
}

/// Id of the surface at a pixel of the visibility buffer.
pub(crate) trait VisibilityId: Copy + PartialEq {
    /// Id of a pixel without a surface.
    const BACKGROUND: Self;

    /// Neighboring pixels, aligned so that they are loaded and stored together.
    type Block: Copy + std::fmt::Debug + Default;

    /// Block of pixels that all have this id.
    fn block(self) -> Self::Block;

    /// Ids of the pixels of a block.
    fn unpack(block: &Self::Block) -> [Self; LANES];

    /// Id of a triangle of an instance of an entity.
    fn new(entity: EntityId, instance: usize, triangle: usize) -> Self;

    /// Replaces the id of pixel `k` by `new` if all bits of the mask are set; keeps it if none is.
    fn replace(block: &mut Self::Block, k: usize, new: Self, mask: u32);
}

/// A block of pixels with 32-bit values. Blocks that cross a cache line boundary make rendering
/// about 4% slower.
#[repr(align(64))]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Block32<T>([T; LANES]);

impl<T> Deref for Block32<T> {
    type Target = [T; LANES];

    #[inline(always)]
    fn deref(&self) -> &[T; LANES] {
        &self.0
    }
}

impl<T> DerefMut for Block32<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T; LANES] {
        &mut self.0
    }
}

/// A block of 16-bit ids.
#[repr(align(32))]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct IdBlock16([u16; LANES]);

/// A block of 32-bit ids in two halves. A selection of 32-bit values compiles to masked stores,
/// which make rendering in color up to 10 % slower.
#[repr(align(64))]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct IdBlock32 {
    low: [u16; LANES],
    high: [u16; LANES],
}

/// Returns `new` if all bits of the mask are set, and `old` if none is.
#[inline(always)]
fn select(old: u16, new: u16, mask: u32) -> u16 {
    (new & mask as u16) | (old & !mask as u16)
}

/// Identifies a triangle, as shading needs it: see [`visibility_id`].
impl VisibilityId for u32 {
    const BACKGROUND: u32 = BACKGROUND;
    type Block = IdBlock32;

    fn block(self) -> IdBlock32 {
        IdBlock32 { low: [self as u16; LANES], high: [(self >> 16) as u16; LANES] }
    }

    #[inline(always)]
    fn unpack(block: &IdBlock32) -> [u32; LANES] {
        let IdBlock32 { low, high } = block;
        let mut ids = [0; LANES];
        for k in 0..LANES {
            ids[k] = u32::from(high[k]) << 16 | u32::from(low[k]);
        }
        ids
    }

    #[inline]
    fn new(_: EntityId, instance: usize, triangle: usize) -> u32 {
        visibility_id(instance, triangle)
    }

    #[inline(always)]
    fn replace(block: &mut IdBlock32, k: usize, new: u32, mask: u32) {
        block.low[k] = select(block.low[k], new as u16, mask);
        block.high[k] = select(block.high[k], (new >> 16) as u16, mask);
    }
}

/// Identifies only an entity, for views without color. It halves the memory traffic.
impl VisibilityId for u16 {
    const BACKGROUND: u16 = EntityId::NOTHING.0;
    type Block = IdBlock16;

    fn block(self) -> IdBlock16 {
        IdBlock16([self; LANES])
    }

    #[inline(always)]
    fn unpack(block: &IdBlock16) -> [u16; LANES] {
        block.0
    }

    #[inline]
    fn new(entity: EntityId, _: usize, _: usize) -> u16 {
        entity.0
    }

    #[inline(always)]
    fn replace(block: &mut IdBlock16, k: usize, new: u16, mask: u32) {
        block.0[k] = select(block.0[k], new, mask);
    }
}

/// A tile: blocks of [`LANES`] pixels below each other. An image consists of rows of tiles, so that
/// pixels near each other on the image are near in memory.
type PixelTile<B> = [B; TILE_ROWS];

/// One row of blocks across tiles.
#[derive(Clone, Copy)]
pub(crate) struct Blocks<'a, B> {
    tiles: &'a [PixelTile<B>],
    row: usize,
}

impl<'a, B> Blocks<'a, B> {
    /// Returns block `k`, if it exists.
    #[inline(always)]
    pub fn get(self, k: usize) -> Option<&'a B> {
        self.tiles.get(k).map(|tile| &tile[self.row])
    }

    /// Iterates over all blocks.
    #[inline(always)]
    pub fn iter(self) -> impl Iterator<Item = &'a B> {
        self.tiles.iter().map(move |tile| &tile[self.row])
    }
}

/// Depth buffer and visibility buffer. Tile pixels outside the image have infinite inverse depth,
/// so that they never pass the depth test.
#[derive(Clone, Debug, Default)]
pub(crate) struct RenderTarget<V: VisibilityId> {
    pub width: usize,
    pub height: usize,
    /// Number of tiles per row.
    tiles_per_row: usize,
    /// Inverse depth, f32, shape [tile rows, tiles_per_row].
    inverse_depth: Vec<PixelTile<Block32<f32>>>,
    /// Visibility ids, of the same shape.
    visibility_ids: Vec<PixelTile<V::Block>>,
    /// Hierarchical z-buffer: minimum inverse depth (the farthest) of each column of each tile.
    hi_z: Vec<Block32<f32>>,
    /// True if a tile was drawn to since its `hi_z` was updated.
    is_dirty: Vec<bool>,
}

impl<V: VisibilityId> RenderTarget<V> {
    /// Clears the buffers. Only surfaces with an inverse depth above `background` are drawn.
    #[inline(always)]
    pub fn clear(&mut self, width: usize, height: usize, background: f32) {
        (self.width, self.height) = (width, height);
        self.tiles_per_row = width.div_ceil(LANES);
        let tile_rows = height.div_ceil(TILE_ROWS);
        let n = self.tiles_per_row * tile_rows;
        self.inverse_depth.resize_with(n, Default::default);
        self.inverse_depth.fill([Block32([background; LANES]); TILE_ROWS]);
        let (columns_in_last, rows_in_last) = (width % LANES, height % TILE_ROWS);
        if columns_in_last > 0 || rows_in_last > 0 {
            for (k, tile) in self.inverse_depth.iter_mut().enumerate() {
                if columns_in_last > 0 && (k + 1) % self.tiles_per_row == 0 {
                    tile.iter_mut().for_each(|block| block[columns_in_last..].fill(f32::INFINITY));
                }
                if rows_in_last > 0 && k / self.tiles_per_row + 1 == tile_rows {
                    tile[rows_in_last..].fill(Block32([f32::INFINITY; LANES]));
                }
            }
        }
        self.visibility_ids.resize_with(n, Default::default);
        self.visibility_ids.fill([V::BACKGROUND.block(); TILE_ROWS]);
        self.hi_z.clear();
        self.hi_z.resize(n, Block32([background; LANES]));
        self.is_dirty.clear();
        self.is_dirty.resize(n, false);
    }

    /// Returns the inverse depths of a row.
    #[inline(always)]
    pub fn inverse_depth(&self, row: usize) -> Blocks<'_, Block32<f32>> {
        let tiles =
            &self.inverse_depth[row / TILE_ROWS * self.tiles_per_row..][..self.tiles_per_row];
        Blocks { tiles, row: row % TILE_ROWS }
    }

    /// Returns the visibility ids of a row.
    #[inline(always)]
    pub fn visibility_ids(&self, row: usize) -> Blocks<'_, V::Block> {
        let tiles =
            &self.visibility_ids[row / TILE_ROWS * self.tiles_per_row..][..self.tiles_per_row];
        Blocks { tiles, row: row % TILE_ROWS }
    }

    /// Converts the inverse depth of each pixel with `convert`, shape [height, width].
    #[inline(always)]
    pub fn copy_inverse_depth(
        &self,
        out: &mut [f32],
        convert: impl Fn(&Block32<f32>) -> [f32; LANES],
    ) {
        copy_rows(&self.inverse_depth, self.tiles_per_row, self.width, out, convert);
    }

    /// Copies the visibility id of each pixel, shape [height, width].
    #[inline(always)]
    pub fn copy_visibility_ids(&self, out: &mut [V]) {
        copy_rows(&self.visibility_ids, self.tiles_per_row, self.width, out, V::unpack);
    }

    /// Pixels that a rectangle (minimum u and v, maximum u and v) touches: first and last columns
    /// and rows.
    fn pixel_range(&self, [u0, v0, u1, v1]: [f32; 4]) -> [(usize, usize); 2] {
        let pixel = |x: f32, n: usize| (x.max(0.0) as usize).min(n.saturating_sub(1));
        let (columns, rows) = (self.width, self.height);
        [(pixel(u0, columns), pixel(u1, columns)), (pixel(v0, rows), pixel(v1, rows))]
    }

    /// Marks the tiles of a rectangle as drawn to, with a margin of one pixel.
    pub fn mark_dirty(&mut self, [u0, v0, u1, v1]: [f32; 4]) {
        let [(i0, i1), (j0, j1)] = self.pixel_range([u0 - 1.0, v0 - 1.0, u1 + 1.0, v1 + 1.0]);
        let rows = self.is_dirty.chunks_mut(self.tiles_per_row.max(1));
        for row in rows.take(j1 / TILE_ROWS + 1).skip(j0 / TILE_ROWS) {
            row[i0 / LANES..=i1 / LANES].fill(true);
        }
    }

    /// Returns whether everything inside the rectangle at inverse depth `q` or less is occluded.
    /// Tiles marked by [`RenderTarget::mark_dirty`] are updated only where they decide. Most
    /// visible objects are decided in the first tile.
    #[inline(always)]
    pub fn is_occluded(&mut self, rect: [f32; 4], q: f32) -> bool {
        let [(i0, i1), (j0, j1)] = self.pixel_range(rect);
        if self.hi_z.is_empty() {
            return false;
        }
        for j in j0 / TILE_ROWS..=j1 / TILE_ROWS {
            for i in i0 / LANES..=i1 / LANES {
                let k = j * self.tiles_per_row + i;
                if !has_farther_pixel(&self.hi_z[k], LANES * i, i0, i1, q) {
                    continue;
                }
                // An earlier result stays valid after drawing: inverse depth only increases.
                if !std::mem::take(&mut self.is_dirty[k]) {
                    return false;
                }
                self.hi_z[k] = farthest_per_column(&self.inverse_depth[k]);
                if has_farther_pixel(&self.hi_z[k], LANES * i, i0, i1, q) {
                    return false;
                }
            }
        }
        true
    }

    /// Fills the pixels whose centers are inside a triangle.
    #[inline(always)]
    pub fn fill(&mut self, setup: &TriangleSetup, id: V) {
        let TriangleSetup {
            first_row,
            middle_row,
            end_row,
            top,
            middle_vertex,
            columns_per_row,
            short_edges_right,
            depth_plane,
        } = *setup;
        let columns = self.width as f32;
        let q_left = depth_plane.q + depth_plane.du * (0.5 - depth_plane.u0);
        let mut begins = [0; ROWS];
        let mut ends = [0; ROWS];
        let mut starts = [0.0; ROWS];
        let mut row = first_row;
        while row < end_row {
            for k in 0..ROWS {
                let row = row + k as u32;
                let v = row as i32 as f32 + 0.5;
                let long = top[0] + (v - top[1]) * columns_per_row[0];
                let upper = top[0] + (v - top[1]) * columns_per_row[1];
                let lower = middle_vertex[0] + (v - middle_vertex[1]) * columns_per_row[2];
                let short = if row < middle_row { upper } else { lower };
                begins[k] = first_center(if short_edges_right { long } else { short }, columns);
                ends[k] = first_center(if short_edges_right { short } else { long }, columns);
                starts[k] = q_left + depth_plane.dv * (v - depth_plane.v0);
            }
            let n = (end_row - row).min(ROWS as u32);
            // Bit `k` is set if row `k` covers a pixel center.
            let mut covered = 0u32;
            for k in 0..ROWS {
                covered |= u32::from(begins[k] < ends[k]) << k;
            }
            covered &= (1 << n) - 1;
            while covered != 0 {
                let k = covered.trailing_zeros() as usize % ROWS;
                covered &= covered - 1;
                let row = row as usize + k;
                let (tiles, row) = (row / TILE_ROWS * self.tiles_per_row, row % TILE_ROWS);
                let (inverse_depth, visibility_ids) =
                    (&mut self.inverse_depth[tiles..], &mut self.visibility_ids[tiles..]);
                let span = Span { begin: begins[k], end: ends[k] };
                fill_span::<V>(
                    inverse_depth,
                    visibility_ids,
                    row,
                    starts[k],
                    span,
                    &depth_plane,
                    id,
                );
            }
            row += n;
        }
    }
}

/// Writes the converted blocks to the rows of an image, tile by tile.
#[inline(always)]
fn copy_rows<B, T: Copy>(
    tiles: &[PixelTile<B>],
    tiles_per_row: usize,
    width: usize,
    out: &mut [T],
    convert: impl Fn(&B) -> [T; LANES],
) {
    let rows_of_tiles = tiles.chunks_exact(tiles_per_row.max(1));
    for (rows, tiles) in out.chunks_mut((TILE_ROWS * width).max(1)).zip(rows_of_tiles) {
        for (i, tile) in tiles.iter().enumerate() {
            for (row, block) in rows.chunks_exact_mut(width).zip(tile) {
                let (values, row) = (convert(block), &mut row[LANES * i..]);
                match row.first_chunk_mut() {
                    Some(out) => *out = values,
                    None => row.iter_mut().zip(values).for_each(|(out, x)| *out = x),
                }
            }
        }
    }
}

/// Returns whether a surface at `q` is nearer than the farthest pixel of a tile in one of the
/// columns `first..=last`. The first column of the tile is `column_0`.
#[inline(always)]
fn has_farther_pixel(
    farthest: &Block32<f32>,
    column_0: usize,
    first: usize,
    last: usize,
    q: f32,
) -> bool {
    let mut found = false;
    for k in 0..LANES {
        let column = column_0 + k;
        found |= (column >= first) & (column <= last) & (farthest[k] < q);
    }
    found
}

/// Minimum of each column of a tile.
#[inline(always)]
fn farthest_per_column(tile: &PixelTile<Block32<f32>>) -> Block32<f32> {
    let mut columns = Block32([f32::INFINITY; LANES]);
    for block in tile {
        for k in 0..LANES {
            columns[k] = fmin(columns[k], block[k]);
        }
    }
    columns
}

/// A range of columns, `begin..end`.
#[derive(Clone, Copy)]
struct Span {
    begin: u32,
    end: u32,
}

/// Fills a span of one row of tiles.
#[inline(always)]
fn fill_span<V: VisibilityId>(
    inverse_depth: &mut [PixelTile<Block32<f32>>],
    visibility_ids: &mut [PixelTile<V::Block>],
    row: usize,
    q0: f32,
    span: Span,
    depth_plane: &DepthPlane,
    id: V,
) {
    let mut k = span.begin as usize / LANES;
    // Most spans lie within one block.
    while let (Some(q), Some(o)) = (inverse_depth.get_mut(k), visibility_ids.get_mut(k)) {
        let (q, o) = (&mut q[row], &mut o[row]);
        fill_block::<V>(q, o, q0, (LANES * k) as u32, span, depth_plane, id);
        k += 1;
        if LANES * k >= span.end as usize {
            break;
        }
    }
}

/// Fills the pixels of a block inside a span. The first pixel of the block is in column `column_0`.
#[inline(always)]
fn fill_block<V: VisibilityId>(
    q: &mut [f32; LANES],
    o: &mut V::Block,
    q0: f32,
    column_0: u32,
    span: Span,
    depth_plane: &DepthPlane,
    id: V,
) {
    let DepthPlane { du, low, high, .. } = *depth_plane;
    let Span { begin, end } = span;
    let length = end.saturating_sub(begin);
    // Masks instead of conditions, which the compiler would turn into branches. Plain loops:
    // closures would be compiled separately, without the vector instructions of this machine.
    let mut nearest = [0.0; LANES];
    for k in 0..LANES {
        let column = column_0 + k as u32;
        let is_inside = u32::from(column.wrapping_sub(begin) < length).wrapping_neg();
        let x = fmin(high, fmax(low, q0 + du * column as i32 as f32));
        // 0 outside the span, which is never nearer than the buffer.
        let x = f32::from_bits(x.to_bits() & is_inside);
        V::replace(o, k, id, u32::from(x > q[k]).wrapping_neg());
        // A maximum, since a selection compiles to masked stores, which are slow on some machines.
        nearest[k] = fmax(x, q[k]);
    }
    *q = nearest;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::ScreenVertex;

    fn vertex(u: f32, v: f32) -> ScreenVertex {
        ScreenVertex { u, v, q: 1.0 }
    }

    fn draw(target: &mut RenderTarget<u32>, [a, b, c]: [ScreenVertex; 3], id: u32) {
        let setup = TriangleSetup::from_screen_vertices(a, b, c, target.height as f32);
        target.fill(&setup, id);
    }

    fn visibility_ids(target: &RenderTarget<u32>) -> impl Iterator<Item = u32> {
        let rows = (0..target.height).map(|j| target.visibility_ids(j));
        rows.flat_map(|row| row.iter().flat_map(u32::unpack).take(target.width))
    }

    /// A fan of thin triangles around a point covers every pixel exactly once.
    #[test]
    fn adjacent_triangles_leave_no_gap_and_no_overlap() {
        let n = 23;
        let rim = |k: usize| {
            let a = std::f32::consts::TAU * (k % n) as f32 / n as f32;
            let (c, s) = (chaic_core::geom::math::cos(a), chaic_core::geom::math::sin(a));
            vertex(32.3 + 200.0 * c, 31.7 + 200.0 * s)
        };
        let mut count = vec![0; 64 * 64];
        for k in 0..n {
            let mut target = RenderTarget::<u32>::default();
            target.clear(64, 64, 0.0);
            draw(&mut target, [vertex(32.3, 31.7), rim(k + 1), rim(k)], k as u32);
            for (n, o) in count.iter_mut().zip(visibility_ids(&target)) {
                *n += i32::from(o != BACKGROUND);
            }
        }
        assert!(count.iter().all(|n| *n == 1));
    }

    /// Reference for [`fill_span`], pixel by pixel.
    fn fill_reference(
        q: &mut [f32],
        o: &mut [u32],
        q0: f32,
        begin: u32,
        depth_plane: &DepthPlane,
        id: u32,
    ) {
        for (k, (q, o)) in q.iter_mut().zip(o).enumerate() {
            let x = q0 + depth_plane.du * (begin + k as u32) as f32;
            let x = if x < depth_plane.low { depth_plane.low } else { x };
            let x = if x > depth_plane.high { depth_plane.high } else { x };
            if x > *q {
                (*q, *o) = (x, id);
            }
        }
    }

    #[test]
    fn spans_of_any_length_match_the_reference() {
        let mut rng = chaic_core::rng::RngStream::new(1, "spans", 0);
        for n in (0..40).cycle().take(2000) {
            let before: Vec<f32> = (0..6 * LANES).map(|_| rng.range(0.0, 1.0)).collect();
            let du =
                [0.0, rng.range(-0.05, 0.05), f32::NAN, 1e30][rng.below(40).saturating_sub(36)];
            let depth_plane =
                DepthPlane { du, low: 0.2, high: rng.range(0.2, 1.0), ..DepthPlane::default() };
            let (q0, begin) = (rng.range(0.0, 1.0), rng.below(50));
            let span = begin..begin + n;
            let mut right_ids = vec![7; before.len()];
            let mut right_q = before.clone();
            let (q, ids) = (&mut right_q[span.clone()], &mut right_ids[span]);
            fill_reference(q, ids, q0, begin as u32, &depth_plane, 9);
            let span = Span { begin: begin as u32, end: (begin + n) as u32 };
            let row = rng.below(TILE_ROWS);
            let mut q: Vec<PixelTile<Block32<f32>>> =
                before.as_chunks().0.iter().map(|b| [Block32(*b); TILE_ROWS]).collect();
            let mut visibility_ids = vec![[7u32.block(); TILE_ROWS]; q.len()];
            let mut entity_ids = vec![[7u16.block(); TILE_ROWS]; q.len()];
            fill_span::<u16>(&mut q.clone(), &mut entity_ids, row, q0, span, &depth_plane, 9);
            fill_span::<u32>(&mut q, &mut visibility_ids, row, q0, span, &depth_plane, 9);
            let bits = |q: f32| q.to_bits();
            let (q, visibility_ids) = (
                q.iter().flat_map(|q| q[row].0),
                visibility_ids.iter().flat_map(|o| u32::unpack(&o[row])),
            );
            assert!(q.map(bits).eq(right_q.into_iter().map(bits)), "{n} pixels, {depth_plane:?}");
            assert!(visibility_ids.eq(right_ids.iter().copied()), "{n} pixels, {depth_plane:?}");
            let entity_ids = entity_ids.iter().flat_map(|o| u16::unpack(&o[row])).map(u32::from);
            assert!(entity_ids.eq(right_ids), "{n} pixels, {depth_plane:?}");
        }
    }

    #[test]
    fn non_finite_vertices_draw_nothing_and_terminate() {
        let mut target = RenderTarget::<u32>::default();
        target.clear(16, 16, 0.0);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38] {
            draw(&mut target, [vertex(0.0, 0.0), vertex(bad, 8.0), vertex(3.0, bad)], 1);
        }
        draw(&mut target, [vertex(5.0, 5.0); 3], 2);
        assert!(visibility_ids(&target).all(|o| o != 2));
        let mut empty = RenderTarget::<u32>::default();
        empty.clear(0, 0, 0.0);
        empty.mark_dirty([0.0, 0.0, 9.0, 9.0]);
        assert!(!empty.is_occluded([0.0, 0.0, 9.0, 9.0], 1.0));
        draw(&mut empty, [vertex(0.0, 0.0), vertex(0.0, 9.0), vertex(9.0, 0.0)], 1);
    }

    #[test]
    fn only_surfaces_behind_are_occluded() {
        let mut target = RenderTarget::<u32>::default();
        target.clear(20, 20, 0.0);
        draw(&mut target, [vertex(-50.0, -50.0), vertex(-50.0, 100.0), vertex(100.0, -50.0)], 1);
        assert!(
            !target.is_occluded([2.0, 2.0, 9.0, 9.0], 0.5),
            "the tile is not marked as dirty yet"
        );
        target.mark_dirty([-50.0, -50.0, 100.0, 100.0]);
        assert!(target.is_occluded([2.0, 2.0, 9.0, 9.0], 0.5));
        assert!(!target.is_occluded([2.0, 2.0, 9.0, 9.0], 1.5));
    }
}
