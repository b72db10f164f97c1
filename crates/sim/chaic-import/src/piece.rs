//! A model at a pose as a thing of ours.

use chaic_core::Vec3;
use chaic_core::catalogue::ClassInfo;
use chaic_core::geom::wrap_angle;
use chaic_episodes::{mm, mm3};
use chaic_world::{Thing, top_surfaces};

use crate::axes::{self, turned};
use crate::package::Package;
use crate::tables::{MODELS, Model};

/// A model where the original puts it, in Unity's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Posed<'a> {
    pub model: &'a str,
    /// Where its pivot is, metres.
    pub position: Vec3,
    /// Degrees, about z, then x, then y.
    pub euler_deg: Vec3,
    /// Factors on the model's own axes.
    pub scale: Vec3,
}

/// The thing that stands for a posed model, with the height of its bottom as the pose has it; what
/// is wrong, if its name or box isn't known.
///
/// A model that leans or lies becomes the upright box around it.
pub(crate) fn thing(posed: &Posed, package: &Package) -> Result<Thing, String> {
    let name = posed.model;
    let model = MODELS.get(name).ok_or_else(|| format!("is {name:?}, a model without a class"))?;
    let record = package.record(name);
    let record =
        record.ok_or_else(|| format!("is {name:?}, which has no record in the package"))?;
    let [low, high] = model.bounds.map_or(record.bounds, |corners| corners.map(Vec3::from));
    let [low, high] = leaned([low * posed.scale, high * posed.scale], posed.euler_deg);
    let (middle, size) = (0.5 * (low + high), high - low);
    let foot = Vec3::new(middle.x, low.y, middle.z);
    let heading = Vec3::new(0.0, posed.euler_deg.y, 0.0);
    let position = axes::point(posed.position + turned(foot, heading));
    let yaw_rad = wrap_angle(axes::yaw_rad(posed.euler_deg.y) + model.turn_deg.to_radians());
    Ok(shaped(model, mm3(position), mm(yaw_rad), size, posed.scale.y))
}

/// A box in the frame that only the heading turns, around one that is also tipped.
fn leaned(corners: [Vec3; 2], euler_deg: Vec3) -> [Vec3; 2] {
    let tip = Vec3::new(euler_deg.x, 0.0, euler_deg.z);
    let points = (0..8).map(|k| {
        let pick = |bit: usize| corners[k >> bit & 1];
        turned(Vec3::new(pick(0).x, pick(1).y, pick(2).z), tip)
    });
    points.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[a, b], p| [a.min(p), b.max(p)])
}

/// The model's class at this size (metres, along the model's axes).
fn shaped(model: &Model, position: Vec3, yaw_rad: f32, size: Vec3, height_scale: f32) -> Thing {
    let is_across = (model.turn_deg / 90.0) as i32 % 2 != 0;
    let mut size = if is_across { Vec3::new(size.z, size.y, size.x) } else { size };
    let info = model.class.info();
    let mut thing = Thing::new(model.class, position, yaw_rad);
    let seat_m = model.seat_m.map(|m| mm(m * height_scale)).filter(|m| *m < size.y);
    if let Some(seat_m) = seat_m {
        if is_flat(&thing) {
            // What sticks out above its only surface isn't part of the class's shape.
            size.y = seat_m;
        } else {
            thing.seat_m = Some(seat_m);
        }
    }
    let rounded = |x: f32| (x * 1e4).round() / 1e4;
    thing.scale = (size / Vec3::from(info.size_m)).to_array().map(|s| rounded(s).max(0.01));
    thing.variant = model.rgb.map_or(0, |rgb| nearest_color(info, rgb));
    thing
}

/// Whether its only surface is its top.
fn is_flat(thing: &Thing) -> bool {
    top_surfaces(thing).iter().all(|s| s.center.y - thing.position.y > 0.97 * thing.size_m().y)
}

/// Which of the class's colors comes nearest.
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
    fn a_thing_that_lies_is_as_large_as_the_box_around_it() {
        let corners = [Vec3::new(-0.2, 0.0, -0.05), Vec3::new(0.2, 0.3, 0.05)];
        let [low, high] = leaned(corners, Vec3::new(-90.0, 33.0, 0.0));
        assert!((high - low - Vec3::new(0.4, 0.1, 0.3)).abs().max_element() < 1e-5);
        assert!((low.y + 0.05).abs() < 1e-5);
    }

    #[test]
    fn a_turned_class_swaps_width_and_depth() {
        let size = Vec3::new(1.6, 1.0, 0.7);
        let thing = shaped(&model(90.0, None, "bike"), Vec3::ZERO, 0.0, size, 1.0);
        assert!((thing.size_m() - Vec3::new(0.7, 1.0, 1.6)).abs().max_element() < 1e-3);
    }

    #[test]
    fn seats_are_where_they_were_measured() {
        let size = Vec3::new(0.5, 1.0, 0.5);
        let chair = shaped(&model(0.0, Some(0.4), "side_chair"), Vec3::ZERO, 0.0, size, 0.5);
        assert_eq!(chair.seat_m, Some(0.2), "scaled along");
        assert!((top_surfaces(&chair)[0].center.y - 0.2).abs() < 1e-4);
        let bench = shaped(&model(0.0, Some(0.4), "bench_sofa"), Vec3::ZERO, 0.0, size, 1.0);
        assert!(bench.seat_m.is_none() && (bench.size_m().y - 0.4).abs() < 1e-3);
    }
}
