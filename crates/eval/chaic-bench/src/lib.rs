//! Benchmarks of rendering and stepping on this machine. Results never reach a trace or a score.

mod env;
mod gpu;
mod machine;
mod render;
mod scene;
mod world;

use std::time::{Duration, Instant};

pub use env::{EnvBench, EnvSpeed};
pub use gpu::{GpuBench, GpuSpeed};
pub use machine::Machine;
pub use render::{RenderBench, RenderSpeed, parse_channels, parse_channels_or_none};
pub use scene::{BenchScene, N_VIEWS};
pub use world::{WorldSpeed, measure_world};

/// Wall and CPU time since construction.
struct Stopwatch {
    start: Instant,
    cpu_start: Option<Duration>,
}

impl Stopwatch {
    fn start() -> Stopwatch {
        Stopwatch { start: Instant::now(), cpu_start: cpu_time() }
    }

    fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Returns the CPU time of all threads; `None` if the system does not provide it.
    fn cpu(&self) -> Option<Duration> {
        cpu_time()?.checked_sub(self.cpu_start?)
    }
}

#[cfg(unix)]
fn cpu_time() -> Option<Duration> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(Duration::new(u64::try_from(time.tv_sec).ok()?, u32::try_from(time.tv_nsec).ok()?))
}

#[cfg(not(unix))]
fn cpu_time() -> Option<Duration> {
    None
}

/// Returns the mean duration of `n` items, milliseconds.
fn ms_each(whole: Duration, n: u64) -> f64 {
    1e3 * whole.as_secs_f64() / n as f64
}
