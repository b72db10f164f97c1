//! What the network reads of an image of color and depth.

use chaic_core::geom::Camera;

/// Numbers of each pixel: red, green and blue from -1 to 1; inverse depth, up to 4 per metre; height
/// above the floor, metres, from -1 to 3; the normal of the surface in the camera's frame.
pub const N_FEATURES: usize = 8;

/// A rectangle of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column and row.
    pub at: [usize; 2],
    /// Columns and rows.
    pub size: [usize; 2],
}

impl Crop {
    /// The whole image of a camera.
    pub fn whole(camera: &Camera) -> Crop {
        Crop { at: [0, 0], size: [camera.width as usize, camera.height as usize] }
    }
}

/// The features of a part of an image, shape [height, width, N_FEATURES], from color (u8, shape
/// [height, width, 3]) and depth in metres of the whole image.
///
/// # Panics
/// If the crop or the camera's size don't fit the images.
pub fn features(rgb: &[u8], depth_m: &[f32], camera: &Camera, crop: Crop, out: &mut [f32]) {
    let width = camera.width as usize;
    let [columns, rows] = crop.size;
    let focal = camera.focal_px();
    let up = camera.rotation().transpose().y_axis;
    assert_eq!(out.len(), columns * rows * N_FEATURES, "features have another shape");
    let inverse = |column: usize, row: usize| 1.0 / true_depth(depth_m[row * width + column]);
    for (j, line) in out.chunks_exact_mut(columns * N_FEATURES).enumerate() {
        let row = crop.at[1] + j;
        let (above, below) = (row.saturating_sub(1), (row + 1).min(camera.height as usize - 1));
        let v = row as f32 + 0.5 - 0.5 * camera.height as f32;
        for (i, pixel) in line.as_chunks_mut::<N_FEATURES>().0.iter_mut().enumerate() {
            let column = crop.at[0] + i;
            let (left, right) = (column.saturating_sub(1), (column + 1).min(width - 1));
            let u = column as f32 + 0.5 - 0.5 * width as f32;
            let q = inverse(column, row);
            // Of the two sides the one that lies more likely on the same surface: depth changes less.
            let less = |a: f32, b: f32| if a.abs() < b.abs() { a } else { b };
            let du = less(inverse(right, row) - q, q - inverse(left, row));
            let dv = less(inverse(column, below) - q, q - inverse(column, above));
            // Of a plane, inverse depth is linear on the image: its coefficients are the normal.
            let normal = [-focal * du, focal * dv, q - u * du - v * dv];
            let length =
                (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
            let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
            // Axes of the camera: x to the right, y up, looking along -z.
            let depth = true_depth(depth_m[row * width + column]);
            let height_m =
                camera.eye_in_world.y + depth * (up.x * u / focal - up.y * v / focal - up.z);
            let at = 3 * (row * width + column);
            for c in 0..3 {
                pixel[c] = f32::from(rgb[at + c]) / 127.5 - 1.0;
            }
            pixel[3] = q.min(4.0);
            pixel[4] = height_m.clamp(-1.0, 3.0);
            for c in 0..3 {
                pixel[5 + c] = normal[c] * scale;
            }
        }
    }
}

/// A depth that an eye can tell, metres: what is none (not a number, say) counts as far away.
fn true_depth(depth_m: f32) -> f32 {
    /// Half of [`Camera::NEAR_M`].
    const LEAST_M: f32 = 0.05;
    if (LEAST_M..=Camera::FAR_M).contains(&depth_m) { depth_m } else { Camera::FAR_M }
}
