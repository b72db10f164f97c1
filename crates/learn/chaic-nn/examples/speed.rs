//! How fast products, convolutions and passes are on one core of this machine:
//! `cargo run --release -p chaic-nn --example speed`.

use std::hint::black_box;
use std::time::Instant;

use chaic_nn::conv::{self, Patches};
use chaic_nn::depthwise::{self, Padded, Zeros};
use chaic_nn::gemm::{Matrix, Workspace, add_product};
use chaic_nn::simd::widest;
use chaic_nn::{Kernel, Shape};

/// The least time of a few, seconds.
fn least_s(mut work: impl FnMut()) -> f64 {
    let times = (0..7).map(|_| {
        let began = Instant::now();
        work();
        began.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

fn report(what: &str, gmac: f64, s: f64) {
    println!("{what:44} {:8.3} ms {:7.1} GFLOP/s", 1e3 * s, 2.0 * gmac / s);
}

fn main() {
    let arch = widest();
    let mut space = Workspace::default();
    for (m, k, n) in [(16384, 48, 96), (4096, 160, 80), (1024, 320, 160), (65536, 48, 64)] {
        let (a, b, mut c) = (vec![0.5; m * k], vec![0.25; k * n], vec![0.0; m * n]);
        let gmac = 1e-9 * (m * k * n) as f64;
        let (left, right) = (Matrix::row_major(&a, m, k), Matrix::row_major(&b, k, n));
        let s = least_s(|| add_product(arch, black_box(&mut c), left, right, &mut space));
        report(&format!("product {m} x {k} x {n}"), gmac, s);
        let grad = Matrix::row_major(&c, m, n);
        let mut by = vec![0.0; k * n];
        let left = left.transposed();
        let s = least_s(|| add_product(arch, black_box(&mut by), left, grad, &mut space));
        report("  gradient by the right one", gmac, s);
        let mut by = vec![0.0; m * k];
        let right = right.transposed();
        let s = least_s(|| add_product(arch, black_box(&mut by), grad, right, &mut space));
        report("  gradient by the left one", gmac, s);
    }
    for (side, height, channels) in [(5, 128, 48), (5, 64, 80), (5, 32, 160), (3, 128, 48)] {
        let shape = Shape { n: 1, height, width: height, channels };
        let (map, mut out) = (vec![0.5; shape.of_one()], vec![0.0; shape.of_one()]);
        let mut weights = vec![0.1; side * side * channels];
        let gmac = 1e-9 * (shape.of_one() * side * side) as f64;
        let (mut padded, mut zeros) = (Padded::default(), Zeros::default());
        let s = least_s(|| {
            depthwise::forward(arch, (&map, shape), (&weights, side), &mut out, &mut zeros);
        });
        report(&format!("depthwise {side}x{side}, {height}x{height}x{channels}"), gmac, s);
        let s = least_s(|| {
            let by = (&mut weights[..], side);
            depthwise::backward_weights(arch, &map, &out, shape, by, &mut padded);
        });
        report("  gradient by the weights", gmac, s);
    }
    let shape = Shape { n: 1, height: 512, width: 512, channels: 8 };
    let kernel = Kernel { side: 3, stride: 2 };
    let map = vec![0.5; shape.of_one()];
    let (weights, mut out) = (vec![0.1; kernel.patch(8) * 32], vec![0.0; 65536 * 32]);
    let mut patches = Patches::default();
    let s = least_s(|| {
        conv::forward(arch, (&map, shape), (&weights, None, kernel), (&mut out, 32), &mut patches);
    });
    report("dense 3x3 stride 2, 512x512x8 to 32", 1e-9 * (65536 * 72 * 32) as f64, s);
}
