//! Networks as lists of layers, each of which reads feature maps that earlier ones made.

use std::ops::Range;

use chaic_core::rng::Stream;

use crate::conv::Kernel;
use crate::tensor::Shape;

/// Names what a layer makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node(pub(crate) usize);

/// Numbers that are learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// What it is called in a file.
    pub name: String,
    /// How many numbers along each axis.
    pub shape: Vec<usize>,
    /// Where its numbers are in the list of all.
    pub range: Range<usize>,
    /// Whether weight decay applies: to weights of convolutions.
    pub decays: bool,
}

/// A layer. What it reads comes before it; all kernels keep a map's middle where it is.
#[derive(Clone, Debug)]
pub(crate) enum Layer {
    /// What the caller gives, by its place among the inputs.
    Input { which: usize },
    /// A dense convolution, with one number added to each channel if it has a bias.
    Conv { from: Node, weights: usize, bias: Option<usize>, kernel: Kernel, channels: usize },
    /// A depthwise convolution.
    Depthwise { from: Node, weights: usize, side: usize },
    /// Layer normalization of each pixel, of which only the positive part is left if it is `positive`.
    Norm { from: Node, scale: usize, shift: usize, positive: bool },
    /// The positive part.
    Relu { from: Node },
    /// A sum.
    Add { a: Node, b: Node },
    /// Each pixel twice in each row and column.
    Upsample { from: Node },
    /// The same numbers, with the pixels of a map, or two maps of one pixel, as one pixel.
    Join { from: Node },
    /// The channels of two maps, one after the other.
    Concat { a: Node, b: Node },
}

impl Layer {
    /// What it reads.
    pub(crate) fn reads(&self) -> impl Iterator<Item = Node> {
        let (first, second) = match *self {
            Layer::Input { .. } => (None, None),
            Layer::Conv { from, .. }
            | Layer::Depthwise { from, .. }
            | Layer::Norm { from, .. }
            | Layer::Relu { from }
            | Layer::Upsample { from }
            | Layer::Join { from } => (Some(from), None),
            Layer::Add { a, b } | Layer::Concat { a, b } => (Some(a), Some(b)),
        };
        first.into_iter().chain(second)
    }
}

/// How large what a layer makes is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Size {
    channels: usize,
    /// By how many a side of the input is divided.
    stride: usize,
    /// How many maps of the input become one.
    maps: usize,
}

/// A network without its numbers.
#[derive(Clone, Debug, Default)]
pub struct Network {
    pub(crate) layers: Vec<Layer>,
    sizes: Vec<Size>,
    parameters: Vec<Parameter>,
    outputs: Vec<Node>,
    n_inputs: usize,
}

impl Network {
    fn push(&mut self, layer: Layer, size: Size) -> Node {
        self.layers.push(layer);
        self.sizes.push(size);
        Node(self.layers.len() - 1)
    }

    fn parameter(&mut self, name: String, shape: &[usize], decays: bool) -> usize {
        let begin = self.n_numbers();
        let range = begin..begin + shape.iter().product::<usize>();
        self.parameters.push(Parameter { name, shape: shape.to_vec(), range, decays });
        self.parameters.len() - 1
    }

    /// What the caller gives, with so many channels: the first thing in a network.
    pub fn input(&mut self, channels: usize) -> Node {
        self.side_input(channels, 1)
    }

    /// What the caller gives besides, with sides that are those of the first input divided by `stride`.
    pub fn side_input(&mut self, channels: usize, stride: usize) -> Node {
        let which = self.n_inputs;
        self.n_inputs += 1;
        self.push(Layer::Input { which }, Size { channels, stride, maps: 1 })
    }

    /// Numbers that no layer uses, kept in the same file as the others.
    pub fn aside(&mut self, name: &str, n: usize) {
        self.parameter(name.to_owned(), &[n], false);
    }

    /// A dense convolution.
    pub fn conv(&mut self, name: &str, from: Node, kernel: Kernel, channels: usize) -> Node {
        let of = self.sizes[from.0];
        let shape = [kernel.side, kernel.side, of.channels, channels];
        let weights = self.parameter(format!("{name}.weight"), &shape, true);
        let size = Size { channels, stride: of.stride * kernel.stride, ..of };
        self.push(Layer::Conv { from, weights, bias: None, kernel, channels }, size)
    }

    /// A matrix for each pixel, with a bias: what a network ends with.
    pub fn head(&mut self, name: &str, from: Node, channels: usize) -> Node {
        let of = self.sizes[from.0];
        let shape = [1, 1, of.channels, channels];
        let weights = self.parameter(format!("{name}.weight"), &shape, true);
        let bias = Some(self.parameter(format!("{name}.bias"), &[channels], false));
        let kernel = Kernel::POINTWISE;
        let size = Size { channels, ..of };
        let node = self.push(Layer::Conv { from, weights, bias, kernel, channels }, size);
        self.outputs.push(node);
        node
    }

    /// A depthwise convolution with a kernel of 3 or 5 to a side.
    pub fn depthwise(&mut self, name: &str, from: Node, side: usize) -> Node {
        let size = self.sizes[from.0];
        let shape = [side, side, size.channels];
        let weights = self.parameter(format!("{name}.weight"), &shape, true);
        self.push(Layer::Depthwise { from, weights, side }, size)
    }

    /// Layer normalization of each pixel.
    pub fn norm(&mut self, name: &str, from: Node) -> Node {
        self.any_norm(name, from, false)
    }

    /// The positive part of a layer normalization.
    pub fn norm_relu(&mut self, name: &str, from: Node) -> Node {
        self.any_norm(name, from, true)
    }

    fn any_norm(&mut self, name: &str, from: Node, positive: bool) -> Node {
        let size = self.sizes[from.0];
        let channels = size.channels;
        assert!(channels.is_multiple_of(crate::norm::LANES), "{channels} channels");
        let scale = self.parameter(format!("{name}.scale"), &[channels], false);
        let shift = self.parameter(format!("{name}.shift"), &[channels], false);
        self.push(Layer::Norm { from, scale, shift, positive }, size)
    }

    /// The positive part.
    pub fn relu(&mut self, from: Node) -> Node {
        self.push(Layer::Relu { from }, self.sizes[from.0])
    }

    /// The sum of two nodes of the same shape.
    ///
    /// # Panics
    /// If their shapes differ.
    pub fn add(&mut self, a: Node, b: Node) -> Node {
        let of = |n: Node| self.sizes[n.0];
        assert_eq!(of(a), of(b), "shapes that are added differ");
        self.push(Layer::Add { a, b }, of(a))
    }

    /// The channels of two nodes, one after the other.
    ///
    /// # Panics
    /// If they aren't maps of the same size.
    pub fn concat(&mut self, a: Node, b: Node) -> Node {
        let [of_a, of_b] = [a, b].map(|n| self.sizes[n.0]);
        let channels = of_a.channels + of_b.channels;
        assert_eq!(
            (of_a.stride, of_a.maps),
            (of_b.stride, of_b.maps),
            "maps that are joined differ"
        );
        self.push(Layer::Concat { a, b }, Size { channels, ..of_a })
    }

    /// Each pixel twice in each row and column.
    ///
    /// # Panics
    /// If the node is as large as the input.
    pub fn upsample(&mut self, from: Node) -> Node {
        let size = self.sizes[from.0];
        assert!(size.stride.is_multiple_of(2), "nothing is larger than the input");
        self.push(Layer::Upsample { from }, Size { stride: size.stride / 2, ..size })
    }

    /// Maps of `side` x `side` pixels as one pixel each.
    pub fn flatten(&mut self, from: Node, side: usize) -> Node {
        let Size { channels, stride, maps } = self.sizes[from.0];
        let size = Size { channels: side * side * channels, stride: side * stride, maps };
        self.push(Layer::Join { from }, size)
    }

    /// Two maps of one pixel, one after the other in the batch, as one pixel.
    pub fn pair(&mut self, from: Node) -> Node {
        let Size { channels, stride, maps } = self.sizes[from.0];
        self.push(Layer::Join { from }, Size { channels: 2 * channels, stride, maps: 2 * maps })
    }

    /// The shapes of all inputs, the first being this one.
    pub fn input_shapes(&self, first: Shape) -> Vec<Shape> {
        let is_input = |k: &usize| matches!(self.layers[*k], Layer::Input { .. });
        (0..self.layers.len()).filter(is_input).map(|k| self.shape_of(Node(k), first)).collect()
    }

    /// Numbers that are learned.
    pub fn n_numbers(&self) -> usize {
        self.parameters.last().map_or(0, |p| p.range.end)
    }

    /// What is learned, in the order of its numbers.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// What [`Network::head`] made, in order.
    pub fn outputs(&self) -> &[Node] {
        &self.outputs
    }

    /// Sides of the input are multiples of this.
    pub fn stride(&self) -> usize {
        self.sizes.iter().map(|size| size.stride).max().unwrap_or(1)
    }

    /// By how many a side of the input is divided to be a side of what a node makes.
    pub(crate) fn stride_of(&self, node: Node) -> usize {
        self.sizes[node.0].stride
    }

    /// Channels of what a node makes.
    pub(crate) fn channels_of(&self, node: Node) -> usize {
        self.sizes[node.0].channels
    }

    /// The shape of what a node makes of inputs of this shape.
    pub fn shape_of(&self, node: Node, input: Shape) -> Shape {
        let Size { channels, stride, maps } = self.sizes[node.0];
        Shape {
            n: input.n / maps,
            height: input.height / stride,
            width: input.width / stride,
            channels,
        }
    }

    /// Numbers to begin to learn from: weights are normal with a variance of 2 over the numbers under
    /// a kernel (He et al. 2015), of heads a tenth as wide; scales are 1, all else 0.
    pub fn begin(&self, seed: u64) -> Vec<f32> {
        let mut numbers = vec![0.0; self.n_numbers()];
        for (index, parameter) in self.parameters.iter().enumerate() {
            let values = &mut numbers[parameter.range.clone()];
            let mut rng = Stream::new(seed, "weights", index as u64);
            if parameter.name.ends_with(".scale") {
                values.fill(1.0);
            } else if parameter.decays {
                let is_depthwise = parameter.shape.len() == 3;
                let under: usize =
                    parameter.shape[..if is_depthwise { 2 } else { 3 }].iter().product();
                let is_head =
                    self.parameters.get(index + 1).is_some_and(|p| p.name.ends_with(".bias"));
                let deviation = (2.0 / under as f32).sqrt() * if is_head { 0.1 } else { 1.0 };
                values.iter_mut().for_each(|w| *w = deviation * normal(&mut rng));
            }
        }
        numbers
    }
}

/// Roughly normal: the sum of twelve even draws, less their mean. Without logarithms, which machines
/// round each in its own way.
fn normal(rng: &mut Stream) -> f32 {
    (0..12).map(|_| rng.unit()).sum::<f32>() - 6.0
}
