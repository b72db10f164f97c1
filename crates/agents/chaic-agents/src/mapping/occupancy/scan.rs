//! Scan of a depth image: what it shows of each cell.

use chaic_core::Vec3;
use chaic_core::geom::Camera;

use super::{
    HEAD_MARGIN_M, MAP_RANGE_M, NOW_FLOOR, NOW_HIGH, NOW_NEAR, NOW_OCCUPIED, NOW_TALL,
    OccupancyMap, TALL_M, TOP_M, WALL_M,
};
use crate::mapping::grid::{Grid, MAX_SIDE};
use crate::perception::{Percepts, Rays};

/// Points below this are floor, meters. (The paper's code uses 0.05; rugs and curbs need more.)
const FLOOR_M: f32 = 0.08;
/// A pixel's observation is encoded as its cell times this, plus `NOW_*` bits.
const CELL_FACTOR: u32 = 32;
const _: () = assert!(MAX_SIDE * MAX_SIDE < (u32::MAX / CELL_FACTOR) as usize);
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
    /// are those of [`Rays`], axis by axis. Without `FLOOR`, no pixel may show a point below
    /// [`FLOOR_M`]; without `HIGH`, none above [`WALL_M`]; see [`Heights`].
    #[inline(always)]
    fn encode<const FLOOR: bool, const HIGH: bool>(
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
            let floor = mask(FLOOR & (y < FLOOR_M)) & u32::from(NOW_FLOOR);
            let firm = mask((y > self.step_over_m) & (y <= head_m)) & u32::from(NOW_OCCUPIED);
            let is_below_top = !HIGH | (y < TOP_M);
            let high = mask(HIGH & (y > WALL_M) & is_below_top) & u32::from(NOW_HIGH);
            let tall = mask(HIGH & (y > TALL_M) & is_below_top) & u32::from(NOW_TALL);
            let near = mask((d < self.known_m) & is_below_top) & u32::from(NOW_NEAR);
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

/// Heights of the points that pixels of one row can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Heights {
    /// Camera height and below; the camera is not above [`WALL_M`].
    Low,
    /// Camera height and above; the camera is not below [`FLOOR_M`].
    High,
    /// All others.
    Any,
}

impl Heights {
    /// Returns the heights for a camera at `eye_m`. `columns` are the minimum and maximum vertical
    /// component of the columns of [`Rays`], `None` if one of them is NaN; `row` is that of the row.
    ///
    /// A pixel at depth `d` has the height `eye_m + d * (column + row)`. Only pixels with 0 < `d` <
    /// [`MAP_RANGE_M`] show anything. IEEE addition and multiplication are monotonic. If the sum of
    /// the maximum column and the row is at most 0, so are the sums and products of all columns, and
    /// no height exceeds `eye_m`. No height is NaN, because infinite terms have equal signs. The
    /// minimum gives the opposite bound.
    #[inline(always)]
    fn of_row(eye_m: f32, columns: Option<[f32; 2]>, row: f32) -> Heights {
        match columns {
            Some([_, max]) if max + row <= 0.0 && eye_m <= WALL_M => Heights::Low,
            Some([min, _]) if min + row >= 0.0 && eye_m >= FLOOR_M => Heights::High,
            _ => Heights::Any,
        }
    }
}

/// Returns minimum and maximum of these numbers; `None` if one of them is NaN.
fn range(numbers: &[f32]) -> Option<[f32; 2]> {
    let wider = |[min, max]: [f32; 2], x: &f32| [min.min(*x), max.max(*x)];
    let is_ordered = numbers.iter().all(|x| !x.is_nan());
    is_ordered.then(|| numbers.iter().fold([f32::INFINITY, f32::NEG_INFINITY], wider))
}

/// Subsamples a row of pixels with this stride. Samples that are `dynamic` become 0.
#[inline(always)]
fn subsample(stride: usize, row: &[f32], dynamic: Option<&[bool]>, sampled: &mut [f32]) {
    if stride == 2 && row.len().is_multiple_of(2) {
        // The common case, in a form that compiles to a few instructions.
        let samples = sampled.iter_mut().zip(row.as_chunks::<2>().0);
        match dynamic {
            Some(dynamic) => {
                for ((to, pair), is_dynamic) in samples.zip(dynamic) {
                    // A bit mask: a condition would compile to slow masked loads.
                    *to = f32::from_bits(pair[0].to_bits() & mask(!*is_dynamic));
                }
            }
            None => samples.for_each(|(to, pair)| *to = pair[0]),
        }
    } else {
        sampled.iter_mut().zip(row.iter().step_by(stride)).for_each(|(to, d)| *to = *d);
        for (to, is_dynamic) in sampled.iter_mut().zip(dynamic.unwrap_or_default()) {
            if *is_dynamic {
                *to = 0.0;
            }
        }
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
        let vertical = range(&columns[1]);
        let columns = columns.each_ref().map(|c| c.as_chunks::<LANES>().0);
        let mut sampled = vec![0.0; padded_width];
        let limits = Limits {
            grid: self.grid,
            head_m: height_m + HEAD_MARGIN_M,
            step_over_m: self.step_over_m,
            known_m,
        };
        self.touched.clear();
        let mut above = vec![[0; LANES]; padded_width / LANES];
        for (k, row) in (0..height).step_by(stride).enumerate() {
            let dynamic = percepts.dynamic_mask.get(k * sampled_width..(k + 1) * sampled_width);
            subsample(stride, &depth[row * width..][..width], dynamic, &mut sampled);
            let lanes = sampled.as_chunks::<LANES>().0;
            let (eye, ray) = (rays.eye, rays.rows[row]);
            match Heights::of_row(eye.y, vertical, ray.y) {
                Heights::Low => {
                    self.scan_row::<true, false>(&limits, lanes, columns, eye, ray, &mut above);
                }
                Heights::High => {
                    self.scan_row::<false, true>(&limits, lanes, columns, eye, ray, &mut above);
                }
                Heights::Any => {
                    self.scan_row::<true, true>(&limits, lanes, columns, eye, ray, &mut above);
                }
            }
        }
    }

    /// Marks what the pixels of one row show, see [`Limits::encode`]. `above` are the codes of the
    /// row above; they become those of this row.
    #[inline(always)]
    fn scan_row<const FLOOR: bool, const HIGH: bool>(
        &mut self,
        limits: &Limits,
        depth: &[[f32; LANES]],
        [xs, ys, zs]: [&[[f32; LANES]]; 3],
        eye: Vec3,
        row: Vec3,
        above: &mut [[u32; LANES]],
    ) {
        let mut last = 0;
        let lanes = depth.iter().zip(xs.iter().zip(ys).zip(zs));
        for ((d, ((x, y), z)), above) in lanes.zip(above) {
            let codes = limits.encode::<FLOOR, HIGH>(d, [x, y, z], eye, row);
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

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_PI_2;

    use chaic_core::Vec2;
    use chaic_core::geom::{Rect, pitch_rotation, yaw_rotation};
    use chaic_core::rng::RngStream;

    use super::*;

    /// Returns what an image shows of each cell, pixel by pixel.
    fn reference_scan(scan: &Scan<'_>) -> Vec<u8> {
        let (grid, step_over_m) = (scan.map.grid, scan.map.step_over_m);
        let rays = Rays::new(scan.camera);
        let stride = scan.percepts.stride.max(1) as usize;
        let (width, height) = (scan.camera.width as usize, scan.camera.height as usize);
        let n_columns = width.div_ceil(stride);
        let head_m = (scan.height_m + HEAD_MARGIN_M).min(WALL_M);
        let mut now = vec![0; grid.n_cells()];
        for (k, row) in (0..height).step_by(stride).enumerate() {
            let dynamic = scan.percepts.dynamic_mask.get(k * n_columns..(k + 1) * n_columns);
            for (i, column) in (0..width).step_by(stride).enumerate() {
                let d = scan.depth[row * width + column];
                let is_near = d > Camera::NEAR_M && d < MAP_RANGE_M;
                if !is_near || dynamic.is_some_and(|dynamic| dynamic[i]) {
                    continue;
                }
                let p = rays.point(column, row, d);
                let bits = [
                    (p.y < FLOOR_M, NOW_FLOOR),
                    (p.y > step_over_m && p.y <= head_m, NOW_OCCUPIED),
                    (p.y > WALL_M && p.y < TOP_M, NOW_HIGH),
                    (p.y > TALL_M && p.y < TOP_M, NOW_TALL),
                    (d < scan.known_m && p.y < TOP_M, NOW_NEAR),
                ];
                if let Some(cell) = grid.cell_at(Vec2::new(p.x, p.z)) {
                    for (_, bit) in bits.into_iter().filter(|(is_shown, _)| *is_shown) {
                        now[cell] |= bit;
                    }
                }
            }
        }
        now
    }

    #[test]
    fn scans_of_random_images_equal_plain_ones() {
        let (mut n_rows, mut n_marked) = ([0; 3], 0);
        for seed in 0..120 {
            let mut rng = RngStream::new(seed, "scan", 0);
            let mut pick = |values: &[f32]| values[rng.below(values.len())];
            let eye_m = pick(&[0.05, FLOOR_M, 1.1, 1.65, WALL_M, WALL_M.next_up(), 2.5]);
            let (pitch_rad, roll_rad) = (pick(&[0.0, 0.0, -0.5, 0.4]), pick(&[0.0, 0.0, 0.3]));
            let (height_m, known_m) = (pick(&[1.1, 1.75, 2.3]), pick(&[2.0, 5.0, 9.0]));
            let step_over_m = pick(&[0.12, 0.5]);
            let roll =
                yaw_rotation(FRAC_PI_2) * pitch_rotation(roll_rad) * yaw_rotation(-FRAC_PI_2);
            let camera = Camera {
                eye_in_world: Vec3::new(rng.range(-2.0, 2.0), eye_m, rng.range(-2.0, 2.0)),
                world_from_camera: yaw_rotation(rng.range(-3.0, 3.0))
                    * pitch_rotation(pitch_rad)
                    * roll,
                vertical_fov_rad: Camera::EYE_FOV_RAD,
                width: [32, 33, 50, 64][rng.below(4)],
                height: 40,
            };
            let n_pixels = (camera.width * camera.height) as usize;
            let special = [f32::NAN, f32::INFINITY, 0.0, -1.0, Camera::NEAR_M, MAP_RANGE_M];
            let mut pixel = || {
                if rng.chance(0.2) { special[rng.below(6)] } else { rng.range(0.05, 6.0) }
            };
            let depth: Vec<f32> = (0..n_pixels).map(|_| pixel()).collect();
            let stride = rng.below(4) as u32;
            // Complete, absent, or too short.
            let n_columns = camera.width.div_ceil(stride.max(1));
            let n_rows_masked = [camera.height.div_ceil(stride.max(1)), 0, 7][rng.below(3)];
            let n_masked = (n_columns * n_rows_masked) as usize;
            let dynamic_mask = (0..n_masked).map(|_| rng.chance(0.3)).collect();
            let percepts = Percepts { dynamic_mask, stride, ..Percepts::default() };
            let bounds = Rect::new([-3.0, -3.0], [3.0, 3.0]);
            let mut map = OccupancyMap::new(&bounds, step_over_m);
            let scan = Scan {
                map: &mut map,
                depth: &depth,
                percepts: &percepts,
                camera: &camera,
                height_m,
                known_m,
            };
            let expected = reference_scan(&scan);
            pulp::Arch::new().dispatch(scan);
            assert_eq!(map.now, expected, "seed {seed}");
            map.touched.sort_unstable();
            let marked = (0..expected.len()).filter(|cell| expected[*cell] != 0);
            assert_eq!(map.touched, marked.map(|cell| cell as u32).collect::<Vec<_>>());
            n_marked += map.touched.len();
            let rays = Rays::new(&camera);
            let columns = range(&rays.columns.iter().map(|c| c.y).collect::<Vec<_>>());
            for row in &rays.rows {
                n_rows[Heights::of_row(eye_m, columns, row.y) as usize] += 1;
            }
        }
        assert!(n_rows.iter().all(|n| *n > 500) && n_marked > 10_000, "{n_rows:?} {n_marked}");
    }

    #[test]
    fn rows_without_known_bounds_show_any_height() {
        let level = Some([0.0, 0.0]);
        assert_eq!(Heights::of_row(1.65, level, -0.1), Heights::Low);
        assert_eq!(Heights::of_row(1.65, level, 0.1), Heights::High);
        assert_eq!(Heights::of_row(1.65, Some([-0.2, 0.2]), 0.1), Heights::Any);
        assert_eq!(Heights::of_row(WALL_M.next_up(), level, -0.1), Heights::Any);
        assert_eq!(Heights::of_row(FLOOR_M.next_down(), level, 0.1), Heights::Any);
        assert_eq!(Heights::of_row(f32::NAN, level, 0.1), Heights::Any);
        assert_eq!(Heights::of_row(1.65, level, f32::NAN), Heights::Any);
        let infinite = Some([f32::NEG_INFINITY, f32::INFINITY]);
        assert_eq!(Heights::of_row(1.65, infinite, f32::INFINITY), Heights::Any);
        assert_eq!(range(&[0.0, f32::NAN, 1.0]), None);
        assert_eq!(range(&[0.5, -1.0, 0.0]), Some([-1.0, 0.5]));
    }
}
