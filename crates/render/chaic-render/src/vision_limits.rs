//! Vision limits: applies limited range, blur and a narrow field of view to an image.

use chaic_core::EntityId;
use chaic_core::capability::Eyesight;
use chaic_core::geom::{Camera, math, to_xz};
use chaic_core::{Vec2, Vec3};

/// Gray value of haze, sRGB.
const HAZE: f32 = 128.0;
/// Fraction of the range at which haze begins.
const FADE_START: f32 = 0.7;
/// Radius of the blur kernel in standard deviations.
const BLUR_RADIUS_SIGMAS: f32 = 3.0;

/// Applies the limits of an agent's vision to an image. `depth_m` is the depth of the complete
/// image. A pixel outside the range or the field of view gets depth 0 (no measurement), no id and
/// no color. Shapes as in [`ImagesMut`](crate::ImagesMut).
pub(crate) fn limit_vision(
    eyesight: &Eyesight,
    camera: &Camera,
    rgb: Option<&mut [u8]>,
    depth_m: &mut [f32],
    ids: Option<&mut [u16]>,
) {
    let rays = PixelRays::new(eyesight, camera);
    let width = camera.width as usize;
    if let Some(rgb) = rgb {
        fade(eyesight, &rays, width, rgb, depth_m);
        blur(rgb, width, eyesight.blur_rad * camera.focal_px());
    }
    let mut ids = ids;
    for (k, depth) in depth_m.iter_mut().enumerate() {
        let (per_depth, is_in_field) = rays.at(k / width, k % width);
        if !is_in_field || *depth * per_depth > eyesight.range_m {
            *depth = 0.0;
            if let Some(ids) = &mut ids {
                ids[k] = EntityId::NOTHING.0;
            }
        }
    }
}

/// Rays through the pixel centers of a camera.
struct PixelRays {
    focal_px: f32,
    center: [f32; 2],
    /// Horizontal components (x, z) of the camera axes: right, up, forward.
    horizontal_axes: [Vec2; 3],
    /// Maximum squared distance from the camera axis, per squared depth, inside the field of view.
    max_tan_squared: f32,
}

impl PixelRays {
    fn new(eyesight: &Eyesight, camera: &Camera) -> PixelRays {
        let half = 0.5 * eyesight.field_rad;
        let (sine, cosine) = (math::sin(half), math::cos(half));
        // A half angle of 90 degrees has no tangent.
        let tangent = if cosine > 1e-3 { sine / cosine } else { f32::INFINITY };
        let center = [0.5 * camera.width as f32, 0.5 * camera.height as f32];
        let horizontal_axes =
            [Vec3::X, Vec3::Y, Vec3::NEG_Z].map(|axis| to_xz(camera.world_from_camera * axis));
        PixelRays {
            focal_px: camera.focal_px(),
            center,
            horizontal_axes,
            max_tan_squared: tangent * tangent,
        }
    }

    /// Returns the horizontal distance per depth of a pixel, and whether it is in the field of
    /// view.
    fn at(&self, row: usize, column: usize) -> (f32, bool) {
        let x = (column as f32 + 0.5 - self.center[0]) / self.focal_px;
        let y = (row as f32 + 0.5 - self.center[1]) / self.focal_px;
        let [right, up, forward] = self.horizontal_axes;
        let direction = forward + right * x - up * y;
        (
            (direction.x * direction.x + direction.y * direction.y).sqrt(),
            x * x + y * y <= self.max_tan_squared,
        )
    }
}

/// Fades distant pixels into haze.
fn fade(eyesight: &Eyesight, rays: &PixelRays, width: usize, rgb: &mut [u8], depth_m: &[f32]) {
    let fade_start_m = FADE_START * eyesight.range_m;
    for (k, (pixel, depth)) in rgb.as_chunks_mut::<3>().0.iter_mut().zip(depth_m).enumerate() {
        let (per_depth, is_in_field) = rays.at(k / width, k % width);
        let haze = (*depth * per_depth - fade_start_m) / (eyesight.range_m - fade_start_m);
        let haze = if is_in_field { haze.clamp(0.0, 1.0) } else { 1.0 };
        for c in pixel {
            *c = (f32::from(*c) + (HAZE - f32::from(*c)) * haze + 0.5) as u8;
        }
    }
}

/// Applies a separable Gaussian blur, rows first. The border pixels are repeated outside the image.
fn blur(rgb: &mut [u8], width: usize, sigma_px: f32) {
    // An invalid camera has a sigma of NaN.
    if sigma_px.is_nan() || sigma_px < 0.2 || width == 0 {
        return;
    }
    let height = rgb.len() / (3 * width);
    let radius = ((BLUR_RADIUS_SIGMAS * sigma_px).ceil() as usize).min(width.max(height));
    let weights: Vec<f32> = (0..=radius)
        .map(|k| math::exp(-0.5 * (k as f32 / sigma_px) * (k as f32 / sigma_px)))
        .collect();
    let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f32>();
    let weights: Vec<f32> = weights.iter().map(|w| w / sum).collect();
    let mut rows = vec![0.0_f32; rgb.len()];
    let convolve = |at: &dyn Fn(usize) -> f32, center: usize, end: usize| {
        let mut sum = weights[0] * at(center);
        for (k, weight) in weights.iter().enumerate().skip(1) {
            let (before, after) = (center.saturating_sub(k), (center + k).min(end - 1));
            sum += weight * (at(before) + at(after));
        }
        sum
    };
    for row in 0..height {
        for column in 0..width {
            for c in 0..3 {
                let at = |x: usize| f32::from(rgb[3 * (row * width + x) + c]);
                rows[3 * (row * width + column) + c] = convolve(&at, column, width);
            }
        }
    }
    for row in 0..height {
        for column in 0..width {
            for c in 0..3 {
                let at = |y: usize| rows[3 * (y * width + column) + c];
                rgb[3 * (row * width + column) + c] = (convolve(&at, row, height) + 0.5) as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::Quat;

    const SIDE: usize = 33;
    const NEAR_SIGHTED: Eyesight =
        Eyesight { range_m: 2.0, blur_rad: 0.1, field_rad: std::f32::consts::PI, lowered_rad: 0.0 };

    fn camera() -> Camera {
        Camera {
            eye_in_world: Vec3::ZERO,
            world_from_camera: Quat::IDENTITY,
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: SIDE as u32,
            height: SIDE as u32,
        }
    }

    /// Image of a wall at distance `depth_m` whose pixels all differ.
    fn limited(eyesight: &Eyesight, depth_m: f32) -> (Vec<u8>, Vec<f32>, Vec<u16>) {
        let n = SIDE * SIDE;
        let mut rgb: Vec<u8> = (0..3 * n).map(|k| (k * 37 % 251) as u8).collect();
        let (mut depth, mut ids) = (vec![depth_m; n], vec![40; n]);
        limit_vision(eyesight, &camera(), Some(&mut rgb), &mut depth, Some(&mut ids));
        (rgb, depth, ids)
    }

    #[test]
    fn pixels_out_of_range_are_removed() {
        let (rgb, depth, ids) = limited(&NEAR_SIGHTED, 2.01);
        assert!(rgb.iter().all(|c| *c == HAZE as u8));
        assert!(depth.iter().all(|d| *d == 0.0) && ids.iter().all(|id| *id == EntityId::NOTHING.0));
    }

    #[test]
    fn near_pixels_are_blurred_and_keep_their_mean_brightness() {
        let (rgb, depth, ids) = limited(&NEAR_SIGHTED, 0.5);
        assert!(depth.iter().all(|d| *d == 0.5) && ids.iter().all(|id| *id == 40));
        let sharp = Eyesight { blur_rad: 0.0, ..NEAR_SIGHTED };
        let (before, ..) = limited(&sharp, 0.5);
        let mean = |p: &[u8]| p.iter().map(|c| f32::from(*c)).sum::<f32>() / p.len() as f32;
        let variance = |p: &[u8]| {
            let m = mean(p);
            p.iter().map(|c| (f32::from(*c) - m) * (f32::from(*c) - m)).sum::<f32>()
                / p.len() as f32
        };
        assert!((mean(&rgb) - mean(&before)).abs() < 1.0);
        assert!(
            variance(&rgb) < 0.7 * variance(&before),
            "{} {}",
            variance(&rgb),
            variance(&before)
        );
    }

    #[test]
    fn the_range_is_a_cylinder_and_the_field_of_view_a_cone() {
        let (.., ids) = limited(&NEAR_SIGHTED, 1.6);
        let column = SIDE / 2;
        assert!((0..SIDE).all(|row| ids[row * SIDE + column] == 40), "above and below");
        assert!((0..SIDE).all(|row| ids[row * SIDE] == EntityId::NOTHING.0), "to the side");
        let narrow = Eyesight { field_rad: 0.5, range_m: 9.0, ..NEAR_SIGHTED };
        let (rgb, _, ids) = limited(&narrow, 1.0);
        let n_seen = ids.iter().filter(|id| **id == 40).count() as f32;
        // A circle of radius f tan(0.25), f half of the width.
        let radius_px = 0.5 * SIDE as f32 * 0.2553;
        assert!((n_seen - std::f32::consts::PI * radius_px * radius_px).abs() < 8.0, "{n_seen}");
        assert_eq!(rgb[0], HAZE as u8);
    }
}
