//! Forward passes for inference. Only outputs that later layers read at other pixels are kept. All
//! others are computed in strips that fit into the L2 cache. Results are bit-identical to those of
//! [`TrainingPass`](crate::TrainingPass).

use std::ops::Range;

use pulp::Arch;

use crate::conv::{self, ForwardRows, Kernel, STRIP_PIXELS};
use crate::depthwise::{self, ZeroRow};
use crate::elementwise::{Relu, Sum, upsample};
use crate::gemm::PackedMatrix;
use crate::network::{Layer, Network, NodeId};
use crate::norm;
use crate::tensor::{Shape, Tensor, TensorView};

/// Runs a network on one map after another.
#[derive(Clone, Debug)]
pub struct Inference {
    arch: Arch,
    network: Network,
    parameters: Vec<f32>,
    /// Packed weights of dense convolutions; empty for other layers.
    weights: Vec<PackedMatrix>,
    segments: Vec<Range<usize>>,
    /// True for layers whose complete output is kept.
    is_kept: Vec<bool>,
    /// Outputs of the layers: complete, or the current strip.
    activations: Vec<Tensor>,
    edges: Vec<f32>,
    zeros: ZeroRow,
}

impl Inference {
    /// Creates an inference engine for a network with these parameters.
    ///
    /// # Panics
    /// If the network concatenates or reshapes maps or has attention, which only a
    /// [`TrainingPass`](crate::TrainingPass) supports, or the number of parameters differs.
    pub fn new(network: &Network, parameters: &[f32], arch: Arch) -> Inference {
        let is_unsupported = |layer: &Layer| {
            matches!(
                layer,
                Layer::Reshape { .. }
                    | Layer::Concat { .. }
                    | Layer::Neighbors { .. }
                    | Layer::Attention { .. }
            )
        };
        let has_unsupported = network.layers.iter().any(is_unsupported);
        assert!(!has_unsupported, "inference supports no reshapes, concatenations and attention");
        assert_eq!(parameters.len(), network.n_parameters(), "wrong number of parameters");
        let (segments, is_kept) = segments(network);
        Inference {
            arch,
            network: network.clone(),
            parameters: parameters.to_vec(),
            weights: pack_weights(network, parameters, arch),
            segments,
            is_kept,
            activations: vec![Tensor::default(); network.layers.len()],
            edges: Vec::new(),
            zeros: ZeroRow::default(),
        }
    }

    /// Returns the input buffer for a map of this shape, to be written before [`Inference::run`].
    pub fn input(&mut self, shape: Shape) -> &mut [f32] {
        self.activations[0].reshape(shape);
        &mut self.activations[0].data
    }

    /// Returns the input of the last run.
    pub fn last_input(&self) -> &[f32] {
        &self.activations[0].data
    }

    /// Runs all layers on the input. `on_strip(output, first row, rows)` is called for each strip
    /// of each output, from top to bottom; rows have shape [rows, width, channels].
    ///
    /// # Panics
    /// If the input has several maps, or its width or height is not a multiple of
    /// [`Network::stride`].
    pub fn run(&mut self, mut on_strip: impl FnMut(NodeId, usize, &[f32])) {
        let input = self.activations[0].shape;
        let stride = self.network.stride();
        assert_eq!(input.n, 1, "the input must be one map");
        assert!(
            input.height.is_multiple_of(stride) && input.width.is_multiple_of(stride),
            "{} x {} pixels are not multiples of {stride}",
            input.width,
            input.height
        );
        for segment in self.segments.clone() {
            let shape = self.network.shape_of(NodeId(segment.start), input);
            for layer in segment.clone().filter(|layer| self.is_kept[*layer]) {
                self.activations[layer].reshape(self.network.shape_of(NodeId(layer), input));
            }
            // The height of a strip is even, so that an upsampled strip starts at a full input row.
            let strip = (STRIP_PIXELS / shape.width).next_multiple_of(2).max(2);
            for top in (0..shape.height).step_by(strip) {
                let rows = top..(top + strip).min(shape.height);
                for layer in segment.clone() {
                    let shape = self.network.shape_of(NodeId(layer), input);
                    self.compute(layer, shape, rows.clone());
                    if self.network.outputs().contains(&NodeId(layer)) {
                        let first = if self.is_kept[layer] { top } else { 0 };
                        let row = shape.width * shape.channels;
                        let output = &self.activations[layer].data[first * row..];
                        on_strip(NodeId(layer), top, &output[..rows.len() * row]);
                    }
                }
            }
        }
    }

    /// Computes some rows of a layer's output.
    fn compute(&mut self, layer: usize, shape: Shape, rows: Range<usize>) {
        let Inference { arch, network, parameters, activations, is_kept, edges, zeros, .. } = self;
        let arch = *arch;
        let values = |parameter: usize| &parameters[network.parameters()[parameter].range.clone()];
        let (earlier, later) = activations.split_at_mut(layer);
        let row = shape.width * shape.channels;
        if !is_kept[layer] {
            later[0].reshape(Shape { height: rows.len(), ..shape });
        }
        let first = if is_kept[layer] { rows.start * row } else { 0 };
        let out = &mut later[0].data[first..][..rows.len() * row];
        // Returns the same rows of another node with the same height.
        let same_rows = |node: NodeId| {
            let map = &earlier[node.0];
            let row = map.shape.width * map.shape.channels;
            let first = if is_kept[node.0] { rows.start * row } else { 0 };
            &map.data[first..][..rows.len() * row]
        };
        match network.layers[layer] {
            Layer::Input { .. } => unreachable!("the caller writes the input"),
            Layer::Conv { from, bias, kernel, .. } => {
                let (weights, bias) = (&self.weights[layer], bias.map(values));
                // A pointwise convolution treats all pixels of the strip as one row.
                let (map, rows) = match kernel {
                    Kernel::POINTWISE => {
                        let (data, channels) = (same_rows(from), earlier[from.0].shape.channels);
                        let width = data.len() / channels;
                        (TensorView::new(data, Shape { n: 1, height: 1, width, channels }), 0..1)
                    }
                    _ => (earlier[from.0].view(), rows),
                };
                ForwardRows { map, weights, bias, kernel, out, rows, edges }.run(arch);
            }
            Layer::Depthwise { from, weights, kernel_size } => {
                let (map, weights) = (earlier[from.0].view(), values(weights));
                depthwise::forward_rows(arch, map, weights, kernel_size, out, rows, zeros);
            }
            Layer::Norm { from, scale, shift, relu } => {
                let floor = if relu { 0.0 } else { f32::NEG_INFINITY };
                let (scale, shift) = (values(scale), values(shift));
                arch.dispatch(norm::Forward { map: same_rows(from), scale, shift, floor, out });
            }
            Layer::Relu { from } => arch.dispatch(Relu { input: same_rows(from), out }),
            Layer::Add { a, b } => {
                arch.dispatch(Sum { a: same_rows(a), b: same_rows(b), out });
            }
            Layer::Upsample { from } => {
                let Shape { width, channels, .. } = earlier[from.0].shape;
                let rows = rows.start / 2..rows.end.div_ceil(2);
                let map = &earlier[from.0].data[rows.start * width * channels..];
                upsample(&map[..rows.len() * width * channels], width, channels, out);
            }
            Layer::Reshape { .. }
            | Layer::Concat { .. }
            | Layer::Neighbors { .. }
            | Layer::Attention { .. } => {
                unreachable!("the constructor refuses such networks")
            }
        }
    }
}

/// Packs the weights of dense convolutions. Returns one matrix per layer; the matrices of other
/// layers are empty.
pub(crate) fn pack_weights(network: &Network, parameters: &[f32], arch: Arch) -> Vec<PackedMatrix> {
    let mut packed = vec![PackedMatrix::default(); network.layers.len()];
    for (layer, packed) in network.layers.iter().zip(&mut packed) {
        if let Layer::Conv { from, weights, kernel, .. } = *layer {
            let weights = &parameters[network.parameters()[weights].range.clone()];
            conv::pack(arch, weights, kernel, network.channels_of(from), packed);
        }
    }
    packed
}

/// Returns segments, which are ranges of layers that are computed together strip by strip, and for
/// each layer whether its output is kept.
fn segments(network: &Network) -> (Vec<Range<usize>>, Vec<bool>) {
    let layers = &network.layers;
    let mut is_kept = vec![false; layers.len()];
    // Layers that are read at other pixels are kept.
    for layer in layers {
        match *layer {
            Layer::Input { .. }
            | Layer::Norm { .. }
            | Layer::Relu { .. }
            | Layer::Add { .. }
            | Layer::Concat { .. }
            | Layer::Attention { .. } => {}
            Layer::Conv { kernel, .. } if kernel == Kernel::POINTWISE => {}
            Layer::Conv { from, .. }
            | Layer::Depthwise { from, .. }
            | Layer::Upsample { from }
            | Layer::Reshape { from }
            | Layer::Neighbors { from, .. } => {
                is_kept[from.0] = true;
            }
        }
    }
    is_kept[0] = true;
    loop {
        let mut segments = Vec::new();
        let mut start = 1;
        for (k, is_kept) in is_kept.iter().enumerate().skip(1) {
            let continues = network.layers.get(k + 1).is_some_and(|_| {
                network.stride_of(NodeId(k + 1)) == network.stride_of(NodeId(start))
            });
            if *is_kept || !continues {
                segments.push(start..k + 1);
                start = k + 1;
            }
        }
        // Layers that another segment reads are kept.
        let mut is_stable = true;
        for segment in &segments {
            for layer in segment.clone() {
                for from in layers[layer].inputs() {
                    if from.0 < segment.start && !is_kept[from.0] {
                        is_kept[from.0] = true;
                        is_stable = false;
                    }
                }
            }
        }
        if is_stable {
            return (segments, is_kept);
        }
    }
}
