//! Throughput of the GPU renderer. Needs the feature `gpu`.

use chaic_eval::{EvalError, Result};
use chaic_render::Channels;
use serde::Serialize;

use super::Machine;

/// Configuration of a benchmark of the GPU renderer.
#[derive(Clone, Copy, Debug)]
pub struct GpuBench {
    /// Number of worlds; they take the bundled training episodes of the paper's tasks in turn.
    pub worlds: usize,
    /// Side of the images, pixels.
    pub size: u32,
    /// Image channels.
    pub channels: Channels,
    /// True if a software device is accepted; its speed is not that of a GPU.
    pub allows_software: bool,
    /// Minimum duration of each measurement, seconds.
    pub seconds: f32,
}

/// Result of a benchmark of the GPU renderer. Images stay on the device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GpuSpeed {
    /// Name of the adapter.
    pub adapter: String,
    /// Number of worlds.
    pub worlds: usize,
    /// Number of views in a batch: one per world, or as many as fit.
    pub views: usize,
    /// Side of the images, pixels.
    pub size: u32,
    /// Image channels, for example `rgb+depth+ids`.
    pub channels: String,
    /// Device memory of the worlds, bytes.
    pub world_bytes: u64,
    /// World updates per second on one thread of the host.
    pub updates_per_second: f64,
    /// Images per second of worlds that do not change.
    pub frames_per_second: f64,
    /// Images per second if all worlds are updated before each batch.
    pub frames_per_second_with_updates: f64,
    /// Machine and build.
    pub machine: Machine,
}

impl GpuBench {
    /// Renders and measures.
    ///
    /// # Errors
    /// If this build has no GPU renderer, no adapter is found, or rendering fails.
    #[cfg(not(feature = "gpu"))]
    pub fn measure(&self) -> Result<GpuSpeed> {
        Err(EvalError::Options(
            "this build has no GPU renderer; build with `cargo build --release --features gpu`"
                .to_owned(),
        ))
    }

    /// Renders and measures.
    ///
    /// # Errors
    /// If this build has no GPU renderer, no adapter is found, or rendering fails.
    #[cfg(feature = "gpu")]
    pub fn measure(&self) -> Result<GpuSpeed> {
        measurement::measure(self).map_err(|e| EvalError::Options(e.to_string()))
    }
}

#[cfg(feature = "gpu")]
mod measurement {
    use std::error::Error;
    use std::time::{Duration, Instant};

    use chaic_core::TaskId;
    use chaic_episodes::find_episode;
    use chaic_render::{Channels, Scene, View};
    use chaic_render_gpu::{Adapters, Gpu, GpuError, WorldId};
    use chaic_world::{Rules, World};

    use super::{GpuBench, GpuSpeed};
    use crate::Machine;
    use crate::render::channel_names;

    struct UploadedWorld {
        id: WorldId,
        world: World,
        scene: Scene,
    }

    pub fn measure(bench: &GpuBench) -> Result<GpuSpeed, Box<dyn Error>> {
        let adapters = if bench.allows_software { Adapters::Any } else { Adapters::Hardware };
        let mut gpu = Gpu::new(adapters)?;
        let worlds = upload(&mut gpu, bench.worlds)?;
        let duration = Duration::from_secs_f32(bench.seconds);
        let updates_per_second = updates_per_second(&mut gpu, &worlds, duration)?;
        let mut views = helper_views(&worlds, bench.size, bench.channels);
        match gpu.render(&views) {
            Ok(batch) => batch.wait()?,
            Err(GpuError::TooLargeBatch { max, .. }) => views.truncate(max as usize),
            Err(error) => return Err(error.into()),
        }
        Ok(GpuSpeed {
            adapter: gpu.name(),
            worlds: worlds.len(),
            views: views.len(),
            size: bench.size,
            channels: channel_names(bench.channels),
            world_bytes: gpu.world_bytes(),
            updates_per_second,
            frames_per_second: frames_per_second(&mut gpu, &views, &[], duration)?,
            frames_per_second_with_updates: frames_per_second(&mut gpu, &views, &worlds, duration)?,
            machine: Machine::current(),
        })
    }

    fn upload(gpu: &mut Gpu, n_worlds: usize) -> Result<Vec<UploadedWorld>, Box<dyn Error>> {
        /// Number of bundled training episodes of each task.
        const N_EPISODES: usize = 12;
        let tasks: Vec<TaskId> = TaskId::paper().collect();
        let mut worlds = Vec::new();
        for k in 0..n_worlds {
            let task = tasks[k % tasks.len()];
            let episode =
                find_episode(&format!("{task}/train/{:02}", k / tasks.len() % N_EPISODES))?;
            let world = World::new(episode.setup().clone(), Rules::paper())?;
            let scene = Scene::new(world.setup());
            let id = gpu.add(&scene, &world)?;
            worlds.push(UploadedWorld { id, world, scene });
        }
        Ok(worlds)
    }

    /// Returns the view of the helper, or of the only agent, of each world.
    fn helper_views(
        worlds: &[UploadedWorld],
        size: u32,
        channels: Channels,
    ) -> Vec<(WorldId, View)> {
        let view = |UploadedWorld { id, world, .. }: &UploadedWorld| {
            let agent = world.setup().agents().take(2).last()?;
            Some((*id, View::from_eye(agent, world.camera(agent, size), channels)))
        };
        worlds.iter().filter_map(view).collect()
    }

    fn update_all(gpu: &mut Gpu, worlds: &[UploadedWorld]) -> Result<(), GpuError> {
        worlds.iter().try_for_each(|w| gpu.update(w.id, &w.scene, &w.world))
    }

    fn updates_per_second(
        gpu: &mut Gpu,
        worlds: &[UploadedWorld],
        duration: Duration,
    ) -> Result<f64, GpuError> {
        let small = helper_views(&worlds[..1], 8, Channels::DEPTH_AND_IDS);
        let (mut elapsed, mut n) = (Duration::ZERO, 0);
        while n == 0 || elapsed < duration {
            let start = Instant::now();
            update_all(gpu, worlds)?;
            elapsed += start.elapsed();
            n += worlds.len();
            // Rendering recycles staging memory.
            gpu.render(&small)?.wait()?;
        }
        Ok(n as f64 / elapsed.as_secs_f64())
    }

    /// Returns the images per second; `updated` worlds are updated before each batch.
    fn frames_per_second(
        gpu: &mut Gpu,
        views: &[(WorldId, View)],
        updated: &[UploadedWorld],
        duration: Duration,
    ) -> Result<f64, GpuError> {
        gpu.render(views)?.wait()?;
        let (start, mut n) = (Instant::now(), 0);
        while n == 0 || start.elapsed() < duration {
            update_all(gpu, updated)?;
            gpu.render(views)?.wait()?;
            n += views.len();
        }
        Ok(n as f64 / start.elapsed().as_secs_f64())
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;

    #[test]
    fn the_gpu_benchmark_measures_every_rate() {
        let bench = GpuBench {
            worlds: 3,
            size: 32,
            channels: Channels::ALL,
            allows_software: true,
            seconds: 0.0,
        };
        let speed = match bench.measure() {
            // As in chaic-render-gpu: a missing driver is an error only where CI=true promises one.
            Err(error) if std::env::var_os("CI").is_none() => {
                eprintln!("skipped: {error}");
                return;
            }
            result => result.unwrap(),
        };
        assert_eq!((speed.worlds, speed.views), (3, 3));
        assert_eq!(speed.channels, "rgb+depth+ids");
        assert!(speed.world_bytes > 0);
        for rate in [
            speed.updates_per_second,
            speed.frames_per_second,
            speed.frames_per_second_with_updates,
        ] {
            assert!(rate.is_finite() && rate > 0.0, "{speed:?}");
        }
    }
}
