//! Forward and backward passes for training.

use std::ops::Range;
use std::sync::Arc;

use pulp::Arch;

use crate::attention::{Attention, AttentionGrad};
use crate::conv::{self, Im2colBuffers};
use crate::depthwise::{self, PaddedMap, ZeroRow};
use crate::elementwise::{
    AddTo, Relu, ReluGrad, Sum, add_neighbor_gradients, concat_neighbors, downsample, upsample,
};
use crate::gemm::PackedMatrix;
use crate::inference::pack_weights;
use crate::network::{Layer, Network, NodeId};
use crate::norm;
use crate::tensor::{Shape, Tensor, TensorView};

/// Activations and gradients of one pass over a batch. The next pass reuses the memory.
#[derive(Clone, Debug)]
pub struct TrainingPass {
    arch: Arch,
    /// Packed weights by layer if the parameters are constant; otherwise empty.
    packed: Arc<[PackedMatrix]>,
    activations: Vec<Tensor>,
    gradients: Vec<Tensor>,
    im2col: Im2colBuffers,
    padded: PaddedMap,
    zeros: ZeroRow,
    /// Gradient of one map.
    grad_map: Vec<f32>,
    /// Numbers of consecutive rows that attend to each other; empty if all rows attend to each
    /// other.
    groups: Vec<usize>,
    /// Weights of each attention layer.
    attention_weights: Vec<Vec<f32>>,
    attention_grad: AttentionGrad,
}

impl TrainingPass {
    /// Creates the buffers for a network.
    pub fn new(network: &Network, arch: Arch) -> TrainingPass {
        let n = network.layers.len();
        TrainingPass {
            arch,
            packed: Arc::default(),
            activations: vec![Tensor::default(); n],
            gradients: vec![Tensor::default(); n],
            im2col: Im2colBuffers::default(),
            padded: PaddedMap::default(),
            zeros: ZeroRow::default(),
            grad_map: Vec::new(),
            groups: Vec::new(),
            attention_weights: vec![Vec::new(); n],
            attention_grad: AttentionGrad::default(),
        }
    }

    /// Creates the buffers for forward passes that all use these parameters. Weights of dense
    /// convolutions are packed once, and copies share them. Later calls with other parameters still
    /// use the packed weights.
    pub fn with_constant_parameters(
        network: &Network,
        parameters: &[f32],
        arch: Arch,
    ) -> TrainingPass {
        let packed: Arc<[PackedMatrix]> = pack_weights(network, parameters, arch).into();
        TrainingPass { packed, ..TrainingPass::new(network, arch) }
    }

    /// Divides the rows of the next batches into groups of these sizes; attention layers relate the
    /// rows of a group. Without groups, all rows are one group.
    pub fn set_groups(&mut self, sizes: impl Iterator<Item = usize>) {
        self.groups.clear();
        self.groups.extend(sizes);
    }

    /// Returns the group sizes of [`TrainingPass::set_groups`].
    pub fn groups(&self) -> &[usize] {
        &self.groups
    }

    /// Returns the output of a node.
    pub fn activation(&self, node: NodeId) -> &Tensor {
        &self.activations[node.0]
    }

    /// Returns the gradient of the loss with respect to a node's output. Callers write those of the
    /// output heads.
    pub fn gradient(&mut self, node: NodeId) -> &mut Tensor {
        &mut self.gradients[node.0]
    }

    /// Runs all layers on an input.
    ///
    /// # Panics
    /// As [`TrainingPass::forward_all`].
    pub fn forward(&mut self, network: &Network, parameters: &[f32], input: &Tensor) {
        self.forward_all(network, parameters, &[input]);
    }

    /// Runs all layers on the inputs of a network, in the order in which they were added.
    ///
    /// # Panics
    /// If inputs are missing or have the wrong shape, or width or height of the first is not a
    /// multiple of [`Network::stride`], or the groups do not add up to the rows of an attention
    /// layer.
    pub fn forward_all(&mut self, network: &Network, parameters: &[f32], inputs: &[&Tensor]) {
        self.forward_up_to(network, parameters, inputs, NodeId(network.layers.len() - 1));
    }

    /// Runs the layers up to a node on the inputs of a network, as [`TrainingPass::forward_all`].
    ///
    /// # Panics
    /// As [`TrainingPass::forward_all`].
    pub fn forward_up_to(
        &mut self,
        network: &Network,
        parameters: &[f32],
        inputs: &[&Tensor],
        last: NodeId,
    ) {
        let shape = inputs[0].shape;
        let Shape { height, width, .. } = shape;
        let stride = network.stride();
        assert!(
            height.is_multiple_of(stride) && width.is_multiple_of(stride),
            "{width} x {height} pixels are not multiples of {stride}"
        );
        self.run_layers(network, parameters, inputs, shape, 0..last.0 + 1);
    }

    /// Runs the layers after a node on one map of a batch. The pass `batch` has run the layers up to
    /// the node ([`TrainingPass::forward_up_to`]). Activations are bit-identical to those of a
    /// whole batch.
    ///
    /// # Panics
    /// If there are inputs after the node, or a layer combines maps of the batch.
    pub fn forward_map_after(
        &mut self,
        network: &Network,
        parameters: &[f32],
        batch: &TrainingPass,
        last: NodeId,
        map: usize,
    ) {
        let first = last.0 + 1;
        let input_shape = Shape { n: 1, ..batch.activations[0].shape };
        let read = network.layers[first..].iter().flat_map(Layer::inputs);
        for from in read.filter(|from| from.0 < first) {
            let shape = network.shape_of(from, input_shape);
            assert_eq!(shape.n, 1, "a layer combines maps of the batch");
            let (to, n) = (&mut self.activations[from.0], shape.len());
            to.reshape(shape);
            to.data.copy_from_slice(&batch.activations[from.0].data[map * n..][..n]);
        }
        self.run_layers(network, parameters, &[], input_shape, first..network.layers.len());
    }

    /// Runs some layers; the first input of the network has the shape `input_shape`.
    fn run_layers(
        &mut self,
        network: &Network,
        parameters: &[f32],
        inputs: &[&Tensor],
        input_shape: Shape,
        layers: Range<usize>,
    ) {
        let values = |parameter: usize| &parameters[network.parameters()[parameter].range.clone()];
        for k in layers {
            let (earlier, later) = self.activations.split_at_mut(k);
            let out = &mut later[0];
            out.reshape(network.shape_of(NodeId(k), input_shape));
            match network.layers[k] {
                Layer::Input { index } => out.data.copy_from_slice(&inputs[index].data),
                Layer::Conv { from, weights, bias, kernel, .. } => {
                    let (input, out) = (earlier[from.0].view(), &mut out.data);
                    let (arch, bias, buffers) = (self.arch, bias.map(values), &mut self.im2col);
                    if let Some(packed) = self.packed.get(k) {
                        let edges = &mut buffers.edges;
                        conv::forward_packed(arch, input, packed, bias, kernel, out, edges);
                    } else {
                        conv::forward(arch, input, values(weights), bias, kernel, out, buffers);
                    }
                }
                Layer::Depthwise { from, weights, kernel_size } => {
                    let TensorView { data, shape } = earlier[from.0].view();
                    let (n, weights) = (shape.len_per_item(), values(weights));
                    for (map, out) in data.chunks_exact(n).zip(out.data.chunks_exact_mut(n)) {
                        let (map, zeros) = (TensorView::new(map, shape), &mut self.zeros);
                        depthwise::forward(self.arch, map, weights, kernel_size, out, zeros);
                    }
                }
                Layer::Norm { from, scale, shift, relu } => {
                    let floor = if relu { 0.0 } else { f32::NEG_INFINITY };
                    let (scale, shift) = (values(scale), values(shift));
                    let (map, out) = (&earlier[from.0].data[..], &mut out.data[..]);
                    self.arch.dispatch(norm::Forward { map, scale, shift, floor, out });
                }
                Layer::Relu { from } => {
                    let input = &earlier[from.0].data;
                    self.arch.dispatch(Relu { input, out: &mut out.data });
                }
                Layer::Add { a, b } => {
                    let [a, b] = [a, b].map(|node| &earlier[node.0].data[..]);
                    self.arch.dispatch(Sum { a, b, out: &mut out.data });
                }
                Layer::Upsample { from } => {
                    let Tensor { data, shape } = &earlier[from.0];
                    upsample(data, shape.width, shape.channels, &mut out.data);
                }
                Layer::Reshape { from } => out.data.copy_from_slice(&earlier[from.0].data),
                Layer::Concat { a, b } => {
                    let [a, b] = [a, b].map(|node| &earlier[node.0]);
                    let pairs = a.data.chunks_exact(a.shape.channels);
                    let pairs = pairs.zip(b.data.chunks_exact(b.shape.channels));
                    let pixels = out.data.chunks_exact_mut(out.shape.channels);
                    for (pixel, (a, b)) in pixels.zip(pairs) {
                        let (to_a, to_b) = pixel.split_at_mut(a.len());
                        to_a.copy_from_slice(a);
                        to_b.copy_from_slice(b);
                    }
                }
                Layer::Neighbors { from, length } => {
                    concat_neighbors(&earlier[from.0], length, &mut out.data);
                }
                Layer::Attention { query, key, value, n_heads } => {
                    let rows = [out.shape.pixels()];
                    let groups = if self.groups.is_empty() { &rows } else { &self.groups[..] };
                    let n_rows: usize = groups.iter().sum();
                    assert_eq!(n_rows, rows[0], "rows in groups");
                    let [query, key, value] = [query, key, value].map(|n| &earlier[n.0].data[..]);
                    let channels = out.shape.channels;
                    let attention = Attention { query, key, value, channels, n_heads, groups };
                    attention.forward(&mut out.data, &mut self.attention_weights[k]);
                }
            }
        }
    }

    /// Zeroes the gradients before callers write those of the output heads.
    pub fn zero_gradients(&mut self) {
        for (gradient, activation) in self.gradients.iter_mut().zip(&self.activations) {
            gradient.reset(activation.shape);
        }
    }

    /// Backpropagates the gradients of the output heads and accumulates parameter gradients into
    /// `grad_parameters`.
    pub fn backward(&mut self, network: &Network, parameters: &[f32], grad_parameters: &mut [f32]) {
        let range = |parameter: usize| network.parameters()[parameter].range.clone();
        for (k, layer) in network.layers.iter().enumerate().rev() {
            let (earlier, later) = self.gradients.split_at_mut(k);
            let gradient = &mut later[0];
            let channels = gradient.shape.channels;
            match *layer {
                Layer::Input { .. } => {}
                Layer::Conv { from, weights, bias, kernel, .. } => {
                    if let Some(bias) = bias {
                        let sums = &mut grad_parameters[range(bias)];
                        for pixel in gradient.data.chunks_exact(channels) {
                            sums.iter_mut().zip(pixel).for_each(|(sum, g)| *sum += g);
                        }
                    }
                    let (arch, im2col) = (self.arch, &mut self.im2col);
                    let (input, grad_output) = (self.activations[from.0].view(), &gradient.data);
                    let grad_weights = &mut grad_parameters[range(weights)];
                    conv::backward_weights(arch, input, grad_weights, kernel, grad_output, im2col);
                    if !matches!(network.layers[from.0], Layer::Input { .. }) {
                        let (grad_input, shape) = (&mut earlier[from.0].data, input.shape);
                        let weights = &parameters[range(weights)];
                        conv::backward_input(
                            arch,
                            grad_input,
                            shape,
                            weights,
                            kernel,
                            grad_output,
                            im2col,
                        );
                    }
                }
                Layer::Depthwise { from, weights, kernel_size } => {
                    let TensorView { data, shape } = self.activations[from.0].view();
                    let n = shape.len_per_item();
                    let grad_inputs = earlier[from.0].data.chunks_exact_mut(n);
                    self.grad_map.resize(n, 0.0);
                    let (arch, grad_map) = (self.arch, &mut self.grad_map);
                    let maps = data.chunks_exact(n).zip(gradient.data.chunks_exact(n));
                    for ((map, grad_output), grad_input) in maps.zip(grad_inputs) {
                        let map = TensorView::new(map, shape);
                        let grad_weights = &mut grad_parameters[range(weights)];
                        depthwise::backward_weights(
                            arch,
                            map,
                            grad_output,
                            grad_weights,
                            kernel_size,
                            &mut self.padded,
                        );
                        let (grad_output, zeros) =
                            (TensorView::new(grad_output, shape), &mut self.zeros);
                        let weights = &parameters[range(weights)];
                        depthwise::backward_input(
                            arch,
                            grad_output,
                            weights,
                            kernel_size,
                            grad_map,
                            zeros,
                        );
                        arch.dispatch(AddTo { to: grad_input, from: grad_map });
                    }
                }
                Layer::Norm { from, scale, shift, relu } => {
                    if relu {
                        let activation = &self.activations[k].data;
                        self.arch.dispatch(ReluGrad { gradient: &mut gradient.data, activation });
                    }
                    // The shift follows the scale.
                    let both = &mut grad_parameters[range(scale).start..range(shift).end];
                    let (grad_scale, grad_shift) = both.split_at_mut(channels);
                    self.arch.dispatch(norm::Backward {
                        map: &self.activations[from.0].data,
                        scale: &parameters[range(scale)],
                        grad_output: &gradient.data,
                        grad_input: &mut earlier[from.0].data,
                        grad_scale,
                        grad_shift,
                    });
                }
                Layer::Relu { from } => {
                    let activation = &self.activations[k].data;
                    self.arch.dispatch(ReluGrad { gradient: &mut gradient.data, activation });
                    let to = &mut earlier[from.0].data;
                    self.arch.dispatch(AddTo { to, from: &gradient.data });
                }
                Layer::Add { a, b } => {
                    for node in [a, b] {
                        let to = &mut earlier[node.0].data;
                        self.arch.dispatch(AddTo { to, from: &gradient.data });
                    }
                }
                Layer::Concat { a, b } => {
                    let n_a = self.activations[a.0].shape.channels;
                    for (node, range) in [(a, 0..n_a), (b, n_a..channels)] {
                        let to = earlier[node.0].data.chunks_exact_mut(range.len());
                        for (to, pixel) in to.zip(gradient.data.chunks_exact(channels)) {
                            to.iter_mut().zip(&pixel[range.clone()]).for_each(|(to, g)| *to += g);
                        }
                    }
                }
                Layer::Neighbors { from, length } => {
                    add_neighbor_gradients(&gradient.data, length, &mut earlier[from.0]);
                }
                Layer::Attention { query, key, value, n_heads } => {
                    let rows = [gradient.shape.pixels()];
                    let groups = if self.groups.is_empty() { &rows } else { &self.groups[..] };
                    let inputs = [query, key, value];
                    let [query, key, value] = inputs.map(|n| &self.activations[n.0].data[..]);
                    let attention = Attention { query, key, value, channels, n_heads, groups };
                    let (weights, grad) = (&self.attention_weights[k], &mut self.attention_grad);
                    attention.backward(weights, &gradient.data, grad);
                    for (node, from) in inputs.iter().zip([&grad.query, &grad.key, &grad.value]) {
                        self.arch.dispatch(AddTo { to: &mut earlier[node.0].data, from });
                    }
                }
                Layer::Upsample { from } => downsample(gradient, &mut earlier[from.0]),
                Layer::Reshape { from } => {
                    let to = &mut earlier[from.0].data;
                    self.arch.dispatch(AddTo { to, from: &gradient.data });
                }
            }
        }
    }
}
