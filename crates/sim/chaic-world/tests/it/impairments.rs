//! Promise: an impairment limits a person as its table row states, alone and combined with any
//! persona, and limits no one else.

use crate::common::*;
use chaic_core::action::{Action, FailureReason, Hand, Outcome};
use chaic_core::capability::{Impairment, Impairments, PersonKind, Persona};
use chaic_world::{AgentSpec, EventKind, ObjectLocation, ObjectSpec, Rules, World};

fn impaired(persona: Persona, impairment: Impairment, things: Vec<ObjectSpec>) -> World {
    let kind = PersonKind { persona, impairments: Impairments::new(impairment) };
    let pose = person(persona, 0.0, 0.3).pose;
    let setup = hall(things, vec![AgentSpec::new(kind, pose, 0)]);
    World::new(setup, Rules::paper()).expect("the test's setup is valid")
}

fn pick(k: usize, hand: Hand) -> Action<chaic_core::EntityId> {
    Action::PickUp { object: nth(k), hand }
}

const BEYOND: Outcome = Outcome::Failure(FailureReason::BeyondLimits);

#[test]
fn one_handed_people_cannot_use_the_left_hand_containers_or_furniture() {
    for persona in [Persona::Adult, Persona::Child] {
        let things = vec![
            thing("apple", at(0.0, 0.0, -0.4)),
            thing("wicker_basket", at(0.3, 0.0, -0.4)),
            thing("navy_chair", at(-0.6, 0.0, -0.6)),
        ];
        let mut w = impaired(persona, Impairment::OneHanded, things);
        for hand in Hand::BOTH {
            for k in [1, 2] {
                assert_eq!(run(&mut w, A, pick(k, hand)).0, BEYOND, "{persona:?}, object {k}");
            }
        }
        assert_eq!(run(&mut w, A, pick(0, Hand::Left)).0, BEYOND);
        assert_eq!(run(&mut w, A, pick(0, Hand::Right)).0, Outcome::Success);
    }
}

#[test]
fn a_bicycle_needs_both_hands() {
    let kind: PersonKind = "rider+one_handed".parse().expect("a valid kind");
    let setup = hall(
        vec![thing("bike", at(0.5, 0.0, 0.3))],
        vec![AgentSpec::new(kind, person(Persona::Rider, 0.0, 0.3).pose, 0)],
    );
    let error =
        World::new(setup, Rules::paper()).expect_err("a one-handed rider is invalid").to_string();
    assert!(error.contains("people[0].capability.hands"), "{error}");
}

/// Returns the frames that `n` steps forward and `n` steps back take.
fn frames_to_walk(w: &mut World, n: usize) -> u32 {
    let start = w.state().frame;
    for _ in 0..2 {
        for _ in 0..n {
            run(w, A, Action::MoveForward);
        }
        for _ in 0..12 {
            run(w, A, Action::TurnLeft);
        }
    }
    w.state().frame - start
}

#[test]
fn an_agent_that_tires_slows_down_and_recovers_by_rest() {
    let mut unimpaired =
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
    let first = frames_to_walk(&mut unimpaired, 6);
    assert_eq!(frames_to_walk(&mut unimpaired, 6), first, "an unimpaired agent does not tire");
}

#[test]
fn a_tired_person_is_weaker() {
    // 500 kg: less than a rested adult lifts, much more than a tired one lifts.
    let chances = |tired: bool| {
        let succeeds = |seed: u64| {
            let mut setup = hall(vec![heavy()], vec![]);
            let kind = PersonKind {
                persona: Persona::Adult,
                impairments: Impairments::new(Impairment::Tires),
            };
            setup.people = vec![AgentSpec::new(kind, person(Persona::Adult, 0.0, 0.3).pose, 0)];
            setup.seed = seed;
            let mut w = World::new(setup, Rules::paper()).expect("the test's setup is valid");
            if tired {
                for _ in 0..8 {
                    frames_to_walk(&mut w, 6);
                }
            }
            run(&mut w, A, pick(0, Hand::Right)).0.is_success()
        };
        (0..20).filter(|seed| succeeds(*seed)).count()
    };
    let (rested, tired) = (chances(false), chances(true));
    assert!(rested == 20 && tired < 15, "{rested} and {tired} of 20");
}

#[test]
fn objects_slip_and_drop_at_the_chances_of_the_tremor() {
    let tremor = Impairments::new(Impairment::Tremor).apply(Persona::Adult.capability()).tremor;
    let tremor = tremor.expect("the impairment is a tremor");
    let (mut n_tries, mut n_taken, mut n_dropped, mut frames) = (0, 0, 0, 0);
    for seed in 0..400 {
        let mut setup = hall(vec![thing("apple", at(0.0, 0.0, -0.4))], vec![]);
        let kind: PersonKind = "adult+tremor".parse().expect("a valid kind");
        setup.people = vec![AgentSpec::new(kind, person(Persona::Adult, 0.0, 0.3).pose, 0)];
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
        let apple = &w.state().objects[1];
        assert!(matches!(apple.location, ObjectLocation::Resting { .. }) && apple.position.y < 0.2);
        assert_eq!(w.state().agents[0].hands, [None; 2]);
    }
    let slipped = 1.0 - f64::from(n_taken) / f64::from(n_tries);
    assert!((slipped - f64::from(tremor.slip_chance)).abs() < 0.08, "{slipped}");
    let per_frame = f64::from(n_dropped) / f64::from(frames);
    let expected = f64::from(tremor.drop_chance);
    assert!((per_frame - expected).abs() < 0.3 * expected, "{per_frame}");
}

#[test]
fn snapshots_contain_fatigue() {
    let mut w = impaired(Persona::Child, Impairment::Tires, vec![]);
    frames_to_walk(&mut w, 4);
    let (tired, fatigue, digest) = (w.snapshot(), w.fatigue(A), w.digest());
    run(&mut w, A, Action::Wait { frames: 300 });
    assert!(w.fatigue(A) == 0.0 && fatigue > 0.0 && w.digest() != digest);
    w.restore(&tired).expect("the snapshot is of this world");
    assert_eq!((w.fatigue(A), w.digest()), (fatigue, digest));
    let setup = hall(vec![], vec![person(Persona::Child, 0.0, 0.3)]);
    let mut unimpaired = World::new(setup, Rules::paper()).expect("the test's setup is valid");
    assert!(unimpaired.restore(&tired).is_err(), "that setup has no conditions");
}

/// Furniture that only a rested adult can lift.
fn heavy() -> ObjectSpec {
    let heavy_classes = chaic_core::ClassId::all().filter(|c| {
        c.info().role == chaic_core::Role::HeavyTarget
            && (400.0..=600.0).contains(&c.info().mass_kg)
    });
    let class = heavy_classes.last().expect("the catalogue has such furniture");
    thing(class.name(), at(0.0, 0.0, -1.2))
}
