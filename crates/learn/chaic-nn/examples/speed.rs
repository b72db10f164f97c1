//! Measures products, convolutions and passes on one core: `cargo run --release -p chaic-nn
//! --example speed`.

use std::hint::black_box;
use std::time::Instant;

use chaic_nn::conv::{self, Im2colBuffers};
use chaic_nn::depthwise::{self, PaddedMap, ZeroRow};
use chaic_nn::gemm::{Matrix, Workspace, gemm};
use chaic_nn::simd::widest;
use chaic_nn::{Kernel, Shape, TensorView};

/// Returns the minimum time of seven runs, seconds.
fn min_time_s(mut work: impl FnMut()) -> f64 {
    let times = (0..7).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

fn report(name: &str, gmac: f64, s: f64) {
    println!("{name:44} {:8.3} ms {:7.1} GFLOP/s", 1e3 * s, 2.0 * gmac / s);
}

fn main() {
    let arch = widest();
    let mut workspace = Workspace::default();
    for (m, k, n) in [
        (16384, 48, 96),
        (4096, 160, 80),
        (1024, 320, 160),
        (65536, 48, 64),
        (16384, 64, 32),
        (4096, 288, 32),
    ] {
        let (a, b, mut c) = (vec![0.5; m * k], vec![0.25; k * n], vec![0.0; m * n]);
        let gmac = 1e-9 * (m * k * n) as f64;
        let (left, right) = (Matrix::row_major(&a, m, k), Matrix::row_major(&b, k, n));
        let s = min_time_s(|| gemm(arch, black_box(&mut c), left, right, &mut workspace));
        report(&format!("product {m} x {k} x {n}"), gmac, s);
        let grad_out = Matrix::row_major(&c, m, n);
        let mut grad_right = vec![0.0; k * n];
        let left = left.transposed();
        let s =
            min_time_s(|| gemm(arch, black_box(&mut grad_right), left, grad_out, &mut workspace));
        report("  gradient of the right matrix", gmac, s);
        let mut grad_left = vec![0.0; m * k];
        let right = right.transposed();
        let s =
            min_time_s(|| gemm(arch, black_box(&mut grad_left), grad_out, right, &mut workspace));
        report("  gradient of the left matrix", gmac, s);
    }
    for (size, height, channels) in [(5, 128, 48), (5, 64, 80), (5, 32, 160), (3, 128, 48)] {
        let shape = Shape { n: 1, height, width: height, channels };
        let (map, mut out) = (vec![0.5; shape.len_per_item()], vec![0.0; shape.len_per_item()]);
        let mut weights = vec![0.1; size * size * channels];
        let gmac = 1e-9 * (shape.len_per_item() * size * size) as f64;
        let input = TensorView::new(&map, shape);
        let (mut padded, mut zeros) = (PaddedMap::default(), ZeroRow::default());
        let s = min_time_s(|| {
            depthwise::forward(arch, input, &weights, size, &mut out, &mut zeros);
        });
        report(&format!("depthwise {size}x{size}, {height}x{height}x{channels}"), gmac, s);
        let s = min_time_s(|| {
            depthwise::backward_weights(arch, input, &out, &mut weights, size, &mut padded);
        });
        report("  gradient of the weights", gmac, s);
    }
    let shape = Shape { n: 1, height: 512, width: 512, channels: 8 };
    let kernel = Kernel { size: 3, stride: 2 };
    let map = vec![0.5; shape.len_per_item()];
    let (weights, mut out) = (vec![0.1; kernel.patch_len(8) * 32], vec![0.0; 65536 * 32]);
    let mut buffers = Im2colBuffers::default();
    let s = min_time_s(|| {
        let input = TensorView::new(&map, shape);
        conv::forward(arch, input, &weights, None, kernel, &mut out, &mut buffers);
    });
    report("dense 3x3 stride 2, 512x512x8 to 32", 1e-9 * (65536 * 72 * 32) as f64, s);
}
