//! Collision boxes and supporting surfaces of objects, derived from the parts in the catalogue.

use chaic_core::catalogue::Part;
use chaic_core::geom::{rotate_yaw, yaw_rotation};
use chaic_core::{EntityId, Quat, Vec2, Vec3};

use crate::setup::{ObjectSpec, Setup, Wall};

/// An upright box that blocks bodies and falling objects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Center, meters.
    pub center: Vec3,
    /// Half extents along its own x, y and z axes, meters.
    pub half: Vec3,
    /// Rotation about the vertical axis, radians.
    pub yaw_rad: f32,
    /// Entity that it belongs to.
    pub entity: EntityId,
}

/// A horizontal rectangle on which objects can be placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Center of the top face in the world, meters.
    pub center: Vec3,
    /// Half extents along its own x and z axes, meters.
    pub half: [f32; 2],
    /// Rotation about the vertical axis, radians.
    pub yaw_rad: f32,
}

impl Block {
    /// Returns the point of the box that is nearest in plan, and whether `p` is inside.
    pub fn nearest_in_plan(&self, p: Vec3) -> (Vec3, bool) {
        let local = rotate_yaw(p - self.center, -self.yaw_rad);
        let clamped = Vec3::new(
            local.x.clamp(-self.half.x, self.half.x),
            0.0,
            local.z.clamp(-self.half.z, self.half.z),
        );
        let inside = local.x == clamped.x && local.z == clamped.z;
        let world = self.center + rotate_yaw(clamped, self.yaw_rad);
        (Vec3::new(world.x, p.y, world.z), inside)
    }

    /// Returns the lowest and the highest y coordinate, meters.
    pub fn y_range(&self) -> [f32; 2] {
        [self.center.y - self.half.y, self.center.y + self.half.y]
    }

    /// Returns the radius of the circumscribed circle in plan, meters.
    pub fn plan_radius(&self) -> f32 {
        Vec2::new(self.half.x, self.half.z).length()
    }
}

impl ObjectSpec {
    /// Returns the parts of the shape, in the unit box.
    ///
    /// They are the parts of the catalogue, unless [`ObjectSpec::seat_m`] sets a different seat
    /// height. Then everything up to the seat is scaled to that height, and everything above it to
    /// the remaining height.
    pub fn parts(&self) -> impl Iterator<Item = Part> + use<> {
        let parts = self.class.info().parts;
        let seat = self.seat_m.map(|seat_m| seat_m / self.size_m().y);
        let stretch = seat.zip(lowest_top(parts));
        let scale = Vec3::from(self.scale);
        parts.iter().map(move |part| {
            let part = match stretch {
                Some((to, from)) => rescale_height(part, from, to),
                None => *part,
            };
            if scale == Vec3::splat(scale.x) { part } else { scale_rotated_part(part, scale) }
        })
    }
}

/// Scales a rotated part along the directions of its own axes, so that a wheel of a wider truck
/// does not become a higher wheel.
fn scale_rotated_part(mut part: Part, scale: Vec3) -> Part {
    if part.turn_deg != [0.0; 3] {
        let axes = part_rotation(&part);
        for (k, axis) in [axes.x_axis, axes.y_axis, axes.z_axis].into_iter().enumerate() {
            part.extent[k] *= (axis * scale).length() / scale[k];
        }
    }
    part
}

/// Returns the height of the lowest supporting top in the unit box.
fn lowest_top(parts: &[Part]) -> Option<f32> {
    let tops = parts.iter().filter(|p| p.supports).map(|p| p.center[1] + 0.5 * p.extent[1]);
    tops.min_by(f32::total_cmp)
}

/// Maps the heights `0..from` of a part to `0..to`, and `from..1` to `to..1`.
fn rescale_height(part: &Part, from: f32, to: f32) -> Part {
    let height = |y: f32| {
        if y <= from || from >= 1.0 {
            y * to / from
        } else {
            to + (y - from) * (1.0 - to) / (1.0 - from)
        }
    };
    let mut part = *part;
    if part.turn_deg == [0.0; 3] {
        let [low, high] = [-0.5, 0.5].map(|h| height(part.center[1] + h * part.extent[1]));
        part.center[1] = 0.5 * (low + high);
        part.extent[1] = high - low;
    } else {
        // Rotated parts keep their thickness.
        part.center[1] = height(part.center[1]);
    }
    part
}

/// Returns the box of a wall.
pub(crate) fn wall_block(wall: &Wall) -> Block {
    let along = wall.b - wall.a;
    let middle = 0.5 * (wall.a + wall.b);
    Block {
        center: Vec3::new(middle.x, 0.5 * (wall.bottom_m + wall.top_m), middle.y),
        // The ends overlap their neighbors so that corners have no notch.
        half: Vec3::new(
            0.5 * (along.length() + wall.thickness_m),
            0.5 * (wall.top_m - wall.bottom_m),
            0.5 * wall.thickness_m,
        ),
        yaw_rad: chaic_core::geom::math::atan2(-along.y, along.x),
        entity: EntityId::WALL,
    }
}

/// Returns the boxes of the colliding parts of an object that stands upright at `position` with
/// `yaw_rad`.
pub(crate) fn blocks_at(
    spec: &ObjectSpec,
    entity: EntityId,
    position: Vec3,
    yaw_rad: f32,
) -> impl Iterator<Item = Block> + use<> {
    let spec = *spec;
    let parts = spec.parts().filter(|p| p.collides);
    parts.map(move |part| block(&spec, &part, entity, position, yaw_rad))
}

/// Returns the box around a part of an object that stands upright at `position` with `yaw_rad`.
fn block(spec: &ObjectSpec, part: &Part, entity: EntityId, position: Vec3, yaw_rad: f32) -> Block {
    let size = spec.size_m();
    Block {
        center: position + rotate_yaw(Vec3::from(part.center) * size, yaw_rad),
        half: turned_half_extents(part, size),
        yaw_rad,
        entity,
    }
}

/// Returns the collision boxes of an object at its pose in the setup.
pub fn blocks_of(spec: &ObjectSpec) -> Vec<Block> {
    blocks_at(spec, EntityId::NOTHING, spec.position, spec.yaw_rad).collect()
}

/// Returns boxes around the parts of an object without collision, at its pose in the setup. A point
/// inside such a box is hidden from view.
pub fn non_colliding_blocks(spec: &ObjectSpec) -> Vec<Block> {
    let non_colliding = spec.parts().filter(|p| !p.collides);
    non_colliding.map(|p| block(spec, &p, EntityId::NOTHING, spec.position, spec.yaw_rad)).collect()
}

/// Returns the surfaces of an object on which others can be placed, at its pose in the setup.
pub fn top_surfaces(spec: &ObjectSpec) -> Vec<Surface> {
    surfaces_at(spec, spec.position, spec.yaw_rad)
}

pub(crate) fn surfaces_at(spec: &ObjectSpec, position: Vec3, yaw_rad: f32) -> Vec<Surface> {
    let size = spec.size_m();
    let parts = spec.parts().filter(|p| p.supports);
    parts
        .map(|part| {
            let half = turned_half_extents(&part, size);
            let top = Vec3::from(part.center) * size + Vec3::Y * half.y;
            Surface { center: position + rotate_yaw(top, yaw_rad), half: [half.x, half.z], yaw_rad }
        })
        .collect()
}

/// Returns the half extents of the upright box, in the object frame, around a rotated part.
fn turned_half_extents(part: &Part, size: Vec3) -> Vec3 {
    let half = 0.5 * Vec3::from(part.extent) * size;
    if part.turn_deg == [0.0; 3] {
        return half;
    }
    let m = part_rotation(part);
    m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z
}

/// Returns the rotation from the frame of a part to the object frame.
fn part_rotation(part: &Part) -> glam::Mat3 {
    let [x, y, z] = part.turn_deg.map(f32::to_radians);
    glam::Mat3::from_quat(yaw_rotation(y) * axis_rotation(Vec3::X, x) * axis_rotation(Vec3::Z, z))
}

fn axis_rotation(axis: Vec3, rad: f32) -> Quat {
    let (s, c) = (chaic_core::geom::math::sin(0.5 * rad), chaic_core::geom::math::cos(0.5 * rad));
    Quat::from_xyzw(axis.x * s, axis.y * s, axis.z * s, c)
}

/// Returns the walls of a setup as boxes.
pub(crate) fn wall_blocks(setup: &Setup) -> impl Iterator<Item = Block> + '_ {
    setup.walls.iter().map(wall_block)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::ClassId;
    use std::f32::consts::FRAC_PI_2;

    #[test]
    fn a_turned_box_swaps_its_extents_in_plan() {
        let block = Block {
            center: Vec3::new(1.0, 0.5, 0.0),
            half: Vec3::new(1.0, 0.5, 0.1),
            yaw_rad: FRAC_PI_2,
            entity: EntityId::WALL,
        };
        let (nearest, inside) = block.nearest_in_plan(Vec3::new(3.0, 0.0, 0.5));
        assert!(!inside && (nearest - Vec3::new(1.1, 0.0, 0.5)).length() < 1e-5, "{nearest}");
        assert!(block.nearest_in_plan(Vec3::new(1.0, 0.0, -0.9)).1);
    }

    #[test]
    fn walls_follow_their_center_line() {
        let wall = Wall {
            a: Vec2::new(0.0, 0.0),
            b: Vec2::new(3.0, 4.0),
            thickness_m: 0.2,
            bottom_m: 0.0,
            top_m: 3.0,
            color: [0; 3],
        };
        let block = wall_block(&wall);
        assert!(block.nearest_in_plan(Vec3::new(1.5, 0.0, 2.0)).1, "its center is inside");
        assert!(block.nearest_in_plan(Vec3::new(3.0, 0.0, 4.0)).1, "its end is inside");
        assert!(!block.nearest_in_plan(Vec3::new(3.0, 0.0, 0.0)).1);
        assert_eq!(block.y_range(), [0.0, 3.0]);
    }

    #[test]
    fn a_custom_seat_height_moves_the_parts_below_and_above() {
        let mut chair = ObjectSpec::new(ClassId::named("side_chair"), Vec3::ZERO, 0.0);
        let tops = |t: &ObjectSpec| top_surfaces(t).iter().map(|s| s.center.y).collect::<Vec<_>>();
        let highest =
            |t: &ObjectSpec| blocks_of(t).iter().map(|b| b.y_range()[1]).fold(0.0, f32::max);
        let (default_m, high_m) = (tops(&chair)[0], highest(&chair));
        assert!((default_m - 0.45).abs() < 1e-4, "{default_m}");
        chair.seat_m = Some(0.6);
        assert!((tops(&chair)[0] - 0.6).abs() < 1e-4);
        assert!((highest(&chair) - high_m).abs() < 1e-4, "the height of the back is unchanged");
        assert!(blocks_of(&chair).iter().all(|b| b.y_range()[0] >= -1e-4 && b.half.y > 0.0));
    }

    #[test]
    fn a_rotated_part_scales_along_its_own_axes() {
        let mut truck = ObjectSpec::new(ClassId::named("truck"), Vec3::ZERO, 0.0);
        let extents = |t: &ObjectSpec| {
            let part = t.parts().find(|p| p.turn_deg == [0.0, 0.0, 90.0]).expect("a wheel");
            Vec3::from(part.extent) * t.size_m()
        };
        let default = extents(&truck);
        truck.scale = [2.0, 0.5, 3.0];
        // The axle of a wheel is its own y axis and is parallel to the truck's x axis.
        let expected = default * Vec3::new(0.5, 2.0, 3.0);
        assert!((extents(&truck) - expected).abs().max_element() < 1e-4, "{}", extents(&truck));
    }

    #[test]
    fn an_apple_is_as_high_as_the_catalogue_says() {
        let apple = ObjectSpec::new(ClassId::named("apple"), Vec3::new(0.0, 1.0, 0.0), 0.3);
        let top = blocks_of(&apple).iter().map(|b| b.y_range()[1]).fold(0.0, f32::max);
        assert!(top > 1.05 && top <= 1.0 + apple.size_m().y + 1e-4, "{top}");
    }
}
