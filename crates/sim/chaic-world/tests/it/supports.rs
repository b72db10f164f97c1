//! Promise: an object falls when its support is taken or breaks, even if it has not landed there
//! yet.

use crate::common::*;
use chaic_core::action::{Action, Hand, Outcome};
use chaic_core::capability::Persona;
use chaic_core::{EntityId, ResolvedAction};
use chaic_world::{EventKind, ObjectLocation, Phase, Rules, World};

fn pick(object: EntityId) -> ResolvedAction {
    Action::PickUp { object, hand: Hand::Right }
}

#[test]
fn objects_on_a_taken_object_fall_together() {
    let tray = thing("tea_tray", at(0.0, 0.0, -0.6));
    let top = tray.size_m().y;
    let apple = |x: f32| thing("apple", at(x, top + 0.001, -0.6));
    // The upper apple lies on the lower one.
    let size = apple(0.0).size_m();
    let upper = thing("apple", at(0.01, top + 0.002 + size.y, -0.6));
    let mut w = world(hall(vec![tray, apple(0.0), upper], vec![person(Persona::Adult, 0.0, 0.0)]));
    // The state after both have fallen there.
    let mut state = w.state().clone();
    state.objects[2].location = ObjectLocation::Resting { on: Some(nth(0)) };
    state.objects[3].location = ObjectLocation::Resting { on: Some(nth(1)) };
    restore(&mut w, &state);
    assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
    for _ in 0..300 {
        w.tick();
    }
    let things = &w.state().objects;
    let [lower, upper] = [things[2].position, things[3].position];
    assert!(things[2].is_resting() && things[3].is_resting());
    assert!(lower.distance(upper) > 0.9 * size.min_element(), "{lower} and {upper} overlap");
    let is_lost_support = |e: &chaic_world::Event| matches!(e.kind, EventKind::LostSupport { .. });
    assert_eq!(w.drain_events().iter().filter(|e| is_lost_support(e)).count(), 2);
}

#[test]
fn objects_on_a_vase_that_breaks_fall() {
    let vase = thing("vase", at(0.0, 0.0, -0.5));
    let apple = thing("apple", at(0.0, vase.size_m().y, -0.5));
    let setup = hall(vec![vase, apple], vec![person(Persona::Child, 0.0, 0.0)]);
    let rules = Rules { break_chance_low: 1.0, ..Rules::paper() };
    let mut w = World::new(setup, rules).expect("the test's setup is valid");
    let mut state = w.state().clone();
    state.objects[2].location = ObjectLocation::Resting { on: Some(nth(0)) };
    restore(&mut w, &state);
    run(&mut w, A, pick(nth(0)));
    assert_eq!(w.state().objects[1].location, ObjectLocation::Broken);
    for _ in 0..200 {
        w.tick();
    }
    let apple = &w.state().objects[2];
    assert!(apple.is_resting() && apple.position.y < 0.02, "it lies at {}", apple.position);
    assert!(has_event(&mut w, |e| e.kind == EventKind::LostSupport { object: nth(1) }));
}

#[test]
fn an_object_falls_on_if_its_support_is_taken_during_the_fall() {
    let things = vec![
        thing("wood_basket", at(0.5, 0.0, -0.5)),
        thing("orange", at(0.0, 0.0, -0.6)),
        thing("apple", at(0.0, 0.1, -0.6)),
    ];
    let mut w = world(hall(things, vec![person(Persona::Adult, 0.0, 0.0)]));
    let basket = Action::PickUp { object: nth(0), hand: Hand::Left };
    assert_eq!(run(&mut w, A, basket).0, Outcome::Success);
    // The apple is on its way to the orange, for longer than the orange takes into the basket.
    let mut state = w.state().clone();
    let end = (at(0.0, 0.1, -0.6), state.objects[3].rotation);
    state.objects[3].location = ObjectLocation::Falling { path: vec![end; 240], on: Some(nth(1)) };
    restore(&mut w, &state);
    assert_eq!(run(&mut w, A, pick(nth(1))).0, Outcome::Success);
    assert_eq!(run(&mut w, A, Action::PutIn).0, Outcome::Success);
    for _ in 0..240 {
        w.tick();
    }
    let apple = &w.state().objects[3];
    assert!(apple.is_resting() && apple.position.y < 0.02, "it lies at {}", apple.position);
}

#[test]
fn furniture_falls_if_its_place_is_taken_before_the_release() {
    let things =
        vec![thing("backpack", at(0.0, 0.0, -1.0)), thing("navy_chair", at(0.0, 0.0, 1.5))];
    let people = vec![person(Persona::Helper, 0.0, 0.0), person(Persona::Helper, 5.0, 5.0)];
    let mut w = world(hall(things, people));
    assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
    w.submit(A, Action::PutOn { place: nth(1), hand: Hand::Right }).expect("the agent waits");
    let reaches = |w: &World| {
        let activity = w.state().agents[0].activity.as_ref();
        activity.is_some_and(|a| matches!(a.step.phase, Phase::Reach { .. }))
    };
    while !reaches(&w) {
        assert!(!w.is_over(), "the put-on begins");
        w.tick();
    }
    let mut state = w.state().clone();
    state.objects[2].location = ObjectLocation::Held { by: B, hand: Hand::Right };
    state.agents[1].hands = [Some(nth(1)); 2];
    restore(&mut w, &state);
    for _ in 0..300 {
        w.tick();
    }
    assert_eq!(w.state().objects[1].location, ObjectLocation::Resting { on: None });
}
