//! Promises: gradients are those of finite differences, passes are the same bits at every width, and
//! a network learns what is put before it.

use chaic_core::rng::Stream;

use crate::simd::{widest, widths};
use crate::{Adam, AdamRules, Inference, Kernel, Network, Node, Pass, Shape, Tensor};

/// A network with every kind of layer; its output has half as many rows and columns as its input.
fn every_layer() -> (Network, Node) {
    let mut net = Network::default();
    let input = net.input(3);
    let down = net.conv("stem", input, Kernel { side: 3, stride: 2 }, 16);
    let half = net.norm_relu("stem.norm", down);
    let lower = net.conv("down", half, Kernel { side: 3, stride: 2 }, 16);
    let wide = net.depthwise("wide", lower, 5);
    let norm = net.norm("wide.norm", wide);
    let small = net.depthwise("small", norm, 3);
    let positive = net.relu(small);
    let up = net.upsample(positive);
    let sum = net.add(up, half);
    let head = net.head("head", sum, 5);
    (net, head)
}

/// A network that makes one number list of two small maps.
fn joined() -> (Network, Node) {
    let mut net = Network::default();
    let input = net.input(3);
    let down = net.conv("stem", input, Kernel { side: 3, stride: 2 }, 16);
    let half = net.norm_relu("stem.norm", down);
    let lower = net.conv("down", half, Kernel { side: 3, stride: 2 }, 16);
    let flat = net.flatten(lower, 2);
    let each = net.conv("each", flat, Kernel::POINTWISE, 16);
    let norm = net.norm_relu("each.norm", each);
    let pair = net.pair(norm);
    let head = net.head("head", pair, 5);
    (net, head)
}

/// A network that reads a map, a smaller one, and a few numbers.
fn of_several() -> (Network, Node) {
    let mut net = Network::default();
    let map = net.input(3);
    let small_map = net.side_input(2, 2);
    let few = net.side_input(5, 8);
    let down = net.conv("stem", map, Kernel { side: 3, stride: 2 }, 16);
    let half = net.norm_relu("stem.norm", down);
    let both = net.concat(half, small_map);
    let lower = net.conv("down", both, Kernel { side: 3, stride: 2 }, 16);
    let flat = net.flatten(lower, 2);
    let all = net.concat(flat, few);
    let dense = net.conv("dense", all, Kernel::POINTWISE, 16);
    let norm = net.norm_relu("dense.norm", dense);
    let head = net.head("head", norm, 5);
    (net, head)
}

const SMALL: Shape = Shape { n: 4, height: 8, width: 8, channels: 3 };

fn random(shape: Shape, seed: u64) -> Tensor {
    let mut rng = Stream::new(seed, "tensor", 0);
    let data = (0..shape.numbers()).map(|_| rng.range(-1.0, 1.0)).collect();
    Tensor { shape, data }
}

const INPUT: Shape = Shape { n: 2, height: 12, width: 8, channels: 3 };

/// What a network reads, the first input being of this shape.
fn inputs(net: &Network, first: Shape) -> Vec<Tensor> {
    let shapes = net.input_shapes(first);
    shapes.into_iter().enumerate().map(|(k, shape)| random(shape, 1 + 10 * k as u64)).collect()
}

/// The loss: the output times fixed numbers.
fn loss(net: &Network, head: Node, numbers: &[f32], inputs: &[Tensor], factors: &Tensor) -> f64 {
    let mut pass = Pass::new(net, widest());
    pass.forward_all(net, numbers, &inputs.iter().collect::<Vec<_>>());
    let made = &pass.made(head).data;
    made.iter().zip(&factors.data).map(|(x, f)| f64::from(*x) * f64::from(*f)).sum()
}

fn gradient(
    (net, head): &(Network, Node),
    input: Shape,
    numbers: &[f32],
    arch: pulp::Arch,
) -> Vec<f32> {
    let head = *head;
    let mut pass = Pass::new(net, arch);
    let inputs = inputs(net, input);
    pass.forward_all(net, numbers, &inputs.iter().collect::<Vec<_>>());
    pass.begin_backward();
    let shape = pass.made(head).shape;
    *pass.gradient(head) = random(shape, 2);
    let mut by_numbers = vec![0.0; net.n_numbers()];
    pass.backward(net, numbers, &mut by_numbers);
    by_numbers
}

#[test]
fn gradients_are_those_of_finite_differences() {
    check_gradients(&every_layer(), INPUT);
    check_gradients(&joined(), SMALL);
    check_gradients(&of_several(), SMALL);
}

fn check_gradients(of: &(Network, Node), shape: Shape) {
    let (net, head) = (&of.0, of.1);
    let mut numbers = net.begin(3);
    // Nothing at a bend: scales and shifts of their own.
    let mut rng = Stream::new(4, "scales", 0);
    for p in net.parameters().iter().filter(|p| !p.decays) {
        numbers[p.range.clone()].iter_mut().for_each(|x| *x += rng.range(-0.3, 0.3));
    }
    let inputs = inputs(net, shape);
    let factors = random(net.shape_of(head, shape), 2);
    let exact = gradient(of, shape, &numbers, widest());
    for p in net.parameters() {
        let (mut worst, mut scale) = (0.0_f64, 1e-3_f64);
        for k in p.range.clone().step_by(p.range.len().div_ceil(12)) {
            let at = |h: f32| {
                let mut moved = numbers.clone();
                moved[k] += h;
                loss(net, head, &moved, &inputs, &factors)
            };
            let h = 2e-3;
            let measured = (at(h) - at(-h)) / (2.0 * f64::from(h));
            worst = worst.max((measured - f64::from(exact[k])).abs());
            scale = scale.max(measured.abs());
        }
        assert!(worst < 0.03 * scale, "{}: off by {worst} of {scale}", p.name);
    }
}

#[test]
fn passes_are_the_same_bits_at_every_width() {
    for (of, input) in [(every_layer(), INPUT), (joined(), SMALL), (of_several(), SMALL)] {
        let numbers = of.0.begin(3);
        let expected = gradient(&of, input, &numbers, widest());
        for (name, arch) in widths() {
            assert!(gradient(&of, input, &numbers, arch) == expected, "{name}");
        }
    }
}

/// Which of five stripes of brightness each pixel lies in can be learned in a few steps.
#[test]
fn a_network_learns() {
    let (net, head) = every_layer();
    let mut numbers = net.begin(5);
    let (mut adam, rules) = (Adam::new(numbers.len()), AdamRules::default());
    let mut pass = Pass::new(&net, widest());
    let mut losses = Vec::new();
    for step in 0..60 {
        let input = random(INPUT, 100 + step);
        pass.forward(&net, &numbers, &input);
        pass.begin_backward();
        let made = pass.made(head).clone();
        let gradient = pass.gradient(head);
        let mut loss = 0.0;
        let n = made.shape.pixels() as f32;
        for y in 0..made.shape.n * made.shape.height {
            for x in 0..made.shape.width {
                let at = (y * made.shape.width + x) * 5;
                let brightness = input.data[(2 * y * INPUT.width + 2 * x) * 3];
                let stripe = ((brightness + 1.0) * 2.5).clamp(0.0, 4.0) as usize;
                for c in 0..5 {
                    let wanted = if c == stripe { 1.0 } else { 0.0 };
                    let error = made.data[at + c] - wanted;
                    loss += error * error / n;
                    gradient.data[at + c] = 2.0 * error / n;
                }
            }
        }
        losses.push(loss);
        let mut by_numbers = vec![0.0; numbers.len()];
        pass.backward(&net, &numbers, &mut by_numbers);
        adam.step(&rules, 0.01, &net, &mut numbers, &by_numbers);
    }
    let (first, last) = (losses[0], losses[55..].iter().sum::<f32>() / 5.0);
    assert!(last < 0.8 && last < 0.75 * first, "{first} to {last}");
}

#[test]
fn inference_makes_the_same_bits_as_a_pass_at_every_width_of_vectors() {
    let (net, head) = every_layer();
    let numbers = net.begin(3);
    // Strips that end within the map, and one that is the whole of it.
    for (height, width) in [(12, 8), (160, 96), (8, 516)] {
        let input = random(Shape { n: 1, height, width, channels: 3 }, 1);
        let mut pass = Pass::new(&net, widest());
        pass.forward(&net, &numbers, &input);
        for (name, arch) in widths() {
            let mut inference = Inference::new(&net, &numbers, arch);
            for _ in 0..2 {
                inference.input(input.shape).copy_from_slice(&input.data);
                let mut made = Vec::new();
                inference.run(|_, _, strip| made.extend_from_slice(strip));
                assert!(made == pass.made(head).data, "{height} x {width}, {name}");
            }
        }
    }
}
