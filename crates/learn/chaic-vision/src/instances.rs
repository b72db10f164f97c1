//! Grouping of pixels into instances: connected pixels with one label that predict the same object
//! center (center votes).

mod join;

use chaic_core::geom::Camera;
use chaic_nn::Tensor;
use chaic_nn::simd::widest;

use self::join::join;
use crate::detector::{N_OFFSETS, STRIDE};
use crate::labels::{BACKGROUND, class_of, half_extents_m};
use crate::loss::exp;
use crate::structures::PANELS;

/// Detected object.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Labels that the object may have, never the background, with their scores from 0 to 1. There
    /// is at least one; scores descend.
    pub names: Vec<(u8, f32)>,
    /// Row-major indices of its pixels in the image, ascending.
    pub pixels: Vec<u32>,
    /// Center of the visible part in the camera's frame (x right, y up, z towards the camera),
    /// meters.
    pub center: [f32; 3],
}

impl Instance {
    /// Returns the most probable label.
    pub fn label(&self) -> u8 {
        self.names[0].0
    }

    /// Returns the score of the most probable label.
    pub fn score(&self) -> f32 {
        self.names[0].1
    }
}

/// Drops pixels that are too far from the center of their instance, because they show the background
/// through a basket or a shelf. A structure of panels may be of any size.
pub(crate) fn remove_background(instance: &mut Instance, depth_m: &[f32], camera: &Camera) {
    /// Maximum distance from the center, relative to the diagonal of the class. The center of the
    /// visible part differs from the center of the object, and some objects are larger than their
    /// class. With both constants mAP@50 stays the same, and mAP rises by 0.005 (150 views).
    const MAX_DIAGONALS: f32 = 0.75;
    /// Tolerance of that distance, meters.
    const TOLERANCE_M: f32 = 0.15;
    let Some(class) = class_of(instance.label()) else { return };
    if PANELS.contains(&class.name()) {
        return;
    }
    let [x, y, z] = class.info().size_m;
    let radius_m = MAX_DIAGONALS * (x * x + y * y + z * z).sqrt() + TOLERANCE_M;
    let (width, focal) = (camera.width, camera.focal_px());
    let half = [camera.width, camera.height].map(|n| 0.5 * n as f32);
    let center = instance.center;
    instance.pixels.retain(|pixel| {
        let depth = depth_m[*pixel as usize];
        let u = (pixel % width) as f32 + 0.5 - half[0];
        let v = (pixel / width) as f32 + 0.5 - half[1];
        let point = [depth * u / focal, -depth * v / focal, -depth];
        distance(point, center) < radius_m
    });
}

/// Sorts instances by score, in descending order.
pub(crate) fn sort_by_score(instances: &mut [Instance]) {
    instances.sort_by(|a, b| b.score().total_cmp(&a.score()).then(a.pixels[0].cmp(&b.pixels[0])));
}

/// Thresholds of the grouping. "Half extents" are those of the label's class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceConfig {
    /// Maximum distance between neighboring pixels of one instance, meters; the larger of this and
    /// [`InstanceConfig::gap_extents`] applies.
    pub gap_m: f32,
    /// Maximum distance between neighboring pixels of one instance, half extents.
    pub gap_extents: f32,
    /// Maximum distance between the center votes of neighboring pixels of one instance, half
    /// extents.
    pub center_vote_radius: f32,
    /// Maximum distance between the centers of segments of one label that are joined, half extents.
    pub join_extents: f32,
    /// Maximum distance between the centers of segments of different labels that are joined, half
    /// extents of the smaller class. The largest segment determines the label.
    pub relabel_extents: f32,
    /// Minimum number of pixels of an instance at the network's resolution.
    pub min_pixels: usize,
    /// True if neighboring pixels of different labels are connected as well. The instance then gets
    /// the label with the largest sum of probabilities.
    pub ignores_labels: bool,
}

impl InstanceConfig {
    /// Grouping of the one-stage detector.
    pub const DEFAULT: InstanceConfig = InstanceConfig {
        gap_m: 0.05,
        gap_extents: 0.5,
        center_vote_radius: 0.8,
        join_extents: 1.0,
        relabel_extents: 0.7,
        min_pixels: 5,
        ignores_labels: false,
    };

    /// Returns whether a part belongs to the object of a larger segment, given the half extents of
    /// all labels in meters.
    fn is_same_object(&self, half_extents: &[f32], segment: &Segment, part: &Segment) -> bool {
        let distance_m = distance(segment.center, part.center);
        let [half, other] = [part, segment].map(|s| half_extents[usize::from(s.label)]);
        if segment.label == part.label {
            distance_m < self.join_extents * half
        } else {
            distance_m < self.relabel_extents * other.min(half)
        }
    }

    /// Returns an upper bound of the distance from a segment of this label to parts of the same
    /// object, meters.
    fn reach_m(&self, half_extents: &[f32], label: u8) -> f32 {
        self.join_extents.max(self.relabel_extents) * half_extents[usize::from(label)]
    }
}

impl Default for InstanceConfig {
    fn default() -> InstanceConfig {
        InstanceConfig::DEFAULT
    }
}

/// Root of a pixel in the union-find forest, with path halving.
fn find_root(parents: &mut [u32], k: usize) -> usize {
    let mut k = k;
    while parents[k] as usize != k {
        parents[k] = parents[parents[k] as usize];
        k = parents[k] as usize;
    }
    k
}

fn union(parents: &mut [u32], a: usize, b: usize) {
    let (a, b) = (find_root(parents, a), find_root(parents, b));
    // The first pixel is the root, independent of the order of unions.
    let (low, high) = (a.min(b), a.max(b));
    parents[high] = low as u32;
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
}

/// Prediction for one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pixel {
    pub label: u8,
    /// Probability of the label, 0 to 1.
    pub probability: f32,
    pub point: [f32; 3],
    /// Predicted center of the object.
    pub vote: [f32; 3],
}

/// Group of pixels at the network's resolution.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Its label, never the background.
    pub label: u8,
    /// Mean probability of its pixels' labels, 0 to 1.
    pub score: f32,
    /// Row-major indices of its pixels at the network's resolution.
    pub pixels: Vec<u32>,
    /// Median of the centers that its largest connected part predicts, in the camera's frame,
    /// meters.
    pub center: [f32; 3],
}

/// Groups the head's output for a whole image into instances, in descending order of score. Depth
/// is in meters, shape [height, width].
///
/// # Panics
/// If the shapes do not fit the camera.
pub fn instances(
    head: &Tensor,
    depth_m: &[f32],
    camera: &Camera,
    config: &InstanceConfig,
) -> Vec<Instance> {
    let mut pixels = Pixels::new(camera);
    pixels.read(0, &head.data, depth_m);
    pixels.instances(depth_m, config)
}

/// Two neighboring pixels that show objects.
#[derive(Clone, Copy, Debug)]
struct NeighborPair {
    pixels: [u32; 2],
    /// Distance between their points, meters.
    gap_m: f32,
    /// Distance between their center votes, meters.
    vote_gap_m: f32,
    /// Half the largest extent of the smaller class, meters.
    half_extent_m: f32,
    has_one_label: bool,
}

/// Pixels that show objects, and the distances between neighbors. All groupings of an image share
/// them.
#[derive(Clone, Debug)]
pub(crate) struct ObjectPixels {
    /// Row-major indices in ascending order.
    pixels: Vec<u32>,
    pairs: Vec<NeighborPair>,
}

/// Predictions for the pixels of one image, at the network's resolution.
#[derive(Clone, Debug)]
pub struct Pixels {
    camera: Camera,
    half_extents: Vec<f32>,
    pixels: Vec<Pixel>,
}

impl Pixels {
    /// Creates an empty buffer.
    pub fn new(camera: &Camera) -> Pixels {
        Pixels { camera: *camera, half_extents: half_extents_m(), pixels: Vec::new() }
    }

    /// Appends rows of the head's output, shape [rows, width, channels], starting at `first_row`.
    /// Depth is that of the whole image; [`Camera::FAR_M`] replaces values that are not finite.
    ///
    /// # Panics
    /// If the shapes do not fit, or rows are missing or out of order.
    pub fn read(&mut self, first_row: usize, head: &[f32], depth_m: &[f32]) {
        assert_eq!(self.pixels.len(), first_row * self.columns(), "rows come from top to bottom");
        decode(head, &mut self.pixels, depth_m, &self.camera, &self.half_extents);
    }

    /// Returns the camera.
    pub(crate) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns the number of columns at the network's resolution.
    pub(crate) fn columns(&self) -> usize {
        self.camera.width as usize / STRIDE
    }

    /// Returns the predictions in row-major order.
    pub(crate) fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// Returns half the largest extent of each label's class, meters.
    pub(crate) fn half_extents_m(&self) -> &[f32] {
        &self.half_extents
    }

    /// Groups the pixels into instances, in descending order of score.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn instances(&self, depth_m: &[f32], config: &InstanceConfig) -> Vec<Instance> {
        let segments = self.segments(config);
        let masks = self.masks(&segments, depth_m);
        let mut found: Vec<Instance> = segments
            .iter()
            .zip(masks)
            .filter(|(_, mask)| !mask.is_empty())
            .map(|(segment, pixels)| {
                let Segment { label, score, center, .. } = *segment;
                Instance { names: vec![(label, score)], pixels, center }
            })
            .collect();
        sort_by_score(&mut found);
        found
    }

    /// Returns the pixels that show objects, with the distances between neighbors.
    pub(crate) fn object_pixels(&self) -> ObjectPixels {
        let (pixels, half_extents, columns) = (&self.pixels, &self.half_extents, self.columns());
        let mut objects = ObjectPixels { pixels: Vec::new(), pairs: Vec::new() };
        for (k, a) in pixels.iter().enumerate().filter(|(_, a)| a.label != BACKGROUND) {
            objects.pixels.push(k as u32);
            let left = (k % columns > 0).then(|| k - 1);
            for other in left.into_iter().chain(k.checked_sub(columns)) {
                let b = &pixels[other];
                if b.label == BACKGROUND {
                    continue;
                }
                let [half_a, half_b] = [a, b].map(|pixel| half_extents[usize::from(pixel.label)]);
                objects.pairs.push(NeighborPair {
                    pixels: [k as u32, other as u32],
                    gap_m: distance(a.point, b.point),
                    vote_gap_m: distance(a.vote, b.vote),
                    half_extent_m: half_a.min(half_b),
                    has_one_label: a.label == b.label,
                });
            }
        }
        objects
    }

    /// Groups the pixels into segments, in descending order of the size of their largest connected
    /// part.
    pub fn segments(&self, config: &InstanceConfig) -> Vec<Segment> {
        self.segments_among(&self.object_pixels(), config)
    }

    /// Groups the pixels as [`Pixels::segments`], given the result of [`Pixels::object_pixels`].
    pub(crate) fn segments_among(
        &self,
        objects: &ObjectPixels,
        config: &InstanceConfig,
    ) -> Vec<Segment> {
        let (pixels, half_extents) = (&self.pixels, &self.half_extents);
        let mut parents: Vec<u32> = (0..pixels.len() as u32).collect();
        let is_connected = |pair: &&NeighborPair| {
            let half = pair.half_extent_m;
            (pair.has_one_label || config.ignores_labels)
                && pair.gap_m < config.gap_m.max(config.gap_extents * half)
                && pair.vote_gap_m < config.center_vote_radius * half
        };
        for pair in objects.pairs.iter().filter(is_connected) {
            let [a, b] = pair.pixels;
            union(&mut parents, a as usize, b as usize);
        }
        let mut parts: Vec<Vec<u32>> = Vec::new();
        // Index of the part by its first pixel, which precedes the other pixels of the part.
        let mut part_of_first = vec![0; pixels.len()];
        for k in objects.pixels.iter().map(|k| *k as usize) {
            let first = find_root(&mut parents, k);
            if first == k {
                part_of_first[k] = parts.len();
                parts.push(Vec::new());
            }
            parts[part_of_first[first]].push(k as u32);
        }
        // The largest part comes first and determines the label; smaller ones join it.
        parts.sort_by_key(|part| (std::cmp::Reverse(part.len()), part[0]));
        let segment = |part: Vec<u32>| {
            let label = if config.ignores_labels {
                majority_label(pixels, &part)
            } else {
                pixels[part[0] as usize].label
            };
            Segment { label, score: 0.0, center: median_vote(pixels, &part), pixels: part }
        };
        let mut segments = join(
            parts.into_iter().map(segment).collect(),
            |segment| config.reach_m(half_extents, segment.label),
            |segment, part| config.is_same_object(half_extents, segment, part),
        );
        segments.retain(|segment| segment.pixels.len() >= config.min_pixels);
        segments.truncate(MAX_SEGMENTS);
        for segment in &mut segments {
            segment.score = self.mean_probability(&segment.pixels);
        }
        segments
    }

    /// Returns the mean probability of the labels of some pixels.
    fn mean_probability(&self, members: &[u32]) -> f32 {
        let sum: f32 = members.iter().map(|k| self.pixels[*k as usize].probability).sum();
        sum / members.len() as f32
    }

    /// Returns the segment of these pixels, at least one, with the label that most of them show.
    pub fn segment_of(&self, pixels: Vec<u32>) -> Segment {
        Segment {
            label: majority_label(&self.pixels, &pixels),
            score: self.mean_probability(&pixels),
            center: median_vote(&self.pixels, &pixels),
            pixels,
        }
    }

    /// Returns masks of disjoint segments at full resolution, as row-major indices in ascending
    /// order. Each pixel belongs to the segment of the network pixel with the most similar depth
    /// among the four nearest. If segments overlap, the later segment gets the pixel.
    pub fn masks(&self, segments: &[Segment], depth_m: &[f32]) -> Vec<Vec<u32>> {
        let (pixels, columns) = (&self.pixels, self.columns());
        let (width, rows) = (self.camera.width as usize, pixels.len() / columns);
        let mut segment_of = vec![u16::MAX; pixels.len()];
        for (n, segment) in segments.iter().enumerate() {
            segment.pixels.iter().for_each(|k| segment_of[*k as usize] = n as u16);
        }
        let mut masks = vec![Vec::new(); segments.len()];
        for (y, line) in depth_m.chunks_exact(width).enumerate() {
            let (j, below) = (y / STRIDE, y.div_ceil(STRIDE).min(rows - 1));
            for (x, depth) in line.iter().enumerate() {
                let (i, right) = (x / STRIDE, x.div_ceil(STRIDE).min(columns - 1));
                let neighbors = [(i, j), (right, j), (i, below), (right, below)];
                let neighbors = neighbors.map(|(i, j)| j * columns + i);
                let mut segment = segment_of[neighbors[0]];
                // Depth matters only at the border of a segment.
                if neighbors.iter().any(|at| segment_of[*at] != segment) {
                    let depth_error = |at: usize| (depth + pixels[at].point[2]).abs();
                    let nearer = |a, b| if depth_error(b) < depth_error(a) { b } else { a };
                    segment = segment_of[neighbors.into_iter().fold(neighbors[0], nearer)];
                }
                if let Some(mask) = masks.get_mut(usize::from(segment)) {
                    mask.push((y * width + x) as u32);
                }
            }
        }
        masks
    }
}

/// Maximum number of segments of an image; the largest ones count. Masks store segment numbers in
/// 16 bits, and an image of 2,048 x 2,048 pixels could have more segments.
const MAX_SEGMENTS: usize = u16::MAX as usize - 1;

/// Returns the label with the largest sum of probabilities; the lowest one wins ties.
fn majority_label(pixels: &[Pixel], part: &[u32]) -> u8 {
    let mut sums = [0.0f32; 256];
    for k in part {
        let Pixel { label, probability, .. } = pixels[*k as usize];
        sums[usize::from(label)] += probability;
    }
    let best = (1..=u8::MAX)
        .max_by(|a, b| sums[usize::from(*a)].total_cmp(&sums[usize::from(*b)]).then(b.cmp(a)));
    best.expect("there are labels")
}

fn decode(
    head: &[f32],
    pixels: &mut Vec<Pixel>,
    depth_m: &[f32],
    camera: &Camera,
    half_extents: &[f32],
) {
    let (width, columns) = (camera.width as usize, camera.width as usize / STRIDE);
    let n_labels = half_extents.len();
    let focal = camera.focal_px();
    let half = [camera.width, camera.height].map(|n| 0.5 * n as f32);
    let first = pixels.len();
    let rows = head.chunks_exact(n_labels + N_OFFSETS);
    let n = rows.len();
    let mut best = vec![(BACKGROUND, 0.0); n];
    widest().dispatch(ArgmaxSoftmax { head, n_labels, best: &mut best });
    let pixel = |((k, output), (label, probability)): ((usize, &[f32]), (u8, f32))| {
        let (k, offset) = (first + k, &output[n_labels..]);
        let (x, y) = (STRIDE * (k % columns), STRIDE * (k / columns));
        let depth = depth_m[y * width + x];
        let depth = if depth.is_finite() { depth } else { Camera::FAR_M };
        let (u, v) = (x as f32 + 0.5 - half[0], y as f32 + 0.5 - half[1]);
        let point = [u / focal * depth, -v / focal * depth, -depth];
        let scale = half_extents[usize::from(label)];
        let vote = std::array::from_fn(|axis| point[axis] + scale * offset[axis]);
        Pixel { label, probability, point, vote }
    };
    pixels.extend(rows.enumerate().zip(best).map(pixel));
}

/// Computes the most probable label of each pixel and its probability with the widest SIMD
/// instructions. The first label wins ties.
struct ArgmaxSoftmax<'a> {
    head: &'a [f32],
    n_labels: usize,
    best: &'a mut [(u8, f32)],
}

impl pulp::NullaryFnOnce for ArgmaxSoftmax<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        /// Number of partial sums, the same at every vector width.
        const LANES: usize = 16;
        let ArgmaxSoftmax { head, n_labels, best } = self;
        for (output, best) in head.chunks_exact(n_labels + N_OFFSETS).zip(best) {
            let row = &output[..n_labels];
            let (chunks, remainder) = row.as_chunks::<LANES>();
            let mut lanes = [f32::NEG_INFINITY; LANES];
            for chunk in chunks {
                for k in 0..LANES {
                    lanes[k] = if chunk[k] > lanes[k] { chunk[k] } else { lanes[k] };
                }
            }
            let mut max_logit = f32::NEG_INFINITY;
            for x in lanes {
                max_logit = if x > max_logit { x } else { max_logit };
            }
            for x in remainder {
                max_logit = if *x > max_logit { *x } else { max_logit };
            }
            let mut label = 0;
            while label + 1 < n_labels && row[label] < max_logit {
                label += 1;
            }
            best.0 = label as u8;
            if best.0 == BACKGROUND {
                continue;
            }
            let mut sums = [0.0; LANES];
            for chunk in chunks {
                for k in 0..LANES {
                    sums[k] += exp(chunk[k] - max_logit);
                }
            }
            let mut sum = 0.0;
            for x in sums {
                sum += x;
            }
            for x in remainder {
                sum += exp(x - max_logit);
            }
            best.1 = 1.0 / sum;
        }
    }
}

fn median_vote(pixels: &[Pixel], part: &[u32]) -> [f32; 3] {
    std::array::from_fn(|axis| {
        let mut votes: Vec<f32> = part.iter().map(|k| pixels[*k as usize].vote[axis]).collect();
        let median = votes.len() / 2;
        *votes.select_nth_unstable_by(median, f32::total_cmp).1
    })
}

#[cfg(test)]
mod tests {
    use chaic_core::geom::yaw_rotation;
    use chaic_core::{ClassId, Vec3};

    use super::*;
    use crate::labels::label_of;

    #[test]
    fn points_lie_on_the_rays_of_an_image_that_is_not_square() {
        let camera = Camera {
            eye_in_world: Vec3::ZERO,
            world_from_camera: yaw_rotation(0.0),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: 8,
            height: 4,
        };
        let mut pixels = Pixels::new(&camera);
        let head = vec![0.0; 8 * (half_extents_m().len() + N_OFFSETS)];
        pixels.read(0, &head, &[2.0; 32]);
        assert_eq!(pixels.pixels().len(), 8);
        for (k, pixel) in pixels.pixels().iter().enumerate() {
            let [x, y] = [k % 4, k / 4].map(|n| (STRIDE * n) as u32);
            let expected = camera.unproject(x, y, 2.0).to_array();
            assert!(distance(pixel.point, expected) < 1e-4, "{:?} {expected:?}", pixel.point);
        }
    }

    #[test]
    fn background_seen_through_an_object_is_no_part_of_it() {
        const SIDE_PX: u32 = 8;
        let camera = Camera {
            eye_in_world: Vec3::ZERO,
            world_from_camera: yaw_rotation(0.0),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: SIDE_PX,
            height: SIDE_PX,
        };
        let mut depth_m = vec![1.0; (SIDE_PX * SIDE_PX) as usize];
        // Two pixels show the wall behind, one has no depth.
        (depth_m[27], depth_m[28], depth_m[35]) = (3.0, 3.0, f32::NAN);
        let remaining = |class: &str| {
            let mut instance = Instance {
                names: vec![(label_of(Some(ClassId::named(class))), 0.9)],
                pixels: vec![27, 28, 35, 36],
                center: [0.0, 0.0, -1.0],
            };
            remove_background(&mut instance, &depth_m, &camera);
            instance.pixels
        };
        assert_eq!(remaining("plastic_basket"), [36]);
        assert_eq!(remaining("fence"), [27, 28, 35, 36], "a structure may be of any size");
    }
}
