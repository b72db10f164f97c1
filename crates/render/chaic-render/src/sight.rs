//! What is left of a picture for eyes that see less than a camera.

use chaic_core::EntityId;
use chaic_core::capability::Sight;
use chaic_core::geom::{Camera, math, xz};
use chaic_core::{Vec2, Vec3};

/// What nothing can be made out of, sRGB.
const HAZE: f32 = 128.0;
/// From this part of the range on, things fade into haze.
const FADES_FROM: f32 = 0.7;
/// A blur reaches over so many standard deviations.
const BLUR_REACH: f32 = 3.0;

/// Takes out of an image what such eyes don't see. `depth_m` is that of the whole picture; what is
/// out of range or field gets depth 0, which is no measurement, no id and no color. Shapes as in
/// [`ImagesMut`](crate::ImagesMut).
pub(crate) fn limit_vision(
    sight: &Sight,
    camera: &Camera,
    rgb: Option<&mut [u8]>,
    depth_m: &mut [f32],
    ids: Option<&mut [u16]>,
) {
    let rays = Rays::of(sight, camera);
    let width = camera.width as usize;
    if let Some(rgb) = rgb {
        fade(sight, &rays, width, rgb, depth_m);
        blur(rgb, width, sight.blur_rad * camera.focal_px());
    }
    let mut ids = ids;
    for (k, depth) in depth_m.iter_mut().enumerate() {
        let (per_depth, is_in_field) = rays.at(k / width, k % width);
        if !is_in_field || *depth * per_depth > sight.range_m {
            *depth = 0.0;
            if let Some(ids) = &mut ids {
                ids[k] = EntityId::NOTHING.0;
            }
        }
    }
}

/// The rays through the pixels of a camera.
struct Rays {
    focal_px: f32,
    middle: [f32; 2],
    /// The camera's axes in plan: right, up and ahead (x, z).
    in_plan: [Vec2; 3],
    /// Largest squared distance from the axis per depth that is in the field.
    widest: f32,
}

impl Rays {
    fn of(sight: &Sight, camera: &Camera) -> Rays {
        let half = 0.5 * sight.field_rad;
        let (sine, cosine) = (math::sin(half), math::cos(half));
        // Half of a half turn has no tangent.
        let widest = if cosine > 1e-3 { sine / cosine } else { f32::INFINITY };
        let middle = [0.5 * camera.width as f32, 0.5 * camera.height as f32];
        let in_plan =
            [Vec3::X, Vec3::Y, Vec3::NEG_Z].map(|axis| xz(camera.world_from_camera * axis));
        Rays { focal_px: camera.focal_px(), middle, in_plan, widest: widest * widest }
    }

    /// Distance in plan per depth of what a pixel shows, and whether it is in the field.
    fn at(&self, row: usize, column: usize) -> (f32, bool) {
        let x = (column as f32 + 0.5 - self.middle[0]) / self.focal_px;
        let y = (row as f32 + 0.5 - self.middle[1]) / self.focal_px;
        let [right, up, ahead] = self.in_plan;
        let way = ahead + right * x - up * y;
        ((way.x * way.x + way.y * way.y).sqrt(), x * x + y * y <= self.widest)
    }
}

/// Mixes haze into what is far.
fn fade(sight: &Sight, rays: &Rays, width: usize, rgb: &mut [u8], depth_m: &[f32]) {
    let near_m = FADES_FROM * sight.range_m;
    for (k, (pixel, depth)) in rgb.as_chunks_mut::<3>().0.iter_mut().zip(depth_m).enumerate() {
        let (per_depth, is_in_field) = rays.at(k / width, k % width);
        let part = (*depth * per_depth - near_m) / (sight.range_m - near_m);
        let part = if is_in_field { part.clamp(0.0, 1.0) } else { 1.0 };
        for c in pixel {
            *c = (f32::from(*c) + (HAZE - f32::from(*c)) * part + 0.5) as u8;
        }
    }
}

/// Blurs by a Gaussian, rows first, then columns; pixels at the border count on beyond it.
fn blur(rgb: &mut [u8], width: usize, sigma_px: f32) {
    // A camera with numbers that make no picture has a sigma that is no number.
    if sigma_px.is_nan() || sigma_px < 0.2 || width == 0 {
        return;
    }
    let height = rgb.len() / (3 * width);
    let reach = ((BLUR_REACH * sigma_px).ceil() as usize).min(width.max(height));
    let weights: Vec<f32> = (0..=reach)
        .map(|k| math::exp(-0.5 * (k as f32 / sigma_px) * (k as f32 / sigma_px)))
        .collect();
    let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f32>();
    let weights: Vec<f32> = weights.iter().map(|w| w / sum).collect();
    let mut rows = vec![0.0_f32; rgb.len()];
    let spread = |at: &dyn Fn(usize) -> f32, middle: usize, end: usize| {
        let mut mixed = weights[0] * at(middle);
        for (k, weight) in weights.iter().enumerate().skip(1) {
            let (before, after) = (middle.saturating_sub(k), (middle + k).min(end - 1));
            mixed += weight * (at(before) + at(after));
        }
        mixed
    };
    for row in 0..height {
        for column in 0..width {
            for c in 0..3 {
                let at = |x: usize| f32::from(rgb[3 * (row * width + x) + c]);
                rows[3 * (row * width + column) + c] = spread(&at, column, width);
            }
        }
    }
    for row in 0..height {
        for column in 0..width {
            for c in 0..3 {
                let at = |y: usize| rows[3 * (y * width + column) + c];
                rgb[3 * (row * width + column) + c] = (spread(&at, row, height) + 0.5) as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::Quat;

    const SIDE: usize = 33;
    const NEAR_SIGHTED: Sight =
        Sight { range_m: 2.0, blur_rad: 0.1, field_rad: std::f32::consts::PI, lowered_rad: 0.0 };

    fn camera() -> Camera {
        Camera {
            eye_in_world: Vec3::ZERO,
            world_from_camera: Quat::IDENTITY,
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: SIDE as u32,
            height: SIDE as u32,
        }
    }

    /// A wall of pixels that all differ, `depth_m` away.
    fn seen(sight: &Sight, depth_m: f32) -> (Vec<u8>, Vec<f32>, Vec<u16>) {
        let n = SIDE * SIDE;
        let mut rgb: Vec<u8> = (0..3 * n).map(|k| (k * 37 % 251) as u8).collect();
        let (mut depth, mut ids) = (vec![depth_m; n], vec![40; n]);
        limit_vision(sight, &camera(), Some(&mut rgb), &mut depth, Some(&mut ids));
        (rgb, depth, ids)
    }

    #[test]
    fn nothing_is_left_of_what_is_out_of_range() {
        let (rgb, depth, ids) = seen(&NEAR_SIGHTED, 2.01);
        assert!(rgb.iter().all(|c| *c == HAZE as u8));
        assert!(depth.iter().all(|d| *d == 0.0) && ids.iter().all(|id| *id == EntityId::NOTHING.0));
    }

    #[test]
    fn what_is_near_is_seen_less_sharply_and_keeps_its_brightness() {
        let (rgb, depth, ids) = seen(&NEAR_SIGHTED, 0.5);
        assert!(depth.iter().all(|d| *d == 0.5) && ids.iter().all(|id| *id == 40));
        let sharp = Sight { blur_rad: 0.0, ..NEAR_SIGHTED };
        let (before, ..) = seen(&sharp, 0.5);
        let mean = |p: &[u8]| p.iter().map(|c| f32::from(*c)).sum::<f32>() / p.len() as f32;
        let spread = |p: &[u8]| {
            let m = mean(p);
            p.iter().map(|c| (f32::from(*c) - m) * (f32::from(*c) - m)).sum::<f32>()
                / p.len() as f32
        };
        assert!((mean(&rgb) - mean(&before)).abs() < 1.0);
        assert!(spread(&rgb) < 0.7 * spread(&before), "{} {}", spread(&rgb), spread(&before));
    }

    #[test]
    fn the_range_is_a_cylinder_and_the_field_a_cone() {
        let (.., ids) = seen(&NEAR_SIGHTED, 1.6);
        let column = SIDE / 2;
        assert!((0..SIDE).all(|row| ids[row * SIDE + column] == 40), "above and below");
        assert!((0..SIDE).all(|row| ids[row * SIDE] == EntityId::NOTHING.0), "aside");
        let narrow = Sight { field_rad: 0.5, range_m: 9.0, ..NEAR_SIGHTED };
        let (rgb, _, ids) = seen(&narrow, 1.0);
        let n_seen = ids.iter().filter(|id| **id == 40).count() as f32;
        // A circle of radius f tan(0.25), f half of the width.
        let radius_px = 0.5 * SIDE as f32 * 0.2553;
        assert!((n_seen - std::f32::consts::PI * radius_px * radius_px).abs() < 8.0, "{n_seen}");
        assert_eq!(rgb[0], HAZE as u8);
    }
}
