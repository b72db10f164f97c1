//! Replays: a trace played again frame by frame, drawn for people.

mod panel;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use chaic_core::geom::Camera;
use chaic_core::{Action, AgentId, EntityId, Frame, Outcome, ResolvedAction, TaskId};
use chaic_env::trace::Trace;
use chaic_env::{Playback, slug};
use chaic_episodes::Episode;
use chaic_render::{Channels, Scene, View, floor_plan};
use chaic_world::{EventKind, World};
use image::RgbImage;

use crate::error::{EvalError, Result};
use crate::run::RunFolder;
use chaic_video::{VideoError, VideoWriter};

pub use panel::{HEIGHT_PX, WIDTH_PX};

/// What a replay looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReplayOptions {
    /// Pictures a second.
    pub fps: u32,
    /// Every how many frames of the episode a picture is drawn.
    pub every: u32,
}

/// What a detector finds in an image, to be drawn over it.
pub trait Masks {
    /// The pixels and the label of each thing in an image of color (shape [height, width, 3]) and depth
    /// (metres, shape [height, width]).
    fn find(&mut self, rgb: &[u8], depth_m: &[f32], camera: &Camera) -> Vec<(u8, Vec<u32>)>;

    /// The side of the images that it looks at, pixels.
    fn image_size(&self) -> u32;
}

/// What one agent is doing, in words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Caption {
    /// Who.
    pub who: String,
    /// What it does.
    pub action: String,
    /// What it plans.
    pub plan: String,
    /// What it noticed last of the others, if it tells that from what it sees.
    pub noticed: Option<String>,
}

/// Which helper's trace is taken if none is named; one that isn't listed comes first.
const FAVORITES: [&str; 5] = ["rhp", "oracle", "random", "follow", "none"];

/// Finds the trace of an episode in a run: its id, or the id without its task. Helper and seed may
/// be left away; then the lowest seed of the helper with the most to see.
///
/// # Errors
/// If there is none; the message says which there are.
pub fn find_trace(
    folder: &RunFolder,
    episode: &str,
    helper: Option<&str>,
    seed: Option<u32>,
) -> Result<PathBuf> {
    let traces = folder.traces()?;
    let mut fitting: Vec<(usize, &PathBuf)> = Vec::new();
    for path in &traces {
        // traces/TASK/HELPER/EPISODE-sSEED.jsonl
        let part = |up: usize| path.iter().rev().nth(up).and_then(|p| p.to_str()).unwrap_or("");
        let stem = part(0).trim_end_matches(".jsonl");
        let Some((its_name, its_seed)) = stem.rsplit_once("-s") else { continue };
        let Ok(task) = part(2).parse::<TaskId>() else { continue };
        let fits = its_name == slug(task, episode)
            && helper.is_none_or(|h| h == part(1))
            && seed.is_none_or(|s| its_seed == s.to_string());
        if fits {
            let rank = FAVORITES.iter().position(|f| *f == part(1));
            fitting.push((rank.unwrap_or(0), path));
        }
    }
    fitting.sort();
    fitting.first().map(|(_, p)| (*p).clone()).ok_or_else(|| {
        let some: Vec<String> = traces
            .iter()
            .take(3)
            .filter_map(|p| Some(p.strip_prefix(folder.path()).ok()?.display().to_string()))
            .collect();
        let known = match traces.len() {
            0 => "no traces at all".to_owned(),
            n => format!("{n} traces, for example {}", some.join(", ")),
        };
        let mut wanted = episode.to_owned();
        wanted += &helper.map_or(String::new(), |h| format!(" with helper {h}"));
        wanted += &seed.map_or(String::new(), |s| format!(" and seed {s}"));
        EvalError::NoTrace { path: folder.path().to_owned(), wanted, known }
    })
}

/// Draws a trace as a video, with masks over what the helper sees if there are any; what it believes to
/// see is drawn where the trace has it. `progress` hears of every frame of the episode, and says whether to go
/// on. Returns how many pictures it has; `None` if it was broken off, which leaves no video.
///
/// # Errors
/// If the episode isn't the one that was played, the trace doesn't fit it, or the video can't be
/// written.
pub fn write(
    trace: &Trace,
    episode: &Episode,
    options: ReplayOptions,
    mut masks: Option<&mut (dyn Masks + '_)>,
    out: &Path,
    progress: &mut dyn FnMut(Frame) -> ControlFlow<()>,
) -> Result<Option<u32>> {
    let bad = |e: VideoError| match e {
        VideoError::UnsupportedExtension { .. } | VideoError::FrameRate { .. } => {
            EvalError::Options(e.to_string())
        }
        _ => EvalError::Picture(e.to_string()),
    };
    let mut replay = Replay::new(trace, episode)?;
    let mut video = VideoWriter::create(out, WIDTH_PX, HEIGHT_PX, options.fps).map_err(bad)?;
    let every = options.every.max(1);
    loop {
        let frame = replay.world().state().frame;
        if progress(frame).is_break() {
            return Ok(None);
        }
        let is_last = !replay.step()?;
        if frame.is_multiple_of(every) || is_last {
            video.push(&replay.picture(masks.as_deref_mut())).map_err(bad)?;
        }
        if is_last {
            break;
        }
    }
    let n = video.n_frames();
    video.finish().map_err(bad)?;
    Ok(Some(n))
}

/// A trace that is being drawn.
pub struct Replay<'a> {
    playback: Playback<'a>,
    scene: Scene,
    /// What happened last, newest last.
    news: Vec<String>,
}

impl<'a> Replay<'a> {
    /// At the beginning of the trace.
    ///
    /// # Errors
    /// If the episode isn't the one that was played.
    pub fn new(trace: &'a Trace, episode: &Episode) -> Result<Replay<'a>> {
        let playback = Playback::new(trace, episode)?;
        let scene = Scene::with_appearance(playback.world().setup(), trace.header.appearance);
        Ok(Replay { playback, scene, news: Vec::new() })
    }

    /// The world as it stands.
    pub fn world(&self) -> &World {
        self.playback.world()
    }

    /// Lets one frame pass; false once there is no more.
    ///
    /// # Errors
    /// If the trace doesn't fit the world, as an altered one does.
    pub fn step(&mut self) -> Result<bool> {
        let Some(events) = self.playback.step()? else { return Ok(false) };
        for event in events {
            self.tell(&event.kind);
        }
        Ok(true)
    }

    /// The picture of this moment, with these masks over what the helper sees.
    pub fn picture(&self, masks: Option<&mut (dyn Masks + '_)>) -> RgbImage {
        let eyes = [AgentId::PARTNER, AgentId::HELPER];
        let present = eyes.iter().filter(|a| a.index() < self.playback.thoughts().len());
        let view = |agent: &AgentId| match &masks {
            Some(masks) if *agent == AgentId::HELPER => {
                let channels = Channels { depth: true, ..Channels::RGB };
                View::of_agent(self.world(), *agent, masks.image_size(), channels)
            }
            _ => View::of_agent(self.world(), *agent, panel::EYE_PX, Channels::RGB),
        };
        let views: Vec<View> = present.map(view).collect();
        let (mut images, map) = rayon::join(
            || self.scene.render(self.world(), &views),
            || floor_plan::draw_scene_plan(&self.scene, self.world(), panel::MAP_PX),
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
        let believed: Vec<Vec<panel::Mark>> = views
            .iter()
            .zip(self.playback.thoughts())
            .map(|(view, thought)| panel::marks(&thought.sees, &view.camera))
            .collect();
        let captions: Vec<Caption> =
            self.world().setup().agents().map(|a| self.caption(a)).collect();
        panel::compose(&panel::Contents {
            header: self.playback.header(),
            world: self.world(),
            eyes: &images,
            believed: &believed,
            map: &map,
            captions: &captions,
            news: &self.news,
        })
    }

    fn caption(&self, agent: AgentId) -> Caption {
        let person = &self.world().state().people[agent.index()];
        let action = match (&person.activity, &person.last) {
            (Some(activity), _) => self.words(&activity.action),
            (None, Some((action, outcome))) => match outcome {
                Outcome::Success => self.words(action),
                Outcome::Failure(reason) => format!("{} failed: {reason}", self.words(action)),
            },
            (None, None) => "about to begin".to_owned(),
        };
        let thought = &self.playback.thoughts()[agent.index()];
        let mood = thought.mood.as_ref().map_or(String::new(), |m| format!(" ({m})"));
        let who = match agent {
            AgentId::HELPER => format!("{agent} ({})", self.playback.header().helper),
            _ => agent.to_string(),
        };
        let noticed = thought.noticed.clone();
        Caption { who, action, plan: format!("{}{mood}", thought.plan), noticed }
    }

    fn words(&self, action: &ResolvedAction) -> String {
        match *action {
            Action::MoveForward => "walks ahead".to_owned(),
            Action::TurnLeft => "turns left".to_owned(),
            Action::TurnRight => "turns right".to_owned(),
            Action::PickUp { object, .. } => format!("picks up {}", self.name(object)),
            Action::PutIn => "puts it into the container".to_owned(),
            Action::PutOn { place, .. } => format!("puts it on {}", self.name(place)),
            Action::RemoveObstacle { obstacle, .. } => format!("removes {}", self.name(obstacle)),
            Action::Wait { .. } => "waits".to_owned(),
        }
    }

    fn name(&self, entity: EntityId) -> String {
        let class = self.world().setup().thing(entity).map(|t| t.class);
        class.map_or(entity.to_string(), |c| format!("{} {entity}", c.info().label))
    }

    fn tell(&mut self, kind: &EventKind) {
        let news = match *kind {
            EventKind::Delivered { object, by, counted } => {
                let wanted = if counted { "" } else { ", which isn't wanted" };
                format!("{by} delivered {}{wanted}", self.name(object))
            }
            EventKind::Broke { agent, object } => format!("{agent} broke {}", self.name(object)),
            EventKind::Ended { agent, action, outcome: Outcome::Failure(reason) }
                if action.subject().is_some() =>
            {
                format!("{agent} {} in vain: {reason}", self.words(&action))
            }
            EventKind::LiftedTogether { object, .. } => format!("both lift {}", self.name(object)),
            EventKind::ChildAway { away: true } => "the child is away".to_owned(),
            EventKind::ChildAway { away: false } => "the child is back".to_owned(),
            EventKind::Over { complete: true } => "all is done".to_owned(),
            EventKind::Over { complete: false } => "time is up".to_owned(),
            _ => return,
        };
        if self.news.len() == panel::MAX_NEWS {
            self.news.remove(0);
        }
        self.news.push(format!("{:>5}  {news}", self.world().state().frame));
    }
}
