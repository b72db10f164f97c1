//! Behavior network: strided convolutions over each crop, convolutions over time, then a binary
//! tree over time.

use chaic_nn::simd::widest;
use chaic_nn::weights::WeightsError;
use chaic_nn::{Kernel, Network, NodeId, Shape, Tensor, TrainingPass, weights};

use super::Behavior;
use super::calibration::{BehaviorScores, Calibration};
use super::clip::{CROPS, ClipAugmentation, N_CHANNELS, fill_input};
use super::crop::{PersonCrop, SIDE};

/// Channels after each convolution of a crop; each halves the resolution.
const CROP_CHANNELS: [usize; 4] = [32, 48, 80, 112];
/// Channels of a crop's embedding.
const EMBEDDING_CHANNELS: usize = 64;
/// Residual layers that read the previous, the same and the next crop.
const TEMPORAL_LAYERS: usize = 2;
const TREE_CHANNELS: [usize; 5] = [96, 96, 128, 128, 128];

/// Behavior network.
#[derive(Clone, Debug)]
pub struct BehaviorNetwork {
    /// All layers.
    pub network: Network,
    /// Logit of each behavior.
    pub head: NodeId,
}

impl Default for BehaviorNetwork {
    fn default() -> BehaviorNetwork {
        BehaviorNetwork::new()
    }
}

impl BehaviorNetwork {
    /// Creates the network that is trained and bundled.
    pub fn new() -> BehaviorNetwork {
        let mut net = Network::default();
        let mut features = net.input(N_CHANNELS);
        let mut size = SIDE;
        for (k, channels) in CROP_CHANNELS.into_iter().enumerate() {
            features =
                net.conv(&format!("crop{k}"), features, Kernel { size: 3, stride: 2 }, channels);
            features = net.norm_relu(&format!("crop{k}.norm"), features);
            size /= 2;
        }
        features = net.flatten(features, size);
        features = net.conv("moment", features, Kernel::POINTWISE, EMBEDDING_CHANNELS);
        features = net.norm_relu("moment.norm", features);
        for k in 0..TEMPORAL_LAYERS {
            let neighbors = net.concat_neighbors(features, CROPS);
            let name = format!("time{k}");
            let change = net.conv(&name, neighbors, Kernel::POINTWISE, EMBEDDING_CHANNELS);
            let change = net.norm_relu(&format!("{name}.norm"), change);
            features = net.add(features, change);
        }
        for (k, channels) in TREE_CHANNELS.into_iter().enumerate() {
            features = net.concat_pairs(features);
            features = net.conv(&format!("pair{k}"), features, Kernel::POINTWISE, channels);
            features = net.norm_relu(&format!("pair{k}.norm"), features);
        }
        let head = net.output_head("head", features, Behavior::ALL.len());
        BehaviorNetwork { network: net, head }
    }

    /// Returns the shape of the input for a number of clips.
    pub fn input_shape(clips: usize) -> Shape {
        Shape { n: clips * CROPS, height: SIDE, width: SIDE, channels: N_CHANNELS }
    }
}

/// Trained network with its calibration.
#[derive(Clone, Debug)]
pub struct TrainedBehavior {
    /// The network.
    pub network: BehaviorNetwork,
    /// Parameters of the network.
    pub parameters: Vec<f32>,
    /// Calibration of its probabilities.
    pub calibration: Calibration,
}

/// Kind in weights files.
const KIND: &str = "chaic behavior 4";

/// Returns the network together with the calibration of the file.
fn file_layout(network: &BehaviorNetwork) -> Network {
    let mut network = network.network.clone();
    network.extra_parameters("inverse_temperature", 1);
    network.extra_parameters("class_bias", Behavior::ALL.len());
    network
}

impl TrainedBehavior {
    /// Returns the network that is part of chaic; weights/README.md documents its training and accuracy.
    pub fn built_in() -> TrainedBehavior {
        let bytes = include_bytes!("../../weights/behavior.safetensors");
        TrainedBehavior::from_bytes(bytes).expect("a test reads the bundled weights")
    }

    /// Reads a safetensors file.
    ///
    /// # Errors
    /// [`WeightsError`] if the file is damaged or holds weights of another network.
    pub fn from_bytes(bytes: &[u8]) -> Result<TrainedBehavior, WeightsError> {
        let network = BehaviorNetwork::new();
        let mut parameters = weights::from_bytes(&file_layout(&network), bytes, KIND)?;
        let extra = parameters.split_off(network.network.n_parameters());
        let calibration = Calibration {
            inverse_temperature: extra[0],
            class_bias: std::array::from_fn(|k| extra[1 + k]),
        };
        Ok(TrainedBehavior { network, parameters, calibration })
    }

    /// Writes a safetensors file.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub fn to_bytes(&self) -> Result<Vec<u8>, WeightsError> {
        weights::to_bytes(&file_layout(&self.network), &self.all_parameters(), KIND)
    }

    fn all_parameters(&self) -> Vec<f32> {
        let Calibration { inverse_temperature, class_bias } = &self.calibration;
        self.parameters.iter().chain([inverse_temperature]).chain(class_bias).copied().collect()
    }

    /// Returns the digest of the weights file, twelve hexadecimal digits.
    pub fn digest(&self) -> String {
        weights::digest_of(&file_layout(&self.network), &self.all_parameters(), KIND)
    }

    /// Creates buffers for inference with the current parameters.
    pub fn pass(&self) -> TrainingPass {
        TrainingPass::with_constant_parameters(&self.network.network, &self.parameters, widest())
    }

    /// Returns the logits of [`CROPS`] crops; `pass` is one of [`TrainedBehavior::pass`].
    pub fn outputs(
        &self,
        crops: &[PersonCrop],
        first: usize,
        pass: &mut TrainingPass,
    ) -> BehaviorScores {
        let mut input = Tensor::zeros(BehaviorNetwork::input_shape(1));
        fill_input(crops, &ClipAugmentation::identity(first), &mut input.data);
        pass.forward(&self.network.network, &self.parameters, &input);
        let logits = &pass.activation(self.network.head).data;
        std::array::from_fn(|k| logits[k])
    }

    /// Returns the probability of each behavior in clips that are as frequent as helpers see them.
    pub fn probabilities(&self, logits: &BehaviorScores) -> BehaviorScores {
        self.calibration.probabilities(logits)
    }
}
