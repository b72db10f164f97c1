//! What is read when a single action is chosen: color and depth, the own memory as a map, the own state.

use chaic_agents::Mind;
use chaic_agents::memory::egocentric::{CHANNELS, EgocentricMap};
use chaic_agents::policies::External;
use chaic_core::geom::{Camera, forward};
use chaic_core::{Briefing, Observation, Role};

use crate::scales::{flag, share};

/// Side of the image that is read, pixels. An eye's image is larger by a whole number.
pub const IMAGE_SIDE: usize = 128;
/// Channels of the image: color and depth.
pub const IMAGE_CHANNELS: usize = 4;
/// The map that is read: 8 m each way.
pub const MAP: EgocentricMap = EgocentricMap { side: 32, cell_m: 0.5 };
/// Channels of the map.
pub const MAP_CHANNELS: usize = CHANNELS.len();

/// Numbers of the own state: place, heading, time left, whether a container is held, and how many things are held
/// (one of ten, as in the original's hook for learners), counted from none.
pub const STATE: [&str; 16] = [
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
/// How many there are.
pub const N_STATE: usize = STATE.len();
const N_HELD: usize = 10;

/// What is read. Images are kept as bytes, which are a quarter of the memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen {
    /// Shape [128, 128, 4]: color, and depth from 0 to 255 for 0 to 10 m.
    pub image: Vec<u8>,
    /// Shape [32, 32, 8], 0 or 1.
    pub map: Vec<u8>,
    /// The own state, 255 for 1, moved by half for what may be negative.
    pub state: [u8; N_STATE],
}

/// Depth beyond this is as far, metres.
const FAR_M: f32 = 10.0;

impl Seen {
    /// What a mind read that has attended to this observation.
    pub fn of(observation: &Observation, mind: &Mind<External>, briefing: &Briefing) -> Seen {
        let mut map = vec![0; MAP.len()];
        if let Some(memory) = mind.memory() {
            let mut planes = vec![0; MAP.len()];
            MAP.draw(memory, briefing, &mut planes);
            let n = MAP.side * MAP.side;
            for (pixel, to) in map.chunks_exact_mut(MAP_CHANNELS).enumerate() {
                to.iter_mut().enumerate().for_each(|(c, to)| *to = planes[c * n + pixel]);
            }
        }
        Seen { image: image(observation), map, state: state(observation, mind, briefing) }
    }
}

fn image(observation: &Observation) -> Vec<u8> {
    let Camera { width, height, .. } = observation.camera;
    let side = (width.min(height) as usize) / IMAGE_SIDE;
    let mut image = vec![0; IMAGE_SIDE * IMAGE_SIDE * IMAGE_CHANNELS];
    let images = &observation.images;
    let (Some(rgb), Some(depth_m)) = (&images.rgb, &images.depth_m) else { return image };
    for (k, to) in image.chunks_exact_mut(IMAGE_CHANNELS).enumerate() {
        let [row, column] = [k / IMAGE_SIDE, k % IMAGE_SIDE].map(|x| x * side + side / 2);
        let from = row * width as usize + column;
        to[..3].copy_from_slice(&rgb[3 * from..3 * from + 3]);
        to[3] = byte(share(depth_m[from], FAR_M));
    }
    image
}

fn state(observation: &Observation, mind: &Mind<External>, briefing: &Briefing) -> [u8; N_STATE] {
    let own = &observation.own;
    let bounds = briefing.bounds;
    let size = bounds.size();
    let at = own.pose.position;
    let heading = forward(own.pose.yaw_rad);
    let held = mind.memory().map_or(0, |memory| memory.hands.all().count());
    let has_container = mind.memory().is_some_and(|memory| {
        memory.hands.all().any(|(_, class)| class.info().role == Role::Container)
    });
    let left = briefing.horizon.saturating_sub(observation.frame) as f32;
    let mut state = [0; N_STATE];
    let numbers = [
        (at.x - bounds.min.x) / size.x.max(1.0),
        (at.z - bounds.min.y) / size.y.max(1.0),
        0.5 + 0.5 * heading.x,
        0.5 + 0.5 * heading.z,
        left / briefing.horizon.max(1) as f32,
        flag(has_container),
    ];
    state.iter_mut().zip(numbers).for_each(|(to, x)| *to = byte(x));
    state[numbers.len() + held.min(N_HELD - 1)] = u8::MAX;
    state
}

/// 0 to 1 as a byte.
fn byte(x: f32) -> u8 {
    (255.0 * x.clamp(0.0, 1.0)) as u8
}
