//! Obstacles in doorways.

use chaic_core::rng::Stream;
use chaic_core::{ClassId, Vec2, Vec3};
use chaic_world::Thing;

use super::House;
use super::layout::DOOR_M;
use crate::upright_box::{UprightBox, mm, mm3, plan_bounds};

/// Free width beside an obstacle, metres: more than the 0.40 of a walker, less than the 0.70 of a
/// wheelchair, with room for a planner's grid of 0.1 m.
const GAP_M: [f32; 2] = [0.56, 0.66];
/// Fewest and most obstacles of an episode (facts S7 for the most; the fewest ours).
const COUNT: [usize; 2] = [3, 5];
/// Choices of doorways that are compared.
const CHOICES: usize = 12;

pub(super) const CLASSES: [&str; 2] = ["trashbin", "bright_fire_extinguisher"];

/// Obstacles in three to five doorways, chosen so that the partner's room and the rooms around it
/// are cut off from much of the house.
pub(super) fn obstacles(
    house: &House,
    partner: Vec2,
    goal: Vec2,
    rng: &mut Stream,
) -> Option<Vec<Thing>> {
    let n_doors = house.openings.len();
    let most = COUNT[1].min(n_doors);
    let n = COUNT[0] + rng.below(most + 1 - COUNT[0]);
    let room = |p: Vec2| house.rooms.iter().position(|r| r.rect.contains(p));
    let (from, to) = (room(partner)?, room(goal)?);
    let mut best: Option<(usize, Vec<usize>)> = None;
    for _ in 0..CHOICES {
        let mut order: Vec<usize> = (0..n_doors).collect();
        rng.shuffle(&mut order);
        // The doorways that join what nothing else joins come first.
        order.sort_by_key(|d| !house.is_spanning[*d]);
        order.truncate(n);
        let reached = reached(house, from, &order);
        // Cut off from the goal is worth two rooms.
        let open = reached.iter().filter(|r| **r).count() + if reached[to] { 2 } else { 0 };
        if best.as_ref().is_none_or(|(least, _)| open < *least) {
            best = Some((open, order));
        }
    }
    let (open, doors) = best?;
    if open > house.rooms.len() / 2 + 2 {
        return None;
    }
    Some(doors.into_iter().map(|d| obstacle(house, d, rng)).collect())
}

/// The rooms that can be reached from one without passing these doorways.
fn reached(house: &House, from: usize, closed: &[usize]) -> Vec<bool> {
    let mut seen = vec![false; house.rooms.len()];
    let mut open = vec![from];
    seen[from] = true;
    while let Some(room) = open.pop() {
        for (d, opening) in house.openings.iter().enumerate() {
            let [a, b] = opening.rooms.map(|r| r as usize);
            let next = if a == room {
                b
            } else if b == room {
                a
            } else {
                continue;
            };
            if !closed.contains(&d) && !seen[next] {
                seen[next] = true;
                open.push(next);
            }
        }
    }
    seen
}

/// An obstacle in a doorway, so far to one side that the gap on the other has the wanted width.
fn obstacle(house: &House, door: usize, rng: &mut Stream) -> Thing {
    let opening = &house.openings[door];
    let along = (opening.b - opening.a) / DOOR_M;
    let class = ClassId::named(CLASSES[rng.below(CLASSES.len())]);
    // The extinguisher stands across, so that its longer side closes the doorway.
    let turns_along_x = along.x.abs() > 0.5;
    let [w, _, d] = class.info().size_m;
    let yaw_rad = if (d > w) == turns_along_x { std::f32::consts::FRAC_PI_2 } else { 0.0 };
    let mut thing = Thing::new(class, Vec3::ZERO, mm(yaw_rad));
    let axis = if turns_along_x { 0 } else { 1 };
    let bounds = plan_bounds(&thing);
    let gap_m = rng.range(GAP_M[0], GAP_M[1]);
    // From jamb `a`, or, seen from the other side, from jamb `b`.
    let middle = 0.5 * (opening.a + opening.b);
    let shift = if rng.chance(0.5) {
        0.5 * DOOR_M - gap_m - bounds.max[axis]
    } else {
        gap_m - 0.5 * DOOR_M - bounds.min[axis]
    };
    let at = middle + along.abs() * shift;
    thing.position = mm3(Vec3::new(at.x, 0.0, at.y));
    debug_assert!(UprightBox::of_thing(&thing).iter().all(|s| s.low_m < 1.0));
    thing
}
