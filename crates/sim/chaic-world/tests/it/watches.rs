//! Promise: the counters of the world match the docs: frames in which the child is away from its
//! guardian, and frames without progress. Scores depend on both counters.

use crate::common::*;
use chaic_core::action::{Action, Hand, Outcome};
use chaic_core::capability::Persona;
use chaic_core::{AgentId, Frame, ResolvedAction, TaskId};
use chaic_world::{EventKind, PROGRESS_M, STUCK_AFTER_FRAMES, World};

const CHILD: AgentId = AgentId::CHILD;
const WAIT: ResolvedAction = Action::Wait { frames: 5 };

/// A partner at the origin, a helper behind it and a child at `child_x` to the right.
fn outdoor_world(child_x: f32) -> World {
    let people = vec![
        person(Persona::Adult, 0.0, 0.0),
        person(Persona::Helper, 0.0, 5.0),
        person(Persona::Child, child_x, 0.0),
    ];
    let mut setup = hall(vec![thing("apple", at(0.0, 0.0, -0.6))], people);
    setup.task = TaskId::Shopping;
    world(setup)
}

/// Runs frames; each waiting agent submits the action that `policy` chooses for it.
fn run_frames(w: &mut World, frames: Frame, mut policy: impl FnMut(AgentId) -> ResolvedAction) {
    let end = w.state().frame + frames;
    while w.state().frame < end {
        for agent in w.waiting() {
            w.submit(agent, policy(agent)).expect("the agent waits");
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
fn the_child_is_away_exactly_beyond_three_and_a_half_meters() {
    for (child_x, expected) in [(2.0, 0), (3.49, 0), (3.51, 40), (8.0, 40)] {
        let mut w = outdoor_world(child_x);
        run_frames(&mut w, 40, |_| WAIT);
        assert_eq!(w.state().child_away_frames, expected, "{child_x} m away");
        let events: &[_] = if expected > 0 { &[(1, true)] } else { &[] };
        assert_eq!(away_events(&mut w), events, "one event, {child_x} m away");
    }
}

#[test]
fn the_distance_between_child_and_guardian_counts_when_the_guardian_walks() {
    let mut w = outdoor_world(3.2);
    // The partner walks away from the child and returns; the helper is never near either.
    run_frames(&mut w, 1, |agent| if agent == A { Action::TurnLeft } else { WAIT });
    let turns = |k: u32, n: u32| if k < n { Action::TurnLeft } else { Action::MoveForward };
    let mut k = 1;
    run_frames(&mut w, 60, |agent| {
        k += u32::from(agent == A);
        if agent == A { turns(k - 1, 6) } else { WAIT }
    });
    let distance = |w: &World| {
        let [a, c] = [A, CHILD].map(|a| w.state().agents[a.index()].pose.position);
        a.distance(c)
    };
    assert!(distance(&w) > 3.5, "{}", distance(&w));
    let mut k = 0;
    run_frames(&mut w, 80, |agent| {
        k += u32::from(agent == A);
        if agent == A { turns(k - 1, 12) } else { WAIT }
    });
    assert!(distance(&w) < 3.5, "{}", distance(&w));
    let events = away_events(&mut w);
    let [(start, true), (end, false)] = events[..] else { panic!("{events:?}") };
    assert_eq!(w.state().child_away_frames, end - start);
}

#[test]
fn without_a_child_no_away_frames_are_counted() {
    let people = vec![person(Persona::Adult, 0.0, 0.0), person(Persona::Helper, 0.0, 9.0)];
    let mut w = world(hall(vec![], people));
    run_frames(&mut w, 40, |_| WAIT);
    assert_eq!(w.state().child_away_frames, 0);
}

#[test]
fn an_agent_that_stands_or_turns_is_stuck_until_it_moves_far_enough() {
    for idle in [WAIT, Action::TurnLeft] {
        let mut w = outdoor_world(1.0);
        // The helper walks back and forth over more than the distance that counts.
        let back_and_forth = |k: &mut u32| {
            *k += 1;
            if *k % 17 < 5 { Action::MoveForward } else { Action::TurnLeft }
        };
        let mut k = 0;
        run_frames(&mut w, STUCK_AFTER_FRAMES - 1, |a| {
            if a == B { back_and_forth(&mut k) } else { idle }
        });
        assert_eq!((w.state().stuck_frames, stuck_events(&mut w)), (0, vec![]));
        run_frames(&mut w, 31, |a| if a == B { back_and_forth(&mut k) } else { idle });
        assert_eq!(w.state().stuck_frames, 31);
        assert_eq!(
            stuck_events(&mut w),
            [(STUCK_AFTER_FRAMES, A, true)],
            "the child does not count"
        );
        run_frames(&mut w, 60, |_| Action::MoveForward);
        let events = stuck_events(&mut w);
        let [(freed, A, false)] = events[..] else { panic!("{events:?}") };
        assert_eq!(w.state().stuck_frames, freed - STUCK_AFTER_FRAMES);
    }
}

#[test]
fn stepping_back_and_forth_is_no_progress_and_a_successful_action_is() {
    let mut w = outdoor_world(1.0);
    let mut k = 0;
    // A step, a half turn, a step: at most 0.4 m from the start.
    run_frames(&mut w, STUCK_AFTER_FRAMES + 20, |agent| {
        k += u32::from(agent == A);
        let step = k % 13 == 0;
        if agent == A && step { Action::MoveForward } else { Action::TurnLeft }
    });
    assert!(w.state().agents[0].progress.is_stuck);
    assert!(w.state().agents[0].walked_m > PROGRESS_M);
    let mut w = outdoor_world(1.0);
    let picks =
        |a| if a == A { Action::PickUp { object: nth(0), hand: Hand::Right } } else { WAIT };
    run_frames(&mut w, 100, picks);
    let (action, outcome) = w.state().agents[0].last.expect("an action has ended");
    assert!(w.state().agents[0].hands[1].is_some(), "{action:?} {outcome:?}");
    let taken = w.state().agents[0].progress.frame;
    assert!(taken > 50 && taken < 100, "{taken}");
    // Repeated failures are no progress.
    run_frames(&mut w, STUCK_AFTER_FRAMES, picks);
    assert_ne!(w.state().agents[0].last.map(|l| l.1), Some(Outcome::Success));
    assert!(w.state().agents[0].progress.is_stuck);
}
