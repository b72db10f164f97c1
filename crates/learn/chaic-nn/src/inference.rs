//! Forward passes for who learns nothing: only what later layers look at from elsewhere is kept, all
//! else is made strip by strip in the second-level cache. The same bits as [`Pass`] makes.
//!
//! [`Pass`]: crate::Pass

use std::ops::Range;

use pulp::Arch;

use crate::conv::{self, Kernel, STRIP_PIXELS};
use crate::depthwise::{self, Zeros};
use crate::elementwise::{Relu, Sum, upsample};
use crate::gemm::Panels;
use crate::network::{Layer, Network, Node};
use crate::norm;
use crate::tensor::{Shape, Tensor};

/// One forward pass after the other over one map each.
#[derive(Clone, Debug)]
pub struct Inference {
    arch: Arch,
    network: Network,
    numbers: Vec<f32>,
    /// The weights of dense convolutions, of which other layers have none.
    weights: Vec<Panels>,
    segments: Vec<Range<usize>>,
    /// Whether the whole of what a layer makes is kept.
    is_kept: Vec<bool>,
    /// What layers make: all of it, or the present strip.
    made: Vec<Tensor>,
    edges: Vec<f32>,
    zeros: Zeros,
}

impl Inference {
    /// Of a network with these numbers.
    ///
    /// # Panics
    /// If the network joins maps or their pixels (that takes a [`Pass`](crate::Pass)), or has another
    /// count of numbers.
    pub fn new(network: &Network, numbers: &[f32], arch: Arch) -> Inference {
        let joins = network
            .layers
            .iter()
            .any(|layer| matches!(layer, Layer::Join { .. } | Layer::Concat { .. }));
        assert!(!joins, "maps are joined by passes only");
        assert_eq!(numbers.len(), network.n_numbers(), "numbers of another network");
        let (segments, is_kept) = segments(network);
        let mut packed = vec![Panels::default(); network.layers.len()];
        for (layer, packed) in network.layers.iter().zip(&mut packed) {
            if let Layer::Conv { from, weights, kernel, channels, .. } = *layer {
                let weights = &numbers[network.parameters()[weights].range.clone()];
                conv::pack(arch, (weights, kernel), (network.channels_of(from), channels), packed);
            }
        }
        Inference {
            arch,
            network: network.clone(),
            numbers: numbers.to_vec(),
            weights: packed,
            segments,
            is_kept,
            made: vec![Tensor::default(); network.layers.len()],
            edges: Vec::new(),
            zeros: Zeros::default(),
        }
    }

    /// Where the input goes: a map of this shape, to be written before [`Inference::run`].
    pub fn input(&mut self, shape: Shape) -> &mut [f32] {
        self.made[0].reshape(shape);
        &mut self.made[0].data
    }

    /// Runs all layers on the input. `take` is called with each strip of each output, from top to bottom:
    /// the output, the number of its first row, and its rows, shape [rows, width, channels].
    ///
    /// # Panics
    /// If the input is more than one map, or a side of it is no multiple of [`Network::stride`].
    pub fn run(&mut self, mut take: impl FnMut(Node, usize, &[f32])) {
        let input = self.made[0].shape;
        let stride = self.network.stride();
        assert_eq!(input.n, 1, "one map at a time");
        assert!(
            input.height.is_multiple_of(stride) && input.width.is_multiple_of(stride),
            "{} x {} pixels are no multiple of {stride}",
            input.width,
            input.height
        );
        for segment in self.segments.clone() {
            let whole = self.network.shape_of(Node(segment.start), input);
            for layer in segment.clone().filter(|layer| self.is_kept[*layer]) {
                self.made[layer].reshape(self.network.shape_of(Node(layer), input));
            }
            // Even, so that what is twice as large begins with a whole row.
            let strip = (STRIP_PIXELS / whole.width).next_multiple_of(2).max(2);
            for top in (0..whole.height).step_by(strip) {
                let rows = top..(top + strip).min(whole.height);
                for layer in segment.clone() {
                    let shape = self.network.shape_of(Node(layer), input);
                    self.make(layer, (shape, rows.clone()));
                    if self.network.outputs().contains(&Node(layer)) {
                        let first = if self.is_kept[layer] { top } else { 0 };
                        let row = shape.width * shape.channels;
                        take(
                            Node(layer),
                            top,
                            &self.made[layer].data[first * row..][..rows.len() * row],
                        );
                    }
                }
            }
        }
    }

    /// Some rows of what a layer makes.
    fn make(&mut self, layer: usize, (shape, rows): (Shape, Range<usize>)) {
        let Inference {
            arch, network, numbers, weights: packed, is_kept, made, edges, zeros, ..
        } = self;
        let of = |parameter: usize| &numbers[network.parameters()[parameter].range.clone()];
        let (before, rest) = made.split_at_mut(layer);
        let row = shape.width * shape.channels;
        if !is_kept[layer] {
            rest[0].reshape(Shape { height: rows.len(), ..shape });
        }
        let first = if is_kept[layer] { rows.start * row } else { 0 };
        let out = &mut rest[0].data[first..][..rows.len() * row];
        // What lies in the same rows of a map of the same width.
        let beside = |node: Node| {
            let map = &before[node.0];
            let row = map.shape.width * map.shape.channels;
            let first = if is_kept[node.0] { rows.start * row } else { 0 };
            &map.data[first..][..rows.len() * row]
        };
        match network.layers[layer] {
            Layer::Input { .. } => unreachable!("the caller writes it"),
            Layer::Conv { from, bias, kernel, .. } => {
                let weights = (&packed[layer], bias.map(of), kernel);
                // Without neighbors, all pixels of the strip are one row.
                let (map, shape, rows) = match kernel {
                    Kernel::POINTWISE => {
                        let map = beside(from);
                        let channels = before[from.0].shape.channels;
                        (
                            map,
                            Shape { n: 1, height: 1, width: map.len() / channels, channels },
                            0..1,
                        )
                    }
                    _ => (&before[from.0].data[..], before[from.0].shape, rows),
                };
                conv::forward_rows(*arch, (map, shape), weights, (out, rows), edges);
            }
            Layer::Depthwise { from, weights, side } => {
                let map = (&before[from.0].data[..], before[from.0].shape);
                depthwise::forward_rows(*arch, map, (of(weights), side), (out, rows), zeros);
            }
            Layer::Norm { from, scale, shift, positive } => {
                let floor = if positive { 0.0 } else { f32::NEG_INFINITY };
                let (scale, shift) = (of(scale), of(shift));
                arch.dispatch(norm::Forward { map: beside(from), scale, shift, floor, out });
            }
            Layer::Relu { from } => arch.dispatch(Relu { map: beside(from), out }),
            Layer::Add { a, b } => {
                arch.dispatch(Sum { a: beside(a), b: beside(b), out });
            }
            Layer::Upsample { from } => {
                let Shape { width, channels, .. } = before[from.0].shape;
                let rows = rows.start / 2..rows.end.div_ceil(2);
                let map = &before[from.0].data[rows.start * width * channels..];
                upsample(&map[..rows.len() * width * channels], (width, channels), out);
            }
            Layer::Join { .. } | Layer::Concat { .. } => unreachable!("there is none"),
        }
    }
}

/// Runs of layers that are made strip by strip together, and which layers are kept as a whole.
fn segments(network: &Network) -> (Vec<Range<usize>>, Vec<bool>) {
    let layers = &network.layers;
    let mut is_kept = vec![false; layers.len()];
    // What is looked at from other pixels.
    for layer in layers {
        match *layer {
            Layer::Input { .. }
            | Layer::Norm { .. }
            | Layer::Relu { .. }
            | Layer::Add { .. }
            | Layer::Concat { .. } => {}
            Layer::Conv { kernel, .. } if kernel == Kernel::POINTWISE => {}
            Layer::Conv { from, .. }
            | Layer::Depthwise { from, .. }
            | Layer::Upsample { from }
            | Layer::Join { from } => {
                is_kept[from.0] = true;
            }
        }
    }
    is_kept[0] = true;
    loop {
        let mut segments = Vec::new();
        let mut start = 1;
        for (k, is_kept) in is_kept.iter().enumerate().skip(1) {
            let goes_on = network
                .layers
                .get(k + 1)
                .is_some_and(|_| network.stride_of(Node(k + 1)) == network.stride_of(Node(start)));
            if *is_kept || !goes_on {
                segments.push(start..k + 1);
                start = k + 1;
            }
        }
        // What is looked at from another segment.
        let mut is_settled = true;
        for segment in &segments {
            for layer in segment.clone() {
                for from in layers[layer].reads() {
                    if from.0 < segment.start && !is_kept[from.0] {
                        is_kept[from.0] = true;
                        is_settled = false;
                    }
                }
            }
        }
        if is_settled {
            return (segments, is_kept);
        }
    }
}
