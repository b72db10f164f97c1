//! Benchmarks of rendering and stepping on this machine. Results never reach a trace or a score.

mod env;
mod gpu;
mod machine;
mod queueing;
mod render;
mod scaling;
mod scene;
mod world;

use std::time::{Duration, Instant};

use chaic_eval::{EvalError, Result};

pub use env::{EnvBench, EnvSetup, EnvSpeed};
pub use gpu::{GpuBench, GpuSpeed};
pub use machine::Machine;
pub use render::{RenderBench, RenderSpeed, parse_channels, parse_channels_or_none};
pub use scaling::{Cluster, ClusterSpeed, CoreSpeed, ScalingBench, ScalingEstimate};
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

/// Runs `work` on a pool of its own. Its progress reaches the calling thread, since progress bars cannot be
/// shared between threads.
fn with_threads<T: Send>(
    threads: usize,
    progress: &mut dyn FnMut(f32),
    work: impl FnOnce(&mut dyn FnMut(f32)) -> Result<T> + Send,
) -> Result<T> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool =
        pool.map_err(|problem| EvalError::Options(format!("cannot start threads: {problem}")))?;
    let (sender, receiver) = std::sync::mpsc::channel();
    std::thread::scope(|scope| {
        let work = scope.spawn(move || {
            pool.install(|| {
                work(&mut |fraction| {
                    let _ = sender.send(fraction);
                })
            })
        });
        receiver.iter().for_each(progress);
        work.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// Returns the mean duration of `n` items, milliseconds.
fn ms_each(whole: Duration, n: u64) -> f64 {
    1e3 * whole.as_secs_f64() / n as f64
}
