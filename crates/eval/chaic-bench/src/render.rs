//! Throughput of rendering.

use std::hint::black_box;
use std::time::Duration;

use chaic_render::{Channels, Scene, View};
use rayon::prelude::*;
use serde::Serialize;

use super::{BenchScene, Machine, Stopwatch, ms_each};
use chaic_eval::{EvalError, Result};

/// Configuration of a rendering benchmark.
#[derive(Clone, Copy, Debug)]
pub struct RenderBench<'a> {
    /// Scene with cameras.
    pub scene: &'a BenchScene,
    /// Image channels.
    pub channels: Channels,
    /// Number of threads; each renders separate images.
    pub threads: usize,
    /// Minimum duration, seconds; complete rounds of all cameras are rendered.
    pub seconds: f32,
}

/// Result of a rendering benchmark.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RenderSpeed {
    /// Name of the scene.
    pub scene: String,
    /// Side of the images, pixels.
    pub size: u32,
    /// Image channels, for example `rgb+depth+ids`.
    pub channels: String,
    /// Number of threads.
    pub threads: usize,
    /// Number of cameras, used in turn.
    pub views: usize,
    /// Number of objects in the scene.
    pub objects: usize,
    /// Number of triangles of the whole scene at the finest level of detail. An image shows a part
    /// of them, most at coarser levels.
    pub triangles: usize,
    /// Number of images.
    pub frames: u64,
    /// Wall time, seconds.
    pub seconds: f64,
    /// Wall time per image, milliseconds.
    pub ms_per_frame: f64,
    /// CPU time per image, milliseconds: on an idle machine, the wall time times the number of
    /// threads.
    pub cpu_ms_per_frame: Option<f64>,
    /// Wall time per image in the fastest round of all cameras, milliseconds.
    pub ms_per_frame_in_fastest_round: f64,
    /// Images per second.
    pub frames_per_second: f64,
    /// Machine and build.
    pub machine: Machine,
}

impl RenderBench<'_> {
    /// Renders and measures. `progress` receives the fraction of the duration that has passed, 0 to
    /// 1.
    ///
    /// # Errors
    /// If threads cannot be started.
    pub fn measure(&self, progress: &mut dyn FnMut(f32)) -> Result<RenderSpeed> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build();
        let pool = pool.map_err(|e| EvalError::Options(format!("cannot start threads: {e}")))?;
        let scene = Scene::new(self.scene.world.setup());
        let views = self.scene.views(self.channels);
        // Enough images per round that no thread waits long for the last ones.
        let round: Vec<View> =
            std::iter::repeat_n(views.clone(), self.threads.div_ceil(4)).flatten().collect();
        let draw = |view: &View| drop(black_box(scene.render(&self.scene.world, &[*view])));
        // Textures and meshes are built when they are first needed.
        pool.install(|| views.iter().for_each(draw));
        let (mut frames, mut fastest) = (0, Duration::MAX);
        let clock = Stopwatch::start();
        let mut fraction = 0.0;
        while fraction < 1.0 {
            let start = clock.elapsed();
            if self.threads == 1 {
                pool.install(|| round.iter().for_each(draw));
            } else {
                pool.install(|| round.par_iter().with_max_len(1).for_each(draw));
            }
            fastest = fastest.min(clock.elapsed() - start);
            frames += round.len() as u64;
            fraction = clock.elapsed().as_secs_f32() / self.seconds;
            progress(fraction.min(1.0));
        }
        let (wall, cpu) = (clock.elapsed(), clock.cpu());
        let ms_per_frame = ms_each(wall, frames);
        Ok(RenderSpeed {
            scene: self.scene.name.clone(),
            size: views[0].camera.height,
            channels: channel_names(self.channels),
            threads: self.threads,
            views: views.len(),
            objects: self.scene.world.setup().things.len(),
            triangles: self.scene.count_triangles(),
            frames,
            seconds: wall.as_secs_f64(),
            ms_per_frame,
            cpu_ms_per_frame: cpu.map(|cpu| ms_each(cpu, frames)),
            ms_per_frame_in_fastest_round: ms_each(fastest, round.len() as u64),
            frames_per_second: 1e3 / ms_per_frame,
            machine: Machine::current(),
        })
    }
}

pub(super) fn channel_names(channels: Channels) -> String {
    let all = [("rgb", channels.rgb), ("depth", channels.depth), ("ids", channels.ids)];
    let names: Vec<&str> = all.into_iter().filter(|(_, on)| *on).map(|(name, _)| name).collect();
    if names.is_empty() { NONE.into() } else { names.join("+") }
}

/// Name of the empty set of channels.
const NONE: &str = "none";

/// Parses channels as [`parse_channels`] does; `none` means no channel.
///
/// # Errors
/// If a name is unknown; the message lists the names.
pub fn parse_channels_or_none(text: &str) -> std::result::Result<Channels, String> {
    match text {
        NONE => Ok(Channels { rgb: false, depth: false, ids: false }),
        _ => parse_channels(text),
    }
}

/// Parses channels such as `rgb+depth+ids`.
///
/// # Errors
/// If a name is unknown; the message lists the names.
pub fn parse_channels(text: &str) -> std::result::Result<Channels, String> {
    let mut channels = Channels { rgb: false, depth: false, ids: false };
    for name in text.split('+') {
        match name {
            "rgb" => channels.rgb = true,
            "depth" => channels.depth = true,
            "ids" => channels.ids = true,
            _ => return Err(format!("no channel `{name}`; join rgb, depth and ids by +")),
        }
    }
    Ok(channels)
}
