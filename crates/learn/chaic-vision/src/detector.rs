//! The network: an encoder of dense strides and depthwise blocks, a decoder of sums, and a head at half
//! the image's resolution: which label a pixel has, and where the middle of its thing is.

use chaic_nn::{Kernel, Network, Node};
use serde::{Deserialize, Serialize};

use crate::features::N_FEATURES;
use crate::labels::n_labels;

/// Every how many pixels of the image the head tells something.
pub const STRIDE: usize = 2;
/// Channels of the decoder, and of the encoder at half the resolution.
const WIDTH: usize = 48;
/// Channels of the encoder at a 4th, 8th, 16th and 32nd of the resolution.
const STAGES: [usize; 4] = [48, 96, 144, 240];
/// So many times as wide are blocks within.
const EXPANSION: usize = 2;

/// What the encoder's blocks are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Blocks {
    /// Depthwise 5x5, then wider and narrower by a matrix for each pixel, as of Liu et al. 2022: the
    /// shipped detector's.
    #[default]
    Depthwise,
    /// Dense 3x3, as of He et al. 2016, fewer of them: what the others are compared with.
    Dense,
}

impl Blocks {
    /// How many at a 4th, 8th, 16th and 32nd of the resolution: 0.9 billion multiplications for
    /// 512x512 pixels, or 1.2 for dense ones.
    fn of_stages(self) -> [usize; 4] {
        match self {
            Blocks::Depthwise => [1, 2, 3, 2],
            Blocks::Dense => [1, 1, 2, 1],
        }
    }
}

/// The network.
#[derive(Clone, Debug)]
pub struct Detector {
    /// All layers.
    pub network: Network,
    /// What it tells of each pixel, [`N_OFFSETS`] numbers after [`n_labels`]: a number for each label,
    /// the greatest of which is the pixel's; and the way from the surface to the middle of what is seen
    /// of the thing, in units of half the class's largest extent, in the camera's frame (x right, y up,
    /// z towards the eye).
    pub head: Node,
}

/// Numbers of a way to a middle.
pub const N_OFFSETS: usize = 3;

impl Default for Detector {
    fn default() -> Detector {
        Detector::new()
    }
}

impl Detector {
    /// The network that is trained and shipped.
    pub fn new() -> Detector {
        Detector::of(Blocks::Depthwise)
    }

    /// One of these blocks.
    pub fn of(blocks: Blocks) -> Detector {
        let mut net = Network::default();
        let input = net.input(N_FEATURES);
        let down = Kernel { side: 3, stride: 2 };
        let stem = net.conv("stem", input, down, WIDTH);
        let stem = net.norm_relu("stem.norm", stem);
        let mut levels = vec![stem];
        let mut at = stem;
        let stages = STAGES.into_iter().zip(blocks.of_stages());
        for (stage, (channels, n_blocks)) in stages.enumerate() {
            let name = format!("stage{}", stage + 1);
            at = net.conv(&format!("{name}.down"), at, down, channels);
            at = net.norm_relu(&format!("{name}.down.norm"), at);
            for k in 0..n_blocks {
                let name = format!("{name}.block{k}");
                at = match blocks {
                    Blocks::Depthwise => wide_block(&mut net, &name, at, channels),
                    Blocks::Dense => dense_block(&mut net, &name, at, channels),
                };
            }
            levels.push(at);
        }
        let mut up = None;
        for (level, node) in levels.into_iter().enumerate().rev() {
            let name = format!("up{level}");
            // The stem is as wide as the decoder already.
            let mut sum = match level {
                0 => node,
                _ => net.conv(&name, node, Kernel::POINTWISE, WIDTH),
            };
            if let Some(below) = up {
                let below = net.upsample(below);
                sum = net.add(sum, below);
            }
            up = Some(narrow_block(&mut net, &format!("{name}.block"), sum));
        }
        let last = net.norm_relu("last.norm", up.expect("there are levels"));
        let head = net.head("head", last, n_labels() + N_OFFSETS);
        Detector { network: net, head }
    }
}

/// Depthwise, wider, narrower, and added to what came in (as of Liu et al. 2022).
fn wide_block(net: &mut Network, name: &str, from: Node, channels: usize) -> Node {
    let deep = net.depthwise(&format!("{name}.depthwise"), from, 5);
    let deep = net.norm(&format!("{name}.norm"), deep);
    let wide = net.conv(&format!("{name}.wide"), deep, Kernel::POINTWISE, EXPANSION * channels);
    let wide = net.relu(wide);
    let narrow = net.conv(&format!("{name}.narrow"), wide, Kernel::POINTWISE, channels);
    net.add(from, narrow)
}

/// Dense, and added to what came in (as of He et al. 2016).
fn dense_block(net: &mut Network, name: &str, from: Node, channels: usize) -> Node {
    let norm = net.norm_relu(&format!("{name}.norm"), from);
    let dense = net.conv(&format!("{name}.dense"), norm, Kernel { side: 3, stride: 1 }, channels);
    net.add(from, dense)
}

/// A cheaper one for the decoder, where pixels are many: as wide within as without.
fn narrow_block(net: &mut Network, name: &str, from: Node) -> Node {
    let deep = net.depthwise(&format!("{name}.depthwise"), from, 3);
    let deep = net.norm_relu(&format!("{name}.norm"), deep);
    let mixed = net.conv(&format!("{name}.mixed"), deep, Kernel::POINTWISE, WIDTH);
    net.add(from, mixed)
}
