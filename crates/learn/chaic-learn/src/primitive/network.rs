//! The paper's network: a convolutional one for each image, layers for numbers, what they make joined, two layers to
//! 64 that actor and critic share.

use chaic_nn::simd::widest;
use chaic_nn::{Kernel, Network, Node, Pass, Shape, Tensor};

use super::ACTIONS;
use super::seen::{IMAGE_CHANNELS, IMAGE_SIDE, MAP, MAP_CHANNELS, N_STATE, Seen};
use crate::actor_critic::{ActorCritic, BySaid, Said, log_softmax};

/// The network without its numbers.
#[derive(Clone, Debug)]
pub struct PrimitiveNetwork {
    network: Network,
    logits: Node,
    value: Node,
}

/// Side of the patches of an image that become one pixel of the first map, whose products are then large enough to
/// be quick (as in vision transformers, Dosovitskiy et al. 2021).
const PATCH: usize = 4;
/// Patches along a side.
const PATCHES: usize = IMAGE_SIDE / PATCH;
const DOWN: Kernel = Kernel { side: 3, stride: 2 };
/// How much the sides of an image's last map are divided by.
const LAST_SIDE: usize = 8;
/// What each input becomes.
const N_FEATURES: usize = 64;
/// What the shared layers make (paper, appendix on learning).
const N_SHARED: usize = 64;

impl Default for PrimitiveNetwork {
    fn default() -> PrimitiveNetwork {
        let mut net = Network::default();
        let image = net.input(PATCH * PATCH * IMAGE_CHANNELS);
        let map = net.side_input(MAP_CHANNELS, PATCHES / MAP.side);
        let state = net.side_input(N_STATE, PATCHES);
        let mut of_image = layer(&mut net, "image.patches", image, Kernel::POINTWISE, 32);
        for k in 0..2 {
            of_image = layer(&mut net, &format!("image{k}"), of_image, DOWN, 32);
        }
        let mut of_map = map;
        for (k, channels) in [16, 32].into_iter().enumerate() {
            of_map = layer(&mut net, &format!("map{k}"), of_map, DOWN, channels);
        }
        let [of_image, of_map] = [("image", of_image), ("map", of_map)].map(|(name, maps)| {
            let flat = net.flatten(maps, LAST_SIDE);
            layer(&mut net, &format!("{name}.dense"), flat, Kernel::POINTWISE, N_FEATURES)
        });
        let of_state = layer(&mut net, "state.dense", state, Kernel::POINTWISE, N_FEATURES);
        let both = net.concat(of_image, of_map);
        let mut shared = net.concat(both, of_state);
        for k in 0..2 {
            shared = layer(&mut net, &format!("shared{k}"), shared, Kernel::POINTWISE, N_SHARED);
        }
        let logits = net.head("actor", shared, ACTIONS.len());
        let value = net.head("critic", shared, 1);
        PrimitiveNetwork { network: net, logits, value }
    }
}

fn layer(net: &mut Network, name: &str, from: Node, kernel: Kernel, channels: usize) -> Node {
    let made = net.conv(name, from, kernel, channels);
    net.norm_relu(&format!("{name}.norm"), made)
}

/// The bytes of an image, patch by patch.
fn in_patches(image: &[u8]) -> impl Iterator<Item = u8> + '_ {
    let row_of_patch = PATCH * IMAGE_CHANNELS;
    (0..PATCHES * PATCHES * PATCH).flat_map(move |k| {
        let (patch, row) = (k / PATCH, k % PATCH);
        let (y, x) = (patch / PATCHES * PATCH + row, patch % PATCHES * PATCH);
        let begin = (y * IMAGE_SIDE + x) * IMAGE_CHANNELS;
        image[begin..begin + row_of_patch].iter().copied()
    })
}

impl PrimitiveNetwork {
    /// Working space.
    pub fn pass(&self) -> Pass {
        Pass::new(&self.network, widest())
    }
}

impl ActorCritic for PrimitiveNetwork {
    type Seen = Seen;

    fn network(&self) -> &Network {
        &self.network
    }

    fn forward<'a>(
        &self,
        numbers: &[f32],
        seen: impl Iterator<Item = &'a Seen> + Clone,
        pass: &mut Pass,
    ) -> Vec<Said> {
        let n = seen.clone().count();
        let bytes = seen.clone().flat_map(|s| in_patches(&s.image));
        let image = Tensor {
            shape: Shape {
                n,
                height: PATCHES,
                width: PATCHES,
                channels: PATCH * PATCH * IMAGE_CHANNELS,
            },
            data: bytes.map(|byte| f32::from(byte) / 255.0).collect(),
        };
        let tensor =
            |side: usize, channels: usize, of: &dyn Fn(&'a Seen) -> &'a [u8], scale: f32| {
                let shape = Shape { n, height: side, width: side, channels };
                let data = seen.clone().flat_map(of).map(|byte| scale * f32::from(*byte)).collect();
                Tensor { shape, data }
            };
        let map = tensor(MAP.side, MAP_CHANNELS, &|s| &s.map, 1.0);
        let state = tensor(1, N_STATE, &|s| &s.state, 1.0 / 255.0);
        pass.forward_all(&self.network, numbers, &[&image, &map, &state]);
        let logits = pass.made(self.logits).data.chunks_exact(ACTIONS.len());
        let said = logits.zip(&pass.made(self.value).data);
        said.map(|(logits, value)| Said {
            log_probabilities: log_softmax(logits),
            of_state: vec![*value],
        })
        .collect()
    }

    fn backward(&self, numbers: &[f32], by: &[BySaid], pass: &mut Pass, by_numbers: &mut [f32]) {
        pass.begin_backward();
        for (k, by) in by.iter().enumerate() {
            pass.gradient(self.value).data[k] = by.of_state[0];
            let to = &mut pass.gradient(self.logits).data[k * ACTIONS.len()..][..ACTIONS.len()];
            to.copy_from_slice(&by.logits);
        }
        pass.backward(&self.network, numbers, by_numbers);
    }
}
