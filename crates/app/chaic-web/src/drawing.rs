//! Images for a canvas.

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
