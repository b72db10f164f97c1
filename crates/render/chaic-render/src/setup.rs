//! Triangle setup: projected vertices, back-face culling, edges and depth planes, before pixels are
//! filled.
//!
//! A pixel belongs to a triangle if its center does. The crossing of an edge with a row of centers
//! is computed from the two ends of the edge in a fixed order. Two triangles that share an edge
//! therefore leave neither a gap nor an overlap.

use chaic_core::Vec3;

use crate::projection::{CameraTransform, Projection};

/// A vertex in screen space: pixels from the left and the top, and inverse depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenVertex {
    pub u: f32,
    pub v: f32,
    pub q: f32,
}

/// Maximum number of vertices of a mesh. A 16-bit index then needs no bounds check.
const N_VERTICES: usize = 1 << 16;

/// Vertices of a mesh in screen space, as a structure of arrays.
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

    /// Projects points into screen space.
    #[inline(always)]
    pub fn project_vertices(
        &mut self,
        positions: &[Vec3],
        transform: &CameraTransform,
        projection: &Projection,
    ) {
        let (mu, mv) = projection.center();
        let n = positions.len().min(N_VERTICES);
        let (u, v, q) = (&mut self.u[..n], &mut self.v[..n], &mut self.q[..n]);
        let positions = &positions[..n];
        if projection.is_plan {
            for k in 0..n {
                let p = transform.map(positions[k]);
                (u[k], v[k], q[k]) = (mu + p.x, mv + p.y, projection.inverse_depth(p.z));
            }
            return;
        }
        for k in 0..n {
            let p = transform.map(positions[k]);
            let inverse_depth = 1.0 / p.z;
            (u[k], v[k], q[k]) =
                (mu + p.x * inverse_depth, mv + p.y * inverse_depth, inverse_depth);
        }
    }

    /// Returns whether a vertex is in front of the camera and not beyond the inverse depth
    /// `nearest`.
    #[inline(always)]
    pub fn is_beyond_near_plane(&self, vertex: u16, nearest: f32) -> bool {
        let q = self.q[usize::from(vertex)];
        (q > 0.0) & (q <= nearest)
    }

    /// Returns whether the first `n` vertices are in front of the camera and not beyond the inverse
    /// depth `nearest`.
    #[inline(always)]
    fn are_beyond_near_plane(&self, n: usize, nearest: f32) -> bool {
        let mut all = true;
        for q in &self.q[..n.min(N_VERTICES)] {
            all &= (*q > 0.0) & (*q <= nearest);
        }
        all
    }

    /// Collects the triangles that face the camera, may cover a pixel center of the image, and have
    /// no vertex nearer than `nearest`. The mesh has `n_vertices` vertices.
    #[inline(always)]
    pub fn cull_backfaces(
        &self,
        n_vertices: usize,
        vertices: &[Vec<u16>; 3],
        projection: &Projection,
        nearest: f32,
        survivors: &mut Vec<u32>,
    ) {
        // Few meshes reach the near plane. The others need no test for each triangle.
        if self.are_beyond_near_plane(n_vertices, nearest) {
            self.cull::<false>(vertices, projection, nearest, survivors);
        } else {
            self.cull::<true>(vertices, projection, nearest, survivors);
        }
    }

    #[inline(always)]
    fn cull<const CHECKS_NEAR_PLANE: bool>(
        &self,
        vertices: &[Vec<u16>; 3],
        projection: &Projection,
        nearest: f32,
        survivors: &mut Vec<u32>,
    ) {
        let n = vertices[0].len().min(vertices[1].len()).min(vertices[2].len());
        let [a, b, c] = vertices.each_ref().map(|list| &list[..n]);
        let (u, v, q) = (&*self.u, &*self.v, &*self.q);
        let (columns, rows) = (projection.width as f32, projection.height as f32);
        survivors.clear();
        survivors.resize(n, 0);
        for k in 0..n {
            let (a, b, c) = (usize::from(a[k]), usize::from(b[k]), usize::from(c[k]));
            let (au, av, bu, bv, cu, cv) = (u[a], v[a], u[b], v[b], u[c], v[c]);
            let area = (bu - au) * (cv - av) - (bv - av) * (cu - au);
            // Edges are rounded where they cross a row: a slightly wider range is safe.
            let begin = first_center(fmin(fmin(au, bu), cu) - 0.01, columns);
            let end = first_center(fmax(fmax(au, bu), cu) + 0.01, columns);
            let top = first_center(fmin(fmin(av, bv), cv), rows);
            let bottom = first_center(fmax(fmax(av, bv), cv), rows);
            let is_in_front = !CHECKS_NEAR_PLANE || {
                let nearer = fmax(fmax(q[a], q[b]), q[c]);
                let farther = fmin(fmin(q[a], q[b]), q[c]);
                (farther > 0.0) & (nearer <= nearest)
            };
            // Rows run downward, so counter-clockwise triangles have negative area here.
            survivors[k] = u32::from((area < 0.0) & (begin < end) & (top < bottom) & is_in_front);
        }
        let mut n_survivors = 0;
        for k in 0..n {
            let survives = survivors[k];
            survivors[n_survivors] = k as u32;
            n_survivors += survives as usize;
        }
        survivors.truncate(n_survivors);
    }
}

/// Plane of inverse depth over the image: `q + du * (u - u0) + dv * (v - v0)`, clamped to [low,
/// high].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DepthPlane {
    /// Inverse depth at (u0, v0).
    pub q: f32,
    pub u0: f32,
    pub v0: f32,
    pub du: f32,
    pub dv: f32,
    pub low: f32,
    pub high: f32,
}

impl DepthPlane {
    /// Plane through three vertices; not finite if they are collinear.
    #[inline(always)]
    fn through(a: ScreenVertex, b: ScreenVertex, c: ScreenVertex) -> DepthPlane {
        let (bu, bv, bq) = (b.u - a.u, b.v - a.v, b.q - a.q);
        let (cu, cv, cq) = (c.u - a.u, c.v - a.v, c.q - a.q);
        let inverse = 1.0 / (bu * cv - bv * cu);
        DepthPlane {
            q: a.q,
            u0: a.u,
            v0: a.v,
            du: (bq * cv - cq * bv) * inverse,
            dv: (cq * bu - bq * cu) * inverse,
            low: fmin(fmin(a.q, b.q), c.q),
            high: fmax(fmax(a.q, b.q), c.q),
        }
    }
}

/// A triangle ready for rasterization. It covers the pixel rows `first_row..end_row`. Rows before
/// `middle_row` end at the upper short edge, the others at the lower one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TriangleSetup {
    pub first_row: u32,
    pub middle_row: u32,
    pub end_row: u32,
    /// Start of the long edge and of the upper short edge.
    pub top: [f32; 2],
    /// Start of the lower short edge.
    pub middle_vertex: [f32; 2],
    /// Columns per row along the long edge, the upper short edge and the lower short edge.
    pub columns_per_row: [f32; 3],
    /// True if the short edges are on the right.
    pub short_edges_right: bool,
    pub depth_plane: DepthPlane,
}

impl TriangleSetup {
    /// Setup of a triangle that faces the camera.
    #[inline(always)]
    pub fn from_screen_vertices(
        a: ScreenVertex,
        b: ScreenVertex,
        c: ScreenVertex,
        rows: f32,
    ) -> TriangleSetup {
        let depth_plane = DepthPlane::through(a, b, c);
        TriangleSetup::from_vertices([(a.u, a.v), (b.u, b.v), (c.u, c.v)], depth_plane, rows)
    }

    /// Setup of three vertices in any winding order, on an image of `rows` rows.
    #[inline(always)]
    pub fn from_vertices(
        [a, b, c]: [(f32, f32); 3],
        depth_plane: DepthPlane,
        rows: f32,
    ) -> TriangleSetup {
        let (a, b) = sort_by_row(a, b);
        let (b, c) = sort_by_row(b, c);
        let (a, b) = sort_by_row(a, b);
        TriangleSetup {
            first_row: first_center(a.1, rows),
            middle_row: first_center(b.1, rows),
            end_row: first_center(c.1, rows),
            top: [a.0, a.1],
            middle_vertex: [b.0, b.1],
            columns_per_row: [columns_per_row(a, c), columns_per_row(a, b), columns_per_row(b, c)],
            short_edges_right: (b.0 - a.0) * (c.1 - a.1) > (c.0 - a.0) * (b.1 - a.1),
            depth_plane,
        }
    }
}

/// Sorts two vertices: the upper one first, of two at the same height the left one.
#[inline(always)]
fn sort_by_row(a: (f32, f32), b: (f32, f32)) -> ((f32, f32), (f32, f32)) {
    let is_swapped = (b.1 < a.1) | ((b.1 == a.1) & (b.0 < a.0));
    let first = (if is_swapped { b.0 } else { a.0 }, if is_swapped { b.1 } else { a.1 });
    let second = (if is_swapped { a.0 } else { b.0 }, if is_swapped { a.1 } else { b.1 });
    (first, second)
}

/// Returns the columns that an edge moves per row.
#[inline(always)]
fn columns_per_row(top: (f32, f32), bottom: (f32, f32)) -> f32 {
    let dv = bottom.1 - top.1;
    if dv > 0.0 { (bottom.0 - top.0) / dv } else { 0.0 }
}

/// Number of triangles that are set up together.
pub(crate) const SETUP_BATCH_SIZE: usize = 16;

/// Triangles that are set up together, as a structure of arrays.
#[derive(Default)]
pub(crate) struct TriangleSetups {
    first_row: [u32; SETUP_BATCH_SIZE],
    middle_row: [u32; SETUP_BATCH_SIZE],
    end_row: [u32; SETUP_BATCH_SIZE],
    top: [[f32; SETUP_BATCH_SIZE]; 2],
    middle_vertex: [[f32; SETUP_BATCH_SIZE]; 2],
    columns_per_row: [[f32; SETUP_BATCH_SIZE]; 3],
    short_edges_right: [u32; SETUP_BATCH_SIZE],
    q: [[f32; SETUP_BATCH_SIZE]; 3],
    depth_plane: [[f32; SETUP_BATCH_SIZE]; 4],
}

impl TriangleSetups {
    /// Sets up the triangles with these indices, all of which face the camera.
    #[inline(always)]
    pub fn fill(
        &mut self,
        triangles: &[u32; SETUP_BATCH_SIZE],
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
            let s = TriangleSetup::from_screen_vertices(a, b, c, rows);
            (self.first_row[k], self.middle_row[k], self.end_row[k]) =
                (s.first_row, s.middle_row, s.end_row);
            (self.top[0][k], self.top[1][k]) = (s.top[0], s.top[1]);
            (self.middle_vertex[0][k], self.middle_vertex[1][k]) =
                (s.middle_vertex[0], s.middle_vertex[1]);
            self.columns_per_row[0][k] = s.columns_per_row[0];
            self.columns_per_row[1][k] = s.columns_per_row[1];
            self.columns_per_row[2][k] = s.columns_per_row[2];
            self.short_edges_right[k] = u32::from(s.short_edges_right);
            (self.q[0][k], self.q[1][k], self.q[2][k]) =
                (s.depth_plane.q, s.depth_plane.u0, s.depth_plane.v0);
            (self.depth_plane[0][k], self.depth_plane[1][k]) = (s.depth_plane.du, s.depth_plane.dv);
            (self.depth_plane[2][k], self.depth_plane[3][k]) =
                (s.depth_plane.low, s.depth_plane.high);
        }
    }

    /// Returns the setup of triangle `k`.
    #[inline(always)]
    pub fn get(&self, k: usize) -> TriangleSetup {
        let k = k % SETUP_BATCH_SIZE;
        TriangleSetup {
            first_row: self.first_row[k],
            middle_row: self.middle_row[k],
            end_row: self.end_row[k],
            top: [self.top[0][k], self.top[1][k]],
            middle_vertex: [self.middle_vertex[0][k], self.middle_vertex[1][k]],
            columns_per_row: [
                self.columns_per_row[0][k],
                self.columns_per_row[1][k],
                self.columns_per_row[2][k],
            ],
            short_edges_right: self.short_edges_right[k] != 0,
            depth_plane: DepthPlane {
                q: self.q[0][k],
                u0: self.q[1][k],
                v0: self.q[2][k],
                du: self.depth_plane[0][k],
                dv: self.depth_plane[1][k],
                low: self.depth_plane[2][k],
                high: self.depth_plane[3][k],
            },
        }
    }
}

/// Minimum of two values; `y` if either is NaN.
#[inline(always)]
pub(crate) fn fmin(x: f32, y: f32) -> f32 {
    if x < y { x } else { y }
}

/// Maximum of two values; `y` if either is NaN.
#[inline(always)]
pub(crate) fn fmax(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

/// 2^23: floats from here to 2^24 are exactly the integers.
pub(crate) const TWO_POW_23: f32 = 8_388_608.0;

/// First row or column whose center (index + 0.5) is not before `x`, clamped to [0, max]. Ties
/// round to even.
#[inline(always)]
pub(crate) fn first_center(x: f32, max: f32) -> u32 {
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < max { x } else { max };
    (x + TWO_POW_23).to_bits().wrapping_sub(TWO_POW_23.to_bits())
}
