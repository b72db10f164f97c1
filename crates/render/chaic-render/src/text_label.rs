//! Text of an image that is not drawn yet.

use chaic_core::Vec2;

/// Horizontal alignment of a text relative to its anchor point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// The text begins at the anchor.
    Left,
    /// The text is centered on the anchor.
    Center,
    /// The text ends at the anchor.
    Right,
}

/// Line of text on an image. Programs without a font, such as the module of the pages, let others draw
/// it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextLabel {
    /// The text, ASCII.
    pub text: String,
    /// Anchor of the text: on the upper edge of the line, pixels from the upper left corner of the
    /// image.
    pub top: Vec2,
    /// Height of the line from the highest ascender to the lowest descender, pixels.
    pub size_px: f32,
    /// Position of the text relative to its anchor.
    pub align: Align,
    /// Red, green and blue.
    pub color: [u8; 3],
    /// Color of a border of one pixel.
    pub border: Option<[u8; 3]>,
}

/// Metrics of the font, Hack: units of an em, of the width of every character, and of the height from
/// the highest ascender to the baseline and from there to the lowest descender.
const EM: f32 = 2048.0;
const ADVANCE: f32 = 1233.0;
const ASCENT: f32 = 1901.0;
const DESCENT: f32 = 483.0;

impl TextLabel {
    /// Returns the width of a line, pixels.
    pub fn width_px(text: &str, size_px: f32) -> f32 {
        text.len() as f32 * (ADVANCE / (ASCENT + DESCENT)) * size_px
    }

    /// Returns the size of the font in pixels per em, as canvases measure it.
    pub fn em_px(&self) -> f32 {
        EM / (ASCENT + DESCENT) * self.size_px
    }

    /// Returns the anchor on the baseline, pixels.
    pub fn baseline(&self) -> Vec2 {
        self.top + Vec2::new(0.0, ASCENT / (ASCENT + DESCENT) * self.size_px)
    }
}
