//! Crops of a person from image histories, at a fixed scale independent of distance.

use chaic_agents::memory::Memory;
use chaic_core::geom::Camera;
use chaic_core::observation::{FrameHistorySpec, HistoryFrame};
use chaic_core::{AgentId, Frame, Observation, Vec3};

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
/// Maximum age of a person's position that determines crops, frames.
const MAX_AGE_FRAMES: Frame = 120;

/// Crop of a person.
#[derive(Clone, Debug, PartialEq)]
pub struct PersonCrop {
    /// Frame of the image.
    pub frame: Frame,
    /// Distance along the camera's axis, meters; 0 if the person is not visible.
    pub distance_m: f32,
    /// Horizontal speed, meters per frame.
    pub speed: f32,
    /// Color, shape [`SIDE`, `SIDE`, 3]; empty if the person is not visible.
    pub rgb: Vec<u8>,
    /// Depth, shape [`SIDE`, `SIDE`]: 128 at the person's distance, 0 outside of the image.
    pub depth: Vec<u8>,
}

impl PersonCrop {
    /// Creates a crop without a person.
    pub fn blank(frame: Frame) -> PersonCrop {
        PersonCrop { frame, distance_m: 0.0, speed: 0.0, rgb: Vec::new(), depth: Vec::new() }
    }

    /// Returns whether the crop shows no person.
    pub fn is_blank(&self) -> bool {
        self.distance_m == 0.0
    }

    /// Converts stored depth to meters behind the person.
    pub fn behind_m(depth: u8) -> f32 {
        (f32::from(depth) - 128.0) * DEPTH_STEP_M
    }

    /// Crops the person at this position, who moves at this speed.
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

/// Crops one person from the image histories of an episode.
#[derive(Clone, Debug)]
pub struct PersonCropper {
    person: AgentId,
    /// Frame of the last observation, and the person's position if visible.
    last: Option<(Frame, Option<Vec3>)>,
}

impl PersonCropper {
    /// Creates a cropper for a person.
    pub fn new(person: AgentId) -> PersonCropper {
        PersonCropper { person, last: None }
    }

    /// Returns the crops since the last observation. Memory must include this observation.
    /// Positions between two observations are interpolated linearly.
    pub fn crop(&mut self, observation: &Observation, memory: &Memory) -> Vec<PersonCrop> {
        let now = observation.frame;
        let visible = memory.people.get(self.person).filter(|p| p.is_in_view);
        let current = visible.map(|p| p.position_in_world);
        let last = self.last.replace((now, current));
        let previous = last.filter(|(frame, _)| frame + MAX_AGE_FRAMES > now);
        let previous = previous.and_then(|(frame, at)| Some((frame, at?)));
        let speed = match (previous, current) {
            (Some((previous_frame, from)), Some(to)) if previous_frame < now => {
                let displacement = to - from;
                (displacement.x * displacement.x + displacement.z * displacement.z).sqrt()
                    / (now - previous_frame) as f32
            }
            _ => 0.0,
        };
        let at = |frame: Frame| match (previous, current) {
            (Some((previous_frame, from)), Some(to)) if previous_frame < now => {
                let fraction =
                    (frame.saturating_sub(previous_frame)) as f32 / (now - previous_frame) as f32;
                Some(from + fraction.min(1.0) * (to - from))
            }
            (previous, current) => current.or(previous.map(|(_, from)| from)),
        };
        let crop = |image: &HistoryFrame| match at(image.frame) {
            Some(at) => PersonCrop::new(image, at, speed),
            None => PersonCrop::blank(image.frame),
        };
        observation.frame_history.iter().map(crop).collect()
    }
}
