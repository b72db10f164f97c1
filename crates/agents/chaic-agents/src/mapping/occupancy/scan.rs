//! Scan of a depth image: what it shows of each cell.

use chaic_core::Vec3;
use chaic_core::geom::Camera;

use super::{
    HEAD_MARGIN_M, MAP_RANGE_M, NOW_FLOOR, NOW_HIGH, NOW_NEAR, NOW_OCCUPIED, NOW_TALL,
    OccupancyMap, TALL_M, TOP_M, WALL_M,
};
use crate::mapping::grid::Grid;
use crate::perception::{Percepts, Rays};

/// Points below this are floor, meters. (The paper's code uses 0.05; rugs and curbs need more.)
const FLOOR_M: f32 = 0.08;
/// A pixel's observation is encoded as its cell times this, plus `NOW_*` bits.
const CELL_FACTOR: u32 = 32;
/// Number of pixels processed at once.
const LANES: usize = 16;

/// Thresholds by which pixels are classified.
#[derive(Clone, Copy)]
struct Limits {
    grid: Grid,
    /// Obstacles above this do not block the body, meters; those below `step_over_m` are stepped
    /// over.
    head_m: f32,
    step_over_m: f32,
    /// Range in which observed cells count as known, meters.
    known_m: f32,
}

impl Limits {
    /// Encodes the observations of pixels of one row at depths `d`, 0 for none. `columns` and `row`
    /// are those of [`Rays`], axis by axis.
    #[inline(always)]
    fn encode(
        &self,
        d: &[f32; LANES],
        columns: [&[f32; LANES]; 3],
        eye: Vec3,
        row: Vec3,
    ) -> [u32; LANES] {
        // Plain loops over arrays vectorize; closures would be compiled separately.
        let mut any_near = false;
        for d in d {
            any_near |= (*d < MAP_RANGE_M) & (*d > Camera::NEAR_M);
        }
        let mut codes = [0; LANES];
        if !any_near {
            return codes;
        }
        let head_m = self.head_m.min(WALL_M);
        let [xs, ys, zs] = columns;
        for k in 0..LANES {
            let d = d[k];
            let x = eye.x + d * (xs[k] + row.x);
            let y = eye.y + d * (ys[k] + row.y);
            let z = eye.z + d * (zs[k] + row.z);
            // Bit masks instead of conditions, which would compile to branches.
            let floor = mask(y < FLOOR_M) & u32::from(NOW_FLOOR);
            let firm = mask((y > self.step_over_m) & (y <= head_m)) & u32::from(NOW_OCCUPIED);
            let high = mask((y > WALL_M) & (y < TOP_M)) & u32::from(NOW_HIGH);
            let tall = mask((y > TALL_M) & (y < TOP_M)) & u32::from(NOW_TALL);
            let near = mask((d < self.known_m) & (y < TOP_M)) & u32::from(NOW_NEAR);
            let bits = floor | firm | high | tall | near;
            let cell = self.grid.cell_or_none(x, z);
            let is_near = (d < MAP_RANGE_M) & (d > Camera::NEAR_M);
            let counts = mask(is_near & (bits != 0) & (cell >= 0));
            codes[k] = ((cell as u32).wrapping_mul(CELL_FACTOR) | bits) & counts;
        }
        codes
    }
}

/// Returns all bits set, or none.
#[inline(always)]
fn mask(condition: bool) -> u32 {
    u32::from(condition).wrapping_neg()
}

/// Subsamples a row of pixels with this stride.
#[inline(always)]
fn subsample(stride: usize, row: &[f32], sampled: &mut [f32]) {
    if stride == 2 && row.len().is_multiple_of(2) {
        // The common case, in a form that compiles to a few instructions.
        sampled.iter_mut().zip(row.as_chunks::<2>().0).for_each(|(to, pair)| *to = pair[0]);
    } else {
        sampled.iter_mut().zip(row.iter().step_by(stride)).for_each(|(to, d)| *to = *d);
    }
}

/// Scan of one image, compiled for vectors of each width.
pub(super) struct Scan<'a> {
    pub map: &'a mut OccupancyMap,
    pub depth: &'a [f32],
    pub percepts: &'a Percepts,
    pub camera: &'a Camera,
    pub height_m: f32,
    pub known_m: f32,
}

impl pulp::NullaryFnOnce for Scan<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Scan { map, depth, percepts, camera, height_m, known_m } = self;
        map.scan(depth, percepts, camera, height_m, known_m);
    }
}

impl OccupancyMap {
    /// Marks in `now` what the image shows of each cell.
    #[inline(always)]
    fn scan(
        &mut self,
        depth: &[f32],
        percepts: &Percepts,
        camera: &Camera,
        height_m: f32,
        known_m: f32,
    ) {
        let stride = percepts.stride.max(1) as usize;
        let (width, height) = (camera.width as usize, camera.height as usize);
        let sampled_width = width.div_ceil(stride);
        let rays = Rays::new(camera);
        // Padded to whole lanes; pixels at depth 0 show nothing.
        let padded_width = sampled_width.next_multiple_of(LANES);
        let columns: [Vec<f32>; 3] = std::array::from_fn(|axis| {
            let mut columns: Vec<f32> =
                rays.columns.iter().step_by(stride).map(|c| c[axis]).collect();
            columns.resize(padded_width, 0.0);
            columns
        });
        let [xs, ys, zs] = columns.each_ref().map(|c| c.as_chunks::<LANES>().0);
        let mut sampled = vec![0.0; padded_width];
        let mut static_depth = vec![0.0; padded_width];
        let limits = Limits {
            grid: self.grid,
            head_m: height_m + HEAD_MARGIN_M,
            step_over_m: self.step_over_m,
            known_m,
        };
        self.touched.clear();
        let mut above = vec![[0; LANES]; padded_width / LANES];
        for (k, row) in (0..height).step_by(stride).enumerate() {
            subsample(stride, &depth[row * width..][..width], &mut sampled);
            let dynamic = percepts.dynamic_mask.get(k * sampled_width..(k + 1) * sampled_width);
            let sampled = match dynamic {
                Some(dynamic) => {
                    // Into another buffer: in place, it compiles to slow masked stores.
                    for ((to, d), is_dynamic) in static_depth.iter_mut().zip(&sampled).zip(dynamic)
                    {
                        *to = if *is_dynamic { 0.0 } else { *d };
                    }
                    &static_depth
                }
                None => &sampled,
            };
            let mut last = 0;
            let lanes = sampled.as_chunks::<LANES>().0.iter().zip(xs.iter().zip(ys).zip(zs));
            for ((d, ((x, y), z)), above) in lanes.zip(&mut above) {
                let codes = limits.encode(d, [x, y, z], rays.eye, rays.rows[row]);
                // A bit for each pixel that differs from its left and its upper neighbor.
                let mut before = [last; LANES];
                before[1..].copy_from_slice(&codes[..LANES - 1]);
                let mut changes = 0;
                for k in 0..LANES {
                    let is_new = (codes[k] != before[k]) & (codes[k] != above[k]);
                    changes |= u32::from(is_new) << k;
                }
                while changes != 0 {
                    self.mark(codes[changes.trailing_zeros() as usize % LANES]);
                    changes &= changes - 1;
                }
                last = codes[LANES - 1];
                *above = codes;
            }
        }
    }

    /// Marks the observation of one pixel, see [`Limits::encode`].
    #[inline(always)]
    fn mark(&mut self, code: u32) {
        if code != 0 {
            let (cell, bits) = ((code / CELL_FACTOR) as usize, (code % CELL_FACTOR) as u8);
            if self.now[cell] == 0 {
                self.touched.push(cell as u32);
            }
            self.now[cell] |= bits;
        }
    }
}
