//! Replays: videos of traces.

mod belief_panel;
mod layout;
mod panel;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use chaic_agents::HelperInfo;
use chaic_core::catalogue::TargetSet;
use chaic_core::geom::Camera;
use chaic_core::{AgentId, Frame, TaskId, Vec2};
use chaic_env::narration::{Caption, DetectedObject, detected_objects, event_text};
use chaic_env::trace::Trace;
use chaic_env::{Playback, slug};
use chaic_episodes::Episode;
use chaic_render::{Channels, Scene, View, floor_plan};
use chaic_world::{EventKind, World};
use image::RgbImage;

use self::belief_panel::BeliefView;
use crate::error::{EvalError, Result};
use crate::recorded_belief::true_set;
use crate::run::RunFolder;
use chaic_video::{VideoError, VideoWriter};

pub use layout::{HEIGHT_PX, WIDTH_PX};

/// Options of a replay video.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReplayOptions {
    /// Frames per second of the video.
    pub fps: u32,
    /// Interval between drawn frames of the episode. The first and the last frame are always drawn.
    pub every: u32,
}

/// Detector whose masks are drawn over the helper's view.
pub trait MaskDetector {
    /// Returns the label and the pixels of each detection in an image. Color has shape [height,
    /// width, 3], depth in meters has shape [height, width].
    fn find(&mut self, rgb: &[u8], depth_m: &[f32], camera: &Camera) -> Vec<(u8, Vec<u32>)>;

    /// Returns the side of the images that the detector takes, pixels.
    fn image_size(&self) -> u32;
}

/// Preferred helpers if none is named. Other built-in helpers come last, and helpers of the user
/// first.
const PREFERRED_HELPERS: [&str; 6] = ["infer", "rhp", "oracle", "random", "follow", "none"];

/// Returns the rank of a helper by [`PREFERRED_HELPERS`]; the lowest one is preferred.
fn preference(helper: &str) -> usize {
    match PREFERRED_HELPERS.iter().position(|name| *name == helper) {
        Some(rank) => rank + 1,
        None if HelperInfo::find_helper(helper).is_some() => PREFERRED_HELPERS.len() + 1,
        None => 0,
    }
}

/// Returns the traces among these that match the episode (id with or without the task), the helper and
/// the seed, each with its helper. An absent value matches all. `traces` are the
/// [`planned_traces`](crate::run::planned_traces) of a run.
pub fn find_traces(
    traces: &[PathBuf],
    episode: Option<&str>,
    helper: Option<&str>,
    seed: Option<u32>,
) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for path in traces {
        // traces/TASK/HELPER/EPISODE-sSEED.jsonl
        let part = |up: usize| path.iter().rev().nth(up).and_then(|p| p.to_str()).unwrap_or("");
        let stem = part(0).trim_end_matches(".jsonl");
        let Some((name, trace_seed)) = stem.rsplit_once("-s") else { continue };
        let Ok(task) = part(2).parse::<TaskId>() else { continue };
        let matches = episode.is_none_or(|episode| name == slug(task, episode))
            && helper.is_none_or(|h| h == part(1))
            && seed.is_none_or(|s| trace_seed == s.to_string());
        if matches {
            found.push((path.clone(), part(1).to_owned()));
        }
    }
    found
}

/// Returns the path of the trace of an episode, by its id with or without the task, among the
/// [`planned_traces`](crate::run::planned_traces) of a run. Without `helper` and `seed`, selects the
/// preferred helper and its lowest seed.
///
/// # Errors
/// If there is no such trace; the message lists existing ones.
pub fn find_trace(
    folder: &RunFolder,
    traces: &[PathBuf],
    episode: &str,
    helper: Option<&str>,
    seed: Option<u32>,
) -> Result<PathBuf> {
    let found = find_traces(traces, Some(episode), helper, seed);
    // Seeds are compared as numbers. In the order of paths, 10 is before 2.
    let order = |(path, helper): &(PathBuf, String)| {
        (preference(helper), path.parent().map(Path::to_owned), seed_of(path).unwrap_or(u32::MAX))
    };
    if let Some((path, _)) = found.into_iter().min_by_key(order) {
        return Ok(path);
    }
    let examples: Vec<String> = traces
        .iter()
        .take(3)
        .filter_map(|p| Some(p.strip_prefix(folder.path()).ok()?.display().to_string()))
        .collect();
    let known = match traces.len() {
        0 => "no traces at all".to_owned(),
        1 => format!("one trace, {}", examples.join(", ")),
        n => format!("{n} traces, for example {}", examples.join(", ")),
    };
    let mut wanted = episode.to_owned();
    wanted += &helper.map_or(String::new(), |h| format!(" with helper {h}"));
    wanted += &seed.map_or(String::new(), |s| format!(" and seed {s}"));
    Err(EvalError::NoTrace { path: folder.path().to_owned(), wanted, known })
}

/// Returns the seed in the file name of a trace, `EPISODE-sSEED.jsonl`.
fn seed_of(path: &Path) -> Option<u32> {
    path.file_stem()?.to_str()?.rsplit_once("-s")?.1.parse().ok()
}

/// Renders a trace as a video; returns the number of its frames. Draws masks over the helper's
/// view, and recorded beliefs of both agents.
///
/// Calls `progress` for each frame of the episode. If it breaks, returns `None` and leaves no
/// video.
///
/// # Errors
/// If the episode is not the one of the trace, the trace does not fit it, or the video can't be
/// written.
pub fn write(
    trace: &Trace,
    episode: &Episode,
    options: ReplayOptions,
    masks: Option<&mut (dyn MaskDetector + '_)>,
    out: &Path,
    progress: &mut dyn FnMut(Frame) -> ControlFlow<()>,
) -> Result<Option<u32>> {
    let convert = |e: VideoError| match e {
        VideoError::UnsupportedExtension { .. } | VideoError::FrameRate { .. } => {
            EvalError::Options(e.to_string())
        }
        _ => EvalError::Image(e.to_string()),
    };
    let mut replay = Replay::new(trace, episode)?;
    let mut video = VideoWriter::create(out, WIDTH_PX, HEIGHT_PX, options.fps).map_err(convert)?;
    let mut sink = |image: &RgbImage| video.push(image).map_err(convert);
    if draw_images(&mut replay, options.every, masks, progress, &mut sink)?.is_break() {
        return Ok(None);
    }
    let n = video.n_frames();
    video.finish().map_err(convert)?;
    Ok(Some(n))
}

/// Passes the images of a video to `sink`: those of the first frame, of each `every`-th one and of
/// the last one. Stops if `progress` breaks.
fn draw_images(
    replay: &mut Replay<'_>,
    every: u32,
    mut masks: Option<&mut (dyn MaskDetector + '_)>,
    progress: &mut dyn FnMut(Frame) -> ControlFlow<()>,
    sink: &mut dyn FnMut(&RgbImage) -> Result<()>,
) -> Result<ControlFlow<()>> {
    loop {
        let frame = replay.world().state().frame;
        if progress(frame).is_break() {
            return Ok(ControlFlow::Break(()));
        }
        // Drawn before the step, which advances to the next frame.
        let is_drawn = frame.is_multiple_of(every.max(1));
        if is_drawn {
            sink(&replay.render(masks.as_deref_mut()))?;
        }
        if !replay.step()? {
            if !is_drawn {
                sink(&replay.render(masks))?;
            }
            return Ok(ControlFlow::Continue(()));
        }
    }
}

/// Renderer of a trace.
pub struct Replay<'a> {
    playback: Playback<&'a Trace>,
    scene: Scene,
    /// Last events, newest last.
    events: Vec<String>,
}

impl<'a> Replay<'a> {
    /// Creates a replay at the first frame of the trace.
    ///
    /// # Errors
    /// If the episode is not the one of the trace.
    pub fn new(trace: &'a Trace, episode: &Episode) -> Result<Replay<'a>> {
        let playback = Playback::new(trace, episode)?;
        let scene = Scene::with_appearance(playback.world().setup(), trace.header.appearance);
        Ok(Replay { playback, scene, events: Vec::new() })
    }

    /// Returns the world in its current state.
    pub fn world(&self) -> &World {
        self.playback.world()
    }

    /// Advances one frame; returns false at the end of the trace.
    ///
    /// # Errors
    /// If the trace does not fit the world, as an altered one does.
    pub fn step(&mut self) -> Result<bool> {
        let Some(events) = self.playback.step()? else { return Ok(false) };
        for event in events {
            self.log_event(&event.kind);
        }
        Ok(true)
    }

    /// Renders the current frame, with these masks over the helper's view.
    pub fn render(&self, masks: Option<&mut (dyn MaskDetector + '_)>) -> RgbImage {
        let viewers = [AgentId::PARTNER, AgentId::HELPER];
        let present = viewers.iter().filter(|a| a.index() < self.playback.thoughts().len());
        let view = |agent: &AgentId| match &masks {
            Some(masks) if *agent == AgentId::HELPER => {
                let channels = Channels { depth: true, ..Channels::RGB };
                View::from_agent(self.world(), *agent, masks.image_size(), channels)
            }
            _ => View::from_agent(self.world(), *agent, layout::VIEW_PX, Channels::RGB),
        };
        let views: Vec<View> = present.map(view).collect();
        let (mut images, mut map) = rayon::join(
            || self.scene.render(self.world(), &views),
            || floor_plan::draw_scene_plan(&self.scene, self.world(), layout::MAP_PX),
        );
        let helper = AgentId::HELPER.index();
        if let (Some(masks), Some(images), Some(view)) =
            (masks, images.get_mut(helper), views.get(helper))
            && let (Some(rgb), Some(depth_m)) = (&mut images.rgb, &images.depth_m)
        {
            for (label, pixels) in masks.find(rgb, depth_m, &view.camera) {
                panel::tint(rgb, &pixels, label);
            }
        }
        let believed: Vec<Vec<DetectedObject>> = views
            .iter()
            .zip(self.playback.thoughts())
            .map(|(view, thought)| detected_objects(&thought.perceived, &view.camera))
            .collect();
        let belief = self.belief();
        if let Some([x, z]) = belief.as_ref().and_then(|view| view.belief.position_cm) {
            let position = Vec2::new(0.01 * x as f32, 0.01 * z as f32);
            floor_plan::mark_believed_position(&mut map, self.world(), AgentId::HELPER, position);
        }
        let captions: Vec<Caption> =
            self.world().setup().agents().map(|a| Caption::new(&self.playback, a)).collect();
        panel::compose(&panel::Contents {
            header: self.playback.header(),
            world: self.world(),
            views: &images,
            believed: &believed,
            map: &map,
            captions: &captions,
            events: &self.events,
            belief: belief.as_ref(),
        })
    }

    /// Returns the current belief of the helper with the true hypotheses.
    fn belief(&self) -> Option<BeliefView> {
        let belief =
            self.playback.thoughts().get(AgentId::HELPER.index())?.belief.as_deref()?.clone();
        let setup = self.world().setup();
        let true_set = true_set(&setup.goal, &belief).map(TargetSet::name);
        let true_person = setup.people.first()?.persona.name();
        Some(BeliefView { belief, true_set, true_person })
    }

    fn log_event(&mut self, kind: &EventKind) {
        let Some(text) = event_text(self.world().setup(), kind) else { return };
        if self.events.len() == panel::MAX_EVENTS {
            self.events.remove(0);
        }
        self.events.push(format!("{:>5}  {text}", self.world().state().frame));
    }
}

#[cfg(test)]
mod tests;
