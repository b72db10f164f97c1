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
/// Maximum age of a sighting that determines crops, frames: 1.5 s (ours).
const MAX_AGE_FRAMES: Frame = 45;
/// Displacement that crops ignore, meters. Positions are means over masks, which vary from image to
/// image and with the arms. Nearly all errors of the bundled detector are smaller.
pub const SLACK_M: f32 = 0.1;

/// Crop of a person.
#[derive(Clone, Debug, PartialEq)]
pub struct PersonCrop {
    /// Frame of the image.
    pub frame: Frame,
    /// Distance along the camera's axis, meters; 0 if the person is not visible.
    pub distance_m: f32,
    /// Horizontal speed, meters per frame.
    pub speed: f32,
    /// True if the helper detected the person when it received the image. Other crops show the place where
    /// the person is assumed to be.
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
            speed: 0.0,
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

    /// Crops the person at this position, who moves at this speed and is not seen.
    pub fn new(image: &HistoryFrame, position_in_world: Vec3, speed: f32) -> PersonCrop {
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
        crop
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
    /// Horizontal speed up to this sighting, meters per frame.
    speed: f32,
}

impl Sighting {
    /// Returns the position after a move to `at`, short of the ignored displacement.
    fn follow(&self, at: Vec3) -> Vec3 {
        let displacement_m = horizontal_distance(self.position_in_world, at);
        let fraction = (displacement_m - SLACK_M).max(0.0) / displacement_m.max(SLACK_M);
        self.position_in_world + fraction * (at - self.position_in_world)
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
    /// helper. After the last sighting the person is assumed to stand still for a while, since detectors
    /// miss people in single images.
    pub fn crop(
        &mut self,
        now: Frame,
        images: &[HistoryFrame],
        position_in_world: Option<Vec3>,
    ) -> Vec<PersonCrop> {
        let is_recent = |last: &Sighting, frame: Frame| last.frame + MAX_AGE_FRAMES > frame;
        let start = images.first().map_or(now, |image| image.frame);
        let previous = self.last.filter(|last| is_recent(last, start));
        let current = position_in_world.map(|at| match previous {
            Some(previous) => previous.follow(at),
            None => at,
        });
        let speed = match (previous, current) {
            (Some(previous), Some(to)) if previous.frame < now => {
                horizontal_distance(previous.position_in_world, to) / (now - previous.frame) as f32
            }
            (Some(previous), _) => previous.speed,
            (None, _) => 0.0,
        };
        if let Some(position_in_world) = current {
            self.last = Some(Sighting { frame: now, position_in_world, speed });
        }
        let at = |frame: Frame| match (previous, current) {
            (Some(previous), Some(to)) if previous.frame < now => {
                let from = previous.position_in_world;
                let elapsed = frame.saturating_sub(previous.frame) as f32;
                let fraction = elapsed / (now - previous.frame) as f32;
                Some(from + fraction.min(1.0) * (to - from))
            }
            (_, Some(to)) => Some(to),
            (Some(last), None) => is_recent(&last, frame).then_some(last.position_in_world),
            (None, None) => None,
        };
        let crop = |image: &HistoryFrame| {
            let Some(at) = at(image.frame) else { return PersonCrop::blank(image.frame) };
            let crop = PersonCrop::new(image, at, speed);
            PersonCrop { is_seen: position_in_world.is_some() && !crop.is_blank(), ..crop }
        };
        images.iter().map(crop).collect()
    }
}
