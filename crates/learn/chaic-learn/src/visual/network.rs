//! The paper's network: a convolutional encoder per image and a dense layer for the state. Two
//! layers of 64 units join them, shared by actor and critic.

use std::ops::Range;

use chaic_nn::simd::widest;
use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{Kernel, Network, NodeId, Shape, Tensor, TrainingPass};

use super::actions::{ActionSpace, classes};
use super::observation::{
    IMAGE_CHANNELS, IMAGE_SIZE, MAP, MAP_CHANNELS, N_OPPONENT_FEATURES, N_STATE_FEATURES,
    VisualObservation,
};
use crate::actor_critic::{ActorCritic, ActorCriticOutput, OutputGrad, log_softmax};
use crate::opponent::network::{self as opponent_network, OPPONENT, OpponentInput, OpponentModel};

/// Network architecture without parameter values.
#[derive(Clone, Debug)]
pub struct VisualNetwork {
    network: Network,
    logits: NodeId,
    value: NodeId,
    /// Meaning of the outputs.
    action_space: ActionSpace,
    opponent: OpponentInput,
}

/// Returns the kind in weights files, without the classes.
fn kind(action_space: ActionSpace, opponent: OpponentInput) -> String {
    let name = match action_space {
        ActionSpace::Plans => "chaic visual plan policy 1",
        ActionSpace::Primitives => "chaic primitive policy 2",
    };
    format!("{name}{}", opponent.kind_suffix())
}

/// Separates the kind in weights files from the digest of the classes that actions refer to.
const CLASSES: &str = ", classes ";

/// Returns a digest of the names of [`classes`] in their order.
fn class_digest() -> String {
    let names: Vec<&str> = classes().iter().map(|class| class.info().name).collect();
    weights::digest(names.join("\n").as_bytes())
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

impl VisualNetwork {
    /// Creates the network. Its parameters include those of the opponent model.
    pub fn new(action_space: ActionSpace, opponent: OpponentInput) -> VisualNetwork {
        let mut net = Network::default();
        let image = net.input(PATCH_SIZE * PATCH_SIZE * IMAGE_CHANNELS);
        let map = net.auxiliary_input(MAP_CHANNELS, PATCHES_PER_SIDE / MAP.side);
        let state = net.auxiliary_input(N_STATE_FEATURES, PATCHES_PER_SIDE);
        let has_opponent = opponent != OpponentInput::None;
        let prediction =
            has_opponent.then(|| net.auxiliary_input(N_OPPONENT_FEATURES, PATCHES_PER_SIDE));
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
        let logits = net.output_head("actor", shared, action_space.head_sizes().iter().sum());
        let value = net.output_head("critic", shared, 1);
        if has_opponent {
            net.extra_parameters(OPPONENT, opponent_network::network().network.n_parameters());
        }
        VisualNetwork { network: net, logits, value, action_space, opponent }
    }

    /// Kind in weights files. It has a digest of the classes, if actions refer to classes.
    pub fn kind(&self) -> String {
        let kind = kind(self.action_space, self.opponent);
        match self.action_space {
            ActionSpace::Plans => format!("{kind}{CLASSES}{}", class_digest()),
            ActionSpace::Primitives => kind,
        }
    }

    /// Parses the parameters in a weights file. Files of earlier versions without the digest of the
    /// classes are accepted.
    ///
    /// # Errors
    /// [`WeightsError`] if the file is incomplete, belongs to another network, or was trained with other
    /// classes.
    pub fn read(&self, bytes: &[u8]) -> Result<Vec<f32>, WeightsError> {
        let (found, current) = (weights::kind(bytes)?, self.kind());
        let earlier = without_class_digest(&current);
        if found != current && found != earlier && without_class_digest(&found) == earlier {
            let problem = "trained with other object classes or in another order; train it again";
            return Err(WeightsError::Configuration(problem.to_owned()));
        }
        let expected = if found == earlier { earlier } else { current.as_str() };
        weights::from_bytes(&self.network, bytes, expected)
    }

    /// Meaning of the outputs.
    pub fn action_space(&self) -> ActionSpace {
        self.action_space
    }

    /// Returns the network of this kind in weights files, if there is one. The classes may differ.
    pub fn from_kind(name: &str) -> Option<VisualNetwork> {
        let name = without_class_digest(name);
        let kinds =
            ActionSpace::ALL.into_iter().flat_map(|space| OpponentInput::ALL.map(|o| (space, o)));
        let found = kinds.into_iter().find(|(space, opponent)| kind(*space, *opponent) == name);
        found.map(|(space, opponent)| VisualNetwork::new(space, opponent))
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

/// Returns a kind in weights files without the digest of the classes.
fn without_class_digest(kind: &str) -> &str {
    kind.split_once(CLASSES).map_or(kind, |(before, _)| before)
}

/// Returns the log-probabilities of all combinations of independent choices, the last choice varying
/// fastest, given the logits of each.
fn joint_log_probs(logits: &[f32], head_sizes: &[usize]) -> Vec<f32> {
    let mut joint = vec![0.0];
    let mut remaining = logits;
    for size in head_sizes {
        let (head, rest) = remaining.split_at(*size);
        let log_probs = log_softmax(head);
        joint = joint.iter().flat_map(|a| log_probs.iter().map(move |b| a + b)).collect();
        remaining = rest;
    }
    joint
}

/// Sums gradients with respect to the joint logits into gradients with respect to the logits of
/// each independent choice: the backward pass of [`joint_log_probs`].
fn sum_by_head(joint: &[f32], head_sizes: &[usize], sums: &mut [f32]) {
    let mut first = 0;
    let mut n_later: usize = head_sizes.iter().product();
    for size in head_sizes {
        n_later /= size;
        let head = &mut sums[first..first + size];
        head.fill(0.0);
        for (k, grad) in joint.iter().enumerate() {
            head[k / n_later % size] += grad;
        }
        first += size;
    }
}

fn layer(net: &mut Network, name: &str, from: NodeId, kernel: Kernel, channels: usize) -> NodeId {
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

impl VisualNetwork {
    /// Creates the buffers of a pass.
    pub fn pass(&self) -> TrainingPass {
        TrainingPass::new(&self.network, widest())
    }
}

impl ActorCritic for VisualNetwork {
    type Observation = VisualObservation;

    fn network(&self) -> &Network {
        &self.network
    }

    fn forward<'a>(
        &self,
        parameters: &[f32],
        observations: impl Iterator<Item = &'a VisualObservation> + Clone,
        pass: &mut TrainingPass,
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
        let tensor =
            |size: usize, channels: usize, bytes: fn(&VisualObservation) -> &[u8], scale: f32| {
                let shape = Shape { n, height: size, width: size, channels };
                let mut data = Vec::with_capacity(n * shape.len_per_item());
                for observation in observations.clone() {
                    data.extend(bytes(observation).iter().map(|byte| scale * f32::from(*byte)));
                }
                Tensor { shape, data }
            };
        let map = tensor(MAP.side, MAP_CHANNELS, |s| &s.map, 1.0);
        let state = tensor(1, N_STATE_FEATURES, |s| &s.state, 1.0 / 255.0);
        if self.opponent == OpponentInput::None {
            pass.forward_all(&self.network, parameters, &[&image, &map, &state]);
        } else {
            let opponent = tensor(1, N_OPPONENT_FEATURES, |s| &s.opponent, 1.0 / 255.0);
            pass.forward_all(&self.network, parameters, &[&image, &map, &state, &opponent]);
        }
        let head_sizes = self.action_space.head_sizes();
        let logits = pass.activation(self.logits).data.chunks_exact(head_sizes.iter().sum());
        let outputs = logits.zip(&pass.activation(self.value).data);
        outputs
            .map(|(logits, value)| ActorCriticOutput {
                log_probs: joint_log_probs(logits, &head_sizes),
                values: vec![*value],
            })
            .collect()
    }

    fn backward(
        &self,
        parameters: &[f32],
        grad_outputs: &[OutputGrad],
        pass: &mut TrainingPass,
        grad_parameters: &mut [f32],
    ) {
        pass.zero_gradients();
        let head_sizes = self.action_space.head_sizes();
        let n: usize = head_sizes.iter().sum();
        for (k, grad) in grad_outputs.iter().enumerate() {
            pass.gradient(self.value).data[k] = grad.values[0];
            let to = &mut pass.gradient(self.logits).data[k * n..][..n];
            sum_by_head(&grad.logits, &head_sizes, to);
        }
        pass.backward(&self.network, parameters, grad_parameters);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_choices_have_joint_probabilities_and_separate_gradients() {
        let joint = joint_log_probs(&[0.0, 1.0, 2.0, 0.5, -0.5], &[3, 2]);
        let [a, b] = [log_softmax(&[0.0, 1.0, 2.0]), log_softmax(&[0.5, -0.5])];
        for (k, log_prob) in joint.iter().enumerate() {
            assert!((log_prob - a[k / 2] - b[k % 2]).abs() < 1e-6, "{k}");
        }
        let mut sums = [9.0; 5];
        sum_by_head(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &[3, 2], &mut sums);
        assert_eq!(sums, [3.0, 7.0, 11.0, 9.0, 12.0]);
    }

    /// The bundled weights are older than the digest of the classes, so loading checks only the
    /// number of classes.
    #[test]
    fn the_classes_are_those_of_the_bundled_weights_in_their_order() {
        let names: Vec<&str> = classes().iter().map(|class| class.info().name).collect();
        let trained_with = "apple banana orange shop_banana grape bread burger loaf_bread \
                            croissant pink_donut pepsi_can cocacola_can sprite_can fanta_can \
                            iphone ipod purse key mouse pen pencil_bucket calculator lighter \
                            vase bowl plate tea_tray plastic_basket wicker_basket wood_basket \
                            bamboo_basket backpack kettle navy_chair wood_shelving printer table \
                            television microwave dishwasher drawer piano sofa trashbin \
                            bright_fire_extinguisher";
        assert_eq!(names.join(" "), trained_with);
    }
}
