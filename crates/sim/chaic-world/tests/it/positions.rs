//! Promise: carried, stored, removed and fallen objects are where the rules put them.

use crate::common::*;
use chaic_core::action::{Action, FailureReason, Hand, Outcome};
use chaic_core::capability::Persona;
use chaic_core::geom::{Pose, forward};
use chaic_core::{EntityId, ResolvedAction, Vec2, Vec3};
use chaic_world::{ObjectLocation, Opening, Room, RoomKind, Snapshot, World, top_surfaces};

fn pick(object: EntityId) -> ResolvedAction {
    Action::PickUp { object, hand: Hand::Right }
}

fn position(w: &World, object: EntityId) -> Vec3 {
    let index = w.setup().thing_index(object).expect("it exists");
    w.state().objects[index].position
}

fn size(w: &World, object: EntityId) -> Vec3 {
    w.setup().thing(object).expect("it exists").size_m()
}

/// Distance in plan, meters.
fn in_plan(a: Vec3, b: Vec3) -> f32 {
    Vec2::new(a.x - b.x, a.z - b.z).length()
}

#[test]
fn furniture_is_carried_in_front_of_one_person_or_between_two() {
    let turned = |persona, x, z| {
        let mut someone = person(persona, x, z);
        someone.pose = Pose { yaw_rad: 0.7, ..someone.pose };
        someone
    };
    let mut w = world(hall(
        vec![thing("backpack", at(-0.6, 0.0, -0.6))],
        vec![turned(Persona::Adult, 0.0, 0.0)],
    ));
    assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
    let pose = w.state().agents[0].pose;
    let expected =
        pose.position + forward(pose.yaw_rad) * (0.3 + 0.5 * size(&w, nth(0)).z) + Vec3::Y * 0.45;
    assert!(position(&w, nth(0)).distance(expected) < 1e-4, "{expected}");

    let people = vec![person(Persona::Frail, 0.0, 1.15), person(Persona::Helper, 3.0, 0.0)];
    let mut setup = hall(vec![thing("piano", at(0.0, 0.0, 0.0))], people);
    setup.seed = 3;
    let mut w = world(setup);
    for agent in [A, B] {
        w.submit(agent, pick(nth(0))).unwrap();
    }
    w.advance();
    let [leader, follower] = [0, 1].map(|k| w.state().agents[k].pose.position);
    let expected = 0.5 * (leader + follower) + Vec3::Y * 0.45;
    assert!(position(&w, nth(0)).distance(expected) < 1e-3, "{expected}");
}

#[test]
fn the_slots_of_a_container_form_a_triangle_above_its_bottom() {
    let mut things = vec![thing("wood_basket", at(0.0, 0.0, -0.6))];
    things.extend((0..3).map(|i| thing("orange", at(0.5 + 0.2 * i as f32, 0.0, -0.3))));
    let mut w = world(hall(things, vec![person(Persona::Adult, 0.3, 0.3)]));
    let left = Action::PickUp { object: nth(0), hand: Hand::Left };
    assert_eq!(run(&mut w, A, left).0, Outcome::Success);
    for i in 1..4 {
        assert_eq!(run(&mut w, A, pick(nth(i))).0, Outcome::Success);
        assert_eq!(run(&mut w, A, Action::PutIn).0, Outcome::Success);
    }
    let (basket, basket_size) = (&w.state().objects[1], size(&w, nth(0)));
    for i in 1..4 {
        let angle = std::f32::consts::TAU * (i - 1) as f32 / 3.0;
        let local = (0.12 * Vec3::Y + 0.22 * forward(angle)) * basket_size;
        let expected = basket.position + basket.rotation * local;
        assert!(position(&w, nth(i)).distance(expected) < 1e-4, "orange {i}: {expected}");
    }
}

#[test]
fn objects_are_put_on_the_highest_top_beside_each_other() {
    let bed = EntityId::FIRST_OBJECT;
    let things = vec![thing("apple", at(-6.2, 0.0, -7.0)), thing("orange", at(-6.2, 0.0, -7.4))];
    let mut setup = hall(things, vec![person(Persona::Adult, -6.4, -7.2)]);
    setup.goal.targets[0].1 = 2;
    let mut w = world(setup);
    for object in [nth(0), nth(1)] {
        assert_eq!(run(&mut w, A, pick(object)).0, Outcome::Success);
        let put = Action::PutOn { place: bed, hand: Hand::Right };
        assert_eq!(run(&mut w, A, put).0, Outcome::Success);
        run(&mut w, A, Action::Wait { frames: 60 });
    }
    let spec = w.setup().thing(bed).expect("the bed");
    let highest = top_surfaces(spec).into_iter().max_by(|a, b| a.center.y.total_cmp(&b.center.y));
    let highest = highest.expect("a bed has a top");
    for object in [nth(0), nth(1)] {
        let offset = position(&w, object) - highest.center;
        let [half_x, half_z] = highest.half;
        assert!(offset.y.abs() < 0.02 && offset.x.abs() < half_x && offset.z.abs() < half_z);
    }
    let apart = in_plan(position(&w, nth(0)), position(&w, nth(1)));
    let radii = [nth(0), nth(1)].map(|o| 0.5 * size(&w, o).x.max(size(&w, o).z));
    assert!(apart >= radii[0] + radii[1], "{apart} m apart");
}

/// Removes a trash bin in an open room with one door on a side of the person; returns its new position
/// relative to the person, its radius, and the radius of the person.
fn removed_beside_door(door: Vec2) -> (Vec2, f32, f32) {
    let people = vec![person(Persona::Wheelchair, 9.0, 9.0), person(Persona::Helper, 0.0, 0.0)];
    let mut setup = hall(vec![thing("trashbin", at(0.0, 0.0, -0.7))], people);
    setup.rooms.push(Room { kind: RoomKind::Corridor, rect: setup.bounds });
    let half = 0.4 * door.perp().normalize();
    setup.openings.push(Opening { a: door - half, b: door + half, rooms: [0, 0] });
    let mut w = world(setup);
    let remove = Action::RemoveObstacle { obstacle: nth(0), hand: Hand::Right };
    assert_eq!(run(&mut w, B, remove).0, Outcome::Success);
    let away = position(&w, nth(0)) - w.state().agents[1].pose.position;
    let bin = size(&w, nth(0));
    let radius = 0.5 * Vec2::new(bin.x, bin.z).length();
    (Vec2::new(away.x, away.z), radius, Persona::Helper.capability().radius_m)
}

#[test]
fn a_removed_obstacle_stands_as_far_from_the_door_as_the_arms_reach() {
    for door in
        [Vec2::new(1.5, 0.3), Vec2::new(-1.5, 0.3), Vec2::new(0.2, 1.4), Vec2::new(0.2, -1.6)]
    {
        let (at, radius, body) = removed_beside_door(door);
        // Spots lie between the nearest possible one and a meter beyond it.
        let nearest = body + radius + 0.05;
        assert!(at.length() > nearest + 0.8 && at.length() <= nearest + 1.0, "{at} for {door}");
        assert!(at.normalize().dot(-door.normalize()) > 0.9, "{at} for {door}");
    }
}

#[test]
fn a_failed_put_on_drops_the_object_behind_the_person() {
    let dropped = (0..60).find_map(|seed| {
        let cabinet = thing("cabinet", at(0.0, 0.0, -0.8));
        let apple = thing("apple", at(0.3, 0.0, 0.4));
        let mut setup = hall(vec![cabinet, apple], vec![person(Persona::Child, 0.0, 0.3)]);
        setup.seed = seed;
        let mut w = world(setup);
        assert_eq!(run(&mut w, A, pick(nth(1))).0, Outcome::Success);
        let (outcome, _) = run(&mut w, A, Action::PutOn { place: nth(0), hand: Hand::Right });
        (outcome == Outcome::Failure(FailureReason::BeyondLimits)).then_some(w)
    });
    let w = dropped.expect("about half of the put-ons fail");
    let (pose, apple) = (w.state().agents[0].pose, size(&w, nth(1)));
    let distance = Persona::Child.capability().radius_m + 0.5 * apple.x.max(apple.z) + 0.2;
    let expected = pose.position - forward(pose.yaw_rad) * distance;
    let at = position(&w, nth(1));
    assert!(in_plan(at, expected) < 0.05, "{at} instead of {expected}");
}

#[test]
fn an_object_falls_on_the_object_below_the_taken_one() {
    let lower = thing("tea_tray", at(0.0, 0.0, -0.6));
    let height = lower.size_m().y;
    let upper = thing("tea_tray", at(0.0, height + 0.001, -0.6));
    let apple = thing("apple", at(0.0, 2.0 * height + 0.002, -0.6));
    let people = vec![person(Persona::Adult, 0.0, 0.0)];
    let mut w = world(hall(vec![lower, upper, apple], people));
    let mut state = w.state().clone();
    for (k, on) in [(2, nth(0)), (3, nth(1))] {
        state.objects[k].location = ObjectLocation::Resting { on: Some(on) };
    }
    let bytes = postcard::to_stdvec(&state).expect("a state is plain data");
    w.restore(&Snapshot(bytes)).expect("the snapshot is of this world");
    assert_eq!(run(&mut w, A, pick(nth(1))).0, Outcome::Success);
    for _ in 0..300 {
        w.tick();
    }
    let apple = &w.state().objects[3];
    assert_eq!(apple.location, ObjectLocation::Resting { on: Some(nth(0)) });
    assert!(apple.position.y < height + 0.02, "it lies at {}", apple.position);
}

#[test]
fn a_removed_obstacle_covers_no_small_object() {
    // Apples everywhere except where the bin stood.
    let bin = Vec2::new(0.0, -0.7);
    let mut things = vec![thing("trashbin", at(bin.x, 0.0, bin.y))];
    for (i, j) in (-10..=10).flat_map(|i| (-10..=10).map(move |j| (i, j))) {
        let p = 0.2 * Vec2::new(i as f32, j as f32);
        if p.length() > 0.4 && p.distance(bin) > 0.5 {
            things.push(thing("apple", at(p.x, 0.0, p.y)));
        }
    }
    let n_apples = things.len() - 1;
    let people = vec![person(Persona::Wheelchair, 9.0, 9.0), person(Persona::Helper, 0.0, 0.0)];
    let mut w = world(hall(things, people));
    let remove = Action::RemoveObstacle { obstacle: nth(0), hand: Hand::Right };
    assert_eq!(run(&mut w, B, remove).0, Outcome::Success);
    let radius = 0.5 * size(&w, nth(0)).x.max(size(&w, nth(0)).z);
    for k in 1..=n_apples {
        let apart_m = in_plan(position(&w, nth(0)), position(&w, nth(k)));
        assert!(apart_m > radius, "apple {k} at {}", position(&w, nth(k)));
    }
}
