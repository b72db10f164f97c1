//! Promise: two agents that carry furniture turn only if both have room on the whole way.

use crate::common::*;
use chaic_core::action::{Action, FailureReason, Hand, Outcome};
use chaic_core::capability::Persona;
use chaic_core::{EntityId, ResolvedAction, Vec3};
use chaic_world::{EventKind, Wall, World};

fn pick(object: EntityId) -> ResolvedAction {
    Action::PickUp { object, hand: Hand::Right }
}

/// A piano carried by two: the leader at (0, z), the follower to its right and ahead.
fn carried_by_two(walls: Vec<Wall>) -> World {
    let mut setup = hall(
        vec![thing("piano", at(0.0, 0.0, 0.0))],
        vec![person(Persona::Frail, 0.0, 1.15), person(Persona::Helper, 3.0, 0.0)],
    );
    setup.seed = 3;
    setup.walls = walls;
    let mut w = world(setup);
    w.submit(A, pick(nth(0))).unwrap();
    w.submit(B, pick(nth(0))).unwrap();
    w.advance();
    assert!(has_event(&mut w, |e| matches!(e.kind, EventKind::LiftedTogether { .. })));
    w
}

#[test]
fn a_leader_swings_the_follower_around_if_there_is_room() {
    let positions = |w: &World| [0, 1].map(|k| w.state().agents[k].pose.position);
    let mut free = carried_by_two(Vec::new());
    let [leader, follower] = positions(&free);
    assert_eq!(run(&mut free, A, Action::TurnLeft).0, Outcome::Success);
    let [pivot, swung] = positions(&free);
    assert!(pivot == leader && swung.distance(follower) > 0.3, "{follower} to {swung}");
    assert!(swung.z < follower.z - 0.15, "a left turn swings it ahead");

    // With a wall ahead of the follower, they turn about the follower instead.
    let ahead = wall([-9.0, follower.z - 0.38], [9.0, follower.z - 0.38]);
    let mut w = carried_by_two(vec![ahead]);
    assert_eq!(positions(&w), [leader, follower], "the wall blocks neither agent yet");
    assert_eq!(run(&mut w, A, Action::TurnLeft).0, Outcome::Success);
    let [stepped, pivot] = positions(&w);
    assert!(pivot.distance(follower) < 1e-3, "{follower} to {pivot}");
    assert!((stepped.distance(leader) - swung.distance(follower)).abs() < 1e-3);

    // With another wall behind the leader, there is no room to turn.
    let behind = wall([-9.0, leader.z + 0.38], [9.0, leader.z + 0.38]);
    let mut w = carried_by_two(vec![ahead, behind]);
    assert_eq!(run(&mut w, A, Action::TurnLeft).0, Outcome::Failure(FailureReason::Blocked));
    assert_eq!(positions(&w), [leader, follower]);
}

#[test]
fn a_follower_does_not_swing_through_a_thin_wall() {
    let positions = |w: &World| [0, 1].map(|k| w.state().agents[k].pose.position);
    let mut free = carried_by_two(Vec::new());
    let state = free.state().clone();
    let [leader, follower] = positions(&free);
    assert_eq!(run(&mut free, A, Action::TurnLeft).0, Outcome::Success);
    let swung = positions(&free)[1];
    // A short wall across the way of the follower, clear of both ends.
    let middle = 0.5 * (follower + swung);
    let half = 0.1 * (middle - leader).normalize();
    let end = |p: Vec3| [p.x, p.z];
    let thin = Wall { thickness_m: 0.02, ..wall(end(middle - half), end(middle + half)) };
    assert!(swung.distance(follower) > 2.0 * (0.2 + 0.01), "{follower} to {swung}");

    let mut setup = free.setup().clone();
    setup.walls = vec![thin];
    let mut w = world(setup);
    restore(&mut w, &state);
    assert_eq!(run(&mut w, A, Action::TurnLeft).0, Outcome::Success);
    let [stepped, pivot] = positions(&w);
    assert!(pivot.distance(follower) < 1e-3, "the follower went from {follower} to {pivot}");
    assert!(stepped.distance(leader) > 0.3, "they turn about the follower");
}
