//! From labels and offsets of pixels to instances: pixels of one label that lie together and point to
//! one middle.

use chaic_core::geom::Camera;
use chaic_nn::Tensor;
use chaic_nn::simd::widest;

use crate::detector::{N_OFFSETS, STRIDE};
use crate::labels::{BACKGROUND, half_extents_m};
use crate::loss::exp;

/// One thing that the detector sees.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Its label, never the background.
    pub label: u8,
    /// How sure the detector is, 0 to 1.
    pub score: f32,
    /// Its pixels in the image, row by row, ascending.
    pub pixels: Vec<u32>,
    /// The middle of what is seen of it, in the camera's frame (x right, y up, z towards the eye),
    /// metres.
    pub middle: [f32; 3],
}

/// How pixels become instances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceRules {
    /// Neighbors farther apart than this are of two things: metres, and half extents of the class; the
    /// larger of both counts.
    pub gap_m: f32,
    /// See [`InstanceRules::gap_m`].
    pub gap_extents: f32,
    /// Neighbors that point to middles farther apart than this are of two things, half extents.
    pub vote_extents: f32,
    /// Parts of one label that point to middles nearer to each other than this are one thing, half
    /// extents.
    pub join_extents: f32,
    /// Parts of different labels that point to middles nearer to each other than this are one thing, half
    /// extents of the smaller class; the largest part says what it is.
    pub rename_extents: f32,
    /// Things of fewer pixels at the network's resolution aren't told.
    pub least_pixels: usize,
}

impl Default for InstanceRules {
    fn default() -> InstanceRules {
        InstanceRules {
            gap_m: 0.05,
            gap_extents: 0.5,
            vote_extents: 0.8,
            join_extents: 1.0,
            rename_extents: 0.7,
            least_pixels: 5,
        }
    }
}

/// The root of a tree of pixels, each of which names one nearer to it.
fn root(parents: &mut [u32], k: usize) -> usize {
    let mut k = k;
    while parents[k] as usize != k {
        parents[k] = parents[parents[k] as usize];
        k = parents[k] as usize;
    }
    k
}

fn join(parents: &mut [u32], a: usize, b: usize) {
    let (a, b) = (root(parents, a), root(parents, b));
    // The first pixel names all, whatever the order.
    let (low, high) = (a.min(b), a.max(b));
    parents[high] = low as u32;
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
}

/// What the network says of one pixel.
#[derive(Clone, Copy, Debug)]
struct Pixel {
    label: u8,
    /// Of the label, 0 to 1.
    probability: f32,
    point: [f32; 3],
    /// Where it says that the middle is.
    vote: [f32; 3],
}

/// The instances in an image of this depth (metres, shape [height, width]), surest first, from what the
/// network made of the whole image.
///
/// # Panics
/// If shapes don't fit.
pub fn instances(
    head: &Tensor,
    depth_m: &[f32],
    camera: &Camera,
    rules: &InstanceRules,
) -> Vec<Instance> {
    let mut pixels = Pixels::new(camera);
    pixels.read(0, &head.data, depth_m);
    pixels.instances(depth_m, rules)
}

/// What the network says of the pixels of one image, at its own resolution.
#[derive(Clone, Debug)]
pub struct Pixels {
    camera: Camera,
    half_extents: Vec<f32>,
    pixels: Vec<Pixel>,
}

impl Pixels {
    /// Nothing yet.
    pub fn new(camera: &Camera) -> Pixels {
        Pixels { camera: *camera, half_extents: half_extents_m(), pixels: Vec::new() }
    }

    /// Takes in some rows, the first of which has this number: what the head made, shape [rows, width,
    /// channels], and the depth of the whole image.
    ///
    /// # Panics
    /// If shapes don't fit, or rows don't come in order.
    pub fn read(&mut self, first_row: usize, head: &[f32], depth_m: &[f32]) {
        let columns = self.camera.width as usize / STRIDE;
        assert_eq!(self.pixels.len(), first_row * columns, "rows come from top to bottom");
        read(head, &mut self.pixels, (depth_m, &self.camera), &self.half_extents);
    }

    /// The instances, surest first.
    ///
    /// # Panics
    /// If shapes don't fit.
    pub fn instances(&self, depth_m: &[f32], rules: &InstanceRules) -> Vec<Instance> {
        find(&self.pixels, &self.half_extents, (depth_m, &self.camera), rules)
    }
}

fn find(
    pixels: &[Pixel],
    half_extents: &[f32],
    (depth_m, camera): (&[f32], &Camera),
    rules: &InstanceRules,
) -> Vec<Instance> {
    let (width, columns) = (camera.width as usize, camera.width as usize / STRIDE);
    let mut parents: Vec<u32> = (0..pixels.len() as u32).collect();
    let belong = |a: &Pixel, b: &Pixel| {
        let half = half_extents[usize::from(a.label)];
        a.label == b.label
            && a.label != BACKGROUND
            && distance(a.point, b.point) < rules.gap_m.max(rules.gap_extents * half)
            && distance(a.vote, b.vote) < rules.vote_extents * half
    };
    for k in 0..pixels.len() {
        if k % columns > 0 && belong(&pixels[k], &pixels[k - 1]) {
            join(&mut parents, k, k - 1);
        }
        if k >= columns && belong(&pixels[k], &pixels[k - columns]) {
            join(&mut parents, k, k - columns);
        }
    }
    let mut parts: Vec<Vec<usize>> = Vec::new();
    let mut part_of = vec![usize::MAX; pixels.len()];
    for k in (0..pixels.len()).filter(|k| pixels[*k].label != BACKGROUND) {
        let first = root(&mut parents, k);
        if first == k {
            part_of[k] = parts.len();
            parts.push(Vec::new());
        }
        part_of[k] = part_of[first];
        parts[part_of[k]].push(k);
    }
    // The largest first, which small ones join: it says what the whole is.
    parts.sort_by_key(|part| (std::cmp::Reverse(part.len()), part[0]));
    let mut wholes: Vec<(u8, [f32; 3], Vec<usize>)> = Vec::new();
    for part in parts {
        let label = pixels[part[0]].label;
        let middle = median_vote(pixels, &part);
        let near = rules.join_extents * half_extents[usize::from(label)];
        let is_it = |other: u8, apart_m: f32| match other == label {
            true => apart_m < near,
            false => {
                let half = half_extents[usize::from(other)].min(half_extents[usize::from(label)]);
                apart_m < rules.rename_extents * half
            }
        };
        let same = wholes.iter_mut().find(|w| is_it(w.0, distance(w.1, middle)));
        match same {
            Some(whole) => whole.2.extend(part),
            None => wholes.push((label, middle, part)),
        }
    }
    wholes.retain(|whole| whole.2.len() >= rules.least_pixels);
    let mut owner = vec![u16::MAX; pixels.len()];
    for (n, (_, _, part)) in wholes.iter().enumerate() {
        part.iter().for_each(|k| owner[*k] = n as u16);
    }
    let masks = full_masks(&owner, pixels, columns, depth_m, width, wholes.len());
    let mut found: Vec<Instance> = wholes
        .iter()
        .zip(masks)
        .filter(|(_, mask)| !mask.is_empty())
        .map(|((label, middle, part), mask)| Instance {
            label: *label,
            score: part.iter().map(|k| pixels[*k].probability).sum::<f32>() / part.len() as f32,
            pixels: mask,
            middle: *middle,
        })
        .collect();
    found.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.pixels[0].cmp(&b.pixels[0])));
    found
}

fn read(
    head: &[f32],
    pixels: &mut Vec<Pixel>,
    (depth_m, camera): (&[f32], &Camera),
    half_extents: &[f32],
) {
    let (width, columns) = (camera.width as usize, camera.width as usize / STRIDE);
    let n_labels = half_extents.len();
    let (focal, half) = (camera.focal_px(), 0.5 * width as f32);
    let first = pixels.len();
    let rows = head.chunks_exact(n_labels + N_OFFSETS);
    let n = rows.len();
    let mut best = vec![(BACKGROUND, 0.0); n];
    widest().dispatch(Classify { head, n_labels, best: &mut best });
    let pixel = |((k, numbers), (label, probability)): ((usize, &[f32]), (u8, f32))| {
        let (k, offset) = (first + k, &numbers[n_labels..]);
        let (x, y) = (STRIDE * (k % columns), STRIDE * (k / columns));
        let depth = depth_m[y * width + x];
        let (u, v) = (x as f32 + 0.5 - half, y as f32 + 0.5 - half);
        let point = [u / focal * depth, -v / focal * depth, -depth];
        let scale = half_extents[usize::from(label)];
        let vote = std::array::from_fn(|axis| point[axis] + scale * offset[axis]);
        Pixel { label, probability, point, vote }
    };
    pixels.extend(rows.enumerate().zip(best).map(pixel));
}

/// The first of the greatest labels of each pixel, and its probability, compiled for the widest vectors.
struct Classify<'a> {
    head: &'a [f32],
    n_labels: usize,
    best: &'a mut [(u8, f32)],
}

impl pulp::NullaryFnOnce for Classify<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        /// Sums run in so many lanes, the same with vectors of any width.
        const LANES: usize = 16;
        let Classify { head, n_labels, best } = self;
        for (numbers, best) in head.chunks_exact(n_labels + N_OFFSETS).zip(best) {
            let row = &numbers[..n_labels];
            let (chunks, rest) = row.as_chunks::<LANES>();
            let mut lanes = [f32::NEG_INFINITY; LANES];
            for chunk in chunks {
                for k in 0..LANES {
                    lanes[k] = if chunk[k] > lanes[k] { chunk[k] } else { lanes[k] };
                }
            }
            let mut most = f32::NEG_INFINITY;
            for x in lanes {
                most = if x > most { x } else { most };
            }
            for x in rest {
                most = if *x > most { *x } else { most };
            }
            let mut label = 0;
            while label + 1 < n_labels && row[label] < most {
                label += 1;
            }
            best.0 = label as u8;
            if best.0 == BACKGROUND {
                continue;
            }
            let mut sums = [0.0; LANES];
            for chunk in chunks {
                for k in 0..LANES {
                    sums[k] += exp(chunk[k] - most);
                }
            }
            let mut sum = 0.0;
            for x in sums {
                sum += x;
            }
            for x in rest {
                sum += exp(x - most);
            }
            best.1 = 1.0 / sum;
        }
    }
}

fn median_vote(pixels: &[Pixel], part: &[usize]) -> [f32; 3] {
    std::array::from_fn(|axis| {
        let mut votes: Vec<f32> = part.iter().map(|k| pixels[*k].vote[axis]).collect();
        let middle = votes.len() / 2;
        *votes.select_nth_unstable_by(middle, f32::total_cmp).1
    })
}

/// The pixels of each owner in the whole image: each pixel is its who owns the nearest in depth of the
/// four places around it that the network looked at.
fn full_masks(
    owner: &[u16],
    pixels: &[Pixel],
    columns: usize,
    depth_m: &[f32],
    width: usize,
    n_owners: usize,
) -> Vec<Vec<u32>> {
    let rows = pixels.len() / columns;
    let mut masks = vec![Vec::new(); n_owners];
    for (k, depth) in depth_m.iter().enumerate() {
        let (x, y) = (k % width, k / width);
        let (i, j) = (x / STRIDE, y / STRIDE);
        let (right, below) =
            ((x.div_ceil(STRIDE)).min(columns - 1), (y.div_ceil(STRIDE)).min(rows - 1));
        let around = [(i, j), (right, j), (i, below), (right, below)];
        let off = |(i, j): (usize, usize)| (depth + pixels[j * columns + i].point[2]).abs();
        let first = around[0];
        let best = around.into_iter().fold(first, |a, b| if off(b) < off(a) { b } else { a });
        let owner = owner[best.1 * columns + best.0];
        if let Some(mask) = masks.get_mut(usize::from(owner)) {
            mask.push(k as u32);
        }
    }
    masks
}
