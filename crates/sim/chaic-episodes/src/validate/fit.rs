//! Whether things and people have the room that they take up.

use chaic_core::geom::xz;
use chaic_core::{Role, Vec3};
use chaic_world::{Block, Rules, Setup, Surface, Thing, blocks_of, top_surfaces};

use super::{Demand, Problem, TOLERANCE_M, thing_field};
use crate::upright_box::{UprightBox, plan_bounds};

/// How far from walls people start indoors, metres (paper, "Task Generation").
const START_CLEARANCE_M: f32 = 0.5;

/// What leans or lies on its neighbors has its bottom this far above what bears it at most, metres.
const LEANING_M: f32 = 0.3;

pub(super) fn problems(setup: &Setup, demand: Demand) -> Vec<Problem> {
    let solids: Vec<Vec<UprightBox>> = setup.things.iter().map(UprightBox::of_thing).collect();
    let walls = UprightBox::of_walls(setup);
    let mut found = Vec::new();
    overlaps(setup, demand, &solids, &walls, &mut found);
    support(setup, demand, &mut found);
    starts(setup, demand, &solids, &walls, &mut found);
    found
}

/// The deepest that any box of one list sits in any of another.
fn deepest(a: &[UprightBox], b: &[UprightBox]) -> f32 {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| a.overlap(b)));
    pairs.fold(f32::MIN, f32::max)
}

fn overlaps(
    setup: &Setup,
    demand: Demand,
    solids: &[Vec<UprightBox>],
    walls: &[UprightBox],
    found: &mut Vec<Problem>,
) {
    let bounds: Vec<_> = setup.things.iter().map(plan_bounds).collect();
    for (i, thing) in setup.things.iter().enumerate() {
        if !setup.bounds.grown(40.0).contains(xz(thing.position)) {
            let problem = "is more than 40 m outside the bounds";
            found.push(Problem::new(thing_field(setup, i, "position"), problem));
        }
        // What nobody moves only has to look right where it cuts into something.
        let may_cut = |thing: &Thing| demand == Demand::Playable && thing.fixed;
        if !may_cut(thing)
            && let Some(w) =
                (0..walls.len()).find(|w| deepest(&solids[i], &walls[*w..=*w]) > TOLERANCE_M)
        {
            let depth = deepest(&solids[i], &walls[w..=w]);
            let problem = format!("is {depth:.3} m inside walls[{w}]");
            found.push(Problem::new(thing_field(setup, i, "position"), problem));
        }
        for j in 0..i {
            let both_may = may_cut(thing) && may_cut(&setup.things[j]);
            if both_may || !bounds[i].overlaps(&bounds[j]) {
                continue;
            }
            let depth = deepest(&solids[i], &solids[j]);
            if depth > TOLERANCE_M {
                let other = setup.things[j].class;
                let problem = format!("is {depth:.3} m inside things[{j}] ({other})");
                found.push(Problem::new(thing_field(setup, i, "position"), problem));
            }
        }
        let is_out =
            thing.class.info().is_carriable() && !setup.bounds.contains(xz(thing.position));
        if is_out && !thing.fixed {
            let problem = "is outside the bounds, where nobody gets";
            found.push(Problem::new(thing_field(setup, i, "position"), problem));
        }
    }
}

/// Whatever can be taken must lie on something: a world begins at rest.
fn support(setup: &Setup, demand: Demand, found: &mut Vec<Problem>) {
    let slack_m = match demand {
        Demand::Fair => TOLERANCE_M,
        Demand::Playable => LEANING_M,
    };
    let tops_of = |thing: &Thing| match demand {
        Demand::Fair => top_surfaces(thing),
        Demand::Playable => all_tops(thing),
    };
    let tops: Vec<(usize, Surface)> = (setup.things.iter().enumerate())
        .flat_map(|(k, thing)| tops_of(thing).into_iter().map(move |top| (k, top)))
        .collect();
    for (i, thing) in setup.things.iter().enumerate() {
        if thing.fixed || thing.position.y <= slack_m {
            continue;
        }
        let p = thing.position;
        let others = tops.iter().filter(|(k, _)| *k != i);
        let bears = others.into_iter().any(|(_, s)| {
            let local = chaic_core::geom::rotate_yaw(p - s.center, -s.yaw_rad);
            (-TOLERANCE_M..=slack_m).contains(&local.y)
                && local.x.abs() <= s.half[0]
                && local.z.abs() <= s.half[1]
        });
        if !bears {
            let problem = format!("is {}, where nothing holds it up", p.y);
            found.push(Problem::new(thing_field(setup, i, "position[1]"), problem));
        }
    }
}

/// The tops of all its parts: things from elsewhere may lie on arms and backs.
fn all_tops(thing: &Thing) -> Vec<Surface> {
    let top = |b: Block| Surface {
        center: b.center + b.half.y * Vec3::Y,
        half: [b.half.x, b.half.z],
        yaw_rad: b.yaw_rad,
    };
    blocks_of(thing).into_iter().map(top).collect()
}

fn starts(
    setup: &Setup,
    demand: Demand,
    solids: &[Vec<UprightBox>],
    walls: &[UprightBox],
    found: &mut Vec<Problem>,
) {
    let step_over_m = Rules::paper().step_over_m;
    for (i, person) in setup.people.iter().enumerate() {
        let (p, body) = (xz(person.pose.position), person.capability());
        let field = format!("people[{i}].pose.position");
        if !setup.bounds.grown(-body.radius_m).contains(p) {
            found.push(Problem::new(&field, "is outside the bounds"));
        }
        if person.pose.position.y != 0.0 {
            let problem = "doesn't stand on the ground, expected a height of 0";
            found.push(Problem::new(&field, problem));
        }
        let stands = [step_over_m, body.height_m];
        let clearance_m = match demand {
            Demand::Fair => START_CLEARANCE_M,
            Demand::Playable => body.radius_m,
        };
        let walls = walls.iter().filter(|w| w.spans(stands));
        let wall_m = walls.map(|w| w.distance(p)).fold(f32::MAX, f32::min);
        if setup.ceiling_m.is_some() && wall_m < clearance_m - TOLERANCE_M {
            let problem =
                format!("is {wall_m:.2} m from a wall, expected at least {clearance_m} m");
            found.push(Problem::new(&field, problem));
        }
        for (k, thing) in setup.things.iter().enumerate() {
            if thing.class.info().role == Role::Vehicle {
                continue;
            }
            let blocks = solids[k].iter().filter(|s| s.spans(stands));
            let near_m = blocks.map(|s| s.distance(p)).fold(f32::MAX, f32::min);
            if near_m < body.radius_m - 0.001 {
                let problem = format!("stands inside things[{k}] ({})", thing.class);
                found.push(Problem::new(&field, problem));
            }
        }
        for (k, other) in setup.people[..i].iter().enumerate() {
            let apart_m = xz(other.pose.position).distance(p);
            if apart_m < body.radius_m + other.capability().radius_m {
                let problem = format!("is {apart_m:.2} m from people[{k}], which is inside it");
                found.push(Problem::new(&field, problem));
            }
        }
    }
}
