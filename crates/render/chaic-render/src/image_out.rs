//! Conversion of render output to image files and visualizations.

use chaic_core::geom::Camera;
use image::{GrayImage, ImageBuffer, Luma, Rgb, RgbImage};

/// 16-bit grayscale image.
pub type Gray16Image = ImageBuffer<Luma<u16>, Vec<u16>>;

/// Image of an RGB buffer, u8, shape [height, width, 3]; `None` if the length does not match.
pub fn rgb(buffer: &[u8], width: u32, height: u32) -> Option<RgbImage> {
    RgbImage::from_raw(width, height, buffer.to_vec())
}

/// Depth in millimeters, 65535 for everything farther; `None` if the length does not match.
pub fn depth_mm(depth_m: &[f32], width: u32, height: u32) -> Option<Gray16Image> {
    let mm = depth_m.iter().map(|d| crate::depth_mm(*d)).collect();
    Gray16Image::from_raw(width, height, mm)
}

/// Visualization of depth: near is bright, background is black.
pub fn depth_view(depth_m: &[f32], width: u32, height: u32) -> Option<GrayImage> {
    let shade =
        |d: &f32| if *d >= Camera::FAR_M { 0 } else { (255.0 / (1.0 + 0.22 * d.max(0.0))) as u8 };
    GrayImage::from_raw(width, height, depth_m.iter().map(shade).collect())
}

/// Visualization of ids: a fixed color per id.
pub fn ids_view(ids: &[u16], width: u32, height: u32) -> Option<RgbImage> {
    let colors = ids.iter().flat_map(|id| id_color(*id)).collect();
    RgbImage::from_raw(width, height, colors)
}

/// Visualization of unit normals, shape [height, width, 3]: each coordinate from -1 to 1 maps to 0
/// to 255; black for background.
pub fn normals_view(normals: &[f32], width: u32, height: u32) -> Option<RgbImage> {
    let is_valid = |n: &[f32]| n.iter().any(|x| *x != 0.0);
    let colors = normals.chunks_exact(3).flat_map(|n| match n {
        [x, y, z] if is_valid(n) => [x, y, z].map(|c| (127.5 * (c + 1.0) + 0.5) as u8),
        _ => [0; 3],
    });
    RgbImage::from_raw(width, height, colors.collect())
}

/// Color of an id in [`ids_view`]: gray for structure, saturated colors for everything else.
pub fn id_color(id: u16) -> [u8; 3] {
    match id {
        0 => [16, 18, 24],
        1 => [70, 72, 78],
        2 => [120, 122, 128],
        3 => [165, 167, 172],
        _ => {
            // Steps of the golden ratio give neighboring ids different hues.
            let hue = (u32::from(id) * 40_503 % 65_536) as f32 / 65_536.0 * 6.0;
            let light = [1.0, 0.78, 0.9][usize::from(id) % 3];
            let channel = |offset: f32| {
                let h = (hue + offset) % 6.0;
                let x = (2.0 - (h - 3.0).abs()).clamp(-1.0, 1.0) * 0.5 + 0.5;
                (255.0 * light * (0.22 + 0.78 * x)) as u8
            };
            [channel(3.0), channel(1.0), channel(5.0)]
        }
    }
}

/// Arranges images of one size in a grid with `columns` columns.
pub fn grid(pictures: &[RgbImage], columns: usize) -> RgbImage {
    let Some(first) = pictures.first() else { return RgbImage::new(1, 1) };
    let (w, h) = first.dimensions();
    let columns = columns.clamp(1, pictures.len());
    let rows = pictures.len().div_ceil(columns);
    let mut out = RgbImage::from_pixel(w * columns as u32, h * rows as u32, Rgb([250; 3]));
    for (k, picture) in pictures.iter().enumerate() {
        let (x, y) = (k % columns * w as usize, k / columns * h as usize);
        image::imageops::replace(&mut out, picture, x as i64, y as i64);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_saturates_and_sizes_are_checked() {
        let mm = depth_mm(&[1.234, 100.0], 2, 1).expect("fits");
        assert_eq!(mm.into_raw(), [1234, 65535]);
        assert!(rgb(&[0; 5], 1, 2).is_none());
        let normals = normals_view(&[0.0, 0.0, 0.0, -1.0, 1.0, 0.0], 2, 1).expect("fits");
        assert_eq!(normals.into_raw(), [0, 0, 0, 0, 255, 128]);
        let colors: std::collections::BTreeSet<_> = (8..200).map(id_color).collect();
        assert!(colors.len() > 185, "ids have distinct colors: {}", colors.len());
    }
}
