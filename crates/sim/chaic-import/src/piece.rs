//! Conversion of a posed model to an object.

use chaic_core::Vec3;
use chaic_core::catalogue::ClassInfo;
use chaic_core::geom::wrap_angle;
use chaic_episodes::{mm, mm3};
use chaic_world::{ObjectSpec, top_surfaces};

use crate::axes::{self, rotated};
use crate::package::Package;
use crate::tables::{MODELS, Model};

/// A model with its pose, in Unity's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PosedModel<'a> {
    pub model: &'a str,
    /// Position of the pivot, meters.
    pub position: Vec3,
    /// Euler angles in degrees, about z, then x, then y.
    pub euler_deg: Vec3,
    /// Scale factors along the model's axes.
    pub scale: Vec3,
}

/// Converts a posed model to an object, with its bottom at the height of the pose. Fails if the
/// name or the bounding box is unknown.
///
/// A model that leans or lies becomes the upright box around it.
pub(crate) fn to_object(posed: &PosedModel, package: &Package) -> Result<ObjectSpec, String> {
    let name = posed.model;
    let model = MODELS.get(name).ok_or_else(|| format!("is {name:?}, a model without a class"))?;
    let record = package.record(name);
    let record =
        record.ok_or_else(|| format!("is {name:?}, which has no record in the package"))?;
    let [low, high] = model.bounds.map_or(record.bounds, |corners| corners.map(Vec3::from));
    let [low, high] = tilted_bounds([low * posed.scale, high * posed.scale], posed.euler_deg);
    let (middle, size) = (0.5 * (low + high), high - low);
    let foot = Vec3::new(middle.x, low.y, middle.z);
    let heading = Vec3::new(0.0, posed.euler_deg.y, 0.0);
    let position = axes::point(posed.position + rotated(foot, heading));
    let yaw_rad = wrap_angle(axes::yaw_rad(posed.euler_deg.y) + model.turn_deg.to_radians());
    Ok(sized_object(model, mm3(position), mm(yaw_rad), size, posed.scale.y))
}

/// Returns the bounding box of tilted corners, in the frame that is rotated by the heading only.
fn tilted_bounds(corners: [Vec3; 2], euler_deg: Vec3) -> [Vec3; 2] {
    let tip = Vec3::new(euler_deg.x, 0.0, euler_deg.z);
    let points = (0..8).map(|k| {
        let pick = |bit: usize| corners[k >> bit & 1];
        rotated(Vec3::new(pick(0).x, pick(1).y, pick(2).z), tip)
    });
    points.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[a, b], p| [a.min(p), b.max(p)])
}

/// Returns an object of the model's class with this size (meters, along the model's axes).
fn sized_object(
    model: &Model,
    position: Vec3,
    yaw_rad: f32,
    size: Vec3,
    height_scale: f32,
) -> ObjectSpec {
    let is_across = (model.turn_deg / 90.0) as i32 % 2 != 0;
    let mut size = if is_across { Vec3::new(size.z, size.y, size.x) } else { size };
    let info = model.class.info();
    let mut object = ObjectSpec::new(model.class, position, yaw_rad);
    let seat_m = model.seat_m.map(|m| mm(m * height_scale)).filter(|m| *m < size.y);
    if let Some(seat_m) = seat_m {
        if is_flat(&object) {
            // Parts above the only surface are not part of the class's shape.
            size.y = seat_m;
        } else {
            object.seat_m = Some(seat_m);
        }
    }
    let rounded = |x: f32| (x * 1e4).round() / 1e4;
    object.scale = (size / Vec3::from(info.size_m)).to_array().map(|s| rounded(s).max(0.01));
    object.variant = model.rgb.map_or(0, |rgb| nearest_color(info, rgb));
    object
}

/// Returns whether the only surface is the top.
fn is_flat(object: &ObjectSpec) -> bool {
    top_surfaces(object).iter().all(|s| s.center.y - object.position.y > 0.97 * object.size_m().y)
}

/// Returns the index of the nearest color of the class.
fn nearest_color(info: &ClassInfo, rgb: [u8; 3]) -> u8 {
    let off = |color: &[u8; 3]| -> i32 {
        color.iter().zip(rgb).map(|(a, b)| (i32::from(*a) - i32::from(b)).pow(2)).sum()
    };
    let nearest = (0..info.palette.len()).min_by_key(|k| off(&info.palette[*k]));
    nearest.unwrap_or(0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::ClassId;

    fn model(turn_deg: f32, seat_m: Option<f32>, class: &str) -> Model {
        Model { class: ClassId::named(class), turn_deg, seat_m, bounds: None, rgb: None }
    }

    #[test]
    fn a_tilted_model_has_the_size_of_its_bounding_box() {
        let corners = [Vec3::new(-0.2, 0.0, -0.05), Vec3::new(0.2, 0.3, 0.05)];
        let [low, high] = tilted_bounds(corners, Vec3::new(-90.0, 33.0, 0.0));
        assert!((high - low - Vec3::new(0.4, 0.1, 0.3)).abs().max_element() < 1e-5);
        assert!((low.y + 0.05).abs() < 1e-5);
    }

    #[test]
    fn a_turned_class_swaps_width_and_depth() {
        let size = Vec3::new(1.6, 1.0, 0.7);
        let object = sized_object(&model(90.0, None, "bike"), Vec3::ZERO, 0.0, size, 1.0);
        assert!((object.size_m() - Vec3::new(0.7, 1.0, 1.6)).abs().max_element() < 1e-3);
    }

    #[test]
    fn seats_have_the_measured_height() {
        let size = Vec3::new(0.5, 1.0, 0.5);
        let chair = sized_object(&model(0.0, Some(0.4), "side_chair"), Vec3::ZERO, 0.0, size, 0.5);
        assert_eq!(chair.seat_m, Some(0.2), "scaled with the model");
        assert!((top_surfaces(&chair)[0].center.y - 0.2).abs() < 1e-4);
        let bench = sized_object(&model(0.0, Some(0.4), "bench_sofa"), Vec3::ZERO, 0.0, size, 1.0);
        assert!(bench.seat_m.is_none() && (bench.size_m().y - 0.4).abs() < 1e-3);
    }
}
