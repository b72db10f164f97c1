//! Clips of a person and their encoding as network input.

use chaic_core::rng::RngStream;

use super::Behavior;
use super::crop::{CENTER_HEIGHT_M, CROP_DEAD_BAND_M, PersonCrop, SIDE};

/// Crops that the network reads: 96 frames, 3.2 seconds.
pub const CROPS: usize = 32;
/// Additional crops of a labeled clip; the network's input starts at any of them.
pub const N_EXTRA_CROPS: usize = 4;
/// Channels of a pixel: red, green and blue from -1 to 1, depth relative to the person, height
/// above the crop's center, whether it is near the person's axis, brightness and depth in the
/// previous crop, the person's distance and speed (-1 if unknown).
pub const N_CHANNELS: usize = 10;
/// Minimum fraction of [`CROPS`] crops that show the person (paper: 20 % of an action's observations).
pub const MIN_SEEN_FRACTION: f32 = 0.2;

/// Labeled clip.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Behavior in the clip.
    pub label: Behavior,
    /// True if another interaction is in progress. The label is then moving; reports exclude such
    /// clips.
    pub is_mixed: bool,
    /// Number of its episode. Clips of one episode are not independent.
    pub episode: u32,
    /// [`CROPS`] and [`N_EXTRA_CROPS`] crops, oldest first.
    pub crops: Vec<PersonCrop>,
}

impl Clip {
    /// Returns the index of the clip's kind in [`ClipCounts`].
    pub fn kind(&self) -> usize {
        if self.is_mixed { MIXED_INDEX } else { self.label.index() }
    }
}

/// Index of mixed clips in [`ClipCounts`].
pub const MIXED_INDEX: usize = Behavior::ALL.len();

/// Number of clips of each behavior; mixed clips are last.
pub type ClipCounts = [usize; MIXED_INDEX + 1];

/// Clips of some episodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClipSet {
    /// The clips.
    pub clips: Vec<Clip>,
    /// Number of all clips that the episodes gave, with those beyond the maximum of their kind. These are the
    /// relative frequencies of what helpers see.
    pub found: ClipCounts,
}

impl ClipSet {
    /// Creates the set of all clips that episodes gave.
    pub fn new(clips: Vec<Clip>) -> ClipSet {
        let mut found = ClipCounts::default();
        clips.iter().for_each(|clip| found[clip.kind()] += 1);
        ClipSet { clips, found }
    }

    /// Returns the weight of each clip with which kinds are as frequent as helpers see them.
    pub fn weights(&self) -> Vec<f64> {
        let mut kept = ClipCounts::default();
        self.clips.iter().for_each(|clip| kept[clip.kind()] += 1);
        let weight = |clip: &Clip| self.found[clip.kind()] as f64 / kept[clip.kind()] as f64;
        self.clips.iter().map(weight).collect()
    }
}

/// Returns whether enough crops of a clip show the person.
pub fn is_seen_enough<'a>(crops: impl IntoIterator<Item = &'a PersonCrop>) -> bool {
    let n_seen = crops.into_iter().filter(|crop| crop.is_seen).count();
    n_seen as f32 >= MIN_SEEN_FRACTION * CROPS as f32
}

/// Augmentation of a clip during training.
#[derive(Clone, Copy, Debug)]
pub struct ClipAugmentation {
    /// Index of the first crop of the input.
    pub first: usize,
    /// True if the image is mirrored horizontally.
    pub is_mirrored: bool,
    /// Translation to the right and down, pixels.
    pub shift: [i32; 2],
    /// Addition to the depth relative to the person, meters.
    pub depth_offset_m: f32,
    /// Factor of each color channel.
    pub gain: [f32; 3],
    /// Blanked crops: first index and count.
    pub blanked: (usize, usize),
}

impl ClipAugmentation {
    /// Returns the identity for clips that start at this crop.
    pub fn identity(first: usize) -> ClipAugmentation {
        ClipAugmentation {
            first,
            is_mirrored: false,
            shift: [0; 2],
            depth_offset_m: 0.0,
            gain: [1.0; 3],
            blanked: (0, 0),
        }
    }

    /// Draws a random augmentation.
    pub fn random(rng: &mut RngStream) -> ClipAugmentation {
        let mut shift = || rng.below(9) as i32 - 4;
        let shift = [shift(), shift()];
        let brightness = rng.range(0.75, 1.25);
        let gain = [(); 3].map(|()| brightness * rng.range(0.85, 1.15));
        let depth_offset_m = rng.range(-CROP_DEAD_BAND_M, CROP_DEAD_BAND_M);
        let n_blanked = if rng.chance(0.25) { rng.below(CROPS / 4) } else { 0 };
        ClipAugmentation {
            first: rng.below(N_EXTRA_CROPS + 1),
            is_mirrored: rng.chance(0.5),
            shift,
            depth_offset_m,
            gain,
            blanked: (rng.below(CROPS - n_blanked), n_blanked),
        }
    }
}

/// Fills the network's input from [`CROPS`] crops, shape [`CROPS`, `SIDE`, `SIDE`, `N_CHANNELS`].
///
/// # Panics
/// If there are too few crops after the first, or the output has another shape.
pub fn fill_input(crops: &[PersonCrop], augmentation: &ClipAugmentation, out: &mut [f32]) {
    const N: usize = SIDE * SIDE * N_CHANNELS;
    assert_eq!(out.len(), CROPS * N, "a clip has another shape");
    let crops = &crops[augmentation.first..][..CROPS];
    let (first_blanked, n_blanked) = augmentation.blanked;
    let is_blanked = |k: usize| (first_blanked..first_blanked + n_blanked).contains(&k);
    let visible = |k: usize| Some(&crops[k]).filter(|crop| !crop.is_blank() && !is_blanked(k));
    for (k, out) in out.chunks_exact_mut(N).enumerate() {
        let Some(crop) = visible(k) else {
            out.fill(0.0);
            continue;
        };
        let previous = k.checked_sub(1).and_then(visible).unwrap_or(crop);
        fill_crop(crop, previous, augmentation, out);
    }
}

/// Fills the input of one crop.
fn fill_crop(
    crop: &PersonCrop,
    previous: &PersonCrop,
    augmentation: &ClipAugmentation,
    out: &mut [f32],
) {
    /// Maximum distance from the person's axis of pixels that likely show the person, meters.
    const NEAR_AXIS_M: f32 = 0.55;
    let speed = crop.speed.map_or(-1.0, |speed| (20.0 * speed).min(2.0));
    let motion = [0.2 * crop.distance_m, speed];
    for (k, pixel) in out.as_chunks_mut::<N_CHANNELS>().0.iter_mut().enumerate() {
        *pixel = [0.0; N_CHANNELS];
        pixel[8..].copy_from_slice(&motion);
        let column = (k % SIDE) as i32 - augmentation.shift[0];
        let row = (k / SIDE) as i32 - augmentation.shift[1];
        let range = 0..SIDE as i32;
        if !range.contains(&column) || !range.contains(&row) {
            continue;
        }
        let column = if augmentation.is_mirrored { SIDE as i32 - 1 - column } else { column };
        let at = row as usize * SIDE + column as usize;
        if crop.depth[at] == 0 {
            continue;
        }
        let behind_m = PersonCrop::behind_m(crop.depth[at]) + augmentation.depth_offset_m;
        let [lateral_m, above_m] = crop.offsets_m(column as usize, row as usize, behind_m);
        let color = |crop: &PersonCrop, c: usize| {
            (f32::from(crop.rgb[3 * at + c]) / 127.5 * augmentation.gain[c]).min(2.0) - 1.0
        };
        let is_near = lateral_m * lateral_m + behind_m * behind_m < NEAR_AXIS_M * NEAR_AXIS_M;
        for (c, pixel) in pixel[..3].iter_mut().enumerate() {
            *pixel = color(crop, c);
        }
        pixel[3] = behind_m;
        pixel[4] = (above_m / CENTER_HEIGHT_M).clamp(-1.5, 1.5);
        pixel[5] = if is_near { 1.0 } else { 0.0 };
        if previous.depth[at] != 0 {
            pixel[6] = (color(previous, 0) + color(previous, 1) + color(previous, 2)) / 3.0;
            pixel[7] = PersonCrop::behind_m(previous.depth[at]) + augmentation.depth_offset_m;
        }
    }
}
