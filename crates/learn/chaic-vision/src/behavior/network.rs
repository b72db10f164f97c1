//! The network: strided convolutions over each crop, then pairs of pairs of moments.

use chaic_nn::simd::widest;
use chaic_nn::weights::WeightsError;
use chaic_nn::{Kernel, Network, Node, Pass, Shape, Tensor, weights};

use super::Behavior;
use super::clip::{CROPS, Look, N_CHANNELS, read};
use super::crop::{Crop, SIDE};

/// Channels after each convolution over a crop; each halves its sides.
const OF_CROP: [usize; 4] = [16, 32, 48, 64];
/// Numbers of one moment, and after each joining of two.
const OF_MOMENT: usize = 64;
const OF_PAIRS: [usize; 5] = [96, 96, 128, 128, 128];

/// The network.
#[derive(Clone, Debug)]
pub struct BehaviorNetwork {
    /// All layers.
    pub network: Network,
    /// A number for each behavior, the greatest of which is the likeliest.
    pub head: Node,
}

impl Default for BehaviorNetwork {
    fn default() -> BehaviorNetwork {
        BehaviorNetwork::new()
    }
}

impl BehaviorNetwork {
    /// The one that is trained and shipped.
    pub fn new() -> BehaviorNetwork {
        let mut net = Network::default();
        let mut at = net.input(N_CHANNELS);
        let mut side = SIDE;
        for (k, channels) in OF_CROP.into_iter().enumerate() {
            at = net.conv(&format!("crop{k}"), at, Kernel { side: 3, stride: 2 }, channels);
            at = net.norm_relu(&format!("crop{k}.norm"), at);
            side /= 2;
        }
        at = net.flatten(at, side);
        at = net.conv("moment", at, Kernel::POINTWISE, OF_MOMENT);
        at = net.norm_relu("moment.norm", at);
        for (k, channels) in OF_PAIRS.into_iter().enumerate() {
            at = net.pair(at);
            at = net.conv(&format!("pair{k}"), at, Kernel::POINTWISE, channels);
            at = net.norm_relu(&format!("pair{k}.norm"), at);
        }
        let head = net.head("head", at, Behavior::ALL.len());
        BehaviorNetwork { network: net, head }
    }

    /// The shape of what it reads of so many clips.
    pub fn input_shape(clips: usize) -> Shape {
        Shape { n: clips * CROPS, height: SIDE, width: SIDE, channels: N_CHANNELS }
    }
}

/// A trained network: its numbers, and how sure it is of what it says.
#[derive(Clone, Debug)]
pub struct TrainedBehavior {
    /// The network.
    pub network: BehaviorNetwork,
    /// Its numbers.
    pub numbers: Vec<f32>,
    /// What its outputs are multiplied by before they become probabilities (temperature scaling, Guo
    /// et al. 2017).
    pub sharpness: f32,
}

/// What files of it say that they are.
const KIND: &str = "chaic behavior 1";

/// All that is in its file.
fn of_file(network: &BehaviorNetwork) -> Network {
    let mut network = network.network.clone();
    network.aside("sharpness", 1);
    network
}

impl TrainedBehavior {
    /// The one that comes with chaic: weights/README.md says how it was made and how good it is.
    pub fn built_in() -> TrainedBehavior {
        let bytes = include_bytes!("../../weights/behavior.safetensors");
        TrainedBehavior::from_bytes(bytes).expect("a test reads it")
    }

    /// From a safetensors file.
    ///
    /// # Errors
    /// [`WeightsError`] if it isn't a whole file of this network's weights.
    pub fn from_bytes(bytes: &[u8]) -> Result<TrainedBehavior, WeightsError> {
        let network = BehaviorNetwork::new();
        let mut numbers = weights::from_bytes(&of_file(&network), bytes, KIND)?;
        let sharpness = numbers.pop().unwrap_or(1.0);
        Ok(TrainedBehavior { network, numbers, sharpness })
    }

    /// Returns it as a safetensors file.
    ///
    /// # Errors
    /// If a number is not finite.
    pub fn to_bytes(&self) -> Result<Vec<u8>, WeightsError> {
        weights::to_bytes(&of_file(&self.network), &self.all_numbers(), KIND)
    }

    fn all_numbers(&self) -> Vec<f32> {
        self.numbers.iter().chain([&self.sharpness]).copied().collect()
    }

    /// The first digits of the digest of its file, which name it.
    pub fn digest(&self) -> String {
        weights::digest_of(&of_file(&self.network), &self.all_numbers(), KIND)
    }

    /// Working space.
    pub fn pass(&self) -> Pass {
        Pass::new(&self.network.network, widest())
    }

    /// The network's outputs for [`CROPS`] crops.
    pub fn outputs(&self, crops: &[Crop], first: usize, pass: &mut Pass) -> Outputs {
        let mut input = Tensor::zeros(BehaviorNetwork::input_shape(1));
        read(crops, &Look::plain(first), &mut input.data);
        pass.forward(&self.network.network, &self.numbers, &input);
        let made = &pass.made(self.network.head).data;
        std::array::from_fn(|k| made[k])
    }

    /// The probability of each behavior.
    pub fn probabilities(&self, outputs: &Outputs) -> Outputs {
        softmax(&outputs.map(|x| self.sharpness * x))
    }
}

/// A number for each behavior.
pub type Outputs = [f32; Behavior::ALL.len()];

/// Probabilities of outputs.
pub fn softmax(outputs: &Outputs) -> Outputs {
    let most = outputs.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let powers = outputs.map(|x| crate::loss::exp(x - most));
    let sum: f32 = powers.iter().sum();
    powers.map(|x| x / sum)
}
