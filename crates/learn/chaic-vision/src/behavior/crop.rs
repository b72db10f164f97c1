//! Crops of a person from image histories, at a fixed scale independent of distance.

use chaic_agents::memory::Memory;
use chaic_core::geom::{Camera, horizontal_distance};
use chaic_core::observation::{FrameHistorySpec, HistoryFrame};
use chaic_core::{AgentId, Frame, Vec3};

/// Side of a crop, pixels.
pub const SIDE: usize = 48;
/// Width of a crop at the person's distance, meters (2.4 in the experiment of perception.md).
pub const WINDOW_M: f32 = 2.4;
/// Height of a crop's center above the floor, meters; crops show feet to head.
pub const CENTER_HEIGHT_M: f32 = 1.0;
/// Image history that crops come from.
pub const HISTORY: FrameHistorySpec =
    FrameHistorySpec { image_size: 128, every_frames: 3, max_len: 64 };
/// Minimum distance of a cropped person, meters.
const MIN_DISTANCE_M: f32 = 0.5;
/// Quantization step of stored depth relative to the person, meters.
const DEPTH_STEP_M: f32 = 0.0125;
/// Maximum time between a sighting and an image that it alone places a crop in, frames: 1.5 s (ours).
const MAX_AGE_FRAMES: Frame = 45;
/// Maximum distance of a body's points from the vertical axis through the person's place, meters: arms
/// reach further, and the place has an error of up to 0.25 m.
const BODY_RADIUS_M: f32 = 0.4;
/// Minimum height of a body's points that count, meters; lower ones may be the floor.
const MIN_BODY_HEIGHT_M: f32 = 0.3;
/// Minimum number of a body's pixels in a crop that shows the person: 0.05 square meters, about a tenth of
/// an adult. Of crops between two sightings 96 % have as many, of those at a place where the person was
/// not detected 9 % (16 validation episodes with ground-truth ids).
const MIN_BODY_PIXELS: usize = 20;
/// Displacement that crops ignore, meters. Positions are means over masks, which vary from image to
/// image and with the arms. Nearly all errors of the bundled detector are smaller.
pub const CROP_DEAD_BAND_M: f32 = 0.1;

/// Crop of a person.
#[derive(Clone, Debug, PartialEq)]
pub struct PersonCrop {
    /// Frame of the image.
    pub frame: Frame,
    /// Distance along the camera's axis, meters; 0 if the person is not visible.
    pub distance_m: f32,
    /// Horizontal speed between the sightings before and after the image, meters per frame; `None` if one
    /// of them is missing.
    pub speed: Option<f32>,
    /// True if the image shows a body at the person's place. Otherwise the person is hidden, or not where it
    /// is assumed to be.
    pub is_seen: bool,
    /// Color, shape [`SIDE`, `SIDE`, 3]; empty if the person is not visible.
    pub rgb: Vec<u8>,
    /// Depth, shape [`SIDE`, `SIDE`]: 128 at the person's distance, 0 outside of the image.
    pub depth: Vec<u8>,
}

impl PersonCrop {
    /// Creates a crop without a person.
    pub fn blank(frame: Frame) -> PersonCrop {
        PersonCrop {
            frame,
            distance_m: 0.0,
            speed: None,
            is_seen: false,
            rgb: Vec::new(),
            depth: Vec::new(),
        }
    }

    /// Returns whether the crop shows no person.
    pub fn is_blank(&self) -> bool {
        self.distance_m == 0.0
    }

    /// Converts stored depth to meters behind the person.
    pub fn behind_m(depth: u8) -> f32 {
        (f32::from(depth) - 128.0) * DEPTH_STEP_M
    }

    /// Returns the offsets of a pixel's point to the right of and above the crop's center, meters, given its
    /// distance behind the person.
    pub fn offsets_m(&self, column: usize, row: usize, behind_m: f32) -> [f32; 2] {
        const STEP_M: f32 = WINDOW_M / SIDE as f32;
        let scale = STEP_M * (1.0 + behind_m / self.distance_m);
        let lateral_m = (column as f32 + 0.5 - 0.5 * SIDE as f32) * scale;
        let above_m = (0.5 * SIDE as f32 - row as f32 - 0.5) * scale;
        [lateral_m, above_m]
    }

    /// Crops the person at this position, who moves at this speed.
    pub fn new(image: &HistoryFrame, position_in_world: Vec3, speed: Option<f32>) -> PersonCrop {
        let HistoryFrame { frame, camera, images } = image;
        let blank = PersonCrop::blank(*frame);
        let (Some(rgb), Some(depth_m)) = (&images.rgb, &images.depth_m) else { return blank };
        let center = Vec3::new(position_in_world.x, CENTER_HEIGHT_M, position_in_world.z);
        let Some((at, distance_m)) = camera.project(center) else { return blank };
        let (width, height) = (camera.width as usize, camera.height as usize);
        let has_expected_size = rgb.len() == 3 * width * height && depth_m.len() == width * height;
        let size_px = WINDOW_M * camera.focal_px() / distance_m;
        let is_outside = at.x + 0.5 * size_px < 0.0 || at.x - 0.5 * size_px > width as f32;
        if distance_m < MIN_DISTANCE_M || is_outside || !has_expected_size {
            return blank;
        }
        let mut crop = PersonCrop { distance_m, speed, ..blank };
        crop.rgb.resize(3 * SIDE * SIDE, 0);
        crop.depth.resize(SIDE * SIDE, 0);
        let step = size_px / SIDE as f32;
        let first = [at.x - 0.5 * size_px + 0.5 * step, at.y - 0.5 * size_px + 0.5 * step];
        for j in 0..SIDE {
            let Some(row) = pixel(first[1] + j as f32 * step, height) else { continue };
            for i in 0..SIDE {
                let Some(column) = pixel(first[0] + i as f32 * step, width) else { continue };
                let (source, target) = (row * width + column, j * SIDE + i);
                crop.rgb[3 * target..][..3].copy_from_slice(&rgb[3 * source..][..3]);
                let relative_depth =
                    (depth_m[source].min(Camera::FAR_M) - distance_m) / DEPTH_STEP_M;
                crop.depth[target] = (relative_depth + 128.0).clamp(1.0, 255.0) as u8;
            }
        }
        crop.is_seen = crop.n_body_pixels() >= MIN_BODY_PIXELS;
        crop
    }

    /// Returns the number of pixels that show a body at the person's place.
    fn n_body_pixels(&self) -> usize {
        let is_body = |(k, depth): &(usize, &u8)| {
            let behind_m = PersonCrop::behind_m(**depth);
            let [lateral_m, above_m] = self.offsets_m(k % SIDE, k / SIDE, behind_m);
            let squared_m2 = lateral_m * lateral_m + behind_m * behind_m;
            **depth != 0
                && squared_m2 < BODY_RADIUS_M * BODY_RADIUS_M
                && CENTER_HEIGHT_M + above_m > MIN_BODY_HEIGHT_M
        };
        self.depth.iter().enumerate().filter(is_body).count()
    }
}

/// Returns the pixel of a continuous coordinate; `None` if it is outside of the image.
fn pixel(at: f32, n: usize) -> Option<usize> {
    (at >= 0.0 && at < n as f32).then_some(at as usize)
}

/// Sighting of the cropped person.
#[derive(Clone, Copy, Debug)]
struct Sighting {
    frame: Frame,
    position_in_world: Vec3,
}

impl Sighting {
    /// Returns the position after a move to `at`, short of the ignored displacement.
    fn follow(&self, at: Vec3) -> Vec3 {
        let displacement_m = horizontal_distance(self.position_in_world, at);
        let fraction =
            (displacement_m - CROP_DEAD_BAND_M).max(0.0) / displacement_m.max(CROP_DEAD_BAND_M);
        self.position_in_world + fraction * (at - self.position_in_world)
    }

    /// Returns whether the person is assumed to stand at this place in another frame, earlier or later.
    fn is_near(&self, frame: Frame) -> bool {
        self.frame.abs_diff(frame) < MAX_AGE_FRAMES
    }
}

/// Returns a person's position if the current image shows it. Memory must include this image.
pub fn visible_position(memory: &Memory, person: AgentId) -> Option<Vec3> {
    memory.people.get(person).filter(|p| p.is_in_view).map(|p| p.position_in_world)
}

/// Crops one person from the image histories of an episode.
#[derive(Clone, Debug, Default)]
pub struct PersonCropper {
    last: Option<Sighting>,
}

impl PersonCropper {
    /// Returns a crop of each image since the last observation, given the person's position if visible
    /// `now`. Positions between two sightings are interpolated linearly, also during a long action of the
    /// helper. The person is assumed to stand still for a while after a sighting, since detectors miss people
    /// in single images, and before the first one.
    pub fn crop(
        &mut self,
        now: Frame,
        images: &[HistoryFrame],
        position_in_world: Option<Vec3>,
    ) -> Vec<PersonCrop> {
        let start = images.first().map_or(now, |image| image.frame);
        let before = self.last.filter(|last| last.is_near(start));
        let after = position_in_world.map(|at| {
            let position_in_world = before.map_or(at, |before| before.follow(at));
            Sighting { frame: now, position_in_world }
        });
        self.last = after.or(self.last);
        // The person's position, and its speed if known.
        let place_at = |frame: Frame| match (before, after) {
            (Some(before), Some(after)) if before.frame < now => {
                let (from, to) = (before.position_in_world, after.position_in_world);
                let n_frames = (now - before.frame) as f32;
                let fraction = (frame.saturating_sub(before.frame) as f32 / n_frames).min(1.0);
                let speed = horizontal_distance(from, to) / n_frames;
                Some((from + fraction * (to - from), Some(speed)))
            }
            _ => {
                let only = after.or(before).filter(|sighting| sighting.is_near(frame));
                only.map(|sighting| (sighting.position_in_world, None))
            }
        };
        let crop = |image: &HistoryFrame| match place_at(image.frame) {
            Some((at, speed)) => PersonCrop::new(image, at, speed),
            None => PersonCrop::blank(image.frame),
        };
        images.iter().map(crop).collect()
    }
}
