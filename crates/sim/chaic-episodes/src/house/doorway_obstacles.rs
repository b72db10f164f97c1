//! Obstacles in doorways.

use chaic_core::rng::RngStream;
use chaic_core::{ClassId, Vec2, Vec3};
use chaic_world::ObjectSpec;

use super::House;
use super::layout::DOOR_M;
use crate::upright_box::{UprightBox, mm, mm3, plan_bounds};

/// Free width beside an obstacle, meters. A walker needs 0.40 and a wheelchair 0.70. The margin is
/// for a planning grid of 0.1 m.
const GAP_M: [f32; 2] = [0.56, 0.66];
/// Minimum and maximum number of obstacles of an episode (facts S7 for the maximum; the minimum is
/// ours).
const COUNT: [usize; 2] = [3, 5];
/// Number of random sets of doorways that are compared.
const CHOICES: usize = 12;

pub(super) const CLASSES: [&str; 2] = ["trashbin", "bright_fire_extinguisher"];

/// Places obstacles in three to five doorways, chosen so that the partner's room and its neighbors
/// are cut off from much of the house.
pub(super) fn obstacles(
    house: &House,
    partner: Vec2,
    goal: Vec2,
    rng: &mut RngStream,
) -> Option<Vec<ObjectSpec>> {
    let n_doors = house.openings.len();
    let max = COUNT[1].min(n_doors);
    let n = COUNT[0] + rng.below(max + 1 - COUNT[0]);
    let room = |p: Vec2| house.rooms.iter().position(|r| r.rect.contains(p));
    let (from, to) = (room(partner)?, room(goal)?);
    let mut best: Option<(usize, Vec<usize>)> = None;
    for _ in 0..CHOICES {
        let mut order: Vec<usize> = (0..n_doors).collect();
        rng.shuffle(&mut order);
        // Doorways of the spanning tree come first.
        order.sort_by_key(|d| !house.is_spanning[*d]);
        order.truncate(n);
        let reached = reachable_rooms(house, from, &order);
        // A reachable goal counts as two rooms.
        let open = reached.iter().filter(|r| **r).count() + if reached[to] { 2 } else { 0 };
        if best.as_ref().is_none_or(|(fewest, _)| open < *fewest) {
            best = Some((open, order));
        }
    }
    let (open, doors) = best?;
    if open > house.rooms.len() / 2 + 2 {
        return None;
    }
    Some(doors.into_iter().map(|d| obstacle(house, d, rng)).collect())
}

/// Returns the rooms that are reachable from `from` without these doorways.
fn reachable_rooms(house: &House, from: usize, closed: &[usize]) -> Vec<bool> {
    let mut reached = vec![false; house.rooms.len()];
    let mut open = vec![from];
    reached[from] = true;
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
            if !closed.contains(&d) && !reached[next] {
                reached[next] = true;
                open.push(next);
            }
        }
    }
    reached
}

/// Places an obstacle in a doorway, offset to one side so that the gap on the other has the
/// required width.
fn obstacle(house: &House, door: usize, rng: &mut RngStream) -> ObjectSpec {
    let opening = &house.openings[door];
    let along = (opening.b - opening.a) / DOOR_M;
    let class = ClassId::named(CLASSES[rng.below(CLASSES.len())]);
    // The extinguisher stands across, so that its longer side closes the doorway.
    let turns_along_x = along.x.abs() > 0.5;
    let [w, _, d] = class.info().size_m;
    let yaw_rad = if (d > w) == turns_along_x { std::f32::consts::FRAC_PI_2 } else { 0.0 };
    let mut object = ObjectSpec::new(class, Vec3::ZERO, mm(yaw_rad));
    let axis = if turns_along_x { 0 } else { 1 };
    let bounds = plan_bounds(&object);
    let gap_m = rng.range(GAP_M[0], GAP_M[1]);
    // Gap at jamb `a`, or mirrored, at jamb `b`.
    let middle = 0.5 * (opening.a + opening.b);
    let shift = if rng.chance(0.5) {
        0.5 * DOOR_M - gap_m - bounds.max[axis]
    } else {
        gap_m - 0.5 * DOOR_M - bounds.min[axis]
    };
    let at = middle + along.abs() * shift;
    object.position = mm3(Vec3::new(at.x, 0.0, at.y));
    debug_assert!(UprightBox::from_object(&object).iter().all(|s| s.low_m < 1.0));
    object
}
