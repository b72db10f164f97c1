//! A few seconds of somebody, and what the network reads of them.

use chaic_core::rng::Stream;

use super::Behavior;
use super::crop::{Crop, MIDDLE_M, SIDE, WINDOW_M};

/// Crops that the network reads: of 96 frames, 3.2 seconds.
pub const CROPS: usize = 32;
/// Crops of a clip with a label beyond the first [`CROPS`]: the ones that are read begin anywhere up to
/// here.
pub const SLACK: usize = 4;
/// Numbers of each pixel: red, green and blue from -1 to 1, depth behind the person, height above the
/// middle, whether it is near the person's axis, brightness and depth in the crop before, the person's
/// distance and speed.
pub const N_CHANNELS: usize = 10;

/// A clip with a label.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// What is seen.
    pub label: Behavior,
    /// Whether something else went on too: it is to be told as moving, but isn't counted in reports.
    pub is_mixed: bool,
    /// [`CROPS`] and [`SLACK`] crops, oldest first.
    pub crops: Vec<Crop>,
}

/// How a clip is looked at while it is learned from.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// The first crop that is read.
    pub first: usize,
    /// Whether left is right.
    pub mirrored: bool,
    /// By how many pixels it is moved to the right and down.
    pub shift: [i32; 2],
    /// By what each color is multiplied.
    pub gain: [f32; 3],
    /// Crops that are not seen: the first of them, and how many.
    pub hidden: (usize, usize),
}

impl Look {
    /// The crops from here on as they are.
    pub fn plain(first: usize) -> Look {
        Look { first, mirrored: false, shift: [0; 2], gain: [1.0; 3], hidden: (0, 0) }
    }

    /// Any.
    pub fn random(rng: &mut Stream) -> Look {
        let mut shift = || rng.below(9) as i32 - 4;
        let shift = [shift(), shift()];
        let brightness = rng.range(0.75, 1.25);
        let gain = [(); 3].map(|()| brightness * rng.range(0.85, 1.15));
        let n_hidden = if rng.chance(0.25) { rng.below(CROPS / 4) } else { 0 };
        Look {
            first: rng.below(SLACK + 1),
            mirrored: rng.chance(0.5),
            shift,
            gain,
            hidden: (rng.below(CROPS - n_hidden), n_hidden),
        }
    }
}

/// What the network reads of [`CROPS`] crops, shape [`CROPS`, `SIDE`, `SIDE`, `N_CHANNELS`].
///
/// # Panics
/// If there are fewer crops after the first, or the output has another shape.
pub fn read(crops: &[Crop], look: &Look, out: &mut [f32]) {
    const N: usize = SIDE * SIDE * N_CHANNELS;
    assert_eq!(out.len(), CROPS * N, "a clip has another shape");
    let crops = &crops[look.first..][..CROPS];
    let (first_hidden, n_hidden) = look.hidden;
    let is_hidden = |k: usize| (first_hidden..first_hidden + n_hidden).contains(&k);
    let seen = |k: usize| Some(&crops[k]).filter(|crop| !crop.is_blank() && !is_hidden(k));
    for (k, out) in out.chunks_exact_mut(N).enumerate() {
        let Some(crop) = seen(k) else {
            out.fill(0.0);
            continue;
        };
        let before = k.checked_sub(1).and_then(seen).unwrap_or(crop);
        read_one(crop, before, look, out);
    }
}

/// What one crop shows after another.
fn read_one(crop: &Crop, before: &Crop, look: &Look, out: &mut [f32]) {
    const STEP_M: f32 = WINDOW_M / SIDE as f32;
    /// What is no farther from the axis belongs to the person, more or less, metres.
    const NEAR_AXIS_M: f32 = 0.55;
    let far = [0.2 * crop.distance_m, (20.0 * crop.speed).min(2.0)];
    for (k, pixel) in out.as_chunks_mut::<N_CHANNELS>().0.iter_mut().enumerate() {
        *pixel = [0.0; N_CHANNELS];
        pixel[8..].copy_from_slice(&far);
        let column = (k % SIDE) as i32 - look.shift[0];
        let row = (k / SIDE) as i32 - look.shift[1];
        let range = 0..SIDE as i32;
        if !range.contains(&column) || !range.contains(&row) {
            continue;
        }
        let column = if look.mirrored { SIDE as i32 - 1 - column } else { column };
        let at = row as usize * SIDE + column as usize;
        if crop.depth[at] == 0 {
            continue;
        }
        let behind_m = Crop::behind_m(crop.depth[at]);
        let scale = STEP_M * (1.0 + behind_m / crop.distance_m);
        let aside_m = (column as f32 + 0.5 - 0.5 * SIDE as f32) * scale;
        let above_m = (0.5 * SIDE as f32 - row as f32 - 0.5) * scale;
        let color = |crop: &Crop, c: usize| {
            (f32::from(crop.rgb[3 * at + c]) / 127.5 * look.gain[c]).min(2.0) - 1.0
        };
        let is_near = aside_m * aside_m + behind_m * behind_m < NEAR_AXIS_M * NEAR_AXIS_M;
        for (c, pixel) in pixel[..3].iter_mut().enumerate() {
            *pixel = color(crop, c);
        }
        pixel[3] = behind_m;
        pixel[4] = (above_m / MIDDLE_M).clamp(-1.5, 1.5);
        pixel[5] = if is_near { 1.0 } else { 0.0 };
        if before.depth[at] != 0 {
            pixel[6] = (color(before, 0) + color(before, 1) + color(before, 2)) / 3.0;
            pixel[7] = Crop::behind_m(before.depth[at]);
        }
    }
}
