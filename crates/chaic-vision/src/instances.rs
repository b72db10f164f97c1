//! From labels and offsets of pixels to instances: pixels of one label that lie together and point to
//! one middle.

use chaic_nn::Tensor;
use chaic_protocol::geom::Camera;

use crate::detector::{N_OFFSETS, STRIDE};
use crate::labels::{BACKGROUND, half_extents_m};

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
    /// Things of fewer pixels at the network's resolution aren't told.
    pub least_pixels: usize,
}

impl Default for InstanceRules {
    fn default() -> InstanceRules {
        InstanceRules {
            gap_m: 0.05,
            gap_extents: 0.5,
            vote_extents: 0.8,
            join_extents: 0.5,
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
    let (width, columns) = (camera.width as usize, head.shape.width);
    let half_extents = half_extents_m();
    let pixels = read(head, depth_m, camera, &half_extents);
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
    // The largest first, which small ones join.
    parts.sort_by_key(|part| (std::cmp::Reverse(part.len()), part[0]));
    let mut wholes: Vec<(u8, [f32; 3], Vec<usize>)> = Vec::new();
    for part in parts {
        let label = pixels[part[0]].label;
        let middle = median_vote(&pixels, &part);
        let near = rules.join_extents * half_extents[usize::from(label)];
        let same = wholes.iter_mut().find(|w| w.0 == label && distance(w.1, middle) < near);
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
    let masks = full_masks(&owner, &pixels, columns, depth_m, width, wholes.len());
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

fn read(head: &Tensor, depth_m: &[f32], camera: &Camera, half_extents: &[f32]) -> Vec<Pixel> {
    let (width, columns) = (camera.width as usize, head.shape.width);
    let n_labels = head.shape.channels - N_OFFSETS;
    let (focal, half) = (camera.focal_px(), 0.5 * width as f32);
    let rows = head.data.chunks_exact(head.shape.channels);
    let pixel = |(k, numbers): (usize, &[f32])| {
        let (row, offset) = numbers.split_at(n_labels);
        let (x, y) = (STRIDE * (k % columns), STRIDE * (k / columns));
        let depth = depth_m[y * width + x];
        let (u, v) = (x as f32 + 0.5 - half, y as f32 + 0.5 - half);
        let point = [u / focal * depth, -v / focal * depth, -depth];
        let best = (0..row.len()).fold(0, |best, n| if row[n] > row[best] { n } else { best });
        let sum: f32 = row.iter().map(|x| crate::loss::exp(x - row[best])).sum();
        let scale = half_extents[best];
        let vote = std::array::from_fn(|axis| point[axis] + scale * offset[axis]);
        Pixel { label: best as u8, probability: 1.0 / sum, point, vote }
    };
    rows.enumerate().map(pixel).collect()
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
