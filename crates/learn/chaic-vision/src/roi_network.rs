//! Network of the detector's second stage. It classifies a proposal, predicts a refined (redrawn)
//! mask, and predicts the IoU of each mask with the object.

use chaic_nn::{Kernel, Network, NodeId, Shape};

use crate::detector::{decoder_block, inverted_bottleneck};
use crate::labels::n_labels;
use crate::roi::{N_CHANNELS, SIDE, n_scalars};

/// Channels at the crop's resolution and at 1/2, 1/4 and 1/8 of it.
const CHANNELS: [usize; 4] = [16, 32, 64, 128];
/// Blocks at 1/2, 1/4 and 1/8 of the resolution.
const BLOCKS: [usize; 3] = [1, 2, 1];
/// Channels of the mask decoder.
const WIDTH: usize = 32;
/// Widths of the dense layers: of the image, of the scalars, and of both.
const IMAGE_WIDTH: usize = 192;
const SCALARS_WIDTH: usize = 128;
const EMBEDDING_WIDTH: usize = 256;

/// Number of predicted qualities: the IoU of the proposal's mask and of the redrawn mask with the
/// object.
pub const N_QUALITIES: usize = 2;

/// Network of the second stage: 12 million multiplications per proposal. The layers of the mask
/// follow those of labels and qualities, so that they can run for some proposals only.
#[derive(Clone, Debug)]
pub struct RoiNetwork {
    /// All layers. Inputs are crops and scalars.
    pub network: Network,
    /// Logit of each label; the background is a proposal without object.
    pub labels: NodeId,
    /// Logits of the intersection over union of both masks with the object.
    pub qualities: NodeId,
    /// Logit of each sample to belong to the object, at the crop's resolution.
    pub mask: NodeId,
}

impl Default for RoiNetwork {
    fn default() -> RoiNetwork {
        RoiNetwork::new()
    }
}

impl RoiNetwork {
    /// Creates the network that is trained and bundled.
    pub fn new() -> RoiNetwork {
        let mut net = Network::default();
        let crop = net.input(N_CHANNELS);
        let scalars = net.auxiliary_input(n_scalars(), SIDE);
        let same = Kernel { size: 3, stride: 1 };
        let downsample = Kernel { size: 3, stride: 2 };
        let stem = net.conv("stem", crop, same, CHANNELS[0]);
        let mut features = net.norm_relu("stem.norm", stem);
        let mut levels = vec![features];
        for (stage, n_blocks) in BLOCKS.into_iter().enumerate() {
            let name = format!("stage{}", stage + 1);
            let channels = CHANNELS[stage + 1];
            features = net.conv(&format!("{name}.down"), features, downsample, channels);
            features = net.norm_relu(&format!("{name}.down.norm"), features);
            for k in 0..n_blocks {
                features =
                    inverted_bottleneck(&mut net, &format!("{name}.block{k}"), features, channels);
            }
            levels.push(features);
        }
        let dense = |net: &mut Network, name: &str, from: NodeId, width: usize| {
            let dense = net.conv(name, from, Kernel::POINTWISE, width);
            net.norm_relu(&format!("{name}.norm"), dense)
        };
        let image = net.flatten(features, SIDE >> BLOCKS.len());
        let image = dense(&mut net, "image", image, IMAGE_WIDTH);
        let scalars = dense(&mut net, "scalars", scalars, SCALARS_WIDTH);
        let embedding = net.concat(image, scalars);
        let embedding = dense(&mut net, "embedding", embedding, EMBEDDING_WIDTH);
        let labels = net.output_head("labels", embedding, n_labels());
        let qualities = net.output_head("qualities", embedding, N_QUALITIES);
        let mut decoded = None;
        for (level, node) in levels.into_iter().enumerate().rev() {
            let name = format!("up{level}");
            let mut level_features = net.conv(&name, node, Kernel::POINTWISE, WIDTH);
            if let Some(coarser) = decoded {
                let coarser = net.upsample(coarser);
                level_features = net.add(level_features, coarser);
            }
            decoded = Some(match level {
                0 => level_features,
                _ => decoder_block(&mut net, &format!("{name}.block"), level_features, WIDTH),
            });
        }
        let last = net.norm_relu("last.norm", decoded.expect("there are levels"));
        let mask = net.output_head("mask", last, 1);
        RoiNetwork { network: net, labels, qualities, mask }
    }

    /// Returns the shapes of both inputs for a number of proposals.
    pub fn input_shapes(n: usize) -> [Shape; 2] {
        [
            Shape { n, height: SIDE, width: SIDE, channels: N_CHANNELS },
            Shape { n, height: 1, width: 1, channels: n_scalars() },
        ]
    }
}
