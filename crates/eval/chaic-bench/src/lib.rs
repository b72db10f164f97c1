//! How fast this machine draws and steps. Nothing measured here reaches a trace or a score.

mod env;
mod machine;
mod render;
mod scene;
mod world;

use std::time::{Duration, Instant};

pub use env::{EnvBench, EnvSpeed};
pub use machine::Machine;
pub use render::{RenderBench, RenderSpeed, channels_named, channels_or_none};
pub use scene::{BenchScene, N_VIEWS};
pub use world::{WorldSpeed, measure_world};

/// Wall and processor time since it was made.
struct Clock {
    began: Instant,
    cpu_began: Option<Duration>,
}

impl Clock {
    fn start() -> Clock {
        Clock { began: Instant::now(), cpu_began: cpu_time() }
    }

    fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }

    /// Processor time of all threads; `None` where the system doesn't tell.
    fn cpu(&self) -> Option<Duration> {
        cpu_time()?.checked_sub(self.cpu_began?)
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

/// Milliseconds of a part of so many.
fn ms_each(whole: Duration, n: u64) -> f64 {
    1e3 * whole.as_secs_f64() / n as f64
}
