//! Whether the task has what it needs, whatever the places.

use chaic_core::Role;
use chaic_core::capability::{Gait, Persona};
use chaic_core::task::SceneKind;
use chaic_core::task::{Arrangement, GoalApproach};
use chaic_world::{Rules, Setup, Thing};

use super::{Demand, Problem, thing_field};

/// Highest top of anything that a hand must reach, metres: the farthest that anybody can.
const HIGHEST_M: f32 = 3.0;
/// Longest episode, frames: nine hours of walking.
const LONGEST: u32 = 1_000_000;

pub(super) fn problems(setup: &Setup, demand: Demand) -> Vec<Problem> {
    let mut found = Vec::new();
    if setup.horizon > LONGEST {
        let problem = format!("is {}, expected at most {LONGEST} frames", setup.horizon);
        found.push(Problem::new("horizon", problem));
    }
    things(setup, &mut found);
    people(setup, &mut found);
    goal(setup, demand, &mut found);
    task_needs(setup, &mut found);
    if demand == Demand::Fair {
        found.extend(height_problem(setup));
    }
    found
}

fn things(setup: &Setup, found: &mut Vec<Problem>) {
    for (i, thing) in setup.things.iter().enumerate() {
        let top_m = thing.position.y + thing.size_m().y;
        let limit_m = match setup.ceiling_m {
            Some(ceiling_m) => ceiling_m.min(HIGHEST_M),
            None if is_handled(thing) => HIGHEST_M,
            None => f32::MAX,
        };
        if top_m > limit_m {
            let problem = format!("has its top at {top_m:.2} m, expected at most {limit_m:.2} m");
            found.push(Problem::new(thing_field(setup, i, "position[1]"), problem));
        }
        if thing.position.y < 0.0 {
            let problem = format!("is {}, expected 0 (the ground) or more", thing.position.y);
            found.push(Problem::new(thing_field(setup, i, "position[1]"), problem));
        }
        if !thing.fixed && !thing.class.info().is_movable() {
            let problem = "is false, but nobody can move things of this class";
            found.push(Problem::new(thing_field(setup, i, "fixed"), problem));
        }
        if thing.class.info().role == Role::Person {
            let problem = "is a person, who belongs into `people`";
            found.push(Problem::new(thing_field(setup, i, "class"), problem));
        }
    }
}

fn people(setup: &Setup, found: &mut Vec<Problem>) {
    let info = setup.task.info();
    let expected = if info.has_child { 3 } else { 2 };
    if setup.people.len() != expected {
        let n = setup.people.len();
        let problem = format!("has {n} entries, the task {} has {expected}", setup.task);
        found.push(Problem::new("people", problem));
        return;
    }
    // Who somebody is follows from the place in the list.
    for (i, person) in setup.people.iter().enumerate() {
        let (fits, expected) = match i {
            0 => (person.persona != Persona::Helper, "the partner"),
            1 => (person.persona == Persona::Helper, "helper"),
            _ => (person.persona == Persona::Child, "child"),
        };
        if !fits {
            let persona = format!("{:?}", person.persona).to_lowercase();
            let problem = format!("is {persona}, expected {expected}");
            found.push(Problem::new(format!("people[{i}].persona"), problem));
        }
    }
}

fn goal(setup: &Setup, demand: Demand, found: &mut Vec<Problem>) {
    let mut n_there = 0;
    for (i, (class, wanted)) in setup.goal.targets.iter().enumerate() {
        if !class.info().is_possible_target() {
            let problem = format!("asks for {class}, which is no possible target");
            found.push(Problem::new(format!("goal.targets[{i}]"), problem));
        }
        let there = setup.things.iter().filter(|t| t.class == *class && !t.fixed).count();
        n_there += there;
        if demand == Demand::Fair && there < *wanted as usize {
            let problem = format!("asks for {wanted} of {class}, but only {there} can be moved");
            found.push(Problem::new(format!("goal.targets[{i}]"), problem));
        }
    }
    if n_there == 0 && found.is_empty() {
        found.push(Problem::new("things", "hold nothing that the goal asks for"));
    }
    let places = setup.goal_places.iter().filter_map(|e| setup.thing_index(*e));
    for (i, k) in places.enumerate() {
        let thing = &setup.things[k];
        let needed_m = Rules::paper().goal_min_top_m(setup.task);
        let top_m = thing.position.y + thing.size_m().y;
        if top_m < needed_m {
            let (class, field) = (thing.class, format!("goal_places[{i}]"));
            let problem = format!("is a {class} of {top_m:.2} m, expected at least {needed_m} m");
            found.push(Problem::new(field, problem));
        }
        if setup.goal_places[..i].contains(&setup.goal_places[i]) {
            let problem = format!("names things[{k}] ({}) again", thing.class);
            found.push(Problem::new(format!("goal_places[{i}]"), problem));
        }
    }
}

fn task_needs(setup: &Setup, found: &mut Vec<Problem>) {
    let scene = setup.task.info().scene;
    if scene == SceneKind::House && (setup.walls.is_empty() || setup.rooms.is_empty()) {
        found.push(Problem::new("walls", "are missing: the task happens in a house"));
    }
    let has = |role: Role| setup.things.iter().any(|t| t.class.info().role == role && !t.fixed);
    let info = setup.task.info();
    match info.arrangement {
        Arrangement::Obstacles if !has(Role::Obstacle) => {
            found.push(Problem::new("things", "hold no obstacle that can be removed"));
        }
        Arrangement::HighContainers if !has(Role::Container) => {
            found.push(Problem::new("things", "hold no container"));
        }
        _ => {}
    }
    if info.goal_approach == GoalApproach::NearestPoint {
        let mut places = setup.goal_places.iter().filter_map(|e| setup.thing(*e));
        if places.any(|t| !info.goal_places.contains(&t.class.name())) {
            let problem = format!("name something else than a {}", info.goal_places.join(" or "));
            found.push(Problem::new("goal_places", problem));
        }
    }
    let riders = setup.people.iter().filter(|p| p.capability().gait == Gait::WalkBike).count();
    let vehicles = setup.things.iter().filter(|t| t.class.info().role == Role::Vehicle).count();
    if riders > vehicles {
        let problem = format!("hold {vehicles} bicycles for {riders} who walk one");
        found.push(Problem::new("things", problem));
    }
}

/// What lies out of the partner's reach where the task is about that.
fn height_problem(setup: &Setup) -> Option<Problem> {
    let [lowest_m, highest_m] = setup.task.info().partner.capability().pick_range_m;
    let top_m = |t: &&Thing| t.position.y + t.size_m().y;
    let wanted = || setup.things.iter().filter(|t| !t.fixed && setup.goal.wanted(t.class) > 0);
    let is_container = |t: &&Thing| t.class.info().role == Role::Container && !t.fixed;
    let n_high = |high: bool| {
        let containers = setup.things.iter().filter(is_container);
        containers.filter(|t| (top_m(t) > highest_m) == high).count()
    };
    let problem = match setup.task.info().arrangement {
        Arrangement::HighTargets if !wanted().any(|t| top_m(&t) > highest_m) => {
            "hold nothing wanted that is high"
        }
        Arrangement::LowTargets if !wanted().any(|t| top_m(&t) < lowest_m) => {
            "hold nothing wanted that is low"
        }
        Arrangement::HighContainers if n_high(true) <= n_high(false) => {
            "hold no more containers high than low"
        }
        _ => return None,
    };
    Some(Problem::new("things", problem))
}

/// Whether a hand must get at it.
pub(super) fn is_handled(thing: &Thing) -> bool {
    !thing.fixed
}
