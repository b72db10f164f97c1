//! Promise: what the world counts by itself, frame by frame, is what the docs say: the child's being
//! away from its guardian, and people who make no progress. Scores rest on both counts.

mod common;

use chaic_core::action::{Action, Hand, Outcome};
use chaic_core::capability::Persona;
use chaic_core::{AgentId, Frame, ResolvedAction, TaskId};
use chaic_world::{EventKind, PROGRESS_M, STUCK_AFTER_FRAMES, World};
use common::*;

const CHILD: AgentId = AgentId::CHILD;
const WAIT: ResolvedAction = Action::Wait { frames: 5 };

/// A partner at the origin, a helper behind it and a child so far to the right.
fn outing(child_x: f32) -> World {
    let people = vec![
        person(Persona::Adult, 0.0, 0.0),
        person(Persona::Helper, 0.0, 5.0),
        person(Persona::Child, child_x, 0.0),
    ];
    let mut setup = hall(vec![thing("apple", at(0.0, 0.0, -0.6))], people);
    setup.task = TaskId::Shopping;
    world(setup)
}

/// Lets frames pass, with everybody who is not told otherwise waiting.
fn pass(w: &mut World, frames: Frame, mut what: impl FnMut(AgentId) -> ResolvedAction) {
    let end = w.state().frame + frames;
    while w.state().frame < end {
        for agent in w.waiting() {
            w.submit(agent, what(agent)).expect("it waits");
        }
        w.tick();
    }
}

fn away_events(w: &mut World) -> Vec<(Frame, bool)> {
    let events = w.drain_events().into_iter();
    let away = events.filter_map(|e| match e.kind {
        EventKind::ChildAway { away } => Some((e.frame, away)),
        _ => None,
    });
    away.collect()
}

fn stuck_events(w: &mut World) -> Vec<(Frame, AgentId, bool)> {
    let events = w.drain_events().into_iter();
    let stuck = events.filter_map(|e| match e.kind {
        EventKind::Stuck { agent, stuck } => Some((e.frame, agent, stuck)),
        _ => None,
    });
    stuck.collect()
}

#[test]
fn the_child_is_away_in_every_frame_beyond_three_and_a_half_metres_and_in_no_other() {
    for (child_x, expected) in [(2.0, 0), (3.49, 0), (3.51, 40), (8.0, 40)] {
        let mut w = outing(child_x);
        pass(&mut w, 40, |_| WAIT);
        assert_eq!(w.state().child_away_frames, expected, "{child_x} m off");
        let events: &[_] = if expected > 0 { &[(1, true)] } else { &[] };
        assert_eq!(away_events(&mut w), events, "told once, {child_x} m off");
    }
}

#[test]
fn it_is_the_distance_to_the_guardian_that_counts_whoever_of_the_two_walks() {
    let mut w = outing(3.2);
    // The partner walks away from the child and comes back; the helper is never near either.
    pass(&mut w, 1, |agent| if agent == A { Action::TurnLeft } else { WAIT });
    let turns = |k: u32, n: u32| if k < n { Action::TurnLeft } else { Action::MoveForward };
    let mut k = 1;
    pass(&mut w, 60, |agent| {
        k += u32::from(agent == A);
        if agent == A { turns(k - 1, 6) } else { WAIT }
    });
    let distance = |w: &World| {
        let [a, c] = [A, CHILD].map(|a| w.state().people[a.index()].pose.position);
        a.distance(c)
    };
    assert!(distance(&w) > 3.5, "{}", distance(&w));
    let mut k = 0;
    pass(&mut w, 80, |agent| {
        k += u32::from(agent == A);
        if agent == A { turns(k - 1, 12) } else { WAIT }
    });
    assert!(distance(&w) < 3.5, "{}", distance(&w));
    let events = away_events(&mut w);
    let [(left, true), (back, false)] = events[..] else { panic!("{events:?}") };
    assert_eq!(w.state().child_away_frames, back - left);
}

#[test]
fn without_a_child_nobody_is_away() {
    let people = vec![person(Persona::Adult, 0.0, 0.0), person(Persona::Helper, 0.0, 9.0)];
    let mut w = world(hall(vec![], people));
    pass(&mut w, 40, |_| WAIT);
    assert_eq!(w.state().child_away_frames, 0);
}

#[test]
fn who_stands_or_turns_for_long_is_stuck_until_it_gets_somewhere() {
    for idle in [WAIT, Action::TurnLeft] {
        let mut w = outing(1.0);
        // The helper walks to and fro over more than the distance that counts.
        let walks = |k: &mut u32| {
            *k += 1;
            if *k % 17 < 5 { Action::MoveForward } else { Action::TurnLeft }
        };
        let mut k = 0;
        pass(&mut w, STUCK_AFTER_FRAMES - 1, |a| if a == B { walks(&mut k) } else { idle });
        assert_eq!((w.state().stuck_frames, stuck_events(&mut w)), (0, vec![]));
        pass(&mut w, 31, |a| if a == B { walks(&mut k) } else { idle });
        assert_eq!(w.state().stuck_frames, 31);
        assert_eq!(stuck_events(&mut w), [(STUCK_AFTER_FRAMES, A, true)], "not the child either");
        pass(&mut w, 60, |_| Action::MoveForward);
        let events = stuck_events(&mut w);
        let [(freed, A, false)] = events[..] else { panic!("{events:?}") };
        assert_eq!(w.state().stuck_frames, freed - STUCK_AFTER_FRAMES);
    }
}

#[test]
fn a_step_to_and_fro_is_no_progress_and_what_is_done_well_is() {
    let mut w = outing(1.0);
    let mut k = 0;
    // A step, a half turn, a step: 0.4 m from where it began at most.
    pass(&mut w, STUCK_AFTER_FRAMES + 20, |agent| {
        k += u32::from(agent == A);
        let step = k % 13 == 0;
        if agent == A && step { Action::MoveForward } else { Action::TurnLeft }
    });
    assert!(w.state().people[0].progress.is_stuck);
    assert!(w.state().people[0].walked_m > PROGRESS_M);
    let mut w = outing(1.0);
    let picks =
        |a| if a == A { Action::PickUp { object: nth(0), hand: Hand::Right } } else { WAIT };
    pass(&mut w, 100, picks);
    let (action, outcome) = w.state().people[0].last.expect("it did something");
    assert!(w.state().people[0].hands[1].is_some(), "{action:?} {outcome:?}");
    let taken = w.state().people[0].progress.frame;
    assert!(taken > 50 && taken < 100, "{taken}");
    // What goes on failing is no progress any more.
    pass(&mut w, STUCK_AFTER_FRAMES, picks);
    assert_ne!(w.state().people[0].last.map(|l| l.1), Some(Outcome::Success));
    assert!(w.state().people[0].progress.is_stuck);
}
