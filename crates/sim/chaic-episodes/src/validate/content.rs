//! Checks that the task has the objects and people it needs, independent of their positions.

use chaic_core::Role;
use chaic_core::capability::{Gait, Persona};
use chaic_core::task::SceneKind;
use chaic_core::task::{Arrangement, GoalApproach};
use chaic_world::{ObjectSpec, Rules, Setup};

use super::{Problem, Strictness, object_field};

/// Maximum height of a top that a hand must reach, meters: the longest reach of any person.
const MAX_TOP_M: f32 = 3.0;
/// Maximum duration of an episode, frames: nine hours of walking.
const MAX_HORIZON: u32 = 1_000_000;

pub(super) fn problems(setup: &Setup, strictness: Strictness) -> Vec<Problem> {
    let mut found = Vec::new();
    if setup.horizon > MAX_HORIZON {
        let problem = format!("is {}, expected at most {MAX_HORIZON} frames", setup.horizon);
        found.push(Problem::new("horizon", problem));
    }
    check_objects(setup, &mut found);
    check_people(setup, &mut found);
    check_goal(setup, strictness, &mut found);
    check_task(setup, &mut found);
    if strictness == Strictness::Generated {
        found.extend(height_problem(setup));
    }
    found
}

fn check_objects(setup: &Setup, found: &mut Vec<Problem>) {
    for (i, object) in setup.things.iter().enumerate() {
        let top_m = object.position.y + object.size_m().y;
        let limit_m = match setup.ceiling_m {
            Some(ceiling_m) => ceiling_m.min(MAX_TOP_M),
            None if is_grasped(object) => MAX_TOP_M,
            None => f32::MAX,
        };
        if top_m > limit_m {
            let problem = format!("has its top at {top_m:.2} m, expected at most {limit_m:.2} m");
            found.push(Problem::new(object_field(setup, i, "position[1]"), problem));
        }
        if object.position.y < 0.0 {
            let problem = format!("is {}, expected 0 (the ground) or more", object.position.y);
            found.push(Problem::new(object_field(setup, i, "position[1]"), problem));
        }
        if !object.fixed && !object.class.info().is_movable() {
            let problem = "is false, but objects of this class cannot be moved";
            found.push(Problem::new(object_field(setup, i, "fixed"), problem));
        }
        if object.class.info().role == Role::Person {
            let problem = "is a person; people are listed in `people`";
            found.push(Problem::new(object_field(setup, i, "class"), problem));
        }
    }
}

fn check_people(setup: &Setup, found: &mut Vec<Problem>) {
    let info = setup.task.info();
    let expected = if info.has_child { 3 } else { 2 };
    if setup.people.len() != expected {
        let n = setup.people.len();
        let problem = format!("has {n} entries, the task {} has {expected}", setup.task);
        found.push(Problem::new("people", problem));
        return;
    }
    // The role of a person follows from its index.
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

fn check_goal(setup: &Setup, strictness: Strictness, found: &mut Vec<Problem>) {
    let mut n_available = 0;
    for (i, (class, required)) in setup.goal.targets.iter().enumerate() {
        if !class.info().is_possible_target() {
            let problem = format!("requires {class}, which cannot be a target");
            found.push(Problem::new(format!("goal.targets[{i}]"), problem));
        }
        let available = setup.things.iter().filter(|t| t.class == *class && !t.fixed).count();
        n_available += available;
        if strictness == Strictness::Generated && available < *required as usize {
            let problem =
                format!("requires {required} of {class}, but only {available} can be moved");
            found.push(Problem::new(format!("goal.targets[{i}]"), problem));
        }
    }
    if n_available == 0 && found.is_empty() {
        found.push(Problem::new("things", "hold no target of the goal"));
    }
    let places = setup.goal_places.iter().filter_map(|e| setup.object_index(*e));
    for (i, k) in places.enumerate() {
        let object = &setup.things[k];
        let min_top_m = Rules::paper().goal_min_top_m(setup.task);
        let top_m = object.position.y + object.size_m().y;
        if top_m < min_top_m {
            let (class, field) = (object.class, format!("goal_places[{i}]"));
            let problem = format!("is a {class} of {top_m:.2} m, expected at least {min_top_m} m");
            found.push(Problem::new(field, problem));
        }
        if setup.goal_places[..i].contains(&setup.goal_places[i]) {
            let problem = format!("repeats things[{k}] ({})", object.class);
            found.push(Problem::new(format!("goal_places[{i}]"), problem));
        }
    }
}

fn check_task(setup: &Setup, found: &mut Vec<Problem>) {
    let scene = setup.task.info().scene;
    if scene == SceneKind::House && (setup.walls.is_empty() || setup.rooms.is_empty()) {
        found.push(Problem::new("walls", "are missing: the task takes place in a house"));
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
        let mut places = setup.goal_places.iter().filter_map(|e| setup.object(*e));
        if places.any(|t| !info.goal_places.contains(&t.class.name())) {
            let problem =
                format!("contain an object that is not a {}", info.goal_places.join(" or "));
            found.push(Problem::new("goal_places", problem));
        }
    }
    let riders = setup.people.iter().filter(|p| p.capability().gait == Gait::WalkBike).count();
    let vehicles = setup.things.iter().filter(|t| t.class.info().role == Role::Vehicle).count();
    if riders > vehicles {
        let bicycles = if vehicles == 1 { "bicycle" } else { "bicycles" };
        let people = if riders == 1 { "person who needs one" } else { "people who need one" };
        let problem = format!("hold {vehicles} {bicycles} for {riders} {people}");
        found.push(Problem::new("things", problem));
    }
}

/// Checks that objects are out of the partner's reach in tasks that are about that.
fn height_problem(setup: &Setup) -> Option<Problem> {
    let [lowest_m, highest_m] = setup.task.info().partner.capability().pick_range_m;
    let top_m = |t: &&ObjectSpec| t.position.y + t.size_m().y;
    let targets = || setup.things.iter().filter(|t| !t.fixed && setup.goal.count(t.class) > 0);
    let is_container = |t: &&ObjectSpec| t.class.info().role == Role::Container && !t.fixed;
    let n_high = |high: bool| {
        let containers = setup.things.iter().filter(is_container);
        containers.filter(|t| (top_m(t) > highest_m) == high).count()
    };
    let problem = match setup.task.info().arrangement {
        Arrangement::HighTargets if !targets().any(|t| top_m(&t) > highest_m) => {
            "hold no target that is high"
        }
        Arrangement::LowTargets if !targets().any(|t| top_m(&t) < lowest_m) => {
            "hold no target that is low"
        }
        Arrangement::HighContainers if n_high(true) <= n_high(false) => {
            "hold fewer high containers than low ones, or as many"
        }
        _ => return None,
    };
    Some(Problem::new("things", problem))
}

/// Returns whether the object must be reachable by a hand.
pub(super) fn is_grasped(object: &ObjectSpec) -> bool {
    !object.fixed
}
