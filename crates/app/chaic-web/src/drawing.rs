//! Images for a canvas.

use chaic_render::{Align, TextLabel};
use serde::Serialize;

/// Color image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DrawnImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green, blue and 255 of each pixel, row by row.
    pub rgba: Vec<u8>,
}

impl DrawnImage {
    pub(crate) fn from_rgb(width: u32, height: u32, rgb: &[u8]) -> DrawnImage {
        let rgba = rgb.as_chunks::<3>().0.iter().flat_map(|[r, g, b]| [*r, *g, *b, u8::MAX]);
        DrawnImage { width, height, rgba: rgba.collect() }
    }
}

/// Map without text, and the text for the canvas.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnMap {
    /// The map.
    pub image: DrawnImage,
    /// Text on the map.
    pub labels: Vec<CanvasLabel>,
}

/// Line of monospaced text for the text functions of a canvas.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CanvasLabel {
    /// The text.
    pub text: String,
    /// Anchor on the baseline, pixels from the left and upper edge.
    pub at: [f32; 2],
    /// Size of the font, pixels.
    pub font_px: f32,
    /// Width of the text, pixels.
    pub width_px: f32,
    /// `left`, `center` or `right`.
    pub align: &'static str,
    /// Red, green and blue.
    pub color: [u8; 3],
    /// Color of a border of one pixel.
    pub border: Option<[u8; 3]>,
}

impl CanvasLabel {
    /// Describes a label of an image.
    pub(crate) fn new(label: &TextLabel) -> CanvasLabel {
        CanvasLabel {
            text: label.text.clone(),
            at: label.baseline().to_array(),
            font_px: label.em_px(),
            width_px: TextLabel::width_px(&label.text, label.size_px),
            align: match label.align {
                Align::Left => "left",
                Align::Center => "center",
                Align::Right => "right",
            },
            color: label.color,
            border: label.border,
        }
    }
}
