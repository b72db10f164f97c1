//! Obstacles that block nobody: beside walls and in corners.

use std::f32::consts::{FRAC_PI_2, PI};

use chaic_core::rng::Stream;
use chaic_core::{ClassId, Vec2, Vec3};
use chaic_world::{RoomKind, Thing};

use super::House;
use super::doors::CLASSES;
use super::layout::WALL_M;
use super::room::{BODY_M, foot};
use crate::upright_box::{UprightBox, mm, mm3, plan_bounds, rect_distance};

/// From a doorway's middle, metres: half of its width, the widest body and an arm's length.
const DOOR_CLEAR_M: f32 = 1.5;
/// Between an obstacle and the wall behind it, metres.
const WALL_GAP_M: f32 = 0.03;
/// Between an obstacle and furniture, metres.
const GAP_M: f32 = 0.06;
/// How near the outline of furniture stays to where a wide body gets, metres; an arm reaches 0.7.
const UP_TO_M: f32 = 0.6;
/// How often an obstacle stands in a corner.
const IN_CORNER: f32 = 0.4;
/// Places that are tried for one obstacle.
const TRIES: usize = 60;

/// So many obstacles where nobody is in need of going; the house's ground is what they leave.
pub(super) fn obstacles(house: &mut House, n: usize, rng: &mut Stream) -> Option<Vec<Thing>> {
    let mut put: Vec<Thing> = Vec::new();
    for _ in 0..n {
        let thing = (0..TRIES).find_map(|_| {
            let thing = by_a_wall(house, rng)?;
            (has_room(house, &thing, &put) && blocks_nobody(house, &thing)).then_some(thing)
        })?;
        let ground = without(house, &thing);
        (house.ground, house.walkable) = ground;
        put.push(thing);
    }
    Some(put)
}

/// An obstacle with its back to a random wall of a random room.
fn by_a_wall(house: &House, rng: &mut Stream) -> Option<Thing> {
    let room = rng.choose(&house.rooms)?;
    if room.kind == RoomKind::Corridor {
        return None;
    }
    let inner = room.rect.grown(-0.5 * WALL_M - WALL_GAP_M);
    let class = ClassId::named(CLASSES[rng.below(CLASSES.len())]);
    // Its front, at -z, looks into the room.
    let (yaw_rad, axis, at_max) =
        [(PI, 1, false), (0.0, 1, true), (-FRAC_PI_2, 0, false), (FRAC_PI_2, 0, true)]
            [rng.below(4)];
    let mut thing = Thing::new(class, Vec3::ZERO, mm(yaw_rad));
    let bounds = plan_bounds(&thing);
    let mut at = Vec2::ZERO;
    at[axis] = if at_max {
        inner.max[axis] - bounds.max[axis]
    } else {
        inner.min[axis] - bounds.min[axis]
    };
    let along = 1 - axis;
    let (low, high) = (inner.min[along] - bounds.min[along], inner.max[along] - bounds.max[along]);
    at[along] = match rng.chance(IN_CORNER) {
        true if rng.chance(0.5) => low,
        true => high,
        false => rng.range(low, high),
    };
    thing.position = mm3(Vec3::new(at.x, 0.0, at.y));
    Some(thing)
}

fn has_room(house: &House, thing: &Thing, others: &[Thing]) -> bool {
    let apart = plan_bounds(thing).grown(GAP_M);
    let doorways = house.openings.iter().map(|o| 0.5 * (o.a + o.b));
    let rugs_aside = house.furniture.iter().filter(|t| t.class.name() != "rug");
    rugs_aside.chain(others).all(|t| !foot(t).overlaps(&apart))
        && doorways.into_iter().all(|d| rect_distance(&apart, d) >= DOOR_CLEAR_M)
}

/// The ground with one thing more on it.
fn without(house: &House, thing: &Thing) -> (crate::free_space::FreeSpace, Vec<bool>) {
    let mut ground = house.ground.clone();
    UprightBox::of_thing(thing).iter().for_each(|s| ground.block_rect(&s.bounds(), BODY_M));
    let door = 0.5 * (house.openings[0].a + house.openings[0].b);
    let walkable = ground.flood(door);
    (ground, walkable)
}

/// Whether the widest body still gets to everywhere but the thing's own surroundings, and to all
/// furniture.
fn blocks_nobody(house: &House, thing: &Thing) -> bool {
    let (ground, walkable) = without(house, thing);
    let own = plan_bounds(thing).grown(BODY_M + 0.1);
    let cut_off =
        |i: usize| house.walkable[i] && !walkable[i] && !own.contains(house.ground.middle(i));
    let near = |grid: &crate::free_space::FreeSpace, seen: &[bool], t: &Thing| {
        let f = foot(t);
        grid.cells_in(f.grown(UP_TO_M))
            .any(|i| seen[i] && rect_distance(&f, grid.middle(i)) <= UP_TO_M)
    };
    let stays =
        |t: &&Thing| !near(&house.ground, &house.walkable, t) || near(&ground, &walkable, t);
    !(0..walkable.len()).any(cut_off) && house.furniture.iter().all(|t| stays(&t))
}
