//! Input of the detector's second stage: a square crop around each proposal, and scalars that
//! describe its size and position.

use chaic_core::geom::Camera;

use crate::detector::STRIDE;
use crate::features::N_FEATURES;
use crate::instances::{Pixel, Pixels, Segment};
use crate::labels::{BACKGROUND, n_labels};
use crate::loss::ln;

/// Side of a crop, samples.
pub const SIDE: usize = 32;
/// Channels of a sample: red, green, blue, depth relative to the proposal in units of the crop's
/// side, height above the floor, surface normal (see [`features`](crate::features::features)); and
/// four flags: the sample belongs to the proposal, has its label, votes for its center, and lies in
/// the image.
pub const N_CHANNELS: usize = 12;
/// Scalars before the fraction of the proposal's pixels with each label.
const N_MEASURES: usize = 23;

/// Ratio of a crop's side to the larger side of the proposal's bounding box.
const MARGIN: f32 = 1.3;
/// Additional samples around the bounding box, pixels at the network's resolution.
const MIN_MARGIN: f32 = 2.0;
/// Maximum number of samples that are averaged in each direction.
const MAX_SUPERSAMPLING: usize = 3;

/// Returns the number of scalars.
pub fn n_scalars() -> usize {
    N_MEASURES + n_labels()
}

/// Square around a proposal, in pixels at the network's resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoiBox {
    /// Left and upper edge.
    pub origin: [f32; 2],
    /// Length of a side.
    pub side: f32,
}

impl RoiBox {
    /// Returns the square around these pixels.
    pub fn around(pixels: &[u32], columns: usize) -> RoiBox {
        let [low, high] = bounds(pixels, columns);
        let size = [0, 1].map(|axis| (high[axis] + 1 - low[axis]) as f32);
        let side = MARGIN * size[0].max(size[1]) + MIN_MARGIN;
        let origin = [0, 1].map(|axis| low[axis] as f32 + 0.5 * (size[axis] - side));
        RoiBox { origin, side }
    }

    /// Returns the side of a sample, pixels at the network's resolution.
    pub fn step(&self) -> f32 {
        self.side / SIDE as f32
    }

    /// Returns the index of the network pixel at each sample, row by row; `None` outside of the
    /// image.
    pub fn sample_pixels(
        &self,
        columns: usize,
        rows: usize,
    ) -> impl Iterator<Item = Option<usize>> + use<> {
        let (origin, step) = (self.origin, self.step());
        (0..SIDE * SIDE).map(move |k| {
            let x = origin[0] + step * ((k % SIDE) as f32 + 0.5);
            let y = origin[1] + step * ((k / SIDE) as f32 + 0.5);
            let is_inside = x >= 0.0 && y >= 0.0 && x < columns as f32 && y < rows as f32;
            is_inside.then(|| y as usize * columns + x as usize)
        })
    }
}

/// Smallest and largest column and row.
fn bounds(pixels: &[u32], columns: usize) -> [[usize; 2]; 2] {
    let mut bounds = [[usize::MAX; 2], [0; 2]];
    for k in pixels {
        let at = [*k as usize % columns, *k as usize / columns];
        for axis in 0..2 {
            bounds[0][axis] = bounds[0][axis].min(at[axis]);
            bounds[1][axis] = bounds[1][axis].max(at[axis]);
        }
    }
    bounds
}

/// Image with the first stage's predictions, from which crops are taken.
pub struct RoiSource<'a> {
    /// First stage's input, shape [height, width, `N_FEATURES`].
    pub features: &'a [f32],
    /// First stage's predictions.
    pub pixels: &'a Pixels,
}

impl RoiSource<'_> {
    /// Writes the crop of a proposal, shape [`SIDE`, `SIDE`, `N_CHANNELS`], and its scalars; returns
    /// the square. Pixels of the proposal must be in ascending order, so that sums over them have a
    /// fixed order.
    pub fn write(&self, proposal: &Segment, crop: &mut [f32], scalars: &mut [f32]) -> RoiBox {
        let columns = self.pixels.columns();
        let pixels = self.pixels.pixels();
        let rows = pixels.len() / columns;
        let roi = RoiBox::around(&proposal.pixels, columns);
        let camera = self.pixels.camera();
        let depth_m = median_depth(pixels, &proposal.pixels);
        let side_m = STRIDE as f32 * roi.side * depth_m / camera.focal_px();
        let mut is_member = vec![false; pixels.len()];
        proposal.pixels.iter().for_each(|k| is_member[*k as usize] = true);
        self.write_crop(proposal, &is_member, roi, depth_m, side_m, crop);
        self.write_scalars(proposal, &is_member, [columns, rows], depth_m, scalars);
        roi
    }

    fn write_crop(
        &self,
        proposal: &Segment,
        is_member: &[bool],
        roi: RoiBox,
        depth_m: f32,
        side_m: f32,
        crop: &mut [f32],
    ) {
        let (pixels, columns) = (self.pixels.pixels(), self.pixels.columns());
        let camera = self.pixels.camera();
        let (width, height) = (camera.width as usize, camera.height as usize);
        let half_m = self.pixels.half_extents_m()[usize::from(proposal.label)];
        // Samples are averages over points at the image's resolution.
        let step = STRIDE as f32 * roi.step();
        let n = (step.round() as usize).clamp(1, MAX_SUPERSAMPLING);
        let points = roi.sample_pixels(columns, pixels.len() / columns);
        let samples = crop.as_chunks_mut::<N_CHANNELS>().0.iter_mut();
        for ((k, sample), at) in samples.enumerate().zip(points) {
            sample.fill(0.0);
            let Some(at) = at else { continue };
            let mut n_inside = 0.0;
            let mut sum = [0.0f32; N_FEATURES];
            for sub in 0..n * n {
                let offset = |k: usize| (k as f32 + 0.5) / n as f32;
                let x =
                    STRIDE as f32 * roi.origin[0] + step * ((k % SIDE) as f32 + offset(sub % n));
                let y =
                    STRIDE as f32 * roi.origin[1] + step * ((k / SIDE) as f32 + offset(sub / n));
                if x < 0.0 || y < 0.0 || x >= width as f32 || y >= height as f32 {
                    continue;
                }
                let feature = &self.features[(y as usize * width + x as usize) * N_FEATURES..];
                n_inside += 1.0;
                for (sum, x) in sum.iter_mut().zip(&feature[..N_FEATURES]) {
                    *sum += x;
                }
            }
            let mean = sum.map(|x| if n_inside > 0.0 { x / n_inside } else { 0.0 });
            let Pixel { label, point, vote, .. } = pixels[at];
            let relative = (-point[2] - depth_m) / side_m;
            sample[..3].copy_from_slice(&mean[..3]);
            sample[3] = (2.0 * relative).clamp(-2.0, 2.0);
            sample[4..8].copy_from_slice(&mean[4..8]);
            sample[8] = f32::from(u8::from(is_member[at]));
            sample[9] = f32::from(u8::from(label == proposal.label));
            if label != BACKGROUND {
                let distance = (0..3).map(|axis| {
                    let d = (vote[axis] - proposal.center[axis]) / half_m;
                    d * d
                });
                sample[10] = 1.0 - distance.sum::<f32>().sqrt().min(2.0);
            } else {
                sample[10] = -1.0;
            }
            sample[11] = 1.0;
        }
    }

    fn write_scalars(
        &self,
        proposal: &Segment,
        is_member: &[bool],
        [columns, rows]: [usize; 2],
        depth_m: f32,
        scalars: &mut [f32],
    ) {
        let (pixels, camera) = (self.pixels.pixels(), self.pixels.camera());
        let up = camera.rotation().transpose().y_axis.to_array();
        let eye_m = camera.eye_in_world.y;
        let n = proposal.pixels.len() as f32;
        let members = || proposal.pixels.iter().map(|k| &pixels[*k as usize]);
        // Right, up and depth, meters.
        let measures = |pixel: &Pixel| {
            let p = pixel.point;
            [p[0], p[0] * up[0] + p[1] * up[1] + p[2] * up[2], -p[2]]
        };
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let mut mean = [0.0f32; 3];
        for measures in members().map(measures) {
            for axis in 0..3 {
                low[axis] = low[axis].min(measures[axis]);
                high[axis] = high[axis].max(measures[axis]);
                mean[axis] += measures[axis] / n;
            }
        }
        let mut variance = [0.0f32; 3];
        let mut vote_variance = 0.0;
        for pixel in members() {
            let measures = measures(pixel);
            for axis in 0..3 {
                let d = measures[axis] - mean[axis];
                variance[axis] += d * d / n;
                let d = pixel.vote[axis] - proposal.center[axis];
                vote_variance += d * d / n;
            }
        }
        let half_m = self.pixels.half_extents_m()[usize::from(proposal.label)];
        let [first, last] = bounds(&proposal.pixels, columns);
        let [box_width, box_height] = [0, 1].map(|axis| (last[axis] + 1 - first[axis]) as f32);
        let flag = |condition: bool| f32::from(u8::from(condition));
        // Neighbors of the proposal that are nearer than it occlude it; farther ones are behind it.
        let (mut nearer, mut farther, mut border) = (0.0, 0.0, 1e-3);
        for k in &proposal.pixels {
            let k = *k as usize;
            let depth = -pixels[k].point[2];
            let (x, y) = (k % columns, k / columns);
            let neighbors = [
                (x > 0).then(|| k - 1),
                (x + 1 < columns).then(|| k + 1),
                (y > 0).then(|| k - columns),
                (y + 1 < rows).then(|| k + columns),
            ];
            for neighbor in neighbors.into_iter().flatten() {
                if is_member[neighbor] {
                    continue;
                }
                border += 1.0;
                let jump = -pixels[neighbor].point[2] - depth;
                let gap_m = 0.05 + 0.02 * depth;
                nearer += flag(jump < -gap_m);
                farther += flag(jump > gap_m);
            }
        }
        let log = |x: f32| 0.5 * ln(x.max(0.01));
        let extent = |axis: usize| log(high[axis] - low[axis]);
        let deviation = |axis: usize| log(variance[axis].sqrt());
        let values: [f32; N_MEASURES] = [
            log(depth_m),
            extent(0),
            extent(1),
            extent(2),
            deviation(0),
            deviation(1),
            deviation(2),
            (eye_m + low[1]).clamp(-1.0, 3.0),
            (eye_m + high[1]).clamp(-1.0, 3.0),
            log(n) - 2.0,
            log(box_width) - 1.0,
            log(box_height) - 1.0,
            n / (box_width * box_height),
            flag(first[0] == 0),
            flag(first[1] == 0),
            flag(last[0] + 1 == columns),
            flag(last[1] + 1 == rows),
            proposal.score,
            log(vote_variance.sqrt()),
            log(half_m),
            nearer / border,
            farther / border,
            log(n / border),
        ];
        scalars[..N_MEASURES].copy_from_slice(&values);
        scalars[N_MEASURES..].fill(0.0);
        for pixel in members() {
            scalars[N_MEASURES + usize::from(pixel.label)] += pixel.probability / n;
        }
    }
}

/// Median depth of pixels, meters.
fn median_depth(pixels: &[Pixel], members: &[u32]) -> f32 {
    let mut depths: Vec<f32> = members.iter().map(|k| -pixels[*k as usize].point[2]).collect();
    let median = depths.len() / 2;
    (*depths.select_nth_unstable_by(median, f32::total_cmp).1).clamp(0.1, Camera::FAR_M)
}
