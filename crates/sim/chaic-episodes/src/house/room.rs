//! One room during furnishing: places groups of furniture and keeps the room walkable.

use std::f32::consts::{FRAC_PI_2, PI};

use chaic_core::geom::{Rect, rotate_yaw};
use chaic_core::rng::RngStream;
use chaic_core::{ClassId, Vec2, Vec3};
use chaic_world::ObjectSpec;

use super::layout::{DOOR_M, Door, WALL_M};
use crate::free_space::FreeSpace;
use crate::upright_box::{mm, mm3};

/// Radius of the widest body plus a margin, meters: a wheelchair has 0.35.
pub(super) const BODY_M: f32 = 0.40;
/// Distance from the outline of furniture to which a body must get, meters; less than an arm's
/// reach.
const ACCESS_M: f32 = 0.6;
/// Depth of the zone that is kept clear on both sides of a doorway, meters.
const DOOR_CLEAR_M: f32 = 1.0;
/// Gap between a piece of furniture and the wall behind it, meters.
const WALL_GAP_M: f32 = 0.02;
/// Gap between neighboring pieces of different groups, meters.
const GAP_M: f32 = 0.04;
/// Number of positions tried along one wall.
const ATTEMPTS_PER_WALL: usize = 8;
/// Number of positions tried in the interior of a room.
const ATTEMPTS_FREE: usize = 16;
/// Minimum fraction of the empty room's standing area that must remain.
const MIN_FREE_FRACTION: f32 = 0.35;

/// A piece of furniture within a group. In the group's frame the wall is at z = 0, and the front
/// faces -z, into the room.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub class: ClassId,
    /// Center along the wall, meters.
    pub x: f32,
    /// Distance of the center from the wall, meters.
    pub d: f32,
    /// Quarter turns to the left.
    pub turns: u8,
    /// Depth of the clear zone in front of the piece, meters.
    pub access_m: f32,
    pub variant: u8,
}

/// Location where a group may stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spot {
    /// With its back to a wall.
    Wall,
    /// With its back to a wall, as close to a corner as possible.
    Corner,
    /// Anywhere in the room; positions near the center are tried first.
    Free,
}

/// A wall of a room, as the number of quarter turns of furniture with its back to the wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Side(pub u8);

impl Side {
    pub const ALL: [Side; 4] = [Side(0), Side(1), Side(2), Side(3)];

    /// Returns the yaw of furniture with its back to this wall. Side 0 is at the largest z, and
    /// each next side is a quarter turn to the left.
    fn yaw_rad(self) -> f32 {
        [0.0, FRAC_PI_2, PI, -FRAC_PI_2][usize::from(self.0 % 4)]
    }

    /// Returns the opposite wall.
    pub fn opposite(self) -> Side {
        Side((self.0 + 2) % 4)
    }

    /// Returns the center of the wall, its length, and the direction of the group's x axis along
    /// it.
    fn line(self, inner: &Rect) -> (Vec2, f32, Vec2) {
        let (c, s) = (inner.center(), inner.size());
        match self.0 % 4 {
            0 => (Vec2::new(c.x, inner.max.y), s.x, Vec2::X),
            1 => (Vec2::new(inner.max.x, c.y), s.y, Vec2::NEG_Y),
            2 => (Vec2::new(c.x, inner.min.y), s.x, Vec2::NEG_X),
            _ => (Vec2::new(inner.min.x, c.y), s.y, Vec2::Y),
        }
    }
}

/// A room and its furniture.
#[derive(Clone, Debug)]
pub(super) struct RoomPlan {
    pub inner: Rect,
    pub things: Vec<ObjectSpec>,
    footprints: Vec<Rect>,
    access: Vec<Rect>,
    rugs: Vec<Rect>,
    door_zones: Vec<Rect>,
    door_points: Vec<Vec2>,
}

impl RoomPlan {
    pub fn new(index: usize, rect: Rect, doors: &[Door]) -> RoomPlan {
        let inner = rect.expanded(-0.5 * WALL_M);
        let (mut door_zones, mut door_points) = (Vec::new(), Vec::new());
        for door in doors.iter().filter(|d| d.rooms.contains(&index)) {
            let inwards = if rect.center()[door.axis] > door.at { 1.0 } else { -1.0 };
            let half = 0.5 * DOOR_M + 0.05;
            let (a, b) = (door.point(0.0, -half), door.point(inwards * DOOR_CLEAR_M, half));
            door_zones.push(Rect { min: a.min(b), max: a.max(b) });
            door_points.push(door.point(inwards * 0.55, 0.0));
        }
        let (things, footprints, access, rugs) = Default::default();
        RoomPlan { inner, things, footprints, access, rugs, door_zones, door_points }
    }

    /// Places a group at the first valid position; returns its wall and the offset from the wall's
    /// center.
    pub fn place(
        &mut self,
        rng: &mut RngStream,
        group: &[Piece],
        spot: Spot,
    ) -> Option<(Side, f32)> {
        let mut sides = Side::ALL;
        rng.shuffle(&mut sides);
        if spot == Spot::Free {
            return (0..ATTEMPTS_FREE).find_map(|k| {
                let side = sides[k % 2];
                // The center first, then positions with an increasing distance.
                let spread = k as f32 / ATTEMPTS_FREE as f32;
                let off = self.inner.size()
                    * Vec2::new(rng.range(-0.35, 0.35), rng.range(-0.35, 0.35))
                    * spread;
                let at = self.inner.center() + off;
                self.try_at(group, at, side.yaw_rad()).then_some((side, 0.0))
            });
        }
        let (low, high) = x_range(group);
        for side in sides {
            let (_, length_m, _) = side.line(&self.inner);
            let slack = length_m - (high - low);
            if slack < 2.0 * WALL_GAP_M {
                continue;
            }
            let (first, last) =
                (-0.5 * length_m - low + WALL_GAP_M, 0.5 * length_m - high - WALL_GAP_M);
            for k in 0..ATTEMPTS_PER_WALL {
                let ends = if rng.chance(0.5) { [first, last] } else { [last, first] };
                let along = match spot {
                    Spot::Corner if k < 2 => ends[k],
                    Spot::Corner => break,
                    _ if k < 2 && rng.chance(0.4) => ends[k],
                    _ => rng.range(first, last),
                };
                if self.place_at(group, side, along) {
                    return Some((side, along));
                }
            }
        }
        None
    }

    /// Places a group at a wall with the given offset from the wall's center, if that is valid.
    pub fn place_at(&mut self, group: &[Piece], side: Side, along_m: f32) -> bool {
        let (middle, length_m, along) = side.line(&self.inner);
        let (low, high) = x_range(group);
        if low + along_m < -0.5 * length_m || high + along_m > 0.5 * length_m {
            return false;
        }
        let inwards = rotate_yaw(Vec3::NEG_Z, side.yaw_rad());
        let at = middle + along * along_m + WALL_GAP_M * Vec2::new(inwards.x, inwards.z);
        self.try_at(group, at, side.yaw_rad())
    }

    fn try_at(&mut self, group: &[Piece], at: Vec2, yaw_rad: f32) -> bool {
        let before = (self.things.len(), self.footprints.len(), self.access.len(), self.rugs.len());
        let (mut things, mut footprints, mut access, mut rugs) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for piece in group {
            let object = piece.to_object(at, yaw_rad);
            let footprint = footprint(&object);
            if object.size_m().y < 0.05 {
                if !contains(&self.inner, &footprint)
                    || self.rugs.iter().any(|r| r.overlaps(&footprint))
                {
                    return false;
                }
                rugs.push(footprint);
            } else {
                if !self.has_room_for(&footprint) {
                    return false;
                }
                footprints.push(footprint);
                if piece.access_m > 0.0 {
                    access.push(front_zone(&object, piece.access_m));
                }
            }
            things.push(object);
        }
        // Pieces of one group may block each other: a chair at its table does.
        let blocked = |zone: &Rect| {
            !contains(&self.inner.expanded(0.01), zone)
                || self.footprints.iter().any(|f| f.overlaps(zone))
        };
        if access.iter().any(blocked) {
            return false;
        }
        self.things.extend(things);
        self.footprints.extend(footprints);
        self.access.extend(access);
        self.rugs.extend(rugs);
        if self.is_walkable() {
            return true;
        }
        self.things.truncate(before.0);
        self.footprints.truncate(before.1);
        self.access.truncate(before.2);
        self.rugs.truncate(before.3);
        false
    }

    /// Returns the number of pieces of a class.
    pub fn count(&self, class: &str) -> usize {
        self.things.iter().filter(|t| t.class.name() == class).count()
    }

    /// Returns the fraction of the floor under furniture.
    pub fn furnished_fraction(&self) -> f32 {
        let area = |r: &Rect| r.size().x * r.size().y;
        self.footprints.iter().map(area).sum::<f32>() / area(&self.inner)
    }

    fn has_room_for(&self, footprint: &Rect) -> bool {
        let apart = footprint.expanded(GAP_M);
        contains(&self.inner, footprint)
            && !self.footprints.iter().any(|f| f.overlaps(&apart))
            && !self.access.iter().any(|f| f.overlaps(footprint))
            && !self.door_zones.iter().any(|f| f.overlaps(footprint))
    }

    /// Returns whether a wide body gets from every doorway to all furniture, and enough standing
    /// area remains.
    fn is_walkable(&self) -> bool {
        let mut grid = FreeSpace::around(self.inner, BODY_M, []);
        let empty = grid.free.iter().filter(|f| **f).count();
        self.footprints.iter().for_each(|f| grid.block_rect(f, BODY_M));
        let Some(start) = self.door_points.first() else { return false };
        let reached = grid.flood(*start);
        let left = reached.iter().filter(|s| **s).count();
        let stands = |p: &Vec2| grid.cell(*p).is_some_and(|i| reached[i]);
        let near = |f: &Rect| {
            grid.cells_in(f.expanded(ACCESS_M)).any(|i| {
                reached[i] && crate::upright_box::rect_distance(f, grid.middle(i)) <= ACCESS_M
            })
        };
        left as f32 >= MIN_FREE_FRACTION * empty as f32
            && self.door_points.iter().all(stands)
            && self.footprints.iter().all(near)
    }
}

impl Piece {
    fn to_object(self, at: Vec2, yaw_rad: f32) -> ObjectSpec {
        let offset = rotate_yaw(Vec3::new(self.x, 0.0, -self.d), yaw_rad);
        let yaw_rad = chaic_core::geom::wrap_angle(yaw_rad + f32::from(self.turns) * FRAC_PI_2);
        let position = mm3(Vec3::new(at.x, 0.0, at.y) + offset);
        let mut object = ObjectSpec::new(self.class, position, mm(yaw_rad));
        object.variant = self.variant;
        object.fixed = true;
        object
    }

    /// Returns half of the extent along the group's x, meters.
    fn half_width_m(&self) -> f32 {
        let size = self.class.info().size_m;
        0.5 * if self.turns.is_multiple_of(2) { size[0] } else { size[2] }
    }
}

/// Returns the minimum and maximum x of a group along its wall.
fn x_range(group: &[Piece]) -> (f32, f32) {
    let solid = group.iter().filter(|p| p.class.info().size_m[1] >= 0.05);
    solid.fold((f32::MAX, f32::MIN), |(low, high), p| {
        (low.min(p.x - p.half_width_m()), high.max(p.x + p.half_width_m()))
    })
}

fn contains(outer: &Rect, inner: &Rect) -> bool {
    outer.contains(inner.min) && outer.contains(inner.max)
}

/// Returns the footprint of an object at a quarter turn: its whole bounding box, not only the
/// colliding parts.
pub(super) fn footprint(object: &ObjectSpec) -> Rect {
    let size = object.size_m();
    let along_x = rotate_yaw(Vec3::X, object.yaw_rad).x.abs() > 0.5;
    let half = 0.5 * if along_x { Vec2::new(size.x, size.z) } else { Vec2::new(size.z, size.x) };
    let middle = Vec2::new(object.position.x, object.position.z);
    Rect { min: middle - half, max: middle + half }
}

/// Returns the strip in front of an object.
fn front_zone(object: &ObjectSpec, depth_m: f32) -> Rect {
    let half = 0.5 * object.size_m();
    let corner = |x: f32, z: f32| {
        let p = object.position + rotate_yaw(Vec3::new(x, 0.0, z), object.yaw_rad);
        Vec2::new(p.x, p.z)
    };
    let inset = 0.05;
    let a = corner(-half.x + inset, -half.z - 0.005);
    let b = corner(half.x - inset, -half.z - depth_m);
    Rect { min: a.min(b), max: a.max(b) }
}
