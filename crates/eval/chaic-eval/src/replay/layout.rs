//! Layout of the images: positions, colors, and text in rows.

use chaic_render::text;
use image::{Rgb, RgbImage};

/// Width of an image, pixels.
pub const WIDTH_PX: u32 = 1440;
/// Height of an image, pixels.
pub const HEIGHT_PX: u32 = 720;
/// Side of an agent's view, pixels.
pub(super) const VIEW_PX: u32 = 460;
/// Width of the map before it is fitted, pixels.
pub(super) const MAP_PX: u32 = 472;

pub(super) const MARGIN_PX: u32 = 12;
/// Left edge and width of the column to the right of the views.
pub(super) const SIDE_X_PX: u32 = 3 * MARGIN_PX + 2 * VIEW_PX;
pub(super) const SIDE_COLUMN_PX: u32 = WIDTH_PX - MARGIN_PX - SIDE_X_PX;
pub(super) const INK: [u8; 3] = [30, 32, 38];
pub(super) const FAINT: [u8; 3] = [110, 114, 122];
pub(super) const BAR: [u8; 3] = [20, 150, 70];
pub(super) const BAR_BACKGROUND: [u8; 3] = [222, 224, 226];

/// Breaks a text between words into rows no wider than `width_px`. Rows after the first begin with
/// `indent`.
pub(super) fn wrapped(text: &str, size_px: f32, width_px: f32, indent: &str) -> Vec<String> {
    let mut rows = Vec::new();
    let mut row = String::new();
    for word in text.split_inclusive(' ') {
        let candidate = format!("{row}{word}");
        if !row.trim().is_empty() && text::width(candidate.trim_end(), size_px) > width_px {
            rows.push(std::mem::replace(&mut row, format!("{indent}{word}")));
        } else {
            row = candidate;
        }
    }
    rows.push(row);
    rows
}

pub(super) fn fill(image: &mut RgbImage, [x0, y0, x1, y1]: [u32; 4], color: [u8; 3]) {
    for y in y0..y1.min(HEIGHT_PX) {
        for x in x0..x1.min(WIDTH_PX) {
            image.put_pixel(x, y, Rgb(color));
        }
    }
}
