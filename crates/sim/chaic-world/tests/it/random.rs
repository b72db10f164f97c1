//! Promise: chances follow the formula of the paper, with the factors of two limits multiplied.
//! Random draws and limits change outcomes but not durations.

use crate::common::*;
use chaic_core::ResolvedAction;
use chaic_core::action::{Action, FailureReason, Hand, Outcome};
use chaic_core::capability::{Capability, Persona};
use chaic_world::{Durations, ObjectLocation, Rules, Setup, Snapshot, World};

fn pick(k: usize) -> ResolvedAction {
    Action::PickUp { object: nth(k), hand: Hand::Right }
}

/// Tries the same action `n` times from the same state, each time with the agent's next draw.
/// Returns the number of successes.
fn count_successes(setup: Setup, rules: Rules, action: ResolvedAction, n: u32) -> u32 {
    let mut w = World::new(setup, rules).expect("the test's setup is valid");
    let mut state = w.state().clone();
    let mut n_successes = 0;
    for draw in 0..n {
        state.agents[0].draws.takes = draw;
        let bytes = postcard::to_stdvec(&state).expect("a state is plain data");
        w.restore(&Snapshot(bytes)).expect("the snapshot is of this world");
        n_successes += u32::from(run(&mut w, A, action).0.is_success());
    }
    n_successes
}

/// A chair of 120 kg in front of a person with this strength, whose pick range ends `below_top_m`
/// below its top.
fn at_a_chair(strength_kg: f32, below_top_m: f32) -> Setup {
    let chair = thing("navy_chair", at(0.0, 0.0, -0.8));
    let limits = Capability {
        strength_kg,
        pick_range_m: [0.0, chair.size_m().y - below_top_m],
        ..Persona::Adult.capability()
    };
    let mut setup = hall(vec![chair], vec![person(Persona::Adult, 0.0, 0.3)]);
    setup.people[0].capability = Some(limits);
    setup
}

#[test]
fn two_exceeded_limits_multiply_their_chances() {
    // Shortest possible durations, because only the draws are measured.
    let durations = Durations {
        reach: 1,
        grasp: 1,
        reset_arms: 1,
        raise_furniture: 1,
        ..Rules::paper().durations
    };
    let rules = Rules { durations, ..Rules::paper() };
    for (strength_kg, below_top_m, expected, draws) in [
        // Height alone: exp(-0.4) / 2.
        (120.0, 0.4, 0.335_160, 10_000),
        // Mass alone: exp(-20 / 50).
        (100.0, 0.0, 0.670_320, 10_000),
        // Both: the product.
        (100.0, 0.4, 0.224_664, 100_000),
        // exp(-0.25) / 2 * exp(-60 / 50).
        (60.0, 0.25, 0.117_286, 10_000),
    ] {
        let n_successes =
            count_successes(at_a_chair(strength_kg, below_top_m), rules, pick(0), draws);
        let (rate, n) = (f64::from(n_successes) / f64::from(draws), f64::from(draws));
        // Four standard errors.
        let margin = 4.0 * (expected * (1.0 - expected) / n).sqrt();
        assert!(
            (rate - expected).abs() < margin,
            "{strength_kg} kg, {below_top_m} m: {rate}, expected {expected} within {margin}"
        );
    }
}

#[test]
fn a_failed_pick_up_takes_as_long_as_a_successful_one_or_two_frames_less_under_compat() {
    for (rules, shorter) in [(Rules::paper(), 0), (Rules::compat(), 2)] {
        let frames = |success: bool| {
            (0..100).find_map(|seed| {
                let apple = thing("apple", at(0.0, 0.0, -0.6));
                let mut setup = hall(vec![apple], vec![person(Persona::Wheelchair, 0.0, 0.0)]);
                setup.seed = seed;
                let mut w = World::new(setup, rules).expect("the test's setup is valid");
                let (outcome, n) = run(&mut w, A, pick(0));
                (outcome.is_success() == success).then_some(n)
            })
        };
        let [succeeded, failed] = [true, false].map(|s| frames(s).expect("both happen at 0.43"));
        assert_eq!(succeeded, 57 + 1, "57 and one frame that finds it within reach");
        assert_eq!(failed, succeeded - shorter);
    }
}

#[test]
fn a_put_in_takes_80_to_104_frames() {
    let frames: Vec<u32> = (0..200)
        .map(|seed| {
            let things =
                vec![thing("wood_basket", at(0.0, 0.0, -0.6)), thing("apple", at(0.3, 0.0, 0.4))];
            let mut setup = hall(things, vec![person(Persona::Adult, 0.0, 0.0)]);
            setup.seed = seed;
            let mut w = world(setup);
            let left = Action::PickUp { object: nth(0), hand: Hand::Left };
            assert_eq!(run(&mut w, A, left).0, Outcome::Success);
            assert_eq!(run(&mut w, A, pick(1)).0, Outcome::Success);
            let (outcome, frames) = run(&mut w, A, Action::PutIn);
            assert_eq!(outcome, Outcome::Success);
            assert_eq!(
                w.state().objects[2].location,
                ObjectLocation::Inside { container: nth(0), slot: 0 }
            );
            frames
        })
        .collect();
    assert_eq!(frames.iter().min(), Some(&80));
    assert_eq!(frames.iter().max(), Some(&104));
    let mean = f64::from(frames.iter().sum::<u32>()) / frames.len() as f64;
    assert!((mean - 92.0).abs() < 2.2, "{mean}: four standard errors from the mean");
}

/// Runs a put-on by a rider with two apples in the basket at a cabinet that is 0.5 m too high.
/// Returns the outcome and the world.
fn rider_at_a_cabinet(seed: u64) -> (Outcome, World) {
    let cabinet = thing("cabinet", at(0.0, 0.0, -2.0));
    let top = cabinet.size_m().y;
    let mut things = vec![thing("bike", at(-0.45, 0.0, 0.0)), cabinet];
    things.extend([-0.2, 0.2].map(|x| thing("apple", at(x, 0.0, -0.6))));
    let mut setup = hall(things, vec![person(Persona::Rider, 0.0, 0.0)]);
    setup.goal_places = vec![nth(1)];
    setup.goal.targets[0].1 = 2;
    setup.seed = seed;
    setup.people[0].capability =
        Some(Capability { put_range_m: [0.0, top - 0.5], ..Persona::Rider.capability() });
    let mut w = world(setup);
    for k in [2, 3] {
        assert_eq!(run(&mut w, A, pick(k)).0, Outcome::Success);
    }
    let put = Action::PutOn { place: nth(1), hand: Hand::Right };
    let outcome = run(&mut w, A, put).0;
    for _ in 0..60 {
        w.tick();
    }
    (outcome, w)
}

#[test]
fn a_riders_put_on_has_the_same_chance_as_any_put_on() {
    let mut failed = 0;
    for seed in 0..60 {
        let (outcome, w) = rider_at_a_cabinet(seed);
        let [first, second] = [&w.state().objects[3], &w.state().objects[4]];
        if outcome.is_success() {
            assert_eq!(w.delivered(), vec![nth(2), nth(3)]);
            continue;
        }
        failed += 1;
        assert_eq!(outcome, Outcome::Failure(FailureReason::BeyondLimits));
        assert!(w.delivered().is_empty());
        assert!(first.is_resting() && first.position.y < 0.05, "the first dropped to the floor");
        assert_eq!(second.location, ObjectLocation::Inside { container: nth(0), slot: 1 });
    }
    // 0.5 m too high: exp(-0.5) = 0.61 succeed.
    assert!((9..38).contains(&failed), "{failed} of 60 failed");
}

#[test]
fn an_agent_that_cannot_remove_obstacles_is_refused_with_a_reason() {
    let people = vec![person(Persona::Wheelchair, 0.0, 1.0), person(Persona::Helper, 1.0, 0.5)];
    let mut w = world(hall(vec![thing("trashbin", at(0.3, 0.0, 0.0))], people));
    let remove = Action::RemoveObstacle { obstacle: nth(0), hand: Hand::Right };
    let refused = Outcome::Failure(FailureReason::BeyondLimits);
    assert_eq!(run(&mut w, A, remove).0, refused);
    assert_eq!(run(&mut w, A, pick(0)).0, refused, "a pick-up is refused too");
    assert!(w.state().objects[1].is_resting());
    assert_eq!(run(&mut w, B, remove).0, Outcome::Success);
}
