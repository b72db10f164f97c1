//! Checks that objects and people do not intersect, and that objects are supported.

use chaic_core::geom::to_xz;
use chaic_core::{Role, Vec3};
use chaic_world::{Block, ObjectSpec, Rules, Setup, Surface, blocks_of, top_surfaces};

use super::{Problem, Strictness, TOLERANCE_M, object_field};
use crate::upright_box::{UprightBox, plan_bounds};

/// Minimum distance from walls at which people start, meters (paper, "Task Generation").
const START_CLEARANCE_M: f32 = 0.5;

/// Maximum height of an object's bottom above its support, meters, for objects that lean on their
/// neighbors.
const LEANING_M: f32 = 0.3;

pub(super) fn problems(setup: &Setup, strictness: Strictness) -> Vec<Problem> {
    let solids: Vec<Vec<UprightBox>> = setup.things.iter().map(UprightBox::from_object).collect();
    let walls = UprightBox::from_walls(setup);
    let mut found = Vec::new();
    check_overlaps(setup, strictness, &solids, &walls, &mut found);
    check_support(setup, strictness, &mut found);
    check_starts(setup, strictness, &solids, &walls, &mut found);
    found
}

/// Returns the maximum penetration depth between boxes of two lists.
fn max_overlap(a: &[UprightBox], b: &[UprightBox]) -> f32 {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| a.overlap(b)));
    pairs.fold(f32::MIN, f32::max)
}

fn check_overlaps(
    setup: &Setup,
    strictness: Strictness,
    solids: &[Vec<UprightBox>],
    walls: &[UprightBox],
    found: &mut Vec<Problem>,
) {
    let bounds: Vec<_> = setup.things.iter().map(plan_bounds).collect();
    for (i, object) in setup.things.iter().enumerate() {
        if !setup.bounds.expanded(40.0).contains(to_xz(object.position)) {
            let problem = "is more than 40 m outside the bounds";
            found.push(Problem::new(object_field(setup, i, "position"), problem));
        }
        // Fixed furniture of other sources may intersect, which affects the appearance only.
        let may_cut = |object: &ObjectSpec| strictness == Strictness::Playable && object.fixed;
        if !may_cut(object)
            && let Some(w) =
                (0..walls.len()).find(|w| max_overlap(&solids[i], &walls[*w..=*w]) > TOLERANCE_M)
        {
            let depth = max_overlap(&solids[i], &walls[w..=w]);
            let problem = format!("is {depth:.3} m inside walls[{w}]");
            found.push(Problem::new(object_field(setup, i, "position"), problem));
        }
        for j in 0..i {
            let both_may = may_cut(object) && may_cut(&setup.things[j]);
            if both_may || !bounds[i].overlaps(&bounds[j]) {
                continue;
            }
            let depth = max_overlap(&solids[i], &solids[j]);
            if depth > TOLERANCE_M {
                let other = setup.things[j].class;
                let problem = format!("is {depth:.3} m inside things[{j}] ({other})");
                found.push(Problem::new(object_field(setup, i, "position"), problem));
            }
        }
        let is_out =
            object.class.info().is_carriable() && !setup.bounds.contains(to_xz(object.position));
        if is_out && !object.fixed {
            let problem = "is outside the bounds, where no agent can go";
            found.push(Problem::new(object_field(setup, i, "position"), problem));
        }
    }
}

/// Checks that movable objects are supported: a world begins at rest.
fn check_support(setup: &Setup, strictness: Strictness, found: &mut Vec<Problem>) {
    let slack_m = match strictness {
        Strictness::Generated => TOLERANCE_M,
        Strictness::Playable => LEANING_M,
    };
    let tops_of = |object: &ObjectSpec| match strictness {
        Strictness::Generated => top_surfaces(object),
        Strictness::Playable => all_tops(object),
    };
    let tops: Vec<(usize, Surface)> = (setup.things.iter().enumerate())
        .flat_map(|(k, object)| tops_of(object).into_iter().map(move |top| (k, top)))
        .collect();
    for (i, object) in setup.things.iter().enumerate() {
        if object.fixed || object.position.y <= slack_m {
            continue;
        }
        let p = object.position;
        let others = tops.iter().filter(|(k, _)| *k != i);
        let is_supported = others.into_iter().any(|(_, s)| {
            let local = chaic_core::geom::rotate_yaw(p - s.center, -s.yaw_rad);
            (-TOLERANCE_M..=slack_m).contains(&local.y)
                && local.x.abs() <= s.half[0]
                && local.z.abs() <= s.half[1]
        });
        if !is_supported {
            let problem = format!("is {}, where nothing supports it", p.y);
            found.push(Problem::new(object_field(setup, i, "position[1]"), problem));
        }
    }
}

/// Returns the tops of all parts: objects from other sources may lie on arms and backs.
fn all_tops(object: &ObjectSpec) -> Vec<Surface> {
    let top = |b: Block| Surface {
        center: b.center + b.half.y * Vec3::Y,
        half: [b.half.x, b.half.z],
        yaw_rad: b.yaw_rad,
    };
    blocks_of(object).into_iter().map(top).collect()
}

fn check_starts(
    setup: &Setup,
    strictness: Strictness,
    solids: &[Vec<UprightBox>],
    walls: &[UprightBox],
    found: &mut Vec<Problem>,
) {
    let step_over_m = Rules::paper().step_over_m;
    for (i, person) in setup.people.iter().enumerate() {
        let (p, body) = (to_xz(person.pose.position), person.capability());
        let field = format!("people[{i}].pose.position");
        if !setup.bounds.expanded(-body.radius_m).contains(p) {
            found.push(Problem::new(&field, "is outside the bounds"));
        }
        if person.pose.position.y != 0.0 {
            let problem = "is not on the ground, expected a height of 0";
            found.push(Problem::new(&field, problem));
        }
        let stands = [step_over_m, body.height_m];
        let clearance_m = match strictness {
            Strictness::Generated => START_CLEARANCE_M,
            Strictness::Playable => body.radius_m,
        };
        let walls = walls.iter().filter(|w| w.spans(stands));
        let wall_m = walls.map(|w| w.distance(p)).fold(f32::MAX, f32::min);
        if wall_m < clearance_m - TOLERANCE_M {
            let problem =
                format!("is {wall_m:.2} m from a wall, expected at least {clearance_m} m");
            found.push(Problem::new(&field, problem));
        }
        for (k, object) in setup.things.iter().enumerate() {
            if object.class.info().role == Role::Vehicle {
                continue;
            }
            let blocks = solids[k].iter().filter(|s| s.spans(stands));
            let near_m = blocks.map(|s| s.distance(p)).fold(f32::MAX, f32::min);
            if near_m < body.radius_m - 0.001 {
                let problem = format!("stands inside things[{k}] ({})", object.class);
                found.push(Problem::new(&field, problem));
            }
        }
        for (k, other) in setup.people[..i].iter().enumerate() {
            let apart_m = to_xz(other.pose.position).distance(p);
            if apart_m < body.radius_m + other.capability().radius_m {
                let problem = format!("is {apart_m:.2} m from people[{k}], which intersects it");
                found.push(Problem::new(&field, problem));
            }
        }
    }
}
