use chaic_core::Vec2;

use super::*;
use crate::team::tests::{line, plane, random_problem};
use Operation::{Deliver, PickUp, Remove, TakeContainer};
use PlaceKind::{Container, Goal, Obstacle, Target};

const SHORT: SearchSettings = SearchSettings { n_evaluations: 300, ..SearchSettings::DEFAULT };

/// Returns a random sequence of valid operations.
fn random_sequence(problem: &TeamProblem, rng: &mut RngStream) -> Vec<Operation> {
    let mut all = Search::new(problem).single;
    all.push(Deliver);
    rng.shuffle(&mut all);
    all.truncate(1 + rng.below(all.len()));
    all
}

#[test]
fn the_result_is_never_worse_than_any_candidate_or_the_greedy_sequences() {
    let mut rng = RngStream::new(7, "team search", 0);
    for case in 0..50 {
        let problem = random_problem(&mut rng);
        let candidates: Vec<_> = (0..3).map(|_| random_sequence(&problem, &mut rng)).collect();
        let plan = search_operations(&problem, &candidates, SHORT, &mut rng);
        let value = simulate(&problem, &plan.operations);
        assert!(value >= plan.value, "{case}: useless operations do not lower the value");
        let greedy = [(false, false), (false, true), (true, false), (true, true)]
            .map(|(uses_containers, removes)| greedy(&problem, uses_containers, removes));
        for other in greedy.iter().chain(&candidates).chain([&Vec::new()]) {
            let limit = simulate(&problem, other);
            assert!(value >= limit, "{case}: {value} < {limit} of {other:?}");
        }
    }
}

/// Returns the highest value of all sequences of these targets, with and without deliveries between
/// them, that begin with `start`.
fn brute_force(problem: &TeamProblem, start: &[Operation], targets: &[usize]) -> f32 {
    let mut best = simulate(problem, start);
    for (k, target) in targets.iter().enumerate() {
        let mut rest = targets.to_vec();
        rest.remove(k);
        for end in [&[PickUp(*target)][..], &[PickUp(*target), Deliver]] {
            best = best.max(brute_force(problem, &[start, end].concat(), &rest));
        }
    }
    best
}

#[test]
fn the_best_of_all_sequences_of_three_targets_is_found() {
    let mut rng = RngStream::new(8, "team search", 0);
    let mut n_beyond_greedy = 0;
    for case in 0..10 {
        let mut at = || Vec2::new(rng.range(-15.0, 15.0), rng.range(-15.0, 15.0));
        let (helper, partner) = (at(), at());
        let places = [Target, Target, Target, Goal, Goal].map(|kind| (kind, at()));
        let problem = plane(helper, (case % 2 == 0).then_some(partner), &places);
        let optimum = brute_force(&problem, &[], &[0, 1, 2]);
        let plan = search_operations(&problem, &[], SearchSettings::DEFAULT, &mut rng);
        let value = simulate(&problem, &plan.operations);
        assert!((value - optimum).abs() < 1e-5, "{case}: {value} instead of {optimum}");
        let greedy = simulate(&problem, &greedy(&problem, false, false));
        n_beyond_greedy += usize::from(optimum > greedy + 1e-3);
    }
    assert!(n_beyond_greedy >= 3, "the problems are too easy: {n_beyond_greedy}");
}

#[test]
fn an_operation_is_inserted_at_the_first_of_the_best_positions() {
    let mut rng = RngStream::new(10, "team search", 0);
    for case in 0..60 {
        let problem = random_problem(&mut rng);
        let operations = random_sequence(&problem, &mut rng);
        let mut search = Search::new(&problem);
        let new = rng.choose(&search.single).copied().unwrap_or(Deliver);
        let mut expected: Option<TeamPlan> = None;
        for at in 0..=operations.len() {
            let mut with_new = operations.clone();
            with_new.insert(at, new);
            let value = simulate(&problem, &with_new);
            if expected.as_ref().is_none_or(|best| value > best.value) {
                expected = Some(TeamPlan { operations: with_new, value });
            }
        }
        assert_eq!(Some(search.insert_best(&operations, new)), expected, "{case}");
        assert_eq!(search.n_evaluations, operations.len() + 1, "{case}");
    }
}

#[test]
fn the_same_seed_gives_the_same_plan() {
    let problem = random_problem(&mut RngStream::new(9, "team search", 0));
    let [a, b] = [0, 1].map(|_| {
        let mut rng = RngStream::new(3, "team search", 1);
        let plan = search_operations(&problem, &[], SHORT, &mut rng);
        (plan, rng.seed())
    });
    assert_eq!(a, b);
}

#[test]
fn operations_without_effect_are_removed_and_useful_ones_stay() {
    let places = [(Target, 5.0), (Target, -20.0), (Goal, 0.0), (Target, 6.0), (Container, 1.0)];
    let mut problem = line(0.0, None, &places);
    problem.places[3].class_index = Some(1);
    let clean = |operations: &[Operation]| {
        let cleaned = Search::new(&problem).without_useless(operations.to_vec());
        assert!(simulate(&problem, &cleaned) >= simulate(&problem, operations));
        cleaned
    };
    // Nothing to deliver yet; the last delivery needs no operation.
    assert_eq!(clean(&[Deliver, PickUp(0), Deliver, Deliver]), [PickUp(0)]);
    // Nobody wants the object at place 3.
    assert_eq!(clean(&[PickUp(0), PickUp(3)]), [PickUp(0)]);
    assert_eq!(clean(&[PickUp(0), PickUp(0)]), [PickUp(0)]);
    assert_eq!(clean(&[TakeContainer(4), PickUp(0)]), [PickUp(0)]);
    // With the delivery on the way, the first object arrives at frame 286 instead of 764.
    let useful = [PickUp(0), Deliver, PickUp(1)];
    assert_eq!(clean(&useful), useful);
    assert!(clean(&[]).is_empty());
}

#[test]
fn the_greedy_sequence_follows_the_published_order() {
    let places = [
        (Target, 5.0),
        (Target, 3.0),
        (Target, 9.0),
        (Goal, 0.0),
        (Container, 2.0),
        (Obstacle, 7.0),
    ];
    let mut problem = line(0.0, None, &places);
    let by_hand = [PickUp(1), PickUp(0), Deliver, PickUp(2)];
    assert_eq!(greedy(&problem, false, false), by_hand);
    assert_eq!(greedy(&problem, false, true), [&[Remove(5)][..], &by_hand].concat());
    let with_container = [TakeContainer(4), PickUp(1), PickUp(0), PickUp(2)];
    assert_eq!(greedy(&problem, true, false), with_container);
    problem.helper.carries_containers = false;
    assert_eq!(greedy(&problem, true, false), by_hand);
    assert!(greedy(&line(0.0, None, &[]), true, true).is_empty());
}

#[test]
fn an_empty_problem_has_an_empty_plan() {
    for partner in [None, Some(0.0)] {
        let mut problem = line(0.0, partner, &[]);
        problem.hypotheses.clear();
        let plan =
            search_operations(&problem, &[], SHORT, &mut RngStream::new(1, "team search", 2));
        assert_eq!(plan, TeamPlan { operations: Vec::new(), value: 0.0 });
    }
}
