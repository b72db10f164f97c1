//! What is worked out of a triangle before its pixels are filled.
//!
//! A pixel belongs to a triangle if its center does. Each edge's crossing with a row of centers is
//! computed from its two ends in one fixed order, so that two triangles that share an edge leave
//! neither a gap nor an overlap.

use crate::draw::Corners;

/// A corner on the image: pixels from the left and the top, and nearness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub u: f32,
    pub v: f32,
    pub q: f32,
}

/// Nearness over the image: `q + du * (u - u0) + dv * (v - v0)`, kept within [low, high].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Slope {
    /// Nearness at u0 and v0.
    pub q: f32,
    pub u0: f32,
    pub v0: f32,
    pub du: f32,
    pub dv: f32,
    pub low: f32,
    pub high: f32,
}

impl Slope {
    /// Through three corners; without meaning if they lie on a line.
    #[inline(always)]
    fn through(a: Corner, b: Corner, c: Corner) -> Slope {
        let (bu, bv, bq) = (b.u - a.u, b.v - a.v, b.q - a.q);
        let (cu, cv, cq) = (c.u - a.u, c.v - a.v, c.q - a.q);
        let inverse = 1.0 / (bu * cv - bv * cu);
        Slope {
            q: a.q,
            u0: a.u,
            v0: a.v,
            du: (bq * cv - cq * bv) * inverse,
            dv: (cq * bu - bq * cu) * inverse,
            low: least(least(a.q, b.q), c.q),
            high: most(most(a.q, b.q), c.q),
        }
    }
}

/// A triangle ready to be filled: rows `first..last` of pixels, of which those before `middle` end
/// at the upper short edge and the others at the lower one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Setup {
    pub first: u32,
    pub middle: u32,
    pub last: u32,
    /// Where the long edge and the upper short one begin.
    pub top: [f32; 2],
    /// Where the lower short one begins.
    pub turn: [f32; 2],
    /// Columns per row of the long edge, the upper and the lower short one.
    pub per_row: [f32; 3],
    /// Whether the short edges are on the right.
    pub turns_right: bool,
    pub slope: Slope,
}

impl Setup {
    /// Of a triangle that faces the camera.
    #[inline(always)]
    pub fn through(a: Corner, b: Corner, c: Corner, rows: f32) -> Setup {
        let slope = Slope::through(a, b, c);
        Setup::of([(a.u, a.v), (b.u, b.v), (c.u, c.v)], slope, rows)
    }

    /// Of these corners on an image of so many rows, whichever way they turn.
    #[inline(always)]
    pub fn of([a, b, c]: [(f32, f32); 3], slope: Slope, rows: f32) -> Setup {
        let (a, b) = in_order(a, b);
        let (b, c) = in_order(b, c);
        let (a, b) = in_order(a, b);
        Setup {
            first: first_center(a.1, rows),
            middle: first_center(b.1, rows),
            last: first_center(c.1, rows),
            top: [a.0, a.1],
            turn: [b.0, b.1],
            per_row: [per_row(a, c), per_row(a, b), per_row(b, c)],
            turns_right: (b.0 - a.0) * (c.1 - a.1) > (c.0 - a.0) * (b.1 - a.1),
            slope,
        }
    }
}

/// The upper one first; of two at the same height the left one.
#[inline(always)]
fn in_order(a: (f32, f32), b: (f32, f32)) -> ((f32, f32), (f32, f32)) {
    let swaps = (b.1 < a.1) | ((b.1 == a.1) & (b.0 < a.0));
    let first = (if swaps { b.0 } else { a.0 }, if swaps { b.1 } else { a.1 });
    let second = (if swaps { a.0 } else { b.0 }, if swaps { a.1 } else { b.1 });
    (first, second)
}

/// By how many columns a line moves in a row.
#[inline(always)]
fn per_row(top: (f32, f32), bottom: (f32, f32)) -> f32 {
    let dv = bottom.1 - top.1;
    if dv > 0.0 { (bottom.0 - top.0) / dv } else { 0.0 }
}

/// So many triangles are set up at once.
pub(crate) const N_SETUPS: usize = 16;

/// Triangles that are set up at once, a list for each quantity.
#[derive(Default)]
pub(crate) struct Setups {
    first: [u32; N_SETUPS],
    middle: [u32; N_SETUPS],
    last: [u32; N_SETUPS],
    top: [[f32; N_SETUPS]; 2],
    turn: [[f32; N_SETUPS]; 2],
    per_row: [[f32; N_SETUPS]; 3],
    turns_right: [u32; N_SETUPS],
    q: [[f32; N_SETUPS]; 3],
    slope: [[f32; N_SETUPS]; 4],
}

impl Setups {
    /// Sets up the triangles of these numbers, all of which face the camera.
    #[inline(always)]
    pub fn fill(
        &mut self,
        triangles: &[u32; N_SETUPS],
        mesh: &[&[u16]; 3],
        corners: &Corners,
        rows: f32,
    ) {
        let n = mesh[0].len();
        let last = n - 1;
        let (m0, m1, m2) = (&mesh[0][..n], &mesh[1][..n], &mesh[2][..n]);
        for (k, triangle) in triangles.iter().enumerate() {
            let triangle = (*triangle as usize).min(last);
            let (a, b, c) =
                (corners.get(m0[triangle]), corners.get(m1[triangle]), corners.get(m2[triangle]));
            let s = Setup::through(a, b, c, rows);
            (self.first[k], self.middle[k], self.last[k]) = (s.first, s.middle, s.last);
            (self.top[0][k], self.top[1][k]) = (s.top[0], s.top[1]);
            (self.turn[0][k], self.turn[1][k]) = (s.turn[0], s.turn[1]);
            self.per_row[0][k] = s.per_row[0];
            self.per_row[1][k] = s.per_row[1];
            self.per_row[2][k] = s.per_row[2];
            self.turns_right[k] = u32::from(s.turns_right);
            (self.q[0][k], self.q[1][k], self.q[2][k]) = (s.slope.q, s.slope.u0, s.slope.v0);
            (self.slope[0][k], self.slope[1][k]) = (s.slope.du, s.slope.dv);
            (self.slope[2][k], self.slope[3][k]) = (s.slope.low, s.slope.high);
        }
    }

    /// One of them.
    #[inline(always)]
    pub fn get(&self, k: usize) -> Setup {
        let k = k % N_SETUPS;
        Setup {
            first: self.first[k],
            middle: self.middle[k],
            last: self.last[k],
            top: [self.top[0][k], self.top[1][k]],
            turn: [self.turn[0][k], self.turn[1][k]],
            per_row: [self.per_row[0][k], self.per_row[1][k], self.per_row[2][k]],
            turns_right: self.turns_right[k] != 0,
            slope: Slope {
                q: self.q[0][k],
                u0: self.q[1][k],
                v0: self.q[2][k],
                du: self.slope[0][k],
                dv: self.slope[1][k],
                low: self.slope[2][k],
                high: self.slope[3][k],
            },
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
