//! Pictures for a page, as lossless PNG.

use std::io;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};

/// Compresses an image (RGB, u8, shape `[side_px, side_px, 3]`).
///
/// # Errors
/// If the image has another size.
pub fn to_png(rgb: &[u8], side_px: u32) -> io::Result<Vec<u8>> {
    let mut png = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Up);
    let written = encoder.write_image(rgb, side_px, side_px, ExtendedColorType::Rgb8);
    written.map_err(io::Error::other)?;
    Ok(png)
}
