//! Promise: carried, stored, removed and fallen objects are where the rules put them.

use crate::common::*;
use chaic_core::action::{Action, FailureReason, Hand, Outcome};
use chaic_core::capability::{PersonKind, Persona};
use chaic_core::geom::{Pose, forward};
use chaic_core::{EntityId, ResolvedAction, Vec2, Vec3};
use chaic_world::{
    ActionStep, Activity, AgentSpec, ObjectLocation, Opening, Phase, Room, RoomKind, Snapshot,
    World, top_surfaces,
};

fn pick(object: EntityId) -> ResolvedAction {
    Action::PickUp { object, hand: Hand::Right }
}

fn position(w: &World, object: EntityId) -> Vec3 {
    let index = w.setup().object_index(object).expect("it exists");
    w.state().objects[index].position
}

fn size(w: &World, object: EntityId) -> Vec3 {
    w.setup().object(object).expect("it exists").size_m()
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
    let spec = w.setup().object(bed).expect("the bed");
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

/// Removes a trash bin in an open room with one door on a side of the person. Returns its new position
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

/// Returns the positions of agent A's left and right hand in its body frame.
fn hands_in_body(w: &World) -> [Vec3; 2] {
    w.posture(A).arms.map(|arm| arm.hand_in_body)
}

#[test]
fn hands_hang_beside_the_body_and_hold_objects_in_front_of_it() {
    let h = Persona::Adult.capability().height_m;
    let (empty, holding) = (at(0.24, 0.43 * h, 0.0), at(0.2, 0.57 * h, -0.31 * h));
    let in_sling = at(0.0, 0.66 * h, -0.12 * h);
    // The left hand, the right hand, and the right hand with an object.
    for (name, expected) in [
        ("adult", [at(-0.24, 0.43 * h, 0.0), empty, holding]),
        ("adult+one_handed", [in_sling, empty, holding]),
        ("rider", [at(-0.4, 0.98, -0.35), empty, holding]),
        ("wheelchair", [at(-0.33, 0.62, 0.0), at(0.33, 0.62, 0.0), at(0.18, 0.82, -0.5)]),
    ] {
        let kind: PersonKind = name.parse().expect("a valid kind");
        let pose = Pose { position: at(1.0, 0.0, 2.0), yaw_rad: 0.7 };
        let mut things = vec![thing("apple", at(3.0, 0.0, 0.0))];
        things.extend((name == "rider").then(|| thing("bike", at(1.5, 0.0, 2.0))));
        let mut w = world(hall(things, vec![AgentSpec::new(kind, pose, 0)]));
        let [left, right] = hands_in_body(&w);
        let mut state = w.state().clone();
        state.agents[0].hands[Hand::Right.index()] = Some(nth(0));
        state.objects[1].location = ObjectLocation::Held { by: A, hand: Hand::Right };
        restore(&mut w, &state);
        w.tick();
        let found = [left, right, hands_in_body(&w)[Hand::Right.index()]];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!(found.distance(expected) < 1e-4, "{name}: {found} instead of {expected}");
        }
        let hangs_at = pose.to_world(expected[2]) - Vec3::Y * (0.5 * size(&w, nth(0)).y);
        assert!(position(&w, nth(0)).distance(hangs_at) < 1e-4, "{name}: {hangs_at}");
    }
}

/// Replaces the current step of agent A; its duration is 16 frames.
fn set_step(w: &mut World, phase: Phase, elapsed: u32) {
    let step = ActionStep { phase, elapsed, frames: 16 };
    let (action, queue) = (Action::PutIn, Vec::new());
    let mut state = w.state().clone();
    state.agents[0].activity = Some(Activity { action, since: 0, step, queue, failing: None });
    restore(w, &state);
}

#[test]
fn hands_follow_the_steps_of_an_action() {
    let apple = thing("apple", at(0.5, 0.0, -0.5));
    let mut w = world(hall(vec![apple], vec![person(Persona::Adult, 0.0, 0.0)]));
    // The body frame is the world frame.
    let ([left, right], to) = (hands_in_body(&w), at(0.4, 1.0, -0.6));
    let half_height = Vec3::Y * (0.5 * size(&w, nth(0)).y);
    let grasped = position(&w, nth(0)) + half_height;
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (hand, object) = (Some(Hand::Right), nth(0));
    let reach = |hand, fails| Phase::Reach { hand, to, fails };
    let release = Phase::Release { hand, object, on: None, at: to, set_down: true };
    for (phase, elapsed, expected) in [
        (reach(hand, false), 4, [left, right.lerp(to, smooth(0.25))]),
        // A failed reach is faster.
        (reach(hand, true), 4, [left, right.lerp(to, smooth(0.375))]),
        (reach(hand, true), 12, [left, to]),
        (reach(Some(Hand::Left), false), 16, [to, right]),
        (reach(None, false), 16, [to - Vec3::X * 0.22, to + Vec3::X * 0.22]),
        (Phase::Grasp { hand, object }, 1, [left, grasped]),
        (release, 1, [left, to + half_height]),
        (Phase::ResetArms { from: Some(to), hand }, 4, [left, to.lerp(right, 0.25)]),
        (Phase::Stand, 4, [left, right]),
    ] {
        set_step(&mut w, phase, elapsed);
        for (found, expected) in hands_in_body(&w).into_iter().zip(expected) {
            let distance = found.distance(expected);
            assert!(distance < 1e-4, "{phase:?}: {found} instead of {expected}");
        }
    }
}

#[test]
fn people_bend_to_low_hands_and_stretch_to_high_ones() {
    let mut w = world(hall(vec![], vec![person(Persona::Adult, 0.0, 0.0)]));
    let height_m = Persona::Adult.capability().height_m;
    for (fraction, bend, stretch) in
        [(-0.1, 1.0, 0.0), (0.2, 0.5, 0.0), (0.7, 0.0, 0.0), (1.2, 0.0, 0.4), (2.0, 0.0, 1.0)]
    {
        let to = at(0.3, fraction * height_m, -0.5);
        set_step(&mut w, Phase::Reach { hand: Some(Hand::Right), to, fails: false }, 16);
        let posture = w.posture(A);
        let differs = (posture.bend - bend).abs().max((posture.stretch - stretch).abs());
        assert!(differs < 1e-4, "{fraction}: {} {}", posture.bend, posture.stretch);
    }
}
