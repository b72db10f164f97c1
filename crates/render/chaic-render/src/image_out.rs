//! Pictures of images, for files and people.

use chaic_core::geom::Camera;
use image::{GrayImage, ImageBuffer, Luma, Rgb, RgbImage};

/// Grayscale of 16 bits.
pub type Gray16Image = ImageBuffer<Luma<u16>, Vec<u16>>;

/// An RGB buffer, shape [height, width, 3], as a picture; `None` if the length doesn't fit.
pub fn rgb(buffer: &[u8], width: u32, height: u32) -> Option<RgbImage> {
    RgbImage::from_raw(width, height, buffer.to_vec())
}

/// Depth in millimetres, 65535 for all beyond; `None` if the length doesn't fit.
pub fn depth_mm(depth_m: &[f32], width: u32, height: u32) -> Option<Gray16Image> {
    let mm = depth_m.iter().map(|d| crate::depth_mm(*d)).collect();
    Gray16Image::from_raw(width, height, mm)
}

/// Depth to look at: near is bright; black where nothing is seen.
pub fn depth_view(depth_m: &[f32], width: u32, height: u32) -> Option<GrayImage> {
    let shade =
        |d: &f32| if *d >= Camera::FAR_M { 0 } else { (255.0 / (1.0 + 0.22 * d.max(0.0))) as u8 };
    GrayImage::from_raw(width, height, depth_m.iter().map(shade).collect())
}

/// Ids to look at: one color for each id, the same in every picture.
pub fn ids_view(ids: &[u16], width: u32, height: u32) -> Option<RgbImage> {
    let colors = ids.iter().flat_map(|id| id_color(*id)).collect();
    RgbImage::from_raw(width, height, colors)
}

/// Unit normals, shape [height, width, 3], as color: each coordinate from -1 to 1 is 0 to 255, and
/// black is where there is none.
pub fn normals_view(normals: &[f32], width: u32, height: u32) -> Option<RgbImage> {
    let seen = |n: &[f32]| n.iter().any(|x| *x != 0.0);
    let colors = normals.chunks_exact(3).flat_map(|n| match n {
        [x, y, z] if seen(n) => [x, y, z].map(|c| (127.5 * (c + 1.0) + 0.5) as u8),
        _ => [0; 3],
    });
    RgbImage::from_raw(width, height, colors.collect())
}

/// The color that [`ids_view`] gives an id: grays for structure, vivid ones for all else.
pub fn id_color(id: u16) -> [u8; 3] {
    match id {
        0 => [16, 18, 24],
        1 => [70, 72, 78],
        2 => [120, 122, 128],
        3 => [165, 167, 172],
        _ => {
            // Steps of the golden ratio keep neighbors apart in hue.
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

/// Puts pictures of one size side by side, `columns` in a row.
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
        assert!(colors.len() > 185, "ids are told apart: {}", colors.len());
    }
}
