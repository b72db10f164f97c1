//! Promise: what impairs a person limits it as its row says, alone and together with its kind, and
//! nobody else.

mod common;

use chaic_core::action::{Action, FailureReason, Hand, Outcome};
use chaic_core::capability::{Impairment, Impairments, PersonKind, Persona};
use chaic_world::{EventKind, Person, Place, Rules, Thing, World};
use common::*;

fn impaired(persona: Persona, impairment: Impairment, things: Vec<Thing>) -> World {
    let kind = PersonKind { persona, impairments: Impairments::of(impairment) };
    let usual = person(persona, 0.0, 0.3);
    let setup = hall(things, vec![Person::new(kind, usual.pose, 0)]);
    World::new(setup, Rules::paper()).expect("the test's setup is valid")
}

fn pick(k: usize, hand: Hand) -> Action<chaic_core::EntityId> {
    Action::PickUp { object: nth(k), hand }
}

const BEYOND: Outcome = Outcome::Failure(FailureReason::BeyondLimits);

#[test]
fn one_handed_people_use_the_right_hand_and_neither_containers_nor_furniture() {
    for persona in [Persona::Adult, Persona::Child] {
        let things = vec![
            thing("apple", at(0.0, 0.0, -0.4)),
            thing("wicker_basket", at(0.3, 0.0, -0.4)),
            thing("navy_chair", at(-0.6, 0.0, -0.6)),
        ];
        let mut w = impaired(persona, Impairment::OneHanded, things);
        for hand in Hand::BOTH {
            for k in [1, 2] {
                assert_eq!(run(&mut w, A, pick(k, hand)).0, BEYOND, "{persona:?}, thing {k}");
            }
        }
        assert_eq!(run(&mut w, A, pick(0, Hand::Left)).0, BEYOND);
        assert_eq!(run(&mut w, A, pick(0, Hand::Right)).0, Outcome::Success);
    }
}

#[test]
fn a_bicycle_needs_both_hands() {
    let kind: PersonKind = "rider+one_handed".parse().expect("such a person can be written");
    let setup = hall(
        vec![thing("bike", at(0.5, 0.0, 0.3))],
        vec![Person::new(kind, person(Persona::Rider, 0.0, 0.3).pose, 0)],
    );
    let refused = World::new(setup, Rules::paper()).expect_err("it has one hand").to_string();
    assert!(refused.contains("people[0].capability.hands"), "{refused}");
}

/// Frames that `n` steps ahead and as many back take.
fn frames_to_walk(w: &mut World, n: usize) -> u32 {
    let began = w.state().frame;
    for _ in 0..2 {
        for _ in 0..n {
            run(w, A, Action::MoveForward);
        }
        for _ in 0..12 {
            run(w, A, Action::TurnLeft);
        }
    }
    w.state().frame - began
}

#[test]
fn who_tires_gets_slower_by_walking_and_recovers_by_rest() {
    let mut usual =
        World::new(hall(vec![], vec![person(Persona::Adult, 0.0, 0.3)]), Rules::paper())
            .expect("the test's setup is valid");
    let mut w = impaired(Persona::Adult, Impairment::Tires, vec![]);
    assert_eq!(w.fatigue(A), 0.0);
    let rested = frames_to_walk(&mut w, 6);
    for _ in 0..6 {
        frames_to_walk(&mut w, 6);
    }
    assert!(w.fatigue(A) > 0.35, "{}", w.fatigue(A));
    let tired = frames_to_walk(&mut w, 6);
    assert!(f64::from(tired) > 1.2 * f64::from(rested), "{rested} {tired}");
    run(&mut w, A, Action::Wait { frames: 200 });
    assert_eq!(w.fatigue(A), 0.0);
    let again = frames_to_walk(&mut w, 6);
    assert!(f64::from(again) < 1.15 * f64::from(rested), "{rested} {again}");
    let always = frames_to_walk(&mut usual, 6);
    assert_eq!(frames_to_walk(&mut usual, 6), always, "nobody else tires");
}

#[test]
fn a_tired_person_is_weaker() {
    // 500 kg: less than an adult lifts, much more than a tired one does.
    let chances = |tired: bool| {
        let won = |seed: u64| {
            let mut setup = hall(vec![heavy()], vec![]);
            let kind = PersonKind {
                persona: Persona::Adult,
                impairments: Impairments::of(Impairment::Tires),
            };
            setup.people = vec![Person::new(kind, person(Persona::Adult, 0.0, 0.3).pose, 0)];
            setup.seed = seed;
            let mut w = World::new(setup, Rules::paper()).expect("the test's setup is valid");
            if tired {
                for _ in 0..8 {
                    frames_to_walk(&mut w, 6);
                }
            }
            run(&mut w, A, pick(0, Hand::Right)).0.is_success()
        };
        (0..20).filter(|seed| won(*seed)).count()
    };
    let (rested, tired) = (chances(false), chances(true));
    assert!(rested == 20 && tired < 15, "{rested} and {tired} of 20");
}

#[test]
fn things_slip_from_trembling_hands_and_can_be_taken_again() {
    let tremor = Impairments::of(Impairment::Tremor).apply(Persona::Adult.capability()).tremor;
    let tremor = tremor.expect("it trembles");
    let (mut n_tries, mut n_taken, mut n_dropped, mut frames) = (0, 0, 0, 0);
    for seed in 0..400 {
        let mut setup = hall(vec![thing("apple", at(0.0, 0.0, -0.4))], vec![]);
        let kind: PersonKind = "adult+tremor".parse().expect("such a person can be");
        setup.people = vec![Person::new(kind, person(Persona::Adult, 0.0, 0.3).pose, 0)];
        setup.seed = seed;
        let mut w = World::new(setup, Rules::paper()).expect("the test's setup is valid");
        n_tries += 1;
        let taken = run(&mut w, A, pick(0, Hand::Right)).0;
        if !taken.is_success() {
            assert_eq!(taken, BEYOND);
            continue;
        }
        n_taken += 1;
        w.drain_events();
        let (_, held_frames) = run(&mut w, A, Action::Wait { frames: 500 });
        let dropped = w.drain_events().into_iter().find(
            |e| matches!(e.kind, EventKind::Released { object, on: None, .. } if object == nth(0)),
        );
        let Some(dropped) = dropped else {
            frames += held_frames;
            continue;
        };
        n_dropped += 1;
        frames += dropped.frame - (w.state().frame - held_frames);
        run(&mut w, A, Action::Wait { frames: 60 });
        let apple = &w.state().things[1];
        assert!(matches!(apple.place, Place::Resting { .. }) && apple.position.y < 0.2);
        assert_eq!(w.state().people[0].hands, [None; 2]);
    }
    let slipped = 1.0 - f64::from(n_taken) / f64::from(n_tries);
    assert!((slipped - f64::from(tremor.slip_chance)).abs() < 0.08, "{slipped}");
    let per_frame = f64::from(n_dropped) / f64::from(frames);
    let expected = f64::from(tremor.drop_chance);
    assert!((per_frame - expected).abs() < 0.3 * expected, "{per_frame}");
}

#[test]
fn snapshots_hold_how_tired_one_is() {
    let mut w = impaired(Persona::Child, Impairment::Tires, vec![]);
    frames_to_walk(&mut w, 4);
    let (tired, fatigue, digest) = (w.snapshot(), w.fatigue(A), w.digest());
    run(&mut w, A, Action::Wait { frames: 300 });
    assert!(w.fatigue(A) == 0.0 && fatigue > 0.0 && w.digest() != digest);
    w.restore(&tired).expect("it is of this world");
    assert_eq!((w.fatigue(A), w.digest()), (fatigue, digest));
    let setup = hall(vec![], vec![person(Persona::Child, 0.0, 0.3)]);
    let mut usual = World::new(setup, Rules::paper()).expect("the test's setup is valid");
    assert!(usual.restore(&tired).is_err(), "nobody tires there");
}

/// Furniture that needs a rested adult.
fn heavy() -> Thing {
    let heavies = chaic_core::ClassId::all().filter(|c| {
        c.info().role == chaic_core::Role::HeavyTarget
            && (400.0..=600.0).contains(&c.info().mass_kg)
    });
    let class = heavies.last().expect("there is such a piece");
    thing(class.name(), at(0.0, 0.0, -1.2))
}
