//! The paper's network: a convolutional encoder per image and a dense layer for the state. Two
//! layers of 64 units join them, shared by actor and critic.

use std::ops::Range;

use chaic_nn::simd::widest;
use chaic_nn::{Kernel, Network, Node, Pass, Shape, Tensor};

use super::ACTIONS;
use super::observation::{
    IMAGE_CHANNELS, IMAGE_SIZE, MAP, MAP_CHANNELS, N_OPPONENT, N_STATE, PrimitiveObservation,
};
use crate::actor_critic::{ActorCritic, ActorCriticOutput, OutputGrad, log_softmax};
use crate::opponent::network::{self as opponent_network, OPPONENT, OpponentInput, OpponentModel};

/// Network architecture without parameter values.
#[derive(Clone, Debug)]
pub struct PrimitiveNetwork {
    network: Network,
    logits: Node,
    value: Node,
    opponent: OpponentInput,
}

/// Returns the kind in weights files.
fn kind(opponent: OpponentInput) -> String {
    format!("chaic primitive policy 2{}", opponent.kind_suffix())
}

/// Size of the image patches that become one pixel of the first map, as in vision transformers
/// (Dosovitskiy et al. 2021). The matrix products are then large enough to be fast.
const PATCH_SIZE: usize = 4;
/// Patches per row and column.
const PATCHES_PER_SIDE: usize = IMAGE_SIZE / PATCH_SIZE;
const DOWNSAMPLE: Kernel = Kernel { size: 3, stride: 2 };
/// Width and height of the last map of an encoder, pixels.
const LAST_MAP_SIZE: usize = 4;
/// Number of features of each input.
const N_FEATURES: usize = 64;
/// Width of the shared layers (paper, appendix on learning).
const N_SHARED: usize = 64;

impl PrimitiveNetwork {
    /// Creates the network. Its parameters include those of the opponent model.
    pub fn new(opponent: OpponentInput) -> PrimitiveNetwork {
        let mut net = Network::default();
        let image = net.input(PATCH_SIZE * PATCH_SIZE * IMAGE_CHANNELS);
        let map = net.auxiliary_input(MAP_CHANNELS, PATCHES_PER_SIDE / MAP.side);
        let state = net.auxiliary_input(N_STATE, PATCHES_PER_SIDE);
        let has_opponent = opponent != OpponentInput::None;
        let prediction = has_opponent.then(|| net.auxiliary_input(N_OPPONENT, PATCHES_PER_SIDE));
        let mut image_features = layer(&mut net, "image.patches", image, Kernel::POINTWISE, 32);
        for k in 0..3 {
            image_features = layer(&mut net, &format!("image{k}"), image_features, DOWNSAMPLE, 32);
        }
        let mut map_features = map;
        for (k, channels) in [16, 32, 32].into_iter().enumerate() {
            map_features = layer(&mut net, &format!("map{k}"), map_features, DOWNSAMPLE, channels);
        }
        let [image_features, map_features] = [("image", image_features), ("map", map_features)]
            .map(|(name, maps)| {
                let flat = net.flatten(maps, LAST_MAP_SIZE);
                layer(&mut net, &format!("{name}.dense"), flat, Kernel::POINTWISE, N_FEATURES)
            });
        let state_features = layer(&mut net, "state.dense", state, Kernel::POINTWISE, N_FEATURES);
        let image_and_map = net.concat(image_features, map_features);
        let mut shared = net.concat(image_and_map, state_features);
        if let Some(prediction) = prediction {
            let kernel = Kernel::POINTWISE;
            let features = layer(&mut net, "opponent.dense", prediction, kernel, N_FEATURES);
            shared = net.concat(shared, features);
        }
        for k in 0..2 {
            shared = layer(&mut net, &format!("shared{k}"), shared, Kernel::POINTWISE, N_SHARED);
        }
        let logits = net.output_head("actor", shared, ACTIONS.len());
        let value = net.output_head("critic", shared, 1);
        if has_opponent {
            net.extra_parameters(OPPONENT, opponent_network::network().network.n_parameters());
        }
        PrimitiveNetwork { network: net, logits, value, opponent }
    }

    /// Kind in weights files.
    pub fn kind(&self) -> String {
        kind(self.opponent)
    }

    /// Returns the network of this kind in weights files, if there is one.
    pub fn from_kind(name: &str) -> Option<PrimitiveNetwork> {
        let input = OpponentInput::ALL.into_iter().find(|input| kind(*input) == name);
        input.map(PrimitiveNetwork::new)
    }

    /// Returns the range of the opponent model's parameters, if there is one.
    pub(crate) fn opponent_range(&self) -> Option<Range<usize>> {
        let found = self.network.parameters().iter().find(|p| p.name == OPPONENT);
        found.map(|parameter| parameter.range.clone())
    }

    /// Returns the opponent model among the parameters of the network.
    pub(crate) fn opponent(&self, parameters: &[f32]) -> Option<OpponentModel> {
        let parameters = parameters[self.opponent_range()?].to_vec();
        Some(OpponentModel::new(parameters, self.opponent == OpponentInput::Granted))
    }
}

fn layer(net: &mut Network, name: &str, from: Node, kernel: Kernel, channels: usize) -> Node {
    let output = net.conv(name, from, kernel, channels);
    net.norm_relu(&format!("{name}.norm"), output)
}

/// Writes an image in patch order, 0 to 1 for 0 to 255.
fn write_patches(image: &[u8], patches: &mut [f32]) {
    const PATCH_ROW: usize = PATCH_SIZE * IMAGE_CHANNELS;
    for (y, row) in image.chunks_exact(IMAGE_SIZE * IMAGE_CHANNELS).enumerate() {
        let first = y / PATCH_SIZE * PATCHES_PER_SIDE;
        for (x, from) in row.as_chunks::<PATCH_ROW>().0.iter().enumerate() {
            let to = ((first + x) * PATCH_SIZE + y % PATCH_SIZE) * PATCH_ROW;
            let to = &mut patches[to..to + PATCH_ROW];
            to.iter_mut().zip(from).for_each(|(to, byte)| *to = f32::from(*byte) / 255.0);
        }
    }
}

impl PrimitiveNetwork {
    /// Creates the buffers of a pass.
    pub fn pass(&self) -> Pass {
        Pass::new(&self.network, widest())
    }
}

impl ActorCritic for PrimitiveNetwork {
    type Observation = PrimitiveObservation;

    fn network(&self) -> &Network {
        &self.network
    }

    fn forward<'a>(
        &self,
        parameters: &[f32],
        observations: impl Iterator<Item = &'a PrimitiveObservation> + Clone,
        pass: &mut Pass,
    ) -> Vec<ActorCriticOutput> {
        let n = observations.clone().count();
        let mut image = Tensor::zeros(Shape {
            n,
            height: PATCHES_PER_SIDE,
            width: PATCHES_PER_SIDE,
            channels: PATCH_SIZE * PATCH_SIZE * IMAGE_CHANNELS,
        });
        let images = image.data.chunks_exact_mut(image.shape.len_per_item());
        observations.clone().zip(images).for_each(|(s, to)| write_patches(&s.image, to));
        let tensor = |size: usize,
                      channels: usize,
                      bytes: fn(&PrimitiveObservation) -> &[u8],
                      scale: f32| {
            let shape = Shape { n, height: size, width: size, channels };
            let mut data = Vec::with_capacity(n * shape.len_per_item());
            for observation in observations.clone() {
                data.extend(bytes(observation).iter().map(|byte| scale * f32::from(*byte)));
            }
            Tensor { shape, data }
        };
        let map = tensor(MAP.side, MAP_CHANNELS, |s| &s.map, 1.0);
        let state = tensor(1, N_STATE, |s| &s.state, 1.0 / 255.0);
        if self.opponent == OpponentInput::None {
            pass.forward_all(&self.network, parameters, &[&image, &map, &state]);
        } else {
            let opponent = tensor(1, N_OPPONENT, |s| &s.opponent, 1.0 / 255.0);
            pass.forward_all(&self.network, parameters, &[&image, &map, &state, &opponent]);
        }
        let logits = pass.activation(self.logits).data.chunks_exact(ACTIONS.len());
        let outputs = logits.zip(&pass.activation(self.value).data);
        outputs
            .map(|(logits, value)| ActorCriticOutput {
                log_probs: log_softmax(logits),
                values: vec![*value],
            })
            .collect()
    }

    fn backward(
        &self,
        parameters: &[f32],
        grad_outputs: &[OutputGrad],
        pass: &mut Pass,
        grad_parameters: &mut [f32],
    ) {
        pass.zero_gradients();
        for (k, grad) in grad_outputs.iter().enumerate() {
            pass.gradient(self.value).data[k] = grad.values[0];
            let to = &mut pass.gradient(self.logits).data[k * ACTIONS.len()..][..ACTIONS.len()];
            to.copy_from_slice(&grad.logits);
        }
        pass.backward(&self.network, parameters, grad_parameters);
    }
}
