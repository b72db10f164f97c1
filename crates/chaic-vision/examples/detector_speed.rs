//! How long the detector takes: `cargo run --release -p chaic-vision --example detector_speed`.
use std::time::Instant;

use chaic_nn::simd::widest;
use chaic_nn::{Inference, Pass, Shape, Tensor};
use chaic_vision::detector::Detector;
use chaic_vision::features::N_FEATURES;
use chaic_vision::trained::TrainedDetector;
use chaic_vision::views::{Part, ViewRules, Views};

fn main() {
    let detector = Detector::new();
    let net = &detector.network;
    println!("{} parameters", net.n_numbers());
    let numbers = net.begin(1);
    let shape = Shape { n: 1, height: 512, width: 512, channels: N_FEATURES };
    let mut inference = Inference::new(net, widest());
    for _ in 0..5 {
        let t = Instant::now();
        inference.input(shape).fill(0.1);
        inference.run(net, &numbers, |_, _, _| ());
        println!("1 x 512: inference {:?}", t.elapsed());
    }
    let view = Views::new(Part::Validation, ViewRules::TRAINING, 1, 0).draw();
    let trained = TrainedDetector::uncalibrated(&detector, &numbers);
    for _ in 0..5 {
        let t = Instant::now();
        let image = (&view.rgb[..], &view.depth_m[..], &view.camera);
        let found = trained.detect(image, &mut inference);
        println!("an image: {:?}, {} instances", t.elapsed(), found.len());
    }
    for (n, side) in [(1, 512), (4, 256)] {
        let shape = Shape { n, height: side, width: side, channels: N_FEATURES };
        let input = Tensor { shape, data: vec![0.1; shape.numbers()] };
        let mut pass = Pass::new(net, widest());
        let mut by = vec![0.0; net.n_numbers()];
        for _ in 0..3 {
            let t = Instant::now();
            pass.forward(net, &numbers, &input);
            let forward = t.elapsed();
            pass.begin_backward();
            pass.backward(net, &numbers, &mut by);
            println!("{n} x {side}: forward {forward:?}, both {:?}", t.elapsed());
        }
    }
}
