//! Networks as lists of layers, each of which reads the outputs of earlier layers.

use std::ops::Range;

use chaic_core::rng::RngStream;

use crate::conv::Kernel;
use crate::tensor::Shape;

/// Identifies the output of a layer of a [`Network`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeId(pub(crate) usize);

/// Named tensor of trainable parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name in a weights file.
    pub name: String,
    /// Shape.
    pub shape: Vec<usize>,
    /// Range in the list of all parameters.
    pub range: Range<usize>,
    /// True if weight decay applies: for convolution weights only.
    pub has_weight_decay: bool,
}

/// Layer of a network; it reads outputs of earlier layers only. Convolutions have zero padding of
/// half the kernel size.
#[derive(Clone, Debug)]
pub(crate) enum Layer {
    /// Input, by its index.
    Input { index: usize },
    /// Dense convolution, with an optional bias per channel.
    Conv { from: NodeId, weights: usize, bias: Option<usize>, kernel: Kernel },
    /// Depthwise convolution.
    Depthwise { from: NodeId, weights: usize, kernel_size: usize },
    /// Layer normalization of each pixel, followed by a ReLU if `relu` is set.
    Norm { from: NodeId, scale: usize, shift: usize, relu: bool },
    /// ReLU.
    Relu { from: NodeId },
    /// Sum.
    Add { a: NodeId, b: NodeId },
    /// Nearest-neighbor upsampling by 2.
    Upsample { from: NodeId },
    /// Reshape: the pixels of a map, or two maps of one pixel, become one pixel.
    Reshape { from: NodeId },
    /// Concatenation of the channels of two maps.
    Concat { a: NodeId, b: NodeId },
    /// Concatenation of the channels of the previous, the same and the next row of a sequence.
    Neighbors { from: NodeId, length: usize },
    /// Multi-head attention between the rows of a group.
    Attention { query: NodeId, key: NodeId, value: NodeId, n_heads: usize },
}

impl Layer {
    /// Returns the inputs of the layer.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = NodeId> {
        let (first, second, third) = match *self {
            Layer::Input { .. } => (None, None, None),
            Layer::Conv { from, .. }
            | Layer::Depthwise { from, .. }
            | Layer::Norm { from, .. }
            | Layer::Relu { from }
            | Layer::Upsample { from }
            | Layer::Reshape { from }
            | Layer::Neighbors { from, .. } => (Some(from), None, None),
            Layer::Add { a, b } | Layer::Concat { a, b } => (Some(a), Some(b), None),
            Layer::Attention { query, key, value, .. } => (Some(query), Some(key), Some(value)),
        };
        first.into_iter().chain(second).chain(third)
    }
}

/// Size of a layer's output relative to the network's input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Size {
    channels: usize,
    /// Divisor of the input's width and height.
    stride: usize,
    /// Number of input maps per output map.
    maps: usize,
}

/// Network architecture without parameter values.
#[derive(Clone, Debug, Default)]
pub struct Network {
    pub(crate) layers: Vec<Layer>,
    sizes: Vec<Size>,
    parameters: Vec<Parameter>,
    outputs: Vec<NodeId>,
    n_inputs: usize,
}

impl Network {
    fn push(&mut self, layer: Layer, size: Size) -> NodeId {
        self.layers.push(layer);
        self.sizes.push(size);
        NodeId(self.layers.len() - 1)
    }

    fn add_parameter(&mut self, name: String, shape: &[usize], has_weight_decay: bool) -> usize {
        let start = self.n_parameters();
        let range = start..start + shape.iter().product::<usize>();
        self.parameters.push(Parameter { name, shape: shape.to_vec(), range, has_weight_decay });
        self.parameters.len() - 1
    }

    /// Adds an input with this many channels: the first layer of a network.
    pub fn input(&mut self, channels: usize) -> NodeId {
        self.auxiliary_input(channels, 1)
    }

    /// Adds a further input, whose width and height are those of the first input divided by
    /// `stride`.
    pub fn auxiliary_input(&mut self, channels: usize, stride: usize) -> NodeId {
        let index = self.n_inputs;
        self.n_inputs += 1;
        self.push(Layer::Input { index }, Size { channels, stride, maps: 1 })
    }

    /// Adds named parameters that no layer reads; they are saved with the weights.
    pub fn extra_parameters(&mut self, name: &str, n: usize) {
        self.add_parameter(name.to_owned(), &[n], false);
    }

    /// Adds the parameters of another network, which no layer of this one reads, with a prefix to
    /// their names.
    pub fn append_parameters(&mut self, prefix: &str, other: &Network) {
        for parameter in &other.parameters {
            let name = format!("{prefix}{}", parameter.name);
            self.add_parameter(name, &parameter.shape, parameter.has_weight_decay);
        }
    }

    /// Adds a dense convolution without bias.
    pub fn conv(&mut self, name: &str, from: NodeId, kernel: Kernel, channels: usize) -> NodeId {
        let input = self.sizes[from.0];
        let shape = [kernel.size, kernel.size, input.channels, channels];
        let weights = self.add_parameter(format!("{name}.weight"), &shape, true);
        let size = Size { channels, stride: input.stride * kernel.stride, ..input };
        self.push(Layer::Conv { from, weights, bias: None, kernel }, size)
    }

    /// Adds an output: a pointwise convolution with a bias.
    pub fn output_head(&mut self, name: &str, from: NodeId, channels: usize) -> NodeId {
        let input = self.sizes[from.0];
        let shape = [1, 1, input.channels, channels];
        let weights = self.add_parameter(format!("{name}.weight"), &shape, true);
        let bias = Some(self.add_parameter(format!("{name}.bias"), &[channels], false));
        let kernel = Kernel::POINTWISE;
        let size = Size { channels, ..input };
        let node = self.push(Layer::Conv { from, weights, bias, kernel }, size);
        self.outputs.push(node);
        node
    }

    /// Adds a depthwise convolution with a kernel of 3x3 or 5x5.
    pub fn depthwise(&mut self, name: &str, from: NodeId, kernel_size: usize) -> NodeId {
        let size = self.sizes[from.0];
        let shape = [kernel_size, kernel_size, size.channels];
        let weights = self.add_parameter(format!("{name}.weight"), &shape, true);
        self.push(Layer::Depthwise { from, weights, kernel_size }, size)
    }

    /// Adds a layer normalization of each pixel.
    pub fn norm(&mut self, name: &str, from: NodeId) -> NodeId {
        self.push_norm(name, from, false)
    }

    /// Adds a layer normalization followed by a ReLU.
    pub fn norm_relu(&mut self, name: &str, from: NodeId) -> NodeId {
        self.push_norm(name, from, true)
    }

    fn push_norm(&mut self, name: &str, from: NodeId, relu: bool) -> NodeId {
        let size = self.sizes[from.0];
        let channels = size.channels;
        assert!(channels.is_multiple_of(crate::norm::LANES), "{channels} channels");
        let scale = self.add_parameter(format!("{name}.scale"), &[channels], false);
        let shift = self.add_parameter(format!("{name}.shift"), &[channels], false);
        self.push(Layer::Norm { from, scale, shift, relu }, size)
    }

    /// Adds a ReLU.
    pub fn relu(&mut self, from: NodeId) -> NodeId {
        self.push(Layer::Relu { from }, self.sizes[from.0])
    }

    /// Adds the sum of two nodes of the same shape.
    ///
    /// # Panics
    /// If their shapes differ.
    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let size = |n: NodeId| self.sizes[n.0];
        assert_eq!(size(a), size(b), "shapes of the summands differ");
        self.push(Layer::Add { a, b }, size(a))
    }

    /// Adds the concatenation of the channels of two nodes.
    ///
    /// # Panics
    /// If their maps have different sizes.
    pub fn concat(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let [size_a, size_b] = [a, b].map(|n| self.sizes[n.0]);
        let channels = size_a.channels + size_b.channels;
        assert_eq!(
            (size_a.stride, size_a.maps),
            (size_b.stride, size_b.maps),
            "sizes of the concatenated maps differ"
        );
        self.push(Layer::Concat { a, b }, Size { channels, ..size_a })
    }

    /// Adds multi-head scaled dot-product attention between the rows of a group, see
    /// [`TrainingPass::set_groups`](crate::TrainingPass::set_groups). Rows are maps of one pixel.
    ///
    /// # Panics
    /// If the inputs have different shapes, or their channels are not a multiple of `n_heads`.
    pub fn attention(&mut self, [query, key, value]: [NodeId; 3], n_heads: usize) -> NodeId {
        let size = self.sizes[query.0];
        assert!([key, value].iter().all(|node| self.sizes[node.0] == size), "shapes differ");
        assert!(size.channels.is_multiple_of(n_heads), "{} channels", size.channels);
        self.push(Layer::Attention { query, key, value, n_heads }, size)
    }

    /// Adds a nearest-neighbor upsampling by 2.
    ///
    /// # Panics
    /// If the node has the resolution of the input.
    pub fn upsample(&mut self, from: NodeId) -> NodeId {
        let size = self.sizes[from.0];
        assert!(size.stride.is_multiple_of(2), "the output would be larger than the input");
        self.push(Layer::Upsample { from }, Size { stride: size.stride / 2, ..size })
    }

    /// Adds a reshape of maps of `map_size` x `map_size` pixels to one pixel each.
    pub fn flatten(&mut self, from: NodeId, map_size: usize) -> NodeId {
        let Size { channels, stride, maps } = self.sizes[from.0];
        let size =
            Size { channels: map_size * map_size * channels, stride: map_size * stride, maps };
        self.push(Layer::Reshape { from }, size)
    }

    /// Adds a reshape that concatenates two consecutive maps of one pixel in a batch.
    pub fn concat_pairs(&mut self, from: NodeId) -> NodeId {
        let Size { channels, stride, maps } = self.sizes[from.0];
        self.push(Layer::Reshape { from }, Size { channels: 2 * channels, stride, maps: 2 * maps })
    }

    /// Adds the concatenation of the channels of the previous, the same and the next row; the first
    /// and last row have zeros for the missing one. Rows are maps of one pixel; `length` consecutive
    /// rows form a sequence. With a pointwise convolution it is a convolution of size 3 over time.
    pub fn concat_neighbors(&mut self, from: NodeId, length: usize) -> NodeId {
        let size = self.sizes[from.0];
        let channels = 3 * size.channels;
        self.push(Layer::Neighbors { from, length }, Size { channels, ..size })
    }

    /// Returns the shapes of all inputs, given that of the first.
    pub fn input_shapes(&self, first: Shape) -> Vec<Shape> {
        let is_input = |k: &usize| matches!(self.layers[*k], Layer::Input { .. });
        (0..self.layers.len()).filter(is_input).map(|k| self.shape_of(NodeId(k), first)).collect()
    }

    /// Returns the number of parameters.
    pub fn n_parameters(&self) -> usize {
        self.parameters.last().map_or(0, |p| p.range.end)
    }

    /// Returns the parameter tensors in storage order.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Returns the nodes of [`Network::output_head`] in order.
    pub fn outputs(&self) -> &[NodeId] {
        &self.outputs
    }

    /// Returns the maximum stride. Width and height of the input must be multiples of this stride.
    pub fn stride(&self) -> usize {
        self.sizes.iter().map(|size| size.stride).max().unwrap_or(1)
    }

    /// Returns the divisor of the input's width and height for a node.
    pub(crate) fn stride_of(&self, node: NodeId) -> usize {
        self.sizes[node.0].stride
    }

    /// Returns the number of channels of a node.
    pub(crate) fn channels_of(&self, node: NodeId) -> usize {
        self.sizes[node.0].channels
    }

    /// Returns the shape of a node's output for an input shape.
    pub fn shape_of(&self, node: NodeId, input: Shape) -> Shape {
        let Size { channels, stride, maps } = self.sizes[node.0];
        Shape {
            n: input.n / maps,
            height: input.height / stride,
            width: input.width / stride,
            channels,
        }
    }

    /// Returns initial parameters. Convolution weights are normal with variance 2 / fan-in (He et
    /// al. 2015); output heads have a tenth of this deviation. Scales are 1, other parameters 0.
    pub fn init_parameters(&self, seed: u64) -> Vec<f32> {
        let mut parameters = vec![0.0; self.n_parameters()];
        for (index, parameter) in self.parameters.iter().enumerate() {
            let values = &mut parameters[parameter.range.clone()];
            let mut rng = RngStream::new(seed, "weights", index as u64);
            if parameter.name.ends_with(".scale") {
                values.fill(1.0);
            } else if parameter.has_weight_decay {
                let is_depthwise = parameter.shape.len() == 3;
                let fan_in: usize =
                    parameter.shape[..if is_depthwise { 2 } else { 3 }].iter().product();
                let is_head =
                    self.parameters.get(index + 1).is_some_and(|p| p.name.ends_with(".bias"));
                let std_dev = (2.0 / fan_in as f32).sqrt() * if is_head { 0.1 } else { 1.0 };
                values.iter_mut().for_each(|w| *w = std_dev * normal(&mut rng));
            }
        }
        parameters
    }
}

/// Draws an approximately normal number: the sum of twelve uniform draws minus 6. It needs no
/// logarithm, which machines round differently.
pub fn normal(rng: &mut RngStream) -> f32 {
    (0..12).map(|_| rng.unit()).sum::<f32>() - 6.0
}
