//! The network: an encoder of dense strides and depthwise blocks, a decoder of sums, and two heads at
//! half the image's resolution: which label a pixel has, and where the middle of its thing is.

use chaic_nn::{Kernel, Network, Node};

use crate::features::N_FEATURES;
use crate::labels::n_labels;

/// Every how many pixels of the image the heads tell something.
pub const STRIDE: usize = 2;
/// Channels of the decoder, and of the encoder at half the resolution.
const WIDTH: usize = 48;
/// Channels and blocks of the encoder at a 4th, 8th, 16th and 32nd of the resolution.
const STAGES: [(usize, usize); 4] = [(48, 1), (96, 2), (144, 3), (240, 2)];
/// So many times as wide are blocks within.
const EXPANSION: usize = 2;

/// The network with its heads.
#[derive(Clone, Debug)]
pub struct Detector {
    /// All layers.
    pub network: Network,
    /// A number for each label, [`n_labels`]; the greatest is the pixel's.
    pub labels: Node,
    /// From the surface to the middle of what is seen of the thing, in units of half the class's largest
    /// extent, in the camera's frame (x right, y up, z towards the eye).
    pub offsets: Node,
}

impl Default for Detector {
    fn default() -> Detector {
        Detector::new()
    }
}

impl Detector {
    /// The network that is trained and shipped.
    pub fn new() -> Detector {
        let mut net = Network::default();
        let input = net.input(N_FEATURES);
        let down = Kernel { side: 3, stride: 2 };
        let stem = net.conv("stem", input, down, WIDTH);
        let stem = positive(&mut net, "stem.norm", stem);
        let mut levels = vec![stem];
        let mut at = stem;
        for (stage, (channels, n_blocks)) in STAGES.into_iter().enumerate() {
            let name = format!("stage{}", stage + 1);
            at = net.conv(&format!("{name}.down"), at, down, channels);
            at = positive(&mut net, &format!("{name}.down.norm"), at);
            for k in 0..n_blocks {
                at = block(&mut net, &format!("{name}.block{k}"), at, channels, 5);
            }
            levels.push(at);
        }
        let mut up = None;
        for (level, node) in levels.into_iter().enumerate().rev() {
            let name = format!("up{level}");
            let side = net.conv(&name, node, Kernel::POINTWISE, WIDTH);
            let mut sum = net.norm(&format!("{name}.norm"), side);
            if let Some(below) = up {
                let below = net.upsample(below);
                sum = net.add(sum, below);
            }
            up = Some(block(&mut net, &format!("{name}.block"), sum, WIDTH, 3));
        }
        let last = up.expect("there are levels");
        let last = net.norm_relu("last.norm", last);
        let labels = net.head("labels", last, n_labels());
        let offsets = net.head("offsets", last, 3);
        Detector { network: net, labels, offsets }
    }
}

fn positive(net: &mut Network, name: &str, node: Node) -> Node {
    net.norm_relu(name, node)
}

/// Depthwise, wider, narrower, and added to what came in (as of Liu et al. 2022).
fn block(net: &mut Network, name: &str, from: Node, channels: usize, side: usize) -> Node {
    let deep = net.depthwise(&format!("{name}.depthwise"), from, side);
    let deep = net.norm(&format!("{name}.norm"), deep);
    let wide = net.conv(&format!("{name}.wide"), deep, Kernel::POINTWISE, EXPANSION * channels);
    let wide = net.relu(wide);
    let narrow = net.conv(&format!("{name}.narrow"), wide, Kernel::POINTWISE, channels);
    net.add(from, narrow)
}
