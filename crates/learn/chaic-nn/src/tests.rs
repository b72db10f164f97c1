//! Gradients agree with finite differences, passes are bit-identical at every vector width, and a
//! network learns a simple task.

use chaic_core::rng::RngStream;

use crate::simd::{widest, widths};
use crate::{AdamW, AdamWConfig, Inference, Kernel, Network, NodeId, Shape, Tensor, TrainingPass};

/// Creates a network with strided, depthwise and upsampling layers. The output has half the
/// resolution of the input.
fn network_with_strided_layers() -> (Network, NodeId) {
    let mut net = Network::default();
    let input = net.input(3);
    let down = net.conv("stem", input, Kernel { size: 3, stride: 2 }, 16);
    let half_res = net.norm_relu("stem.norm", down);
    let quarter_res = net.conv("down", half_res, Kernel { size: 3, stride: 2 }, 16);
    let wide = net.depthwise("wide", quarter_res, 5);
    let norm = net.norm("wide.norm", wide);
    let small = net.depthwise("small", norm, 3);
    let positive = net.relu(small);
    let up = net.upsample(positive);
    let sum = net.add(up, half_res);
    let head = net.output_head("head", sum, 5);
    (net, head)
}

/// Creates a network that reduces two small maps to one vector.
fn network_with_reshapes() -> (Network, NodeId) {
    let mut net = Network::default();
    let input = net.input(3);
    let down = net.conv("stem", input, Kernel { size: 3, stride: 2 }, 16);
    let half_res = net.norm_relu("stem.norm", down);
    let quarter_res = net.conv("down", half_res, Kernel { size: 3, stride: 2 }, 16);
    let flat = net.flatten(quarter_res, 2);
    let each = net.conv("each", flat, Kernel::POINTWISE, 16);
    let norm = net.norm_relu("each.norm", each);
    let pair = net.concat_pairs(norm);
    let head = net.output_head("head", pair, 5);
    (net, head)
}

/// Creates a network that reads a map, a smaller map and a vector.
fn network_with_inputs() -> (Network, NodeId) {
    let mut net = Network::default();
    let map = net.input(3);
    let small_map = net.auxiliary_input(2, 2);
    let vector = net.auxiliary_input(5, 8);
    let down = net.conv("stem", map, Kernel { size: 3, stride: 2 }, 16);
    let half_res = net.norm_relu("stem.norm", down);
    let merged = net.concat(half_res, small_map);
    let quarter_res = net.conv("down", merged, Kernel { size: 3, stride: 2 }, 16);
    let flat = net.flatten(quarter_res, 2);
    let joined = net.concat(flat, vector);
    let dense = net.conv("dense", joined, Kernel::POINTWISE, 16);
    let norm = net.norm_relu("dense.norm", dense);
    let head = net.output_head("head", norm, 5);
    (net, head)
}

/// Creates a network whose rows attend to each other.
fn network_with_attention() -> (Network, NodeId) {
    let mut net = Network::default();
    let input = net.input(3);
    let embedding = net.conv("embedding", input, Kernel::POINTWISE, 16);
    let norm = net.norm("embedding.norm", embedding);
    let projected = ["query", "key", "value"].map(|n| net.conv(n, norm, Kernel::POINTWISE, 16));
    let attention = net.attention(projected, 2);
    let sum = net.add(attention, norm);
    let last = net.norm_relu("last.norm", sum);
    let head = net.output_head("head", last, 5);
    (net, head)
}

/// Creates a network whose rows read their neighbors in sequences of three.
fn network_with_sequences() -> (Network, NodeId) {
    let mut net = Network::default();
    let input = net.input(3);
    let embedding = net.conv("embedding", input, Kernel::POINTWISE, 16);
    let norm = net.norm("embedding.norm", embedding);
    let neighbors = net.concat_neighbors(norm, 3);
    let dense = net.conv("dense", neighbors, Kernel::POINTWISE, 16);
    let last = net.norm_relu("last.norm", dense);
    let head = net.output_head("head", last, 5);
    (net, head)
}

const ROWS: Shape = Shape { n: 6, height: 1, width: 1, channels: 3 };
const SMALL: Shape = Shape { n: 4, height: 8, width: 8, channels: 3 };

fn random(shape: Shape, seed: u64) -> Tensor {
    let mut rng = RngStream::new(seed, "tensor", 0);
    let data = (0..shape.len()).map(|_| rng.range(-1.0, 1.0)).collect();
    Tensor { shape, data }
}

const INPUT: Shape = Shape { n: 2, height: 12, width: 8, channels: 3 };

/// Returns random inputs of a network, given the shape of the first.
fn inputs(net: &Network, first: Shape) -> Vec<Tensor> {
    let shapes = net.input_shapes(first);
    shapes.into_iter().enumerate().map(|(k, shape)| random(shape, 1 + 10 * k as u64)).collect()
}

/// Returns the loss: the dot product of the output and fixed factors.
fn loss(
    net: &Network,
    head: NodeId,
    parameters: &[f32],
    inputs: &[Tensor],
    factors: &Tensor,
) -> f64 {
    let mut pass = TrainingPass::new(net, widest());
    pass.forward_all(net, parameters, &inputs.iter().collect::<Vec<_>>());
    let output = &pass.activation(head).data;
    output.iter().zip(&factors.data).map(|(x, f)| f64::from(*x) * f64::from(*f)).sum()
}

fn gradient(
    network: &(Network, NodeId),
    input: Shape,
    parameters: &[f32],
    arch: pulp::Arch,
) -> Vec<f32> {
    let (net, head) = (&network.0, network.1);
    let mut pass = TrainingPass::new(net, arch);
    let inputs = inputs(net, input);
    pass.forward_all(net, parameters, &inputs.iter().collect::<Vec<_>>());
    pass.zero_gradients();
    let shape = pass.activation(head).shape;
    *pass.gradient(head) = random(shape, 2);
    let mut grad_parameters = vec![0.0; net.n_parameters()];
    pass.backward(net, parameters, &mut grad_parameters);
    grad_parameters
}

#[test]
fn gradients_agree_with_finite_differences() {
    check_gradients(&network_with_strided_layers(), INPUT);
    check_gradients(&network_with_reshapes(), SMALL);
    check_gradients(&network_with_inputs(), SMALL);
    check_gradients(&network_with_attention(), ROWS);
    check_gradients(&network_with_sequences(), ROWS);
}

fn check_gradients(network: &(Network, NodeId), shape: Shape) {
    let (net, head) = (&network.0, network.1);
    let mut parameters = net.init_parameters(3);
    // Scales and shifts are perturbed, so that no activation lies at the kink of a ReLU.
    let mut rng = RngStream::new(4, "scales", 0);
    for p in net.parameters().iter().filter(|p| !p.has_weight_decay) {
        parameters[p.range.clone()].iter_mut().for_each(|x| *x += rng.range(-0.3, 0.3));
    }
    let inputs = inputs(net, shape);
    let factors = random(net.shape_of(head, shape), 2);
    let analytic = gradient(network, shape, &parameters, widest());
    for p in net.parameters() {
        let (mut max_error, mut scale) = (0.0_f64, 1e-3_f64);
        for k in p.range.clone().step_by(p.range.len().div_ceil(12)) {
            let at = |h: f32| {
                let mut shifted = parameters.clone();
                shifted[k] += h;
                loss(net, head, &shifted, &inputs, &factors)
            };
            let h = 2e-3;
            let numeric = (at(h) - at(-h)) / (2.0 * f64::from(h));
            max_error = max_error.max((numeric - f64::from(analytic[k])).abs());
            scale = scale.max(numeric.abs());
        }
        assert!(max_error < 0.03 * scale, "{}: off by {max_error} of {scale}", p.name);
    }
}

#[test]
fn passes_are_bit_identical_at_every_width() {
    for (network, input) in [
        (network_with_strided_layers(), INPUT),
        (network_with_reshapes(), SMALL),
        (network_with_inputs(), SMALL),
        (network_with_attention(), ROWS),
        (network_with_sequences(), ROWS),
    ] {
        let parameters = network.0.init_parameters(3);
        let expected = gradient(&network, input, &parameters, widest());
        for (name, arch) in widths() {
            assert!(gradient(&network, input, &parameters, arch) == expected, "{name}");
        }
    }
}

#[test]
fn passes_with_constant_parameters_are_bit_identical() {
    for ((net, head), first) in [
        (network_with_strided_layers(), INPUT),
        (network_with_reshapes(), SMALL),
        (network_with_inputs(), SMALL),
        (network_with_attention(), ROWS),
        (network_with_sequences(), ROWS),
    ] {
        let parameters = net.init_parameters(3);
        let inputs = inputs(&net, first);
        let inputs: Vec<&Tensor> = inputs.iter().collect();
        let mut expected = TrainingPass::new(&net, widest());
        expected.forward_all(&net, &parameters, &inputs);
        for (name, arch) in widths() {
            let mut pass = TrainingPass::with_constant_parameters(&net, &parameters, arch);
            for _ in 0..2 {
                pass.forward_all(&net, &parameters, &inputs);
                assert!(pass.activation(head) == expected.activation(head), "{name}");
            }
        }
    }
}

#[test]
fn maps_that_run_alone_after_any_node_are_bit_identical_to_those_of_the_batch() {
    for ((net, head), first) in
        [(network_with_strided_layers(), INPUT), (network_with_inputs(), SMALL)]
    {
        let parameters = net.init_parameters(3);
        let inputs = inputs(&net, first);
        let inputs: Vec<&Tensor> = inputs.iter().collect();
        let mut whole = TrainingPass::new(&net, widest());
        whole.forward_all(&net, &parameters, &inputs);
        let expected = whole.activation(head);
        for last in (inputs.len() - 1..head.0).map(NodeId) {
            let mut batch = TrainingPass::new(&net, widest());
            batch.forward_up_to(&net, &parameters, &inputs, last);
            let mut single = TrainingPass::with_constant_parameters(&net, &parameters, widest());
            let maps = expected.data.chunks_exact(expected.shape.len_per_item());
            for (map, expected) in maps.enumerate().rev() {
                single.forward_map_after(&net, &parameters, &batch, last, map);
                assert!(single.activation(head).data == expected, "map {map} after {last:?}");
            }
        }
    }
}

#[test]
fn rows_read_their_neighbors_in_their_own_sequence_only() {
    let mut net = Network::default();
    let input = net.input(1);
    let neighbors = net.concat_neighbors(input, 3);
    let shape = Shape { n: 6, height: 1, width: 1, channels: 1 };
    let rows = Tensor { shape, data: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] };
    let mut pass = TrainingPass::new(&net, widest());
    pass.forward(&net, &[], &rows);
    let expected = [
        [0.0, 1.0, 2.0],
        [1.0, 2.0, 3.0],
        [2.0, 3.0, 0.0],
        [0.0, 4.0, 5.0],
        [4.0, 5.0, 6.0],
        [5.0, 6.0, 0.0],
    ];
    assert_eq!(pass.activation(neighbors).data, expected.concat());
}

/// The brightness level (one of five) of each pixel can be learned in a few steps.
#[test]
fn a_network_learns() {
    let (net, head) = network_with_strided_layers();
    let mut parameters = net.init_parameters(5);
    let (mut adam, config) = (AdamW::new(parameters.len()), AdamWConfig::default());
    let mut pass = TrainingPass::new(&net, widest());
    let mut losses = Vec::new();
    for step in 0..60 {
        let input = random(INPUT, 100 + step);
        pass.forward(&net, &parameters, &input);
        pass.zero_gradients();
        let output = pass.activation(head).clone();
        let gradient = pass.gradient(head);
        let mut loss = 0.0;
        let n = output.shape.pixels() as f32;
        for y in 0..output.shape.n * output.shape.height {
            for x in 0..output.shape.width {
                let at = (y * output.shape.width + x) * 5;
                let brightness = input.data[(2 * y * INPUT.width + 2 * x) * 3];
                let level = ((brightness + 1.0) * 2.5).clamp(0.0, 4.0) as usize;
                for c in 0..5 {
                    let target = if c == level { 1.0 } else { 0.0 };
                    let error = output.data[at + c] - target;
                    loss += error * error / n;
                    gradient.data[at + c] = 2.0 * error / n;
                }
            }
        }
        losses.push(loss);
        let mut grad_parameters = vec![0.0; parameters.len()];
        pass.backward(&net, &parameters, &mut grad_parameters);
        adam.step(&config, 0.01, &net, &mut parameters, &grad_parameters);
    }
    let (first, last) = (losses[0], losses[55..].iter().sum::<f32>() / 5.0);
    assert!(last < 0.8 && last < 0.75 * first, "{first} to {last}");
}

#[test]
fn inference_is_bit_identical_to_a_pass_at_every_width() {
    let (net, head) = network_with_strided_layers();
    let parameters = net.init_parameters(3);
    // Strips that end within the map, and one that covers it.
    for (height, width) in [(12, 8), (160, 96), (8, 516)] {
        let input = random(Shape { n: 1, height, width, channels: 3 }, 1);
        let mut pass = TrainingPass::new(&net, widest());
        pass.forward(&net, &parameters, &input);
        for (name, arch) in widths() {
            let mut inference = Inference::new(&net, &parameters, arch);
            for _ in 0..2 {
                inference.input(input.shape).copy_from_slice(&input.data);
                let mut output = Vec::new();
                inference.run(|_, _, strip| output.extend_from_slice(strip));
                assert!(output == pass.activation(head).data, "{height} x {width}, {name}");
            }
        }
    }
}
