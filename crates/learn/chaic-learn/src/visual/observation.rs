//! Input of visual policies: color and depth, the memory as a map, and the agent's state.

use chaic_agents::PlanningAgent;
use chaic_agents::memory::egocentric::{CHANNELS, EgocentricMap};
use chaic_agents::policies::ExternalPolicy;
use chaic_core::geom::{Camera, forward};
use chaic_core::{Briefing, Observation, Role};

use crate::opponent::N_BODY_LIMITS;
use crate::opponent::network::{N_GOALS, OpponentPrediction};
use crate::scales::{flag, normalize_clamped};

/// Width and height of the input image, pixels.
pub const IMAGE_SIZE: usize = 128;
/// Channels of the image: color and depth.
pub const IMAGE_CHANNELS: usize = 4;
/// Egocentric map, 8 m in each direction.
pub const MAP: EgocentricMap = EgocentricMap { side: 32, cell_m: 0.5 };
/// Channels of the map.
pub const MAP_CHANNELS: usize = CHANNELS.len();

/// Features of the agent's state: position, heading, time left, container in hand, and a one-hot of
/// the number of held objects (ten values, as in the original's interface for learners).
pub const STATE_FEATURES: [&str; 16] = [
    "x",
    "z",
    "heading_sin",
    "heading_cos",
    "time_left",
    "has_container",
    "holds_0",
    "holds_1",
    "holds_2",
    "holds_3",
    "holds_4",
    "holds_5",
    "holds_6",
    "holds_7",
    "holds_8",
    "holds_9_or_more",
];
/// Number of state features.
pub const N_STATE_FEATURES: usize = STATE_FEATURES.len();
const N_HELD: usize = 10;

/// Observation, stored as bytes to save memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VisualObservation {
    /// Color, and depth with 0 to 255 for 0 to 10 m; shape [128, 128, 4].
    pub image: Vec<u8>,
    /// Map, 0 or 1; shape [32, 32, 8].
    pub map: Vec<u8>,
    /// State features; 0 to 255 for 0 to 1, and for -1 to 1 where they may be negative.
    pub state: [u8; N_STATE_FEATURES],
    /// Features of [`opponent_features`]; empty without an opponent model.
    pub opponent: Vec<u8>,
}

/// Number of features of an opponent model's prediction: goals, limits, and the probability that
/// the partner wants the class of the nearest visible target.
pub const N_OPPONENT_FEATURES: usize = N_GOALS + N_BODY_LIMITS + 1;

/// Returns a prediction as bytes, 0 to 255 for 0 to 1.
pub fn opponent_features(prediction: &OpponentPrediction, nearest_target: f32) -> Vec<u8> {
    let OpponentPrediction { goals, limits, .. } = prediction;
    goals.iter().chain(limits).chain([&nearest_target]).map(|x| byte(*x)).collect()
}

/// Depth that is encoded as 1, meters.
const MAX_DEPTH_M: f32 = 10.0;

impl VisualObservation {
    /// Creates the observation of an agent that has already processed `observation`; `rgb` is its color
    /// image and `opponent` are the features of its opponent model, if it has one.
    pub fn new(
        observation: &Observation,
        rgb: Option<&[u8]>,
        agent: &PlanningAgent<ExternalPolicy>,
        briefing: &Briefing,
        opponent: Vec<u8>,
    ) -> VisualObservation {
        let mut map = vec![0; MAP.len()];
        if let Some(memory) = agent.memory() {
            let mut planes = vec![0; MAP.len()];
            MAP.draw(memory, briefing, &mut planes);
            let n = MAP.side * MAP.side;
            for (pixel, to) in map.chunks_exact_mut(MAP_CHANNELS).enumerate() {
                to.iter_mut().enumerate().for_each(|(c, to)| *to = planes[c * n + pixel]);
            }
        }
        VisualObservation {
            image: image(observation, rgb),
            map,
            state: state(observation, agent, briefing),
            opponent,
        }
    }
}

/// Returns the pixel at the center of part `x` of [`IMAGE_SIZE`] equal parts of `side` pixels.
fn sample(x: usize, side: usize) -> usize {
    (2 * x + 1) * side / (2 * IMAGE_SIZE)
}

/// Returns the input image, [`IMAGE_SIZE`], [`IMAGE_SIZE`], [`IMAGE_CHANNELS`]: samples of the upper
/// left square of the camera image, at the centers of equal parts.
fn image(observation: &Observation, rgb: Option<&[u8]>) -> Vec<u8> {
    let Camera { width, height, .. } = observation.camera;
    let side = width.min(height) as usize;
    let mut image = vec![0; IMAGE_SIZE * IMAGE_SIZE * IMAGE_CHANNELS];
    let (Some(rgb), Some(depth_m)) = (rgb, &observation.images.depth_m) else { return image };
    for (k, to) in image.chunks_exact_mut(IMAGE_CHANNELS).enumerate() {
        let [row, column] = [k / IMAGE_SIZE, k % IMAGE_SIZE].map(|x| sample(x, side));
        let from = row * width as usize + column;
        to[..3].copy_from_slice(&rgb[3 * from..3 * from + 3]);
        to[3] = byte(normalize_clamped(depth_m[from], MAX_DEPTH_M));
    }
    image
}

fn state(
    observation: &Observation,
    agent: &PlanningAgent<ExternalPolicy>,
    briefing: &Briefing,
) -> [u8; N_STATE_FEATURES] {
    let proprioception = &observation.proprioception;
    let bounds = briefing.bounds;
    let size = bounds.size();
    let at = proprioception.pose.position;
    let heading = forward(proprioception.pose.yaw_rad);
    let held = agent.memory().map_or(0, |memory| memory.hands.all().count());
    let has_container = agent.memory().is_some_and(|memory| {
        memory.hands.all().any(|(_, class)| class.info().role == Role::Container)
    });
    let frames_left = briefing.horizon.saturating_sub(observation.frame) as f32;
    let mut state = [0; N_STATE_FEATURES];
    let values = [
        (at.x - bounds.min.x) / size.x.max(1.0),
        (at.z - bounds.min.y) / size.y.max(1.0),
        0.5 + 0.5 * heading.x,
        0.5 + 0.5 * heading.z,
        frames_left / briefing.horizon.max(1) as f32,
        flag(has_container),
    ];
    state.iter_mut().zip(values).for_each(|(to, x)| *to = byte(x));
    state[values.len() + held.min(N_HELD - 1)] = u8::MAX;
    state
}

/// Encodes a number from 0 to 1 as a byte.
fn byte(x: f32) -> u8 {
    (255.0 * x.clamp(0.0, 1.0)) as u8
}

#[cfg(test)]
mod tests {
    //! Promise: the input covers camera images of every size.

    use super::*;

    #[test]
    fn samples_are_spread_over_images_of_every_size() {
        for side in [16, 64, 128, 256, 300, 512] {
            let samples: Vec<usize> = (0..IMAGE_SIZE).map(|x| sample(x, side)).collect();
            let gap = side.div_ceil(IMAGE_SIZE);
            assert!(samples[0] < gap && samples[IMAGE_SIZE - 1] + gap >= side, "{side}");
            assert!(samples.windows(2).all(|pair| pair[1] - pair[0] <= gap), "{side}");
        }
        assert_eq!([0, 1, 127].map(|x| sample(x, 256)), [1, 3, 255]);
    }
}
