//! What things are to collisions and to those who put something on them: upright boxes and
//! level tops, worked out from the catalogue's parts.

use chaic_protocol::catalogue::Part;
use chaic_protocol::geom::{rotate_yaw, yaw_rotation};
use chaic_protocol::{EntityId, Quat, Vec2, Vec3};

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
        yaw_rad: chaic_protocol::geom::math::atan2(-along.y, along.x),
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
    let size = thing.size_m();
    let parts: &'static [Part] = thing.class.info().parts;
    parts.iter().filter(|p| p.collides).map(move |part| {
        let half = turned_half_extents(part, size);
        Block {
            center: position + rotate_yaw(Vec3::from(part.center) * size, yaw_rad),
            half,
            yaw_rad,
            entity,
        }
    })
}

/// The collision boxes of a thing where the setup puts it.
pub fn blocks_of(thing: &Thing) -> Vec<Block> {
    blocks_at(thing, EntityId::NOTHING, thing.position, thing.yaw_rad).collect()
}

/// The tops of a thing on which others may be put, where the setup puts it.
pub fn top_surfaces(thing: &Thing) -> Vec<Surface> {
    surfaces_at(thing, thing.position, thing.yaw_rad)
}

pub(crate) fn surfaces_at(thing: &Thing, position: Vec3, yaw_rad: f32) -> Vec<Surface> {
    let size = thing.size_m();
    let parts = thing.class.info().parts.iter().filter(|p| p.supports);
    parts
        .map(|part| {
            let half = turned_half_extents(part, size);
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
    let [x, y, z] = part.turn_deg.map(f32::to_radians);
    let turn = yaw_rotation(y) * axis_turn(Vec3::X, x) * axis_turn(Vec3::Z, z);
    let m = glam::Mat3::from_quat(turn);
    m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z
}

fn axis_turn(axis: Vec3, rad: f32) -> Quat {
    let (s, c) =
        (chaic_protocol::geom::math::sin(0.5 * rad), chaic_protocol::geom::math::cos(0.5 * rad));
    Quat::from_xyzw(axis.x * s, axis.y * s, axis.z * s, c)
}

/// The walls of a setup as boxes.
pub(crate) fn wall_blocks(setup: &Setup) -> impl Iterator<Item = Block> + '_ {
    setup.walls.iter().map(wall_block)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_protocol::ClassId;
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
    fn an_apple_is_as_high_as_the_catalogue_says() {
        let apple = Thing::new(ClassId::named("apple"), Vec3::new(0.0, 1.0, 0.0), 0.3);
        let top = blocks_of(&apple).iter().map(|b| b.y_range()[1]).fold(0.0, f32::max);
        assert!(top > 1.05 && top <= 1.0 + apple.size_m().y + 1e-4, "{top}");
    }
}
