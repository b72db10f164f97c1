//! Measures the detector on one core: minimum and median time of several runs.
//! `cargo run --release -p chaic-vision --example detector_speed`.
use std::time::Instant;

use chaic_nn::simd::widest;
use chaic_nn::{Inference, Shape, Tensor, TrainingPass};
use chaic_vision::detector::Detector;
use chaic_vision::features::N_FEATURES;
use chaic_vision::trained::TrainedDetector;
use chaic_vision::views::{DatasetSplit, SyntheticViews, ViewConfig};

fn report(name: &str, n: usize, mut work: impl FnMut()) {
    let mut times: Vec<f64> = (0..n)
        .map(|_| {
            let start = Instant::now();
            work();
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!("{name:40} {:7.1} ms, median {:7.1} ms", times[0], times[n / 2]);
}

fn main() {
    let detector = Detector::new();
    let net = &detector.network;
    println!("{} parameters", net.n_parameters());
    let parameters = net.init_parameters(1);
    let shape = Shape { n: 1, height: 512, width: 512, channels: N_FEATURES };
    let mut inference = Inference::new(net, &parameters, widest());
    report("the network, 512x512", 30, || {
        inference.input(shape).fill(0.1);
        inference.run(|_, _, _| ());
    });
    let trained = TrainedDetector::built_in();
    let mut inference = trained.inference();
    let mut views = SyntheticViews::new(DatasetSplit::Validation, ViewConfig::NATURAL, 1, 0);
    for _ in 0..3 {
        let view = views.draw();
        let n = trained.detect(&view.rgb, &view.depth_m, &view.camera, &mut inference).len();
        report(&format!("an image, {n} instances"), 20, || {
            trained.detect(&view.rgb, &view.depth_m, &view.camera, &mut inference);
        });
    }
    for (n, side) in [(1, 512), (4, 256)] {
        let shape = Shape { n, height: side, width: side, channels: N_FEATURES };
        let input = Tensor { shape, data: vec![0.1; shape.len()] };
        let mut pass = TrainingPass::new(net, widest());
        let mut grad_parameters = vec![0.0; net.n_parameters()];
        report(&format!("forward pass, {n} of {side}x{side}"), 5, || {
            pass.forward(net, &parameters, &input);
        });
        report(&format!("backward pass, {n} of {side}x{side}"), 5, || {
            pass.zero_gradients();
            pass.backward(net, &parameters, &mut grad_parameters);
        });
    }
}
