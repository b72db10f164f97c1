//! Input features of the detector, computed from RGB-D images.

use chaic_core::geom::Camera;

/// Channels of a pixel: red, green and blue from -1 to 1; inverse depth, at most 4 per meter;
/// height above the floor in meters, -1 to 3; surface normal in the camera's frame.
pub const N_FEATURES: usize = 8;

/// Rectangle of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageCrop {
    /// First column and row, pixels.
    pub origin: [usize; 2],
    /// Number of columns and rows, pixels.
    pub size: [usize; 2],
}

impl ImageCrop {
    /// Returns the whole image of a camera.
    pub fn whole(camera: &Camera) -> ImageCrop {
        ImageCrop { origin: [0, 0], size: [camera.width as usize, camera.height as usize] }
    }
}

/// Computes the features of a crop, shape [height, width, N_FEATURES], from color (u8, shape
/// [height, width, 3]) and depth (meters, shape [height, width]) of the whole image.
///
/// # Panics
/// If the crop or the camera's image size does not fit the images.
pub fn features(rgb: &[u8], depth_m: &[f32], camera: &Camera, crop: ImageCrop, out: &mut [f32]) {
    let width = camera.width as usize;
    let [columns, rows] = crop.size;
    let focal = camera.focal_px();
    let up = camera.rotation().transpose().y_axis;
    assert_eq!(out.len(), columns * rows * N_FEATURES, "features have another shape");
    // Inverse depth of the crop and of the pixels around it.
    let [left, top] = crop.origin.map(|first| first.saturating_sub(1));
    let right = (crop.origin[0] + columns + 1).min(width);
    let bottom = (crop.origin[1] + rows + 1).min(camera.height as usize);
    let mut inverse_depths = Vec::with_capacity((right - left) * (bottom - top));
    for row in top..bottom {
        let depths = &depth_m[row * width + left..row * width + right];
        inverse_depths.extend(depths.iter().map(|depth| 1.0 / valid_depth(*depth)));
    }
    let inverse_depths_of = |row: usize| &inverse_depths[(row - top) * (right - left)..];
    // Offset of each column from the optical axis in pixels, and its contribution to the height
    // above the eye.
    let across: Vec<(f32, f32)> = (crop.origin[0]..crop.origin[0] + columns)
        .map(|column| {
            let u = column as f32 + 0.5 - 0.5 * width as f32;
            (u, up.x * u / focal)
        })
        .collect();
    let colors: [f32; 256] = std::array::from_fn(|value| value as f32 / 127.5 - 1.0);
    for (j, line) in out.chunks_exact_mut(columns * N_FEATURES).enumerate() {
        let row = crop.origin[1] + j;
        let (above, below) = (row.saturating_sub(1), (row + 1).min(camera.height as usize - 1));
        let v = row as f32 + 0.5 - 0.5 * camera.height as f32;
        let up_of_row = up.y * v / focal;
        let [here, above, below] = [row, above, below].map(inverse_depths_of);
        for (i, pixel) in line.as_chunks_mut::<N_FEATURES>().0.iter_mut().enumerate() {
            let column = crop.origin[0] + i;
            let at = column - left;
            let (at_left, at_right) =
                (column.saturating_sub(1) - left, (column + 1).min(width - 1) - left);
            let (u, up_of_column) = across[i];
            let inverse_depth = here[at];
            // Of the two neighbors, the one with the smaller change of depth more likely lies on
            // the same surface.
            let smaller = |a: f32, b: f32| if a.abs() < b.abs() { a } else { b };
            let du = smaller(here[at_right] - inverse_depth, inverse_depth - here[at_left]);
            let dv = smaller(below[at] - inverse_depth, inverse_depth - above[at]);
            // The inverse depth of a plane is linear in image coordinates; its coefficients are the
            // normal.
            let normal = [-focal * du, focal * dv, inverse_depth - u * du - v * dv];
            let length =
                (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
            let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
            // Camera axes: x right, y up, view direction -z.
            let depth = valid_depth(depth_m[row * width + column]);
            let height_m = camera.eye_in_world.y + depth * (up_of_column - up_of_row - up.z);
            let at = 3 * (row * width + column);
            for c in 0..3 {
                pixel[c] = colors[usize::from(rgb[at + c])];
            }
            pixel[3] = inverse_depth.min(4.0);
            pixel[4] = height_m.clamp(-1.0, 3.0);
            for c in 0..3 {
                pixel[5 + c] = normal[c] * scale;
            }
        }
    }
}

/// Clamps invalid depth to the far plane, meters.
fn valid_depth(depth_m: f32) -> f32 {
    /// Minimum valid depth, meters: half of [`Camera::NEAR_M`].
    const MIN_M: f32 = 0.05;
    if (MIN_M..=Camera::FAR_M).contains(&depth_m) { depth_m } else { Camera::FAR_M }
}
