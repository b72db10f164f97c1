//! Smooth shapes on images, in pixels from the upper left corner.

use chaic_core::Vec2;
use image::RgbImage;

/// Blends `color` into a pixel.
pub(crate) fn blend(pixel: &mut [u8; 3], color: [u8; 3], amount: f32) {
    let amount = amount.clamp(0.0, 1.0);
    for (p, c) in pixel.iter_mut().zip(color) {
        *p = (f32::from(*p) + (f32::from(c) - f32::from(*p)) * amount + 0.5) as u8;
    }
}

/// Calls `paint` with the center and the value of each pixel between two corners.
fn for_pixels(image: &mut RgbImage, a: Vec2, b: Vec2, mut paint: impl FnMut(Vec2, &mut [u8; 3])) {
    for_pixels_between(image.dimensions(), a, b, |x, y| {
        paint(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), &mut image.get_pixel_mut(x, y).0);
    });
}

/// Calls `visit` with column and row of each pixel between two corners, row by row.
pub(crate) fn for_pixels_between(
    (width, height): (u32, u32),
    a: Vec2,
    b: Vec2,
    mut visit: impl FnMut(u32, u32),
) {
    let clip = |x: f32, n: u32| x.clamp(0.0, n as f32) as u32;
    let (low, high) = (a.min(b), a.max(b));
    for y in clip(low.y, height)..clip(high.y + 1.0, height) {
        for x in clip(low.x, width)..clip(high.x + 1.0, width) {
            visit(x, y);
        }
    }
}

/// Fills a disk. Radius in pixels, smooth edge.
pub(crate) fn disk(image: &mut RgbImage, at: Vec2, radius: f32, color: [u8; 3]) {
    for_pixels(image, at - radius - 1.0, at + radius + 1.0, |p, pixel| {
        blend(pixel, color, radius + 0.5 - (p - at).length_squared().sqrt());
    });
}

/// Draws a ring around a point; radius of its middle and width in pixels, smooth edges.
pub(crate) fn circle(image: &mut RgbImage, at: Vec2, radius: f32, stroke_px: f32, color: [u8; 3]) {
    let reach = radius + stroke_px + 1.0;
    for_pixels(image, at - reach, at + reach, |p, pixel| {
        let distance = ((p - at).length_squared().sqrt() - radius).abs();
        blend(pixel, color, 0.5 * stroke_px + 0.5 - distance);
    });
}

/// Draws a line between two points, `stroke_px` wide, smooth edges.
pub(crate) fn line(image: &mut RgbImage, a: Vec2, b: Vec2, stroke_px: f32, color: [u8; 3]) {
    let reach = Vec2::splat(stroke_px + 1.0);
    let along = b - a;
    let l2 = along.length_squared().max(1e-6);
    for_pixels(image, a.min(b) - reach, a.max(b) + reach, |p, pixel| {
        let t = ((p - a).dot(along) / l2).clamp(0.0, 1.0);
        let distance = (p - a - along * t).length_squared().sqrt();
        blend(pixel, color, 0.5 * stroke_px + 0.5 - distance);
    });
}

/// Fills a triangle.
pub(crate) fn triangle(image: &mut RgbImage, [a, b, c]: [Vec2; 3], color: [u8; 3]) {
    let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).perp_dot(r - p);
    let orientation = side(a, b, c);
    for_pixels(image, a.min(b).min(c), a.max(b).max(c), |p, pixel| {
        if side(a, b, p) * orientation >= 0.0
            && side(b, c, p) * orientation >= 0.0
            && side(c, a, p) * orientation >= 0.0
        {
            *pixel = color;
        }
    });
}
