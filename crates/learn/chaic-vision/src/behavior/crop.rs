//! A person cut out of one image of a film, at the same scale whatever the distance.

use chaic_agents::memory::Memory;
use chaic_core::geom::Camera;
use chaic_core::observation::{Film, FilmFrame};
use chaic_core::{AgentId, Frame, Observation, Vec3};

/// Side of a crop, pixels.
pub const SIDE: usize = 48;
/// What a crop shows at the person's distance, metres (perception.md's experiment: 2.4).
pub const WINDOW_M: f32 = 2.4;
/// Height above the floor of a crop's middle, metres: from the feet to above the head.
pub const MIDDLE_M: f32 = 1.0;
/// The film that crops are cut out of.
pub const FILM: Film = Film { image_size: 128, every_frames: 3, most: 64 };
/// Nobody nearer than this is cut out, metres.
const NEAREST_M: f32 = 0.5;
/// Depth is kept in steps of so much before and behind the person, metres.
const DEPTH_STEP_M: f32 = 0.0125;
/// A sighting that is older than this says nothing of where somebody is in a film, frames.
const OLDEST_FRAMES: Frame = 120;

/// A person cut out of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Crop {
    /// When.
    pub frame: Frame,
    /// The person's distance along the camera's axis, metres; 0 where nobody was to be seen.
    pub distance_m: f32,
    /// How fast the person moved in plan, metres per frame.
    pub speed: f32,
    /// Color, shape [`SIDE`, `SIDE`, 3]; empty where nobody was to be seen.
    pub rgb: Vec<u8>,
    /// Depth, shape [`SIDE`, `SIDE`]: 128 at the person's distance, 0 outside the image.
    pub depth: Vec<u8>,
}

impl Crop {
    /// Of nobody.
    pub fn blank(frame: Frame) -> Crop {
        Crop { frame, distance_m: 0.0, speed: 0.0, rgb: Vec::new(), depth: Vec::new() }
    }

    /// Whether it shows somebody.
    pub fn is_blank(&self) -> bool {
        self.distance_m == 0.0
    }

    /// Metres behind the person of a depth that was kept.
    pub fn behind_m(depth: u8) -> f32 {
        (f32::from(depth) - 128.0) * DEPTH_STEP_M
    }

    /// Somebody who stands here, and moves at this speed.
    pub fn of(film: &FilmFrame, position_in_world: Vec3, speed: f32) -> Crop {
        let FilmFrame { frame, camera, images } = film;
        let blank = Crop::blank(*frame);
        let (Some(rgb), Some(depth_m)) = (&images.rgb, &images.depth_m) else { return blank };
        let middle = Vec3::new(position_in_world.x, MIDDLE_M, position_in_world.z);
        let Some((at, distance_m)) = camera.project(middle) else { return blank };
        let (width, height) = (camera.width as usize, camera.height as usize);
        let fits = rgb.len() == 3 * width * height && depth_m.len() == width * height;
        let size_px = WINDOW_M * camera.focal_px() / distance_m;
        let is_outside = at.x + 0.5 * size_px < 0.0 || at.x - 0.5 * size_px > width as f32;
        if distance_m < NEAREST_M || is_outside || !fits {
            return blank;
        }
        let mut crop = Crop { distance_m, speed, ..blank };
        crop.rgb.resize(3 * SIDE * SIDE, 0);
        crop.depth.resize(SIDE * SIDE, 0);
        let step = size_px / SIDE as f32;
        let first = [at.x - 0.5 * size_px + 0.5 * step, at.y - 0.5 * size_px + 0.5 * step];
        for j in 0..SIDE {
            let Some(row) = pixel(first[1] + j as f32 * step, height) else { continue };
            for i in 0..SIDE {
                let Some(column) = pixel(first[0] + i as f32 * step, width) else { continue };
                let (from, to) = (row * width + column, j * SIDE + i);
                crop.rgb[3 * to..][..3].copy_from_slice(&rgb[3 * from..][..3]);
                let behind = (depth_m[from].min(Camera::FAR_M) - distance_m) / DEPTH_STEP_M;
                crop.depth[to] = (behind + 128.0).clamp(1.0, 255.0) as u8;
            }
        }
        crop
    }
}

/// The pixel at a continuous coordinate, if it is one.
fn pixel(at: f32, n: usize) -> Option<usize> {
    (at >= 0.0 && at < n as f32).then_some(at as usize)
}

/// Cuts one person out of all films.
#[derive(Clone, Debug)]
pub struct Watcher {
    watched: AgentId,
    /// The last decision, and where the person was to be seen then.
    last: Option<(Frame, Option<Vec3>)>,
}

impl Watcher {
    /// Of this person.
    pub fn of(watched: AgentId) -> Watcher {
        Watcher { watched, last: None }
    }

    /// The crops since the last observation, after the memory has taken this one in. Between two
    /// decisions the person is believed to go straight.
    pub fn watch(&mut self, observation: &Observation, memory: &Memory) -> Vec<Crop> {
        let now = observation.frame;
        let seen = memory.people.get(self.watched).filter(|p| p.is_in_view);
        let here = seen.map(|p| p.position_in_world);
        let last = self.last.replace((now, here));
        let before = last.filter(|(frame, _)| frame + OLDEST_FRAMES > now);
        let before = before.and_then(|(frame, at)| Some((frame, at?)));
        let speed = match (before, here) {
            (Some((then, from)), Some(to)) if then < now => {
                let way = to - from;
                (way.x * way.x + way.z * way.z).sqrt() / (now - then) as f32
            }
            _ => 0.0,
        };
        let at = |frame: Frame| match (before, here) {
            (Some((then, from)), Some(to)) if then < now => {
                let part = (frame.saturating_sub(then)) as f32 / (now - then) as f32;
                Some(from + part.min(1.0) * (to - from))
            }
            (before, here) => here.or(before.map(|(_, from)| from)),
        };
        let crop = |film: &FilmFrame| match at(film.frame) {
            Some(at) => Crop::of(film, at, speed),
            None => Crop::blank(film.frame),
        };
        observation.film.iter().map(crop).collect()
    }
}
