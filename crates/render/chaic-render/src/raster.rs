//! Rasterization: triangles into a buffer of inverse depth and visibility ids, span by span, with a
//! hierarchical Z buffer for occlusion culling.
//!
//! For each pixel, the buffer holds how near the nearest surface is and whose it is (a visibility
//! buffer): colors are worked out afterwards, for what is seen only. The inner loops are SIMD over
//! [`LANES`] pixels by plain arrays, see [`crate::view`].

use std::ops::{Deref, DerefMut};

use chaic_core::EntityId;

use crate::setup::{Setup, Slope, first_center, least, most};

/// Nobody's pixel.
pub(crate) const BACKGROUND: u32 = u32::MAX;
/// Pixels one below the other whose least inverse depth is kept.
pub(crate) const TILE: usize = 8;
/// So many neighboring pixels of a row are filled at once.
pub(crate) const LANES: usize = 16;
/// The spans of so many rows are worked out at once.
const ROWS: usize = 16;

/// Names a triangle of an instance, or the first one of a face, in 32 bits.
pub(crate) fn visibility_id(instance: usize, triangle: usize) -> u32 {
    debug_assert!(instance < 0xffff && triangle < 0x1_0000);
    (instance as u32) << 16 | triangle as u32
}

/// The instance and triangle of [`visibility_id`].
pub(crate) fn unpack_visibility_id(id: u32) -> (usize, usize) {
    ((id >> 16) as usize, (id & 0xffff) as usize)
}

/// What stands in the visibility buffer for whoever a pixel belongs to.
pub(crate) trait VisibilityId: Copy + PartialEq {
    /// Nobody's pixel.
    const BACKGROUND: Self;

    /// Neighboring pixels, laid out so that they are loaded and stored at once.
    type Block: Copy + std::fmt::Debug + Default + DerefMut<Target = [Self; LANES]>;

    /// Pixels that are all this one's.
    fn block(self) -> Self::Block;

    /// Stands for a triangle of an instance of an entity.
    fn of(entity: EntityId, instance: usize, triangle: usize) -> Self;

    /// `new` if all bits of the mask are set, `self` if none is.
    fn replaced(self, new: Self, mask: u32) -> Self;
}

/// Pixels whose numbers have 32 bits. Blocks that lie across two cache lines make pictures about a
/// twenty-fifth slower.
#[repr(align(64))]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wide<T>([T; LANES]);

/// Pixels whose numbers have 16 bits.
#[repr(align(32))]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Narrow<T>([T; LANES]);

impl<T> Deref for Wide<T> {
    type Target = [T; LANES];

    #[inline(always)]
    fn deref(&self) -> &[T; LANES] {
        &self.0
    }
}

impl<T> DerefMut for Wide<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T; LANES] {
        &mut self.0
    }
}

impl<T> Deref for Narrow<T> {
    type Target = [T; LANES];

    #[inline(always)]
    fn deref(&self) -> &[T; LANES] {
        &self.0
    }
}

impl<T> DerefMut for Narrow<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T; LANES] {
        &mut self.0
    }
}

/// To the triangle, as coloring needs it: [`visibility_id`].
impl VisibilityId for u32 {
    const BACKGROUND: u32 = BACKGROUND;
    type Block = Wide<u32>;

    fn block(self) -> Wide<u32> {
        Wide([self; LANES])
    }

    #[inline]
    fn of(_: EntityId, instance: usize, triangle: usize) -> u32 {
        visibility_id(instance, triangle)
    }

    #[inline(always)]
    fn replaced(self, new: u32, mask: u32) -> u32 {
        (new & mask) | (self & !mask)
    }
}

/// To the entity, where that is all that is asked for: half as much to write.
impl VisibilityId for u16 {
    const BACKGROUND: u16 = EntityId::NOTHING.0;
    type Block = Narrow<u16>;

    fn block(self) -> Narrow<u16> {
        Narrow([self; LANES])
    }

    #[inline]
    fn of(entity: EntityId, _: usize, _: usize) -> u16 {
        entity.0
    }

    #[inline(always)]
    fn replaced(self, new: u16, mask: u32) -> u16 {
        (new & mask as u16) | (self & !mask as u16)
    }
}

/// Blocks of [`LANES`] pixels one below the other. An image is rows of stacks: what is near on the
/// image is near in memory.
type Stack<B> = [B; TILE];

/// A row of blocks across stacks.
#[derive(Clone, Copy)]
pub(crate) struct Blocks<'a, B> {
    stacks: &'a [Stack<B>],
    row: usize,
}

impl<'a, B> Blocks<'a, B> {
    /// The k-th block, if there is one.
    #[inline(always)]
    pub fn get(self, k: usize) -> Option<&'a B> {
        self.stacks.get(k).map(|stack| &stack[self.row])
    }

    /// All of them.
    #[inline(always)]
    pub fn iter(self) -> impl Iterator<Item = &'a B> {
        self.stacks.iter().map(move |stack| &stack[self.row])
    }
}

/// The image under way. What of its stacks lies beyond the image is nobody's, and near, so that it
/// doesn't count.
#[derive(Clone, Debug, Default)]
pub(crate) struct Target<O: VisibilityId> {
    pub width: usize,
    pub height: usize,
    /// Stacks side by side.
    stacks_wide: usize,
    /// Inverse depth, shape [stacks_high, stacks_wide].
    inverse_depth: Vec<Stack<Wide<f32>>>,
    /// Whose each pixel is, of the same shape.
    visibility_ids: Vec<Stack<O::Block>>,
    /// Hierarchical Z: the least inverse depth (the farthest) in each column of each stack.
    hi_z: Vec<Wide<f32>>,
    /// Whether something was drawn in a stack since its `hi_z` was worked out.
    is_dirty: Vec<bool>,
}

impl<O: VisibilityId> Target<O> {
    /// Forgets all; what isn't nearer than `background` won't be drawn.
    #[inline(always)]
    pub fn clear(&mut self, width: usize, height: usize, background: f32) {
        (self.width, self.height) = (width, height);
        self.stacks_wide = width.div_ceil(LANES);
        let stacks_high = height.div_ceil(TILE);
        let n = self.stacks_wide * stacks_high;
        self.inverse_depth.resize_with(n, Default::default);
        self.inverse_depth.fill([Wide([background; LANES]); TILE]);
        let (in_last, rows_in_last) = (width % LANES, height % TILE);
        if in_last > 0 || rows_in_last > 0 {
            for (k, stack) in self.inverse_depth.iter_mut().enumerate() {
                if in_last > 0 && (k + 1) % self.stacks_wide == 0 {
                    stack.iter_mut().for_each(|block| block[in_last..].fill(f32::INFINITY));
                }
                if rows_in_last > 0 && k / self.stacks_wide + 1 == stacks_high {
                    stack[rows_in_last..].fill(Wide([f32::INFINITY; LANES]));
                }
            }
        }
        self.visibility_ids.resize_with(n, Default::default);
        self.visibility_ids.fill([O::BACKGROUND.block(); TILE]);
        self.hi_z.clear();
        self.hi_z.resize(n, Wide([background; LANES]));
        self.is_dirty.clear();
        self.is_dirty.resize(n, false);
    }

    /// Inverse depth in a row.
    #[inline(always)]
    pub fn inverse_depth(&self, row: usize) -> Blocks<'_, Wide<f32>> {
        let stacks = &self.inverse_depth[row / TILE * self.stacks_wide..][..self.stacks_wide];
        Blocks { stacks, row: row % TILE }
    }

    /// Whose the pixels of a row are.
    #[inline(always)]
    pub fn visibility_ids(&self, row: usize) -> Blocks<'_, O::Block> {
        let stacks = &self.visibility_ids[row / TILE * self.stacks_wide..][..self.stacks_wide];
        Blocks { stacks, row: row % TILE }
    }

    /// Writes what `of` makes of the inverse depth of each pixel, shape [height, width].
    #[inline(always)]
    pub fn copy_inverse_depth(&self, out: &mut [f32], of: impl Fn(&Wide<f32>) -> [f32; LANES]) {
        copy_rows(&self.inverse_depth, self.stacks_wide, self.width, out, of);
    }

    /// Writes whose each pixel is, shape [height, width].
    #[inline(always)]
    pub fn copy_visibility_ids(&self, out: &mut [O]) {
        copy_rows(&self.visibility_ids, self.stacks_wide, self.width, out, unchanged::<O>);
    }

    /// The pixels that the rectangle (least u and v, most u and v) touches: first and last columns
    /// and rows.
    fn pixels_of(&self, [u0, v0, u1, v1]: [f32; 4]) -> [(usize, usize); 2] {
        let pixel = |x: f32, n: usize| (x.max(0.0) as usize).min(n.saturating_sub(1));
        let (columns, rows) = (self.width, self.height);
        [(pixel(u0, columns), pixel(u1, columns)), (pixel(v0, rows), pixel(v1, rows))]
    }

    /// Notes that something is drawn within the rectangle, with a pixel to spare.
    pub fn touch(&mut self, [u0, v0, u1, v1]: [f32; 4]) {
        let [(i0, i1), (j0, j1)] = self.pixels_of([u0 - 1.0, v0 - 1.0, u1 + 1.0, v1 + 1.0]);
        let rows = self.is_dirty.chunks_mut(self.stacks_wide.max(1));
        for row in rows.take(j1 / TILE + 1).skip(j0 / TILE) {
            row[i0 / LANES..=i1 / LANES].fill(true);
        }
    }

    /// Whether something no nearer than `q` inside the rectangle is sure to be hidden. What
    /// [`Target::touch`] announced is brought up to date where it decides: most of what shows does so in
    /// the first stack that is looked at.
    #[inline(always)]
    pub fn is_occluded(&mut self, rect: [f32; 4], q: f32) -> bool {
        let [(i0, i1), (j0, j1)] = self.pixels_of(rect);
        if self.hi_z.is_empty() {
            return false;
        }
        for j in j0 / TILE..=j1 / TILE {
            for i in i0 / LANES..=i1 / LANES {
                let k = j * self.stacks_wide + i;
                let columns = (LANES * i, (i0, i1));
                if !shows(&self.hi_z[k], columns, q) {
                    continue;
                }
                // What was true before something was drawn there is so still: depth only shrinks.
                if !std::mem::take(&mut self.is_dirty[k]) {
                    return false;
                }
                self.hi_z[k] = farthest_of(&self.inverse_depth[k]);
                if shows(&self.hi_z[k], columns, q) {
                    return false;
                }
            }
        }
        true
    }

    /// Fills the pixels whose centers lie in a triangle.
    #[inline(always)]
    pub fn fill(&mut self, setup: &Setup, id: O) {
        let Setup { first, middle, last, top, turn, per_row, turns_right, slope } = *setup;
        let columns = self.width as f32;
        let q_left = slope.q + slope.du * (0.5 - slope.u0);
        let mut begins = [0; ROWS];
        let mut ends = [0; ROWS];
        let mut starts = [0.0; ROWS];
        let mut row = first;
        while row < last {
            for k in 0..ROWS {
                let row = row + k as u32;
                let v = row as i32 as f32 + 0.5;
                let long = top[0] + (v - top[1]) * per_row[0];
                let upper = top[0] + (v - top[1]) * per_row[1];
                let lower = turn[0] + (v - turn[1]) * per_row[2];
                let short = if row < middle { upper } else { lower };
                begins[k] = first_center(if turns_right { long } else { short }, columns);
                ends[k] = first_center(if turns_right { short } else { long }, columns);
                starts[k] = q_left + slope.dv * (v - slope.v0);
            }
            let n = (last - row).min(ROWS as u32);
            for k in 0..n as usize {
                let row = row as usize + k;
                let (stacks, row) = (row / TILE * self.stacks_wide, row % TILE);
                let (inverse_depth, visibility_ids) =
                    (&mut self.inverse_depth[stacks..], &mut self.visibility_ids[stacks..]);
                let span = (begins[k], ends[k]);
                fill_span::<O>(inverse_depth, visibility_ids, row, starts[k], span, &slope, id);
            }
            row += n;
        }
    }
}

#[inline(always)]
fn unchanged<O: VisibilityId>(block: &O::Block) -> [O; LANES] {
    **block
}

/// Writes what `of` makes of each block to the rows of an image, stack by stack.
#[inline(always)]
fn copy_rows<B, T: Copy>(
    stacks: &[Stack<B>],
    stacks_wide: usize,
    width: usize,
    out: &mut [T],
    of: impl Fn(&B) -> [T; LANES],
) {
    let rows_of_stacks = stacks.chunks_exact(stacks_wide.max(1));
    for (rows, stacks) in out.chunks_mut((TILE * width).max(1)).zip(rows_of_stacks) {
        for (i, stack) in stacks.iter().enumerate() {
            for (row, block) in rows.chunks_exact_mut(width).zip(stack) {
                let (numbers, row) = (of(block), &mut row[LANES * i..]);
                match row.first_chunk_mut() {
                    Some(out) => *out = numbers,
                    None => row.iter_mut().zip(numbers).for_each(|(out, x)| *out = x),
                }
            }
        }
    }
}

/// Whether something at `q` is nearer than the farthest of a stack in one of the columns `i0..=i1`; the
/// stack's first one is `at`.
#[inline(always)]
fn shows(farthest: &Wide<f32>, (at, (i0, i1)): (usize, (usize, usize)), q: f32) -> bool {
    let mut shows = false;
    for k in 0..LANES {
        let column = at + k;
        shows |= (column >= i0) & (column <= i1) & (farthest[k] < q);
    }
    shows
}

/// The least in each column.
#[inline(always)]
fn farthest_of(stack: &Stack<Wide<f32>>) -> Wide<f32> {
    let mut columns = Wide([f32::INFINITY; LANES]);
    for block in stack {
        for k in 0..LANES {
            columns[k] = least(columns[k], block[k]);
        }
    }
    columns
}

/// Fills the columns `begin..end` of a row of the stacks that begin here.
#[inline(always)]
fn fill_span<O: VisibilityId>(
    inverse_depth: &mut [Stack<Wide<f32>>],
    visibility_ids: &mut [Stack<O::Block>],
    row: usize,
    q0: f32,
    (begin, end): (u32, u32),
    slope: &Slope,
    id: O,
) {
    let mut k = begin as usize / LANES;
    // Most spans lie within a block: no branch tells those from empty ones.
    while let (Some(q), Some(o)) = (inverse_depth.get_mut(k), visibility_ids.get_mut(k)) {
        let (q, o) = (&mut q[row], &mut o[row]);
        fill_block(q, o, q0, (LANES * k) as u32, (begin, end), slope, id);
        k += 1;
        if LANES * k >= end as usize {
            break;
        }
    }
}

/// Fills those pixels of a block, the first of which is in column `at`.
#[inline(always)]
fn fill_block<O: VisibilityId>(
    q: &mut [f32; LANES],
    o: &mut [O; LANES],
    q0: f32,
    at: u32,
    (begin, end): (u32, u32),
    slope: &Slope,
    id: O,
) {
    let Slope { du, low, high, .. } = *slope;
    let length = end.saturating_sub(begin);
    // Masks instead of conditions, which the compiler would make branches of. Plain loops:
    // closures would be compiled apart, without this machine's vectors.
    for k in 0..LANES {
        let column = at + k as u32;
        let x = least(high, most(low, q0 + du * column as i32 as f32));
        let is_inside = column.wrapping_sub(begin) < length;
        let wins = (u32::from(x > q[k]) & u32::from(is_inside)).wrapping_neg();
        q[k] = f32::from_bits(x.to_bits() & wins | q[k].to_bits() & !wins);
        o[k] = o[k].replaced(id, wins);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::ScreenVertex;

    fn vertex(u: f32, v: f32) -> ScreenVertex {
        ScreenVertex { u, v, q: 1.0 }
    }

    fn draw(target: &mut Target<u32>, [a, b, c]: [ScreenVertex; 3], id: u32) {
        let setup = Setup::through(a, b, c, target.height as f32);
        target.fill(&setup, id);
    }

    fn visibility_ids(target: &Target<u32>) -> impl Iterator<Item = u32> {
        let rows = (0..target.height).map(|j| target.visibility_ids(j));
        rows.flat_map(|row| row.iter().flat_map(|b| b.0).take(target.width))
    }

    /// A fan of thin triangles around a point covers every pixel exactly once.
    #[test]
    fn neighbors_leave_no_gap_and_no_overlap() {
        let n = 23;
        let rim = |k: usize| {
            let a = std::f32::consts::TAU * (k % n) as f32 / n as f32;
            let (c, s) = (chaic_core::geom::math::cos(a), chaic_core::geom::math::sin(a));
            vertex(32.3 + 200.0 * c, 31.7 + 200.0 * s)
        };
        let mut count = vec![0; 64 * 64];
        for k in 0..n {
            let mut target = Target::<u32>::default();
            target.clear(64, 64, 0.0);
            draw(&mut target, [vertex(32.3, 31.7), rim(k + 1), rim(k)], k as u32);
            for (n, o) in count.iter_mut().zip(visibility_ids(&target)) {
                *n += i32::from(o != BACKGROUND);
            }
        }
        assert!(count.iter().all(|n| *n == 1));
    }

    /// What [`fill_span`] is to do, pixel by pixel.
    fn fill_one_by_one(
        (q, o): (&mut [f32], &mut [u32]),
        q0: f32,
        begin: u32,
        slope: &Slope,
        id: u32,
    ) {
        for (k, (q, o)) in q.iter_mut().zip(o).enumerate() {
            let x = q0 + slope.du * (begin + k as u32) as f32;
            let x = if x < slope.low { slope.low } else { x };
            let x = if x > slope.high { slope.high } else { x };
            if x > *q {
                (*q, *o) = (x, id);
            }
        }
    }

    #[test]
    fn spans_of_any_length_are_filled_as_pixel_by_pixel() {
        let mut rng = chaic_core::rng::Stream::new(1, "spans", 0);
        for n in (0..40).cycle().take(2000) {
            let before: Vec<f32> = (0..6 * LANES).map(|_| rng.range(0.0, 1.0)).collect();
            let du =
                [0.0, rng.range(-0.05, 0.05), f32::NAN, 1e30][rng.below(40).saturating_sub(36)];
            let slope = Slope { du, low: 0.2, high: rng.range(0.2, 1.0), ..Slope::default() };
            let (q0, begin) = (rng.range(0.0, 1.0), rng.below(50));
            let span = begin..begin + n;
            let mut right_ids = vec![7; before.len()];
            let mut right_q = before.clone();
            let right = (&mut right_q[span.clone()], &mut right_ids[span]);
            fill_one_by_one(right, q0, begin as u32, &slope, 9);
            let span = (begin as u32, (begin + n) as u32);
            let row = rng.below(TILE);
            let mut q: Vec<Stack<Wide<f32>>> =
                before.as_chunks().0.iter().map(|b| [Wide(*b); TILE]).collect();
            let mut visibility_ids = vec![[7u32.block(); TILE]; q.len()];
            let mut names = vec![[7u16.block(); TILE]; q.len()];
            fill_span::<u16>(&mut q.clone(), &mut names, row, q0, span, &slope, 9);
            fill_span::<u32>(&mut q, &mut visibility_ids, row, q0, span, &slope, 9);
            let bits = |q: f32| q.to_bits();
            let (q, visibility_ids) =
                (q.iter().flat_map(|q| q[row].0), visibility_ids.iter().flat_map(|o| o[row].0));
            assert!(q.map(bits).eq(right_q.into_iter().map(bits)), "{n} pixels, {slope:?}");
            assert!(visibility_ids.eq(right_ids.iter().copied()), "{n} pixels, {slope:?}");
            let names = names.iter().flat_map(|o| o[row].0).map(u32::from);
            assert!(names.eq(right_ids), "{n} pixels, {slope:?}");
        }
    }

    #[test]
    fn odd_numbers_draw_nothing_and_end() {
        let mut target = Target::<u32>::default();
        target.clear(16, 16, 0.0);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38] {
            draw(&mut target, [vertex(0.0, 0.0), vertex(bad, 8.0), vertex(3.0, bad)], 1);
        }
        draw(&mut target, [vertex(5.0, 5.0); 3], 2);
        assert!(visibility_ids(&target).all(|o| o != 2));
        let mut empty = Target::<u32>::default();
        empty.clear(0, 0, 0.0);
        empty.touch([0.0, 0.0, 9.0, 9.0]);
        assert!(!empty.is_occluded([0.0, 0.0, 9.0, 9.0], 1.0));
        draw(&mut empty, [vertex(0.0, 0.0), vertex(0.0, 9.0), vertex(9.0, 0.0)], 1);
    }

    #[test]
    fn only_what_is_behind_is_hidden() {
        let mut target = Target::<u32>::default();
        target.clear(20, 20, 0.0);
        draw(&mut target, [vertex(-50.0, -50.0), vertex(-50.0, 100.0), vertex(100.0, -50.0)], 1);
        assert!(!target.is_occluded([2.0, 2.0, 9.0, 9.0], 0.5), "not yet announced");
        target.touch([-50.0, -50.0, 100.0, 100.0]);
        assert!(target.is_occluded([2.0, 2.0, 9.0, 9.0], 0.5));
        assert!(!target.is_occluded([2.0, 2.0, 9.0, 9.0], 1.5));
    }
}
