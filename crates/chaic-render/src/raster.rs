//! Filling triangles: for each pixel, how near the nearest surface is and whose it is.
//!
//! A pixel belongs to a triangle if its center does. Each edge's crossing with a row of centers is
//! computed from its two ends in one fixed order, so that two triangles that share an edge leave
//! neither a gap nor an overlap.

use chaic_protocol::EntityId;

/// Nobody's pixel.
pub(crate) const NOBODY: u32 = u32::MAX;
/// Side of the squares in which nearness is summed up, pixels.
pub(crate) const TILE: usize = 8;

/// Names a triangle of an instance in 32 bits.
pub(crate) fn pixel_owner(instance: usize, triangle: usize) -> u32 {
    debug_assert!(instance < 0xffff && triangle < 0x1_0000);
    (instance as u32) << 16 | triangle as u32
}

/// The instance and triangle of [`pixel_owner`].
pub(crate) fn owner_parts(owner: u32) -> (usize, usize) {
    ((owner >> 16) as usize, (owner & 0xffff) as usize)
}

/// What stands in the image for whoever a pixel belongs to.
pub(crate) trait Owner: Copy {
    /// Nobody's pixel.
    const NOBODY: Self;

    /// Stands for a triangle of an instance of an entity.
    fn of(entity: EntityId, instance: usize, triangle: usize) -> Self;

    /// `new` if all bits of the mask are set, `self` if none is.
    fn replaced(self, new: Self, mask: u32) -> Self;
}

/// To the triangle, as coloring needs it: [`pixel_owner`].
impl Owner for u32 {
    const NOBODY: u32 = NOBODY;

    #[inline]
    fn of(_: EntityId, instance: usize, triangle: usize) -> u32 {
        pixel_owner(instance, triangle)
    }

    #[inline(always)]
    fn replaced(self, new: u32, mask: u32) -> u32 {
        (new & mask) | (self & !mask)
    }
}

/// To the entity, where that is all that is asked for: half as much to write.
impl Owner for u16 {
    const NOBODY: u16 = EntityId::NOTHING.0;

    #[inline]
    fn of(entity: EntityId, _: usize, _: usize) -> u16 {
        entity.0
    }

    #[inline(always)]
    fn replaced(self, new: u16, mask: u32) -> u16 {
        (new & mask as u16) | (self & !mask as u16)
    }
}

/// A corner on the image: pixels from the left and the top, and nearness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub u: f32,
    pub v: f32,
    pub q: f32,
}

/// Nearness over the image: `q + du * (u - u0) + dv * (v - v0)`, kept within [low, high].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slope {
    pub at: Corner,
    pub du: f32,
    pub dv: f32,
    pub low: f32,
    pub high: f32,
}

/// The image under way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Target<O> {
    pub width: usize,
    pub height: usize,
    /// Nearness, shape [height, width], and [`LANES`] more.
    nearness: Vec<f32>,
    /// Whose each pixel is, shape [height, width], and [`LANES`] more.
    owner: Vec<O>,
    tiles_wide: usize,
    /// The least nearness in each tile.
    tiles: Vec<f32>,
    /// For each row of tiles the first tile that may be stale, and the one after the last.
    stale: Vec<(usize, usize)>,
}

impl<O: Owner> Target<O> {
    /// Forgets all; what isn't nearer than `background` won't be drawn.
    pub fn clear(&mut self, width: usize, height: usize, background: f32) {
        (self.width, self.height) = (width, height);
        self.nearness.clear();
        self.nearness.resize(width * height + LANES, background);
        self.owner.clear();
        self.owner.resize(width * height + LANES, O::NOBODY);
        self.tiles_wide = width.div_ceil(TILE);
        self.tiles.clear();
        self.tiles.resize(self.tiles_wide * height.div_ceil(TILE), background);
        self.stale.clear();
        self.stale.resize(height.div_ceil(TILE), (self.tiles_wide, 0));
    }

    /// Nearness, shape [height, width].
    pub fn nearness(&self) -> &[f32] {
        &self.nearness[..self.width * self.height]
    }

    /// Whose each pixel is, shape [height, width].
    pub fn owner(&self) -> &[O] {
        &self.owner[..self.width * self.height]
    }

    /// The tiles that the rectangle (least u and v, most u and v) touches: columns and rows, the
    /// last ones included.
    fn tiles_of(&self, [u0, v0, u1, v1]: [f32; 4]) -> [(usize, usize); 2] {
        let tile = |x: f32, n: usize| (x.max(0.0) as usize / TILE).min(n.saturating_sub(1));
        let n_high = self.stale.len();
        [
            (tile(u0, self.tiles_wide), tile(u1, self.tiles_wide)),
            (tile(v0, n_high), tile(v1, n_high)),
        ]
    }

    /// Notes that something is drawn within the rectangle, with a pixel to spare.
    pub fn touch(&mut self, [u0, v0, u1, v1]: [f32; 4]) {
        let [(i0, i1), (j0, j1)] = self.tiles_of([u0 - 1.0, v0 - 1.0, u1 + 1.0, v1 + 1.0]);
        for (first, end) in self.stale.iter_mut().take(j1 + 1).skip(j0) {
            (*first, *end) = ((*first).min(i0), (*end).max(i1 + 1));
        }
    }

    /// Brings the tiles up to date in which [`Target::touch`] announced something. Stale tiles are
    /// safe: nearness only grows.
    #[inline(always)]
    pub fn update_tiles(&mut self) {
        if self.width == 0 {
            return;
        }
        let bands = self.nearness[..self.width * self.height].chunks(TILE * self.width);
        let tiles = self.tiles.chunks_mut(self.tiles_wide);
        for ((rows, tiles), (first, end)) in bands.zip(tiles).zip(&mut self.stale) {
            if first < end {
                for (k, tile) in tiles.iter_mut().enumerate().take(*end).skip(*first) {
                    *tile = least_in_tile(rows, self.width, TILE * k);
                }
                (*first, *end) = (self.tiles_wide, 0);
            }
        }
    }

    /// Whether something no nearer than `q` inside the rectangle is sure to be hidden.
    pub fn hides(&self, rect: [f32; 4], q: f32) -> bool {
        let [(i0, i1), (j0, j1)] = self.tiles_of(rect);
        (j0..=j1).all(|j| {
            let row = &self.tiles[j * self.tiles_wide..][..self.tiles_wide];
            row[i0..=i1].iter().all(|least| *least >= q)
        })
    }

    /// Draws a triangle whose corners are all in front of the camera, if it faces it.
    #[inline(always)]
    pub fn draw(&mut self, corners: [Corner; 3], owner: O) {
        let [a, b, c] = corners;
        let (bu, bv, bq) = (b.u - a.u, b.v - a.v, b.q - a.q);
        let (cu, cv, cq) = (c.u - a.u, c.v - a.v, c.q - a.q);
        let area = bu * cv - bv * cu;
        // Rows run downwards, so counter-clockwise triangles have negative area here.
        if area >= 0.0 || area.is_nan() {
            return;
        }
        let inverse = 1.0 / area;
        let slope = Slope {
            at: a,
            du: (bq * cv - cq * bv) * inverse,
            dv: (cq * bu - bq * cu) * inverse,
            low: least(least(a.q, b.q), c.q),
            high: most(most(a.q, b.q), c.q),
        };
        self.fill([(a.u, a.v), (b.u, b.v), (c.u, c.v)], &slope, owner);
    }

    /// Fills the pixels whose centers lie in the triangle, whichever way it turns.
    #[inline(always)]
    pub fn fill(&mut self, mut p: [(f32, f32); 3], slope: &Slope, owner: O) {
        let before = |a: (f32, f32), b: (f32, f32)| a.1 < b.1 || (a.1 == b.1 && a.0 < b.0);
        if before(p[1], p[0]) {
            p.swap(0, 1);
        }
        if before(p[2], p[1]) {
            p.swap(1, 2);
            if before(p[1], p[0]) {
                p.swap(0, 1);
            }
        }
        let [a, b, c] = p;
        let rows = self.height as f32;
        let (first, last) = (first_center(a.1, rows), first_center(c.1, rows));
        let middle = first_center(b.1, rows);
        let (long, upper, lower) = (Edge::new(a, c), Edge::new(a, b), Edge::new(b, c));
        let b_is_right = (b.0 - a.0) * (c.1 - a.1) > (c.0 - a.0) * (b.1 - a.1);
        let columns = self.width as f32;
        for row in first..last {
            let v = row as f32 + 0.5;
            let (long, short) = (long.u_at(v), if row < middle { upper } else { lower }.u_at(v));
            let begin = first_center(if b_is_right { long } else { short }, columns);
            let end = first_center(if b_is_right { short } else { long }, columns);
            let at = row as usize * self.width + begin as usize;
            let q0 = slope.at.q + slope.dv * (v - slope.at.v) + slope.du * (0.5 - slope.at.u);
            fill_span(
                &mut self.nearness[at..],
                &mut self.owner[at..],
                q0,
                begin,
                end,
                slope,
                owner,
            );
        }
    }
}

#[inline(always)]
pub(crate) fn least(x: f32, y: f32) -> f32 {
    if x < y { x } else { y }
}

#[inline(always)]
pub(crate) fn most(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

/// The least of a tile that begins in this column of its rows.
#[inline(always)]
fn least_in_tile(rows: &[f32], width: usize, column: usize) -> f32 {
    let mut columns = [f32::INFINITY; TILE];
    for row in rows.chunks_exact(width) {
        match row[column..].first_chunk::<TILE>() {
            Some(pixels) => {
                for (column, pixel) in columns.iter_mut().zip(pixels) {
                    *column = least(*column, *pixel);
                }
            }
            None => row[column..].iter().for_each(|q| columns[0] = least(columns[0], *q)),
        }
    }
    columns.into_iter().fold(f32::INFINITY, least)
}

/// So many pixels are filled at once; those beyond the end of a span stay as they are.
const LANES: usize = 16;

/// Fills the columns `begin..end` of a row; the lists begin there.
#[inline(always)]
fn fill_span<O: Owner>(
    nearness: &mut [f32],
    owners: &mut [O],
    q0: f32,
    begin: u32,
    end: u32,
    slope: &Slope,
    owner: O,
) {
    // Most spans are shorter than the lanes: no branch tells those from empty ones.
    let mut at = begin;
    let (mut nearness, mut owners) = (nearness, owners);
    while let (Some((q, more_q)), Some((o, more_o))) =
        (nearness.split_first_chunk_mut(), owners.split_first_chunk_mut())
    {
        fill_lanes(q, o, q0, (at, end), slope, owner);
        (nearness, owners) = (more_q, more_o);
        at += LANES as u32;
        if at >= end {
            break;
        }
    }
}

/// Fills pixels side by side, from one column to below another.
#[inline(always)]
fn fill_lanes<O: Owner>(
    q: &mut [f32; LANES],
    o: &mut [O; LANES],
    q0: f32,
    (at, end): (u32, u32),
    slope: &Slope,
    owner: O,
) {
    let Slope { du, low, high, .. } = *slope;
    // Masks instead of conditions, which the compiler would make branches of. Plain loops:
    // closures would be compiled apart, without this machine's vectors.
    for k in 0..LANES {
        let column = at + k as u32;
        let x = least(high, most(low, q0 + du * column as i32 as f32));
        let wins = (u32::from(x > q[k]) & u32::from(column < end)).wrapping_neg();
        q[k] = f32::from_bits(x.to_bits() & wins | q[k].to_bits() & !wins);
        o[k] = o[k].replaced(owner, wins);
    }
}

/// The first row or column whose middle (+ 0.5) isn't before `x`, within [0, max]; one that lies
/// just there is rounded to even.
#[inline(always)]
pub(crate) fn first_center(x: f32, max: f32) -> u32 {
    /// From here to twice as much, floats are the whole numbers.
    const WHOLE: f32 = 8_388_608.0;
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < max { x } else { max };
    (x + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits())
}

/// A line down the image.
#[derive(Clone, Copy)]
struct Edge {
    u: f32,
    v: f32,
    per_row: f32,
}

impl Edge {
    #[inline(always)]
    fn new(top: (f32, f32), bottom: (f32, f32)) -> Edge {
        let dv = bottom.1 - top.1;
        let per_row = if dv > 0.0 { (bottom.0 - top.0) / dv } else { 0.0 };
        Edge { u: top.0, v: top.1, per_row }
    }

    #[inline(always)]
    fn u_at(&self, v: f32) -> f32 {
        self.u + (v - self.v) * self.per_row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(u: f32, v: f32) -> Corner {
        Corner { u, v, q: 1.0 }
    }

    /// A fan of thin triangles around a point covers every pixel exactly once.
    #[test]
    fn neighbors_leave_no_gap_and_no_overlap() {
        let n = 23;
        let rim = |k: usize| {
            let a = std::f32::consts::TAU * (k % n) as f32 / n as f32;
            let (c, s) = (chaic_protocol::geom::math::cos(a), chaic_protocol::geom::math::sin(a));
            corner(32.3 + 200.0 * c, 31.7 + 200.0 * s)
        };
        let mut count = vec![0; 64 * 64];
        for k in 0..n {
            let mut target = Target::<u32>::default();
            target.clear(64, 64, 0.0);
            target.draw([corner(32.3, 31.7), rim(k + 1), rim(k)], k as u32);
            for (n, o) in count.iter_mut().zip(target.owner()) {
                *n += i32::from(*o != NOBODY);
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
        owner: u32,
    ) {
        for (k, (q, o)) in q.iter_mut().zip(o).enumerate() {
            let x = q0 + slope.du * (begin + k as u32) as f32;
            let x = if x > slope.low { x } else { slope.low };
            let x = if x < slope.high { x } else { slope.high };
            if x > *q {
                (*q, *o) = (x, owner);
            }
        }
    }

    #[test]
    fn spans_of_any_length_are_filled_as_pixel_by_pixel() {
        let mut rng = chaic_protocol::rng::Stream::new(1, "spans", 0);
        for n in (0..40).cycle().take(2000) {
            let before: Vec<f32> = (0..n + LANES).map(|_| rng.range(0.0, 1.0)).collect();
            let du =
                [0.0, rng.range(-0.05, 0.05), f32::NAN, 1e30][rng.below(40).saturating_sub(36)];
            let at = Corner { u: 0.0, v: 0.0, q: 0.0 };
            let slope = Slope { at, du, dv: 0.0, low: 0.2, high: rng.range(0.2, 1.0) };
            let (q0, begin) = (rng.range(0.0, 1.0), rng.below(500) as u32);
            let end = begin + n as u32;
            let (mut owners, mut names) = (vec![7u32; n + LANES], vec![7u16; n + LANES]);
            let mut right_owners = owners.clone();
            let mut right_q = before.clone();
            fill_one_by_one((&mut right_q[..n], &mut right_owners[..n]), q0, begin, &slope, 9);
            fill_span(&mut before.clone(), &mut names, q0, begin, end, &slope, 9);
            let mut q = before;
            fill_span(&mut q, &mut owners, q0, begin, end, &slope, 9);
            let bits = |q: &[f32]| q.iter().map(|q| q.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&q), bits(&right_q), "{n} pixels, {slope:?}");
            assert_eq!(owners, right_owners, "{n} pixels, {slope:?}");
            assert!(names.iter().zip(&owners).all(|(a, b)| u32::from(*a) == *b));
        }
    }

    #[test]
    fn odd_numbers_draw_nothing_and_end() {
        let mut target = Target::<u32>::default();
        target.clear(16, 16, 0.0);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38] {
            target.draw([corner(0.0, 0.0), corner(bad, 8.0), corner(3.0, bad)], 1);
        }
        target.draw([corner(5.0, 5.0); 3], 2);
        assert!(target.owner().iter().all(|o| *o != 2));
        let mut empty = Target::<u32>::default();
        empty.clear(0, 0, 0.0);
        empty.touch([0.0, 0.0, 9.0, 9.0]);
        empty.update_tiles();
        empty.draw([corner(0.0, 0.0), corner(0.0, 9.0), corner(9.0, 0.0)], 1);
    }

    #[test]
    fn tiles_hide_only_what_is_behind() {
        let mut target = Target::<u32>::default();
        target.clear(20, 20, 0.0);
        target.draw([corner(-50.0, -50.0), corner(-50.0, 100.0), corner(100.0, -50.0)], 1);
        assert!(!target.hides([2.0, 2.0, 9.0, 9.0], 0.5), "tiles are stale");
        target.touch([-50.0, -50.0, 100.0, 100.0]);
        target.update_tiles();
        assert!(target.hides([2.0, 2.0, 9.0, 9.0], 0.5));
        assert!(!target.hides([2.0, 2.0, 9.0, 9.0], 1.5));
    }
}
