//! How fast pictures are drawn.

use std::hint::black_box;
use std::time::Duration;

use chaic_render::{Channels, Scene, View};
use rayon::prelude::*;
use serde::Serialize;

use super::{BenchScene, Clock, Machine, ms_each};
use chaic_eval::{EvalError, Result};

/// What is measured.
#[derive(Clone, Copy, Debug)]
pub struct RenderBench<'a> {
    /// What is looked at.
    pub scene: &'a BenchScene,
    /// Which images.
    pub channels: Channels,
    /// How many threads draw, each its own pictures.
    pub threads: usize,
    /// For how long, at least; always whole rounds of all eyes.
    pub seconds: f32,
}

/// What came of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RenderSpeed {
    /// What was looked at.
    pub scene: String,
    /// Side of the images, pixels.
    pub size: u32,
    /// Which images, for example `rgb+depth+ids`.
    pub channels: String,
    /// How many threads drew.
    pub threads: usize,
    /// Eye poses, drawn in turn.
    pub views: usize,
    /// Things in the scene.
    pub objects: usize,
    /// Triangles of the whole scene at the finest level of detail; a picture shows a part of them,
    /// most at coarser levels.
    pub triangles: usize,
    /// Pictures drawn.
    pub frames: u64,
    /// Wall time, seconds.
    pub seconds: f64,
    /// Wall time for a picture, milliseconds.
    pub ms_per_frame: f64,
    /// Processor time for a picture, milliseconds: what is left of the wall time on a machine with
    /// nothing else to do, times the threads.
    pub cpu_ms_per_frame: Option<f64>,
    /// Wall time for a picture in the fastest round of all eyes, milliseconds.
    pub ms_per_frame_in_fastest_round: f64,
    /// Pictures per second.
    pub frames_per_second: f64,
    /// Which machine and build.
    pub machine: Machine,
}

impl RenderBench<'_> {
    /// Draws and measures. `progress` is told how much of the time has passed, from 0 to 1.
    ///
    /// # Errors
    /// If the threads can't be had.
    pub fn measure(&self, progress: &mut dyn FnMut(f32)) -> Result<RenderSpeed> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build();
        let pool = pool.map_err(|e| EvalError::Options(format!("can't start threads: {e}")))?;
        let scene = Scene::new(self.scene.world.setup());
        let views = self.scene.views(self.channels);
        // So many pictures that no thread waits long for the last ones.
        let round: Vec<View> =
            std::iter::repeat_n(views.clone(), self.threads.div_ceil(4)).flatten().collect();
        let draw = |view: &View| drop(black_box(scene.render(&self.scene.world, &[*view])));
        // Textures and meshes are made when first needed.
        pool.install(|| views.iter().for_each(draw));
        let (mut frames, mut fastest) = (0, Duration::MAX);
        let clock = Clock::start();
        let mut passed = 0.0;
        while passed < 1.0 {
            let began = clock.elapsed();
            if self.threads == 1 {
                pool.install(|| round.iter().for_each(draw));
            } else {
                pool.install(|| round.par_iter().with_max_len(1).for_each(draw));
            }
            fastest = fastest.min(clock.elapsed() - began);
            frames += round.len() as u64;
            passed = clock.elapsed().as_secs_f32() / self.seconds;
            progress(passed.min(1.0));
        }
        let (wall, cpu) = (clock.elapsed(), clock.cpu());
        let ms_per_frame = ms_each(wall, frames);
        Ok(RenderSpeed {
            scene: self.scene.name.clone(),
            size: views[0].camera.height,
            channels: name_of(self.channels),
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
            machine: Machine::this(),
        })
    }
}

pub(super) fn name_of(channels: Channels) -> String {
    let all = [("rgb", channels.rgb), ("depth", channels.depth), ("ids", channels.ids)];
    let names: Vec<&str> = all.into_iter().filter(|(_, on)| *on).map(|(name, _)| name).collect();
    if names.is_empty() { NONE.into() } else { names.join("+") }
}

/// No channel.
const NONE: &str = "none";

/// As [`channels_named`], or no channel at all: `none`.
///
/// # Errors
/// Says which names there are.
pub fn channels_or_none(text: &str) -> std::result::Result<Channels, String> {
    match text {
        NONE => Ok(Channels { rgb: false, depth: false, ids: false }),
        _ => channels_named(text),
    }
}

/// The channels of a name like `rgb+depth+ids`.
///
/// # Errors
/// Says which names there are.
pub fn channels_named(text: &str) -> std::result::Result<Channels, String> {
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
