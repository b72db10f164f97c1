//! Detector network: an encoder with strided convolutions and depthwise blocks, a decoder that sums
//! levels, and a head at half the image's resolution. The head predicts a label and an offset to
//! the object's center for each pixel.

use chaic_nn::{Kernel, Network, NodeId};
use serde::{Deserialize, Serialize};

use crate::features::N_FEATURES;
use crate::labels::n_labels;

/// Image pixels per output pixel of the head, along each axis.
pub const STRIDE: usize = 2;
/// Channels of the decoder, and of the encoder at half the resolution.
const WIDTH: usize = 48;
/// Channels of the encoder at 1/4, 1/8, 1/16 and 1/32 of the resolution.
const STAGES: [usize; 4] = [48, 96, 144, 240];
/// Ratio of a block's inner width to its outer width.
const EXPANSION: usize = 2;

/// Type of the encoder's residual blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BlockType {
    /// Depthwise 5x5 convolution and an inverted bottleneck (Liu et al. 2022). The bundled detector
    /// uses it.
    #[default]
    Depthwise,
    /// Dense 3x3 convolution (He et al. 2016), fewer blocks. A baseline for comparison.
    Dense,
}

impl BlockType {
    /// Number of blocks at 1/4, 1/8, 1/16 and 1/32 of the resolution: 2.5 billion multiplications
    /// for 512x512 pixels, 2.8 billion with dense blocks.
    fn per_stage(self) -> [usize; 4] {
        match self {
            BlockType::Depthwise => [1, 2, 3, 2],
            BlockType::Dense => [1, 1, 2, 1],
        }
    }
}

/// Detector network.
#[derive(Clone, Debug)]
pub struct Detector {
    /// All layers.
    pub network: Network,
    /// Output of each pixel: [`n_labels`] logits, then [`N_OFFSETS`] components of the offset from
    /// the surface to the center of the visible part of the object. Offsets are in the camera's
    /// frame (x right, y up, z towards the camera), in units of half the class's largest extent.
    pub head: NodeId,
}

/// Components of an offset.
pub const N_OFFSETS: usize = 3;

impl Default for Detector {
    fn default() -> Detector {
        Detector::new()
    }
}

impl Detector {
    /// Creates the network that is trained and bundled.
    pub fn new() -> Detector {
        Detector::with_blocks(BlockType::Depthwise)
    }

    /// Creates a network with the given blocks.
    pub fn with_blocks(blocks: BlockType) -> Detector {
        let mut net = Network::default();
        let input = net.input(N_FEATURES);
        let downsample = Kernel { size: 3, stride: 2 };
        let stem = net.conv("stem", input, downsample, WIDTH);
        let stem = net.norm_relu("stem.norm", stem);
        let mut levels = vec![stem];
        let mut features = stem;
        let stages = STAGES.into_iter().zip(blocks.per_stage());
        for (stage, (channels, n_blocks)) in stages.enumerate() {
            let name = format!("stage{}", stage + 1);
            features = net.conv(&format!("{name}.down"), features, downsample, channels);
            features = net.norm_relu(&format!("{name}.down.norm"), features);
            for k in 0..n_blocks {
                let name = format!("{name}.block{k}");
                features = match blocks {
                    BlockType::Depthwise => {
                        inverted_bottleneck(&mut net, &name, features, channels)
                    }
                    BlockType::Dense => dense_block(&mut net, &name, features, channels),
                };
            }
            levels.push(features);
        }
        let mut decoded = None;
        for (level, node) in levels.into_iter().enumerate().rev() {
            let name = format!("up{level}");
            // The output of the stem already has the decoder's width.
            let mut level_features = match level {
                0 => node,
                _ => net.conv(&name, node, Kernel::POINTWISE, WIDTH),
            };
            if let Some(coarser) = decoded {
                let coarser = net.upsample(coarser);
                level_features = net.add(level_features, coarser);
            }
            decoded =
                Some(decoder_block(&mut net, &format!("{name}.block"), level_features, WIDTH));
        }
        let last = net.norm_relu("last.norm", decoded.expect("there are levels"));
        let head = net.output_head("head", last, n_labels() + N_OFFSETS);
        Detector { network: net, head }
    }
}

/// Inverted bottleneck with a residual connection (Liu et al. 2022).
pub(crate) fn inverted_bottleneck(
    net: &mut Network,
    name: &str,
    from: NodeId,
    channels: usize,
) -> NodeId {
    let spatial = net.depthwise(&format!("{name}.depthwise"), from, 5);
    let spatial = net.norm(&format!("{name}.norm"), spatial);
    let wide = net.conv(&format!("{name}.wide"), spatial, Kernel::POINTWISE, EXPANSION * channels);
    let wide = net.relu(wide);
    let narrow = net.conv(&format!("{name}.narrow"), wide, Kernel::POINTWISE, channels);
    net.add(from, narrow)
}

/// Dense convolution with a residual connection (He et al. 2016).
fn dense_block(net: &mut Network, name: &str, from: NodeId, channels: usize) -> NodeId {
    let norm = net.norm_relu(&format!("{name}.norm"), from);
    let dense = net.conv(&format!("{name}.dense"), norm, Kernel { size: 3, stride: 1 }, channels);
    net.add(from, dense)
}

/// Cheaper block for the decoder at high resolution: the inner width equals the outer width.
pub(crate) fn decoder_block(
    net: &mut Network,
    name: &str,
    from: NodeId,
    channels: usize,
) -> NodeId {
    let spatial = net.depthwise(&format!("{name}.depthwise"), from, 3);
    let spatial = net.norm_relu(&format!("{name}.norm"), spatial);
    let mixed = net.conv(&format!("{name}.mixed"), spatial, Kernel::POINTWISE, channels);
    net.add(from, mixed)
}
