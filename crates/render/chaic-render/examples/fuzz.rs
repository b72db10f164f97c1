//! Renders random and hostile worlds:
//! `cargo run --release -p chaic-render --example fuzz -- 10000 [FIRST]`.
//!
//! The arguments are the number of seeds and the first seed (default 0). Each seed gives a setup, a
//! state, cameras and a floor plan. The program prints the seeds that break a promise, and exits
//! with code 1 if there are any. See `tests/hostile` for the promises.

use chaic_test_kit::hostile;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::time::Instant;

/// Seeds that take longer are printed, seconds.
const SLOW_S: f64 = 2.0;

fn main() -> ExitCode {
    let argument = |k: usize, default: u64| {
        std::env::args().nth(k).map_or(Ok(default), |text| text.parse::<u64>())
    };
    let (Ok(n), Ok(first)) = (argument(1, 1000), argument(2, 0)) else {
        eprintln!("expected the number of seeds and the first seed");
        return ExitCode::from(2);
    };
    let pools = hostile::pools();
    let (mut failures, mut plans) = (0, 0);
    for seed in first..first + n {
        let start = Instant::now();
        // One seed in 2000 has far more objects than a normal episode.
        let n_things = (seed % 2000 == 1999).then_some(9000);
        let images = || hostile::check(&hostile::case(seed, n_things), &pools);
        let images = catch_unwind(AssertUnwindSafe(images)).is_ok();
        let plan = catch_unwind(|| hostile::check_plan(seed));
        plans += u64::from(*plan.as_ref().unwrap_or(&false));
        if !images || plan.is_err() {
            let target = if images { "plan" } else { "pictures" };
            println!("seed {seed}: broken {target}");
            failures += 1;
        }
        let elapsed_s = start.elapsed().as_secs_f64();
        if elapsed_s > SLOW_S {
            println!("seed {seed}: slow, {elapsed_s:.1} s");
        }
    }
    println!("{n} seeds, {plans} plans, {failures} failures");
    if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
