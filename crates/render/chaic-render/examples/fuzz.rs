//! Draws pictures of random and hostile worlds:
//! `cargo run --release -p chaic-render --example fuzz -- 10000 [FIRST]`.
//!
//! So many seeds, from FIRST on (0 if it isn't given), each a setup, a state, cameras and a plan.
//! It says which seeds break a promise, and ends with exit code 1 if there are any. See
//! `tests/hostile` for what is promised.

use chaic_test_kit::hostile;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::time::Instant;

/// Seeds that take longer are named, seconds.
const SLOW_S: f64 = 2.0;

fn main() -> ExitCode {
    let number = |k: usize, usual: u64| {
        std::env::args().nth(k).map_or(Ok(usual), |text| text.parse::<u64>())
    };
    let (Ok(n), Ok(first)) = (number(1, 1000), number(2, 0)) else {
        eprintln!("expected how many seeds, and from which on");
        return ExitCode::from(2);
    };
    let pools = hostile::pools();
    let (mut failures, mut plans) = (0, 0);
    for seed in first..first + n {
        let start = Instant::now();
        // One in two thousand has more things than a usual episode by far.
        let n_things = (seed % 2000 == 1999).then_some(9000);
        let pictures = || hostile::check(&hostile::case(seed, n_things), &pools);
        let pictures = catch_unwind(AssertUnwindSafe(pictures)).is_ok();
        let plan = catch_unwind(|| hostile::check_plan(seed));
        plans += u64::from(*plan.as_ref().unwrap_or(&false));
        if !pictures || plan.is_err() {
            let what = if pictures { "plan" } else { "pictures" };
            println!("seed {seed}: broken {what}");
            failures += 1;
        }
        let took = start.elapsed().as_secs_f64();
        if took > SLOW_S {
            println!("seed {seed}: slow, {took:.1} s");
        }
    }
    println!("{n} seeds, {plans} plans, {failures} failures");
    if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
