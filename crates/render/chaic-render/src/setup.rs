//! Triangle setup: projected vertices, back-face culling, edges and slopes, before pixels are filled.
//!
//! A pixel belongs to a triangle if its center does. Each edge's crossing with a row of centers is
//! computed from its two ends in one fixed order, so that two triangles that share an edge leave
//! neither a gap nor an overlap.

use chaic_core::Vec3;

use crate::lens::{IntoCamera, Lens};

/// A vertex on the image: pixels from the left and the top, and inverse depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenVertex {
    pub u: f32,
    pub v: f32,
    pub q: f32,
}

/// Most vertices of a mesh: an index of 16 bits needs no check.
const N_VERTICES: usize = 1 << 16;

/// The vertices of a mesh on the image, a list for each coordinate.
pub(crate) struct ScreenVertices {
    u: Box<[f32; N_VERTICES]>,
    v: Box<[f32; N_VERTICES]>,
    q: Box<[f32; N_VERTICES]>,
}

impl Default for ScreenVertices {
    fn default() -> ScreenVertices {
        let list = || match vec![0.0; N_VERTICES].into_boxed_slice().try_into() {
            Ok(list) => list,
            Err(_) => Box::new([0.0; N_VERTICES]),
        };
        ScreenVertices { u: list(), v: list(), q: list() }
    }
}

impl ScreenVertices {
    #[inline(always)]
    fn get(&self, vertex: u16) -> ScreenVertex {
        let k = usize::from(vertex);
        ScreenVertex { u: self.u[k], v: self.v[k], q: self.q[k] }
    }

    /// Finds where points are on the image.
    #[inline(always)]
    pub fn place(&mut self, positions: &[Vec3], into: &IntoCamera, lens: &Lens) {
        let (mu, mv) = lens.middle();
        let n = positions.len().min(N_VERTICES);
        let (u, v, q) = (&mut self.u[..n], &mut self.v[..n], &mut self.q[..n]);
        let positions = &positions[..n];
        if lens.is_plan {
            for k in 0..n {
                let p = into.map(positions[k]);
                (u[k], v[k], q[k]) = (mu + p.x, mv + p.y, lens.inverse_depth(p.z));
            }
            return;
        }
        for k in 0..n {
            let p = into.map(positions[k]);
            let inverse_depth = 1.0 / p.z;
            (u[k], v[k], q[k]) =
                (mu + p.x * inverse_depth, mv + p.y * inverse_depth, inverse_depth);
        }
    }

    /// Whether a vertex is in front of the camera, no nearer than this.
    #[inline(always)]
    pub fn is_in_front(&self, vertex: u16, nearest: f32) -> bool {
        let q = self.q[usize::from(vertex)];
        (q > 0.0) & (q <= nearest)
    }

    /// Finds the triangles that face the camera, may cover the center of a pixel of the image and
    /// are nowhere nearer than this.
    #[inline(always)]
    pub fn find_alive(
        &self,
        vertices: &[Vec<u16>; 3],
        lens: &Lens,
        nearest: f32,
        alive: &mut Vec<u32>,
    ) {
        let n = vertices[0].len().min(vertices[1].len()).min(vertices[2].len());
        let [a, b, c] = vertices.each_ref().map(|list| &list[..n]);
        let (u, v, q) = (&*self.u, &*self.v, &*self.q);
        let (columns, rows) = (lens.width as f32, lens.height as f32);
        alive.clear();
        alive.resize(n, 0);
        for k in 0..n {
            let (a, b, c) = (usize::from(a[k]), usize::from(b[k]), usize::from(c[k]));
            let (au, av, bu, bv, cu, cv) = (u[a], v[a], u[b], v[b], u[c], v[c]);
            let area = (bu - au) * (cv - av) - (bv - av) * (cu - au);
            // Edges are rounded where they cross a row: a little wider is safe.
            let begin = first_center(least(least(au, bu), cu) - 0.01, columns);
            let end = first_center(most(most(au, bu), cu) + 0.01, columns);
            let top = first_center(least(least(av, bv), cv), rows);
            let bottom = first_center(most(most(av, bv), cv), rows);
            let (nearer, farther) = (most(most(q[a], q[b]), q[c]), least(least(q[a], q[b]), q[c]));
            let is_in_front = (farther > 0.0) & (nearer <= nearest);
            // Rows run downwards, so counter-clockwise triangles have negative area here.
            alive[k] = u32::from((area < 0.0) & (begin < end) & (top < bottom) & is_in_front);
        }
        let mut found = 0;
        for k in 0..n {
            let is_alive = alive[k];
            alive[found] = k as u32;
            found += is_alive as usize;
        }
        alive.truncate(found);
    }
}

/// Inverse depth over the image: `q + du * (u - u0) + dv * (v - v0)`, kept within [low, high].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Slope {
    /// Inverse depth at u0 and v0.
    pub q: f32,
    pub u0: f32,
    pub v0: f32,
    pub du: f32,
    pub dv: f32,
    pub low: f32,
    pub high: f32,
}

impl Slope {
    /// Through three vertices; without meaning if they lie on a line.
    #[inline(always)]
    fn through(a: ScreenVertex, b: ScreenVertex, c: ScreenVertex) -> Slope {
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
    pub fn through(a: ScreenVertex, b: ScreenVertex, c: ScreenVertex, rows: f32) -> Setup {
        let slope = Slope::through(a, b, c);
        Setup::of([(a.u, a.v), (b.u, b.v), (c.u, c.v)], slope, rows)
    }

    /// Of these vertices on an image of so many rows, whichever way they turn.
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
        vertices: &ScreenVertices,
        rows: f32,
    ) {
        let n = mesh[0].len();
        let last = n - 1;
        let (m0, m1, m2) = (&mesh[0][..n], &mesh[1][..n], &mesh[2][..n]);
        for (k, triangle) in triangles.iter().enumerate() {
            let triangle = (*triangle as usize).min(last);
            let (a, b, c) = (
                vertices.get(m0[triangle]),
                vertices.get(m1[triangle]),
                vertices.get(m2[triangle]),
            );
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

/// 2^23: from here to twice as much, floats are the whole numbers.
pub(crate) const WHOLES: f32 = 8_388_608.0;

/// The first row or column whose middle (+ 0.5) isn't before `x`, within [0, max]; one that lies
/// just there is rounded to even.
#[inline(always)]
pub(crate) fn first_center(x: f32, max: f32) -> u32 {
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < max { x } else { max };
    (x + WHOLES).to_bits().wrapping_sub(WHOLES.to_bits())
}
