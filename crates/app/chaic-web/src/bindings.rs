//! Exports for JavaScript. Structured values are JSON texts.

use chaic_core::AgentId;
use wasm_bindgen::prelude::*;

use crate::player::{DrawnImage, ReplayPlayer};

/// Player of one trace.
#[wasm_bindgen]
pub struct Player {
    player: ReplayPlayer,
}

/// Image for a canvas.
#[wasm_bindgen]
pub struct Picture {
    image: DrawnImage,
}

fn error(problem: impl ToString) -> JsError {
    JsError::new(&problem.to_string())
}

fn json(value: &impl serde::Serialize) -> Result<String, JsError> {
    serde_json::to_string(value).map_err(error)
}

#[wasm_bindgen]
impl Player {
    /// Opens a trace of an episode and re-simulates it.
    ///
    /// # Errors
    /// If one of them is unreadable, or they do not belong together.
    #[wasm_bindgen(constructor)]
    pub fn new(trace: &[u8], episode: &[u8]) -> Result<Player, JsError> {
        Ok(Player { player: ReplayPlayer::open(trace, episode).map_err(error)? })
    }

    /// Returns [`crate::ReplayInfo`].
    ///
    /// # Errors
    /// Never in practice.
    pub fn info(&self) -> Result<String, JsError> {
        json(self.player.info())
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
        Ok(Picture { image })
    }

    /// Draws the map.
    pub fn map(&self, width_px: u32) -> Picture {
        Picture { image: self.player.draw_map(width_px) }
    }
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
}
