//! One room while it is being furnished: finds places for groups of furniture and keeps the room
//! walkable.

use std::f32::consts::{FRAC_PI_2, PI};

use chaic_core::geom::{Rect, rotate_yaw};
use chaic_core::rng::Stream;
use chaic_core::{ClassId, Vec2, Vec3};
use chaic_world::Thing;

use super::layout::{DOOR_M, Door, WALL_M};
use crate::free_space::FreeSpace;
use crate::upright_box::{mm, mm3};

/// Room for the widest body and a hand's breadth, metres: a wheelchair has 0.35.
pub(super) const BODY_M: f32 = 0.40;
/// How near the outline of all furniture can be walked up to, metres; less than an arm's reach.
const UP_TO_M: f32 = 0.6;
/// Depth of what is kept clear on both sides of a doorway, metres.
const DOOR_CLEAR_M: f32 = 1.0;
/// Between a piece of furniture and the wall behind it, metres.
const WALL_GAP_M: f32 = 0.02;
/// Between neighboring pieces of different groups, metres.
const GAP_M: f32 = 0.04;
/// Places along one wall that are tried.
const TRIES_PER_WALL: usize = 8;
/// Places in the middle of the room that are tried.
const TRIES_FREE: usize = 16;
/// Least share of a room's standing room that stays.
const LEAST_FREE: f32 = 0.35;

/// A piece of furniture within a group. The group's frame has its back to the wall at z = 0 and
/// looks along -z into the room.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub class: ClassId,
    /// Middle along the wall, metres.
    pub x: f32,
    /// Middle from the wall, metres.
    pub d: f32,
    /// Quarter turns to the left.
    pub turns: u8,
    /// What stays clear before it, metres.
    pub access_m: f32,
    pub variant: u8,
}

/// Where a group may stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spot {
    /// With its back to a wall.
    Wall,
    /// With its back to a wall, as far in a corner as it gets.
    Corner,
    /// Anywhere in the room, the middle first.
    Free,
}

/// A wall of a room: which way one looks who has it at the back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Side(pub u8);

impl Side {
    pub const ALL: [Side; 4] = [Side(0), Side(1), Side(2), Side(3)];

    /// The yaw of furniture with its back to this wall: side 0 is at the largest z, and each next
    /// one a quarter turn to the left of it.
    fn yaw_rad(self) -> f32 {
        [0.0, FRAC_PI_2, PI, -FRAC_PI_2][usize::from(self.0 % 4)]
    }

    /// The wall on the other side of the room.
    pub fn opposite(self) -> Side {
        Side((self.0 + 2) % 4)
    }

    /// Middle of the wall, its length, and the direction along it of a group's own x.
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

/// A room and what stands in it.
#[derive(Clone, Debug)]
pub(super) struct RoomPlan {
    pub inner: Rect,
    pub things: Vec<Thing>,
    feet: Vec<Rect>,
    access: Vec<Rect>,
    rugs: Vec<Rect>,
    door_zones: Vec<Rect>,
    door_points: Vec<Vec2>,
}

impl RoomPlan {
    pub fn new(index: usize, rect: Rect, doors: &[Door]) -> RoomPlan {
        let inner = rect.grown(-0.5 * WALL_M);
        let (mut door_zones, mut door_points) = (Vec::new(), Vec::new());
        for door in doors.iter().filter(|d| d.rooms.contains(&index)) {
            let inwards = if rect.center()[door.axis] > door.at { 1.0 } else { -1.0 };
            let half = 0.5 * DOOR_M + 0.05;
            let (a, b) = (door.point(0.0, -half), door.point(inwards * DOOR_CLEAR_M, half));
            door_zones.push(Rect { min: a.min(b), max: a.max(b) });
            door_points.push(door.point(inwards * 0.55, 0.0));
        }
        let (things, feet, access, rugs) = Default::default();
        RoomPlan { inner, things, feet, access, rugs, door_zones, door_points }
    }

    /// Puts a group at the first place of many that suits; returns by which wall and how far along
    /// it from the wall's middle.
    pub fn place(&mut self, rng: &mut Stream, group: &[Piece], spot: Spot) -> Option<(Side, f32)> {
        let mut sides = Side::ALL;
        rng.shuffle(&mut sides);
        if spot == Spot::Free {
            return (0..TRIES_FREE).find_map(|k| {
                let side = sides[k % 2];
                // The middle first, then farther and farther out.
                let spread = k as f32 / TRIES_FREE as f32;
                let off = self.inner.size()
                    * Vec2::new(rng.range(-0.35, 0.35), rng.range(-0.35, 0.35))
                    * spread;
                let at = self.inner.center() + off;
                self.try_at(group, at, side.yaw_rad()).then_some((side, 0.0))
            });
        }
        let (low, high) = extent(group);
        for side in sides {
            let (_, length_m, _) = side.line(&self.inner);
            let slack = length_m - (high - low);
            if slack < 2.0 * WALL_GAP_M {
                continue;
            }
            let (first, last) =
                (-0.5 * length_m - low + WALL_GAP_M, 0.5 * length_m - high - WALL_GAP_M);
            for k in 0..TRIES_PER_WALL {
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

    /// Puts a group by a wall, so far along from the wall's middle, if that suits.
    pub fn place_at(&mut self, group: &[Piece], side: Side, along_m: f32) -> bool {
        let (middle, length_m, along) = side.line(&self.inner);
        let (low, high) = extent(group);
        if low + along_m < -0.5 * length_m || high + along_m > 0.5 * length_m {
            return false;
        }
        let inwards = rotate_yaw(Vec3::NEG_Z, side.yaw_rad());
        let at = middle + along * along_m + WALL_GAP_M * Vec2::new(inwards.x, inwards.z);
        self.try_at(group, at, side.yaw_rad())
    }

    fn try_at(&mut self, group: &[Piece], at: Vec2, yaw_rad: f32) -> bool {
        let before = (self.things.len(), self.feet.len(), self.access.len(), self.rugs.len());
        let (mut things, mut feet, mut access, mut rugs) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for piece in group {
            let thing = piece.thing(at, yaw_rad);
            let foot = foot(&thing);
            if thing.size_m().y < 0.05 {
                if !contains(&self.inner, &foot) || self.rugs.iter().any(|r| r.overlaps(&foot)) {
                    return false;
                }
                rugs.push(foot);
            } else {
                if !self.has_room_for(&foot) {
                    return false;
                }
                feet.push(foot);
                if piece.access_m > 0.0 {
                    access.push(before_it(&thing, piece.access_m));
                }
            }
            things.push(thing);
        }
        // Within a group pieces may stand in each other's way: a chair at its table does.
        let blocked = |zone: &Rect| {
            !contains(&self.inner.grown(0.01), zone) || self.feet.iter().any(|f| f.overlaps(zone))
        };
        if access.iter().any(blocked) {
            return false;
        }
        self.things.extend(things);
        self.feet.extend(feet);
        self.access.extend(access);
        self.rugs.extend(rugs);
        if self.is_walkable() {
            return true;
        }
        self.things.truncate(before.0);
        self.feet.truncate(before.1);
        self.access.truncate(before.2);
        self.rugs.truncate(before.3);
        false
    }

    /// How many pieces of a class it has.
    pub fn count(&self, class: &str) -> usize {
        self.things.iter().filter(|t| t.class.name() == class).count()
    }

    /// How much of the floor is under furniture.
    pub fn furnished_share(&self) -> f32 {
        let area = |r: &Rect| r.size().x * r.size().y;
        self.feet.iter().map(area).sum::<f32>() / area(&self.inner)
    }

    fn has_room_for(&self, foot: &Rect) -> bool {
        let apart = foot.grown(GAP_M);
        contains(&self.inner, foot)
            && !self.feet.iter().any(|f| f.overlaps(&apart))
            && !self.access.iter().any(|f| f.overlaps(foot))
            && !self.door_zones.iter().any(|f| f.overlaps(foot))
    }

    /// Whether a wide body gets from every doorway to all furniture and has room left.
    fn is_walkable(&self) -> bool {
        let mut grid = FreeSpace::around(self.inner, BODY_M, []);
        let empty = grid.free.iter().filter(|f| **f).count();
        self.feet.iter().for_each(|f| grid.block_rect(f, BODY_M));
        let Some(start) = self.door_points.first() else { return false };
        let seen = grid.flood(*start);
        let left = seen.iter().filter(|s| **s).count();
        let stands = |p: &Vec2| grid.cell(*p).is_some_and(|i| seen[i]);
        let near = |f: &Rect| {
            grid.cells_in(f.grown(UP_TO_M))
                .any(|i| seen[i] && crate::upright_box::rect_distance(f, grid.middle(i)) <= UP_TO_M)
        };
        left as f32 >= LEAST_FREE * empty as f32
            && self.door_points.iter().all(stands)
            && self.feet.iter().all(near)
    }
}

impl Piece {
    fn thing(&self, at: Vec2, yaw_rad: f32) -> Thing {
        let offset = rotate_yaw(Vec3::new(self.x, 0.0, -self.d), yaw_rad);
        let yaw_rad = chaic_core::geom::wrap_angle(yaw_rad + f32::from(self.turns) * FRAC_PI_2);
        let position = mm3(Vec3::new(at.x, 0.0, at.y) + offset);
        let mut thing = Thing::new(self.class, position, mm(yaw_rad));
        thing.variant = self.variant;
        thing.fixed = true;
        thing
    }

    /// Half of what it takes along the group's x, metres.
    fn half_width_m(&self) -> f32 {
        let size = self.class.info().size_m;
        0.5 * if self.turns.is_multiple_of(2) { size[0] } else { size[2] }
    }
}

/// From where to where a group reaches along its wall.
fn extent(group: &[Piece]) -> (f32, f32) {
    let solid = group.iter().filter(|p| p.class.info().size_m[1] >= 0.05);
    solid.fold((f32::MAX, f32::MIN), |(low, high), p| {
        (low.min(p.x - p.half_width_m()), high.max(p.x + p.half_width_m()))
    })
}

fn contains(outer: &Rect, inner: &Rect) -> bool {
    outer.contains(inner.min) && outer.contains(inner.max)
}

/// What a thing at a quarter turn covers in plan: the whole of its box, not just what collides.
pub(super) fn foot(thing: &Thing) -> Rect {
    let size = thing.size_m();
    let along_x = rotate_yaw(Vec3::X, thing.yaw_rad).x.abs() > 0.5;
    let half = 0.5 * if along_x { Vec2::new(size.x, size.z) } else { Vec2::new(size.z, size.x) };
    let middle = Vec2::new(thing.position.x, thing.position.z);
    Rect { min: middle - half, max: middle + half }
}

/// The strip before a thing's front.
fn before_it(thing: &Thing, depth_m: f32) -> Rect {
    let half = 0.5 * thing.size_m();
    let corner = |x: f32, z: f32| {
        let p = thing.position + rotate_yaw(Vec3::new(x, 0.0, z), thing.yaw_rad);
        Vec2::new(p.x, p.z)
    };
    let inset = 0.05;
    let a = corner(-half.x + inset, -half.z - 0.005);
    let b = corner(half.x - inset, -half.z - depth_m);
    Rect { min: a.min(b), max: a.max(b) }
}
