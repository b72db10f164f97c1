//! What things are to collisions and to those who put something on them: upright boxes and
//! level tops, worked out from the catalogue's parts.

use chaic_core::catalogue::Part;
use chaic_core::geom::{rotate_yaw, yaw_rotation};
use chaic_core::{EntityId, Quat, Vec2, Vec3};

use crate::setup::{Setup, Thing, Wall};

/// An upright box that stops bodies and falling things.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Middle, metres.
    pub center: Vec3,
    /// Half extents along its own x, y, z, metres.
    pub half: Vec3,
    /// Turn about the vertical, radians.
    pub yaw_rad: f32,
    /// What it belongs to.
    pub entity: EntityId,
}

/// A level rectangle on which things may be put.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Middle of the top face, in the world, metres.
    pub center: Vec3,
    /// Half extents along its own x and z, metres.
    pub half: [f32; 2],
    /// Turn about the vertical, radians.
    pub yaw_rad: f32,
}

impl Block {
    /// The nearest point of the box in plan, and whether `p` lies inside it.
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

    /// Lowest and highest point, metres.
    pub fn y_range(&self) -> [f32; 2] {
        [self.center.y - self.half.y, self.center.y + self.half.y]
    }

    /// Radius of the circle around it in plan, metres.
    pub fn plan_radius(&self) -> f32 {
        Vec2::new(self.half.x, self.half.z).length()
    }
}

impl Thing {
    /// The parts of its shape, in its unit box.
    ///
    /// They are the catalogue's, unless [`Thing::seat_m`] puts the seat at another height: then
    /// everything up to the seat is stretched to that height, and everything above it to the rest.
    pub fn parts(&self) -> impl Iterator<Item = Part> + use<> {
        let parts = self.class.info().parts;
        let seat = self.seat_m.map(|seat_m| seat_m / self.size_m().y);
        let stretch = seat.zip(lowest_top(parts));
        let scale = Vec3::from(self.scale);
        parts.iter().map(move |part| {
            let part = match stretch {
                Some((to, from)) => stretched(part, from, to),
                None => *part,
            };
            if scale == Vec3::splat(scale.x) { part } else { in_proportion(part, scale) }
        })
    }
}

/// A part whose own axes, if it is turned, grow as the directions do in which they point: a wheel
/// of a wider truck isn't a higher wheel.
fn in_proportion(mut part: Part, scale: Vec3) -> Part {
    if part.turn_deg != [0.0; 3] {
        let axes = turn_of(&part);
        for (k, axis) in [axes.x_axis, axes.y_axis, axes.z_axis].into_iter().enumerate() {
            part.extent[k] *= (axis * scale).length() / scale[k];
        }
    }
    part
}

/// Height of the lowest supporting top in the unit box.
fn lowest_top(parts: &[Part]) -> Option<f32> {
    let tops = parts.iter().filter(|p| p.supports).map(|p| p.center[1] + 0.5 * p.extent[1]);
    tops.min_by(f32::total_cmp)
}

/// A part where heights `0..from` become `0..to`, and `from..1` become `to..1`.
fn stretched(part: &Part, from: f32, to: f32) -> Part {
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
        // What leans or lies keeps its thickness.
        part.center[1] = height(part.center[1]);
    }
    part
}

/// The box of a wall.
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

/// The boxes of the colliding parts of a thing standing upright at `position` with `yaw_rad`.
pub(crate) fn blocks_at(
    thing: &Thing,
    entity: EntityId,
    position: Vec3,
    yaw_rad: f32,
) -> impl Iterator<Item = Block> + use<> {
    let thing = *thing;
    let parts = thing.parts().filter(|p| p.collides);
    parts.map(move |part| block(&thing, &part, entity, position, yaw_rad))
}

/// The box around a part of a thing standing upright at `position` with `yaw_rad`.
fn block(thing: &Thing, part: &Part, entity: EntityId, position: Vec3, yaw_rad: f32) -> Block {
    let size = thing.size_m();
    Block {
        center: position + rotate_yaw(Vec3::from(part.center) * size, yaw_rad),
        half: turned_half_extents(part, size),
        yaw_rad,
        entity,
    }
}

/// The collision boxes of a thing where the setup puts it.
pub fn blocks_of(thing: &Thing) -> Vec<Block> {
    blocks_at(thing, EntityId::NOTHING, thing.position, thing.yaw_rad).collect()
}

/// Boxes around those parts of a thing that are only to be looked at, where the setup puts it:
/// what lies inside one can't be seen.
pub fn ghosts_of(thing: &Thing) -> Vec<Block> {
    let ghosts = thing.parts().filter(|p| !p.collides);
    ghosts.map(|p| block(thing, &p, EntityId::NOTHING, thing.position, thing.yaw_rad)).collect()
}

/// The tops of a thing on which others may be put, where the setup puts it.
pub fn top_surfaces(thing: &Thing) -> Vec<Surface> {
    surfaces_at(thing, thing.position, thing.yaw_rad)
}

pub(crate) fn surfaces_at(thing: &Thing, position: Vec3, yaw_rad: f32) -> Vec<Surface> {
    let size = thing.size_m();
    let parts = thing.parts().filter(|p| p.supports);
    parts
        .map(|part| {
            let half = turned_half_extents(&part, size);
            let top = Vec3::from(part.center) * size + Vec3::Y * half.y;
            Surface { center: position + rotate_yaw(top, yaw_rad), half: [half.x, half.z], yaw_rad }
        })
        .collect()
}

/// Half extents of the upright box, in the thing's frame, around a part with its turn.
fn turned_half_extents(part: &Part, size: Vec3) -> Vec3 {
    let half = 0.5 * Vec3::from(part.extent) * size;
    if part.turn_deg == [0.0; 3] {
        return half;
    }
    let m = turn_of(part);
    m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z
}

/// Where a part's own axes point in the thing's frame.
fn turn_of(part: &Part) -> glam::Mat3 {
    let [x, y, z] = part.turn_deg.map(f32::to_radians);
    glam::Mat3::from_quat(yaw_rotation(y) * axis_turn(Vec3::X, x) * axis_turn(Vec3::Z, z))
}

fn axis_turn(axis: Vec3, rad: f32) -> Quat {
    let (s, c) = (chaic_core::geom::math::sin(0.5 * rad), chaic_core::geom::math::cos(0.5 * rad));
    Quat::from_xyzw(axis.x * s, axis.y * s, axis.z * s, c)
}

/// The walls of a setup as boxes.
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
    fn walls_lie_along_their_center_line() {
        let wall = Wall {
            a: Vec2::new(0.0, 0.0),
            b: Vec2::new(3.0, 4.0),
            thickness_m: 0.2,
            bottom_m: 0.0,
            top_m: 3.0,
            color: [0; 3],
        };
        let block = wall_block(&wall);
        assert!(block.nearest_in_plan(Vec3::new(1.5, 0.0, 2.0)).1, "its middle is inside");
        assert!(block.nearest_in_plan(Vec3::new(3.0, 0.0, 4.0)).1, "its end is inside");
        assert!(!block.nearest_in_plan(Vec3::new(3.0, 0.0, 0.0)).1);
        assert_eq!(block.y_range(), [0.0, 3.0]);
    }

    #[test]
    fn a_seat_of_its_own_moves_what_is_below_and_above_it() {
        let mut chair = Thing::new(ClassId::named("side_chair"), Vec3::ZERO, 0.0);
        let tops = |t: &Thing| top_surfaces(t).iter().map(|s| s.center.y).collect::<Vec<_>>();
        let highest = |t: &Thing| blocks_of(t).iter().map(|b| b.y_range()[1]).fold(0.0, f32::max);
        let (usual_m, high_m) = (tops(&chair)[0], highest(&chair));
        assert!((usual_m - 0.45).abs() < 1e-4, "{usual_m}");
        chair.seat_m = Some(0.6);
        assert!((tops(&chair)[0] - 0.6).abs() < 1e-4);
        assert!((highest(&chair) - high_m).abs() < 1e-4, "the back ends where it did");
        assert!(blocks_of(&chair).iter().all(|b| b.y_range()[0] >= -1e-4 && b.half.y > 0.0));
    }

    #[test]
    fn a_lying_part_grows_with_the_direction_it_lies_in() {
        let mut truck = Thing::new(ClassId::named("truck"), Vec3::ZERO, 0.0);
        let lying = |t: &Thing| {
            let part = t.parts().find(|p| p.turn_deg == [0.0, 0.0, 90.0]).expect("a wheel");
            Vec3::from(part.extent) * t.size_m()
        };
        let usual = lying(&truck);
        truck.scale = [2.0, 0.5, 3.0];
        // A wheel's axle is its own y and lies along the truck's x.
        let expected = usual * Vec3::new(0.5, 2.0, 3.0);
        assert!((lying(&truck) - expected).abs().max_element() < 1e-4, "{}", lying(&truck));
    }

    #[test]
    fn an_apple_is_as_high_as_the_catalogue_says() {
        let apple = Thing::new(ClassId::named("apple"), Vec3::new(0.0, 1.0, 0.0), 0.3);
        let top = blocks_of(&apple).iter().map(|b| b.y_range()[1]).fold(0.0, f32::max);
        assert!(top > 1.05 && top <= 1.0 + apple.size_m().y + 1e-4, "{top}");
    }
}
