//! Forward and backward passes through a network while it learns.

use pulp::Arch;

use crate::conv::{self, Patches};
use crate::depthwise::{self, Padded, Zeros};
use crate::elementwise::{AddTo, Mask, Relu, downsample, upsample};
use crate::network::{Layer, Network, Node};
use crate::norm;
use crate::tensor::{Shape, Tensor};

/// One pass over a few maps: what each layer made, and the gradient by it. Memory is used again by the
/// next pass.
#[derive(Clone, Debug)]
pub struct Pass {
    arch: Arch,
    made: Vec<Tensor>,
    gradients: Vec<Tensor>,
    patches: Patches,
    padded: Padded,
    zeros: Zeros,
    /// A gradient by one map.
    by_map: Vec<f32>,
}

impl Pass {
    /// Working space for a network.
    pub fn new(network: &Network, arch: Arch) -> Pass {
        let n = network.layers.len();
        Pass {
            arch,
            made: vec![Tensor::default(); n],
            gradients: vec![Tensor::default(); n],
            patches: Patches::default(),
            padded: Padded::default(),
            zeros: Zeros::default(),
            by_map: Vec::new(),
        }
    }

    /// What a node made.
    pub fn made(&self, node: Node) -> &Tensor {
        &self.made[node.0]
    }

    /// The gradient of the loss by what a node made, for the caller to write it of outputs.
    pub fn gradient(&mut self, node: Node) -> &mut Tensor {
        &mut self.gradients[node.0]
    }

    /// Runs all layers on an input.
    ///
    /// # Panics
    /// As [`Pass::forward_all`].
    pub fn forward(&mut self, network: &Network, numbers: &[f32], input: &Tensor) {
        self.forward_all(network, numbers, &[input]);
    }

    /// Runs all layers on the inputs of a network, in the order in which it was given them.
    ///
    /// # Panics
    /// If there are fewer inputs than the network has, a side of the first is no multiple of [`Network::stride`], another
    /// has another shape than that makes, or maps that are joined have another size than the network says.
    pub fn forward_all(&mut self, network: &Network, numbers: &[f32], inputs: &[&Tensor]) {
        let input = inputs[0];
        let Shape { height, width, .. } = input.shape;
        let stride = network.stride();
        assert!(
            height.is_multiple_of(stride) && width.is_multiple_of(stride),
            "{width} x {height} pixels are no multiple of {stride}"
        );
        let of = |parameter: usize| &numbers[network.parameters()[parameter].range.clone()];
        for (k, layer) in network.layers.iter().enumerate() {
            let (before, rest) = self.made.split_at_mut(k);
            let out = &mut rest[0];
            out.reshape(network.shape_of(Node(k), input.shape));
            match *layer {
                Layer::Input { which } => out.data.copy_from_slice(&inputs[which].data),
                Layer::Conv { from, weights, bias, kernel, channels } => {
                    let map = &before[from.0];
                    let out = (&mut out.data[..], channels);
                    let weights = (of(weights), bias.map(of), kernel);
                    conv::forward(
                        self.arch,
                        (&map.data, map.shape),
                        weights,
                        out,
                        &mut self.patches,
                    );
                }
                Layer::Depthwise { from, weights, side } => {
                    let map = &before[from.0];
                    let n = map.shape.of_one();
                    for (map_data, out) in
                        map.data.chunks_exact(n).zip(out.data.chunks_exact_mut(n))
                    {
                        let (weights, map) = ((of(weights), side), (map_data, map.shape));
                        depthwise::forward(self.arch, map, weights, out, &mut self.zeros);
                    }
                }
                Layer::Norm { from, scale, shift, positive } => {
                    let floor = if positive { 0.0 } else { f32::NEG_INFINITY };
                    let (scale, shift) = (of(scale), of(shift));
                    let (map, out) = (&before[from.0].data[..], &mut out.data[..]);
                    self.arch.dispatch(norm::Forward { map, scale, shift, floor, out });
                }
                Layer::Relu { from } => {
                    let map = &before[from.0];
                    self.arch.dispatch(Relu { map: &map.data, out: &mut out.data });
                }
                Layer::Add { a, b } => {
                    out.data.copy_from_slice(&before[a.0].data);
                    self.arch.dispatch(AddTo { to: &mut out.data, from: &before[b.0].data });
                }
                Layer::Upsample { from } => {
                    let map = &before[from.0];
                    upsample(&map.data, (map.shape.width, map.shape.channels), &mut out.data);
                }
                Layer::Join { from } => out.data.copy_from_slice(&before[from.0].data),
                Layer::Concat { a, b } => {
                    let [a, b] = [a, b].map(|node| &before[node.0]);
                    let of_both = a.data.chunks_exact(a.shape.channels);
                    let of_both = of_both.zip(b.data.chunks_exact(b.shape.channels));
                    for (pixel, (a, b)) in
                        out.data.chunks_exact_mut(out.shape.channels).zip(of_both)
                    {
                        let (to_a, to_b) = pixel.split_at_mut(a.len());
                        to_a.copy_from_slice(a);
                        to_b.copy_from_slice(b);
                    }
                }
            }
        }
    }

    /// Makes the gradient of every output zero, for the caller to write it.
    pub fn begin_backward(&mut self) {
        for (gradient, made) in self.gradients.iter_mut().zip(&self.made) {
            gradient.reset(made.shape);
        }
    }

    /// Adds the gradient by all numbers to `by_numbers`, from what was written to those of the outputs.
    pub fn backward(&mut self, network: &Network, numbers: &[f32], by_numbers: &mut [f32]) {
        let of = |parameter: usize| network.parameters()[parameter].range.clone();
        for (k, layer) in network.layers.iter().enumerate().rev() {
            let (before, rest) = self.gradients.split_at_mut(k);
            let gradient = &mut rest[0];
            let channels = gradient.shape.channels;
            match *layer {
                Layer::Input { .. } => {}
                Layer::Conv { from, weights, bias, kernel, .. } => {
                    if let Some(bias) = bias {
                        let sums = &mut by_numbers[of(bias)];
                        for pixel in gradient.data.chunks_exact(channels) {
                            sums.iter_mut().zip(pixel).for_each(|(sum, g)| *sum += g);
                        }
                    }
                    let map = &self.made[from.0];
                    let g = (&gradient.data[..], channels);
                    let out = (&mut by_numbers[of(weights)], kernel);
                    let maps = (&map.data[..], map.shape);
                    conv::backward_weights(self.arch, maps, out, g, &mut self.patches);
                    if !matches!(network.layers[from.0], Layer::Input { .. }) {
                        let out = (&mut before[from.0].data[..], map.shape);
                        let weights = (&numbers[of(weights)], kernel);
                        conv::backward_map(self.arch, out, weights, g, &mut self.patches);
                    }
                }
                Layer::Depthwise { from, weights, side } => {
                    let map = &self.made[from.0];
                    let n = map.shape.of_one();
                    let out = &mut before[from.0].data;
                    self.by_map.resize(n, 0.0);
                    let by_map = &mut self.by_map;
                    let maps = map.data.chunks_exact(n).zip(gradient.data.chunks_exact(n));
                    for ((map_data, g), out) in maps.zip(out.chunks_exact_mut(n)) {
                        let by_weights = (&mut by_numbers[of(weights)], side);
                        let padded = &mut self.padded;
                        let shape = map.shape;
                        depthwise::backward_weights(
                            self.arch, map_data, g, shape, by_weights, padded,
                        );
                        let weights = (&numbers[of(weights)], side);
                        let zeros = &mut self.zeros;
                        depthwise::backward_map(self.arch, (g, shape), weights, by_map, zeros);
                        self.arch.dispatch(AddTo { to: out, from: by_map });
                    }
                }
                Layer::Norm { from, scale, shift, positive } => {
                    if positive {
                        let made = &self.made[k].data;
                        self.arch.dispatch(Mask { gradient: &mut gradient.data, made });
                    }
                    // Scale and shift stand one after the other.
                    let both = &mut by_numbers[of(scale).start..of(shift).end];
                    let (by_scale, by_shift) = both.split_at_mut(channels);
                    self.arch.dispatch(norm::Backward {
                        map: &self.made[from.0].data,
                        scale: &numbers[of(scale)],
                        gradient: &gradient.data,
                        by_map: &mut before[from.0].data,
                        by_scale,
                        by_shift,
                    });
                }
                Layer::Relu { from } => {
                    let made = &self.made[k].data;
                    self.arch.dispatch(Mask { gradient: &mut gradient.data, made });
                    let to = &mut before[from.0].data;
                    self.arch.dispatch(AddTo { to, from: &gradient.data });
                }
                Layer::Add { a, b } => {
                    for node in [a, b] {
                        let to = &mut before[node.0].data;
                        self.arch.dispatch(AddTo { to, from: &gradient.data });
                    }
                }
                Layer::Concat { a, b } => {
                    let n_a = self.made[a.0].shape.channels;
                    for (node, range) in [(a, 0..n_a), (b, n_a..channels)] {
                        let to = before[node.0].data.chunks_exact_mut(range.len());
                        for (to, pixel) in to.zip(gradient.data.chunks_exact(channels)) {
                            to.iter_mut().zip(&pixel[range.clone()]).for_each(|(to, g)| *to += g);
                        }
                    }
                }
                Layer::Upsample { from } => downsample(gradient, &mut before[from.0]),
                Layer::Join { from } => {
                    let to = &mut before[from.0].data;
                    self.arch.dispatch(AddTo { to, from: &gradient.data });
                }
            }
        }
    }
}
