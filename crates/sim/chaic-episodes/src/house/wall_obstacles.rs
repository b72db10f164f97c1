//! Obstacles beside walls and in corners, which block no path.

use std::f32::consts::{FRAC_PI_2, PI};

use chaic_core::rng::RngStream;
use chaic_core::{ClassId, Vec2, Vec3};
use chaic_world::{ObjectSpec, RoomKind};

use super::House;
use super::doorway_obstacles::CLASSES;
use super::layout::WALL_M;
use super::room::{BODY_M, footprint};
use crate::upright_box::{UprightBox, mm, mm3, plan_bounds, rect_distance};

/// Clearance from the center of a doorway, meters: half its width, the widest body and an arm's
/// length.
const DOOR_CLEAR_M: f32 = 1.5;
/// Gap between an obstacle and the wall behind it, meters.
const WALL_GAP_M: f32 = 0.03;
/// Gap between an obstacle and furniture, meters.
const GAP_M: f32 = 0.06;
/// Distance up to which a wide body must get to the outline of furniture, meters; an arm reaches
/// 0.7.
const ACCESS_M: f32 = 0.6;
/// Probability that an obstacle stands in a corner.
const CORNER_PROBABILITY: f32 = 0.4;
/// Attempts per obstacle.
const MAX_ATTEMPTS: usize = 60;

/// Places `n` obstacles that block no path, and removes their area from the ground of the house.
pub(super) fn obstacles(
    house: &mut House,
    n: usize,
    rng: &mut RngStream,
) -> Option<Vec<ObjectSpec>> {
    let mut placed: Vec<ObjectSpec> = Vec::new();
    for _ in 0..n {
        let object = (0..MAX_ATTEMPTS).find_map(|_| {
            let object = draw_at_wall(house, rng)?;
            (has_room(house, &object, &placed) && blocks_no_path(house, &object)).then_some(object)
        })?;
        let ground = ground_with_obstacle(house, &object);
        (house.ground, house.walkable) = ground;
        placed.push(object);
    }
    Some(placed)
}

/// Draws an obstacle with its back to a random wall of a random room.
fn draw_at_wall(house: &House, rng: &mut RngStream) -> Option<ObjectSpec> {
    let room = rng.choose(&house.rooms)?;
    if room.kind == RoomKind::Corridor {
        return None;
    }
    let inner = room.rect.expanded(-0.5 * WALL_M - WALL_GAP_M);
    let class = ClassId::named(CLASSES[rng.below(CLASSES.len())]);
    // The front, at -z, faces the room.
    let (yaw_rad, axis, at_max) =
        [(PI, 1, false), (0.0, 1, true), (-FRAC_PI_2, 0, false), (FRAC_PI_2, 0, true)]
            [rng.below(4)];
    let mut object = ObjectSpec::new(class, Vec3::ZERO, mm(yaw_rad));
    let bounds = plan_bounds(&object);
    let mut at = Vec2::ZERO;
    at[axis] = if at_max {
        inner.max[axis] - bounds.max[axis]
    } else {
        inner.min[axis] - bounds.min[axis]
    };
    let along = 1 - axis;
    let (low, high) = (inner.min[along] - bounds.min[along], inner.max[along] - bounds.max[along]);
    at[along] = match rng.chance(CORNER_PROBABILITY) {
        true if rng.chance(0.5) => low,
        true => high,
        false => rng.range(low, high),
    };
    object.position = mm3(Vec3::new(at.x, 0.0, at.y));
    Some(object)
}

fn has_room(house: &House, object: &ObjectSpec, others: &[ObjectSpec]) -> bool {
    let apart = plan_bounds(object).expanded(GAP_M);
    let doorways = house.openings.iter().map(|o| 0.5 * (o.a + o.b));
    let non_rugs = house.furniture.iter().filter(|t| t.class.name() != "rug");
    non_rugs.chain(others).all(|t| !footprint(t).overlaps(&apart))
        && doorways.into_iter().all(|d| rect_distance(&apart, d) >= DOOR_CLEAR_M)
}

/// Returns the free cells and the walkable cells with one more object on the ground.
fn ground_with_obstacle(
    house: &House,
    object: &ObjectSpec,
) -> (crate::free_space::FreeSpace, Vec<bool>) {
    let mut ground = house.ground.clone();
    UprightBox::from_object(object).iter().for_each(|s| ground.block_rect(&s.bounds(), BODY_M));
    let door = 0.5 * (house.openings[0].a + house.openings[0].b);
    let walkable = ground.flood(door);
    (ground, walkable)
}

/// Returns whether the widest body still reaches all furniture, and all cells except those around
/// the object.
fn blocks_no_path(house: &House, object: &ObjectSpec) -> bool {
    let (ground, walkable) = ground_with_obstacle(house, object);
    let blocked = plan_bounds(object).expanded(BODY_M + 0.1);
    let cut_off =
        |i: usize| house.walkable[i] && !walkable[i] && !blocked.contains(house.ground.middle(i));
    let near = |grid: &crate::free_space::FreeSpace, reached: &[bool], t: &ObjectSpec| {
        let f = footprint(t);
        grid.cells_in(f.expanded(ACCESS_M))
            .any(|i| reached[i] && rect_distance(&f, grid.middle(i)) <= ACCESS_M)
    };
    let stays =
        |t: &&ObjectSpec| !near(&house.ground, &house.walkable, t) || near(&ground, &walkable, t);
    !(0..walkable.len()).any(cut_off) && house.furniture.iter().all(|t| stays(&t))
}
