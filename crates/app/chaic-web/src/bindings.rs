//! Exports for JavaScript. Structured values are JSON texts.

use chaic_core::AgentId;
use chaic_env::continue_with;
use chaic_env::helper_registry::BuiltInHelpers;
use chaic_episodes::Episode;
use wasm_bindgen::prelude::*;

use crate::drawing::{CanvasLabel, DrawnImage, DrawnMap};
use crate::live::LiveSession;
use crate::player::ReplayPlayer;

/// Player of one trace.
#[wasm_bindgen]
pub struct Player {
    player: ReplayPlayer,
}

/// Image for a canvas.
#[wasm_bindgen]
pub struct Picture {
    image: DrawnImage,
    labels: Vec<CanvasLabel>,
}

impl From<DrawnImage> for Picture {
    fn from(image: DrawnImage) -> Picture {
        Picture { image, labels: Vec::new() }
    }
}

fn error(problem: impl ToString) -> JsError {
    JsError::new(&problem.to_string())
}

fn json(value: &impl serde::Serialize) -> Result<String, JsError> {
    serde_json::to_string(value).map_err(error)
}

#[wasm_bindgen]
impl Player {
    /// Opens a trace of an episode at its first frame.
    ///
    /// # Errors
    /// If trace or episode is unreadable, or they do not belong together.
    #[wasm_bindgen(constructor)]
    pub fn new(trace: &[u8], episode: &[u8]) -> Result<Player, JsError> {
        Ok(Player { player: ReplayPlayer::open(trace, episode).map_err(error)? })
    }

    /// Re-simulates at most `n_frames` further frames; returns true once the re-simulation has ended.
    pub fn verify(&mut self, n_frames: u32) -> bool {
        self.player.verify(n_frames)
    }

    /// Returns [`crate::ReplayInfo`].
    ///
    /// # Errors
    /// Never in practice.
    pub fn info(&self) -> Result<String, JsError> {
        json(&self.player.info())
    }

    /// Moves to a frame and returns [`crate::FrameState`].
    ///
    /// # Errors
    /// Never in practice.
    pub fn seek(&mut self, frame: u32) -> Result<String, JsError> {
        self.player.seek(frame).map_err(error)?;
        json(&self.player.state())
    }

    /// Draws what an agent sees.
    ///
    /// # Errors
    /// If the episode has no such agent.
    pub fn view(&self, agent: u8, side_px: u32) -> Result<Picture, JsError> {
        let image = self.player.draw_view(AgentId(agent), side_px).map_err(error)?;
        Ok(image.into())
    }

    /// Runs partner and helper again up to their next decision, and returns [`crate::RerunState`].
    ///
    /// # Errors
    /// Never in practice.
    pub fn rerun_agents(&mut self) -> Result<String, JsError> {
        json(&self.player.rerun_agents().map_err(error)?)
    }

    /// Returns [`crate::MemoryState`] of an agent, or `null`.
    ///
    /// # Errors
    /// Never in practice.
    pub fn memory(&self, agent: u8) -> Result<String, JsError> {
        json(&self.player.memory(AgentId(agent)))
    }

    /// Returns the map in the memory of an agent, see [`ReplayPlayer::explored`].
    pub fn explored(&self, agent: u8) -> Vec<u8> {
        self.player.explored(AgentId(agent))
    }

    /// Returns a list of [`crate::TaskObject`].
    ///
    /// # Errors
    /// Never in practice.
    pub fn task_objects(&self) -> Result<String, JsError> {
        json(&self.player.task_objects())
    }

    /// Draws the map.
    pub fn map(&mut self, width_px: u32) -> Picture {
        let DrawnMap { image, labels } = self.player.draw_map(width_px);
        Picture { image, labels }
    }
}

/// Episode that a person plays.
#[wasm_bindgen]
pub struct Live {
    session: LiveSession,
}

#[wasm_bindgen]
impl Live {
    /// Starts an episode, with a [`crate::LiveConfig`] as JSON.
    ///
    /// # Errors
    /// If episode or configuration is unreadable, or an agent does not exist.
    #[wasm_bindgen(constructor)]
    pub fn new(episode: &[u8], config: &str) -> Result<Live, JsError> {
        let config = serde_json::from_slice(config.as_bytes()).map_err(error)?;
        Ok(Live { session: LiveSession::start(episode, &config, &BuiltInHelpers).map_err(error)? })
    }

    /// Takes over from a frame of a trace.
    ///
    /// # Errors
    /// If an input is unreadable, or the other agents do not act as in the trace.
    pub fn take_over(
        trace: &[u8],
        episode: &[u8],
        frame: u32,
        config: &str,
    ) -> Result<Live, JsError> {
        let config = serde_json::from_slice(config.as_bytes()).map_err(error)?;
        let session = LiveSession::take_over(trace, episode, frame, &config).map_err(error)?;
        Ok(Live { session })
    }

    /// Returns [`crate::LiveInfo`].
    ///
    /// # Errors
    /// Never in practice.
    pub fn info(&self) -> Result<String, JsError> {
        json(&self.session.info())
    }

    /// Advances by at most this many frames.
    ///
    /// # Errors
    /// If an agent cannot decide.
    pub fn advance(&mut self, n_frames: u32) -> Result<(), JsError> {
        self.session.advance(n_frames).map(|_| ()).map_err(error)
    }

    /// Returns [`crate::LiveState`].
    ///
    /// # Errors
    /// Never in practice.
    pub fn state(&mut self) -> Result<String, JsError> {
        json(&self.session.state())
    }

    /// Selects a plan by its text; false if it cannot be started now.
    pub fn choose_plan(&mut self, plan: &str) -> bool {
        self.session.choose_plan(plan)
    }

    /// Performs an action (JSON); false if the person cannot decide now.
    ///
    /// # Errors
    /// If it is no action.
    pub fn act(&mut self, action: &str) -> Result<bool, JsError> {
        let action = serde_json::from_slice(action.as_bytes()).map_err(error)?;
        Ok(self.session.act(action))
    }

    /// Returns the trace so far.
    pub fn trace(&self) -> String {
        self.session.trace()
    }

    /// Returns the trace so far without its first `n_lines` lines.
    pub fn trace_after(&self, n_lines: usize) -> String {
        self.session.trace_after(n_lines)
    }

    /// Returns the number of lines of the trace so far.
    pub fn n_lines(&self) -> usize {
        self.session.n_lines()
    }

    /// Returns the delivered fraction of the goal of this episode (JSON) with a built-in helper and a
    /// simulated partner, from the start.
    ///
    /// # Errors
    /// If the episode is unreadable or the helper does not exist.
    pub fn reference_rate(&self, episode: &[u8], helper: &str) -> Result<f64, JsError> {
        self.session.reference(episode, helper).map_err(error)
    }

    /// Draws what the person sees.
    pub fn view(&self, side_px: u32) -> Picture {
        self.session.draw_view(side_px).into()
    }
}

/// Plays an episode as in a trace up to a frame; after it, a built-in helper decides. Returns the
/// new trace.
///
/// # Errors
/// If an input is unreadable, the helper does not exist, or the trace cannot be continued.
#[wasm_bindgen]
pub fn continued_trace(
    trace: &[u8],
    episode: &[u8],
    frame: u32,
    helper: &str,
) -> Result<String, JsError> {
    let episode = Episode::parse(episode, "episode").map_err(error)?;
    let trace = continue_with(trace, &episode, frame, helper, &BuiltInHelpers).map_err(error)?;
    Ok(trace.lines().map(|line| line + "\n").collect())
}

#[wasm_bindgen]
impl Picture {
    /// Width in pixels.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> u32 {
        self.image.width
    }

    /// Height in pixels.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> u32 {
        self.image.height
    }

    /// Returns the bytes: red, green, blue and 255 of each pixel.
    pub fn rgba(&self) -> Vec<u8> {
        self.image.rgba.clone()
    }

    /// Returns a list of [`CanvasLabel`], empty for a view.
    ///
    /// # Errors
    /// Never in practice.
    pub fn labels(&self) -> Result<String, JsError> {
        json(&self.labels)
    }
}
