//! Timelines worked out by hand. All persons walk 10 frames per meter.

use super::*;
use crate::team::problem::GoalHypothesis;
use crate::team::tests::line;
use Operation::{Deliver, PickUp, Remove, TakeContainer};
use PlaceKind::{Container, Goal, Obstacle, Target};

fn deliveries(problem: &TeamProblem, operations: &[Operation]) -> Vec<Delivery> {
    let events = super::timeline(problem, operations, 0).into_iter();
    let delivery = |event| match event {
        SimulatedEvent::Delivery(delivery) => Some(delivery),
        SimulatedEvent::Arrival { .. } => None,
    };
    events.filter_map(delivery).collect()
}

/// Returns the deliveries under the first hypothesis: frame, rounded, and whether by the helper.
fn timeline(problem: &TeamProblem, operations: &[Operation]) -> Vec<(u32, bool)> {
    let all = deliveries(problem, operations);
    all.iter().map(|d| (d.frames.round() as u32, d.by_helper)).collect()
}

fn assert_near(value: f32, expected: f32) {
    assert!((value - expected).abs() < 1e-3, "{value} instead of {expected}");
}

#[test]
fn one_object_takes_two_walks_a_pick_up_and_a_put_on() {
    let mut problem = line(0.0, None, &[(Target, 5.0), (Goal, 0.0)]);
    // 50 there, 78 to pick up, 50 back, 108 to put on.
    assert_eq!(timeline(&problem, &[PickUp(0)]), [(286, true)]);
    let delivered = 1.0 + 0.5 * (2000.0 - 286.0) / 2000.0;
    assert_near(simulate(&problem, &[PickUp(0)]), delivered - 0.002);
    assert_eq!(simulate(&problem, &[]), 0.0);
    problem.hypotheses = vec![
        GoalHypothesis { probability: 0.25, missing: vec![1.0, 0.0] },
        GoalHypothesis { probability: 0.75, missing: vec![0.0, 1.0] },
    ];
    assert_near(simulate(&problem, &[PickUp(0)]), 0.25 * delivered - 0.002);
    // Half an object that is still missing counts half.
    problem.hypotheses = vec![GoalHypothesis { probability: 1.0, missing: vec![0.5, 0.0] }];
    assert_near(simulate(&problem, &[PickUp(0)]), 0.5 * delivered - 0.002);
}

#[test]
fn a_third_object_needs_a_second_trip() {
    let problem = line(0.0, None, &[(Target, 5.0), (Target, 10.0), (Target, 2.0), (Goal, 0.0)]);
    // 50 + 78, 50 + 78, 100 back, 108 for each hand; then 20 + 78 + 20 + 108.
    let expected = [(464, true), (572, true), (798, true)];
    assert_eq!(timeline(&problem, &[PickUp(0), PickUp(1), PickUp(2)]), expected);
    let with_delivery = [PickUp(0), PickUp(1), Deliver, PickUp(2)];
    assert_eq!(timeline(&problem, &with_delivery), expected);
}

#[test]
fn objects_beyond_the_goal_do_not_count() {
    let mut problem = line(0.0, None, &[(Target, 5.0), (Target, 10.0), (Goal, 0.0)]);
    problem.hypotheses[0].missing = vec![1.0, 0.0];
    let all = deliveries(&problem, &[PickUp(0), PickUp(1)]);
    assert_eq!(all.iter().map(|d| d.count).collect::<Vec<f32>>(), [1.0, 0.0]);
}

#[test]
fn a_container_brings_four_objects_in_one_trip() {
    let fruit = [(Target, 3.0), (Target, 4.0), (Target, 5.0), (Target, 6.0)];
    let places: Vec<_> = fruit.into_iter().chain([(Container, 2.0), (Goal, 0.0)]).collect();
    let operations = [TakeContainer(4), PickUp(0), PickUp(1), PickUp(2), PickUp(3)];
    // Container 20 + 78, four objects 10 + 78 each, of which three are put in at 96 each, then 60
    // back. The container is put down first.
    let helper = line(0.0, None, &places);
    let expected = |by| [(906, by), (906, by), (906, by), (1014, by)];
    assert_eq!(timeline(&helper, &operations), expected(true));
    assert_eq!(timeline(&line(50.0, Some(0.0), &places), &[]), expected(false));
    // Without the container: two trips.
    let by_hand = timeline(&helper, &operations[1..]);
    // 30 + 78, 10 + 78, 40 back; then 50 + 78, 10 + 78, 60 back.
    assert_eq!(by_hand, [(344, true), (452, true), (836, true), (944, true)]);
}

#[test]
fn the_partner_fetches_no_container_for_two_objects_or_after_half_the_time() {
    let places = [(Target, 3.0), (Target, 4.0), (Container, 2.0), (Goal, 0.0)];
    let mut problem = line(50.0, Some(0.0), &places);
    problem.hypotheses[0].missing = vec![2.0, 0.0];
    // 30 + 78, 10 + 78, 40 back.
    let by_hand = [(344, false), (452, false)];
    assert_eq!(timeline(&problem, &[]), by_hand);
    problem.hypotheses[0].missing = vec![3.0, 0.0];
    assert_ne!(timeline(&problem, &[]), by_hand);
    problem.horizon = 2.0 * problem.frames_left;
    assert_eq!(timeline(&problem, &[]), by_hand);
}

#[test]
fn the_first_at_an_object_gets_it_and_the_other_loses_only_the_walk() {
    // The partner arrives at the first object at 40, the helper at 50. The helper walks on to the
    // second one: 40 + 78, then 10 + 108.
    let problem = line(0.0, Some(9.0), &[(Target, 5.0), (Target, 1.0), (Goal, 0.0)]);
    assert_eq!(timeline(&problem, &[PickUp(0), PickUp(1)]), [(276, false), (286, true)]);
    // The helper arrives at 40, the partner at 50. The partner's second way: 110 + 78, 160 + 108.
    let problem = line(1.0, Some(10.0), &[(Target, 5.0), (Target, 16.0), (Goal, 0.0)]);
    let by_both = [(276, true), (506, false)];
    assert_eq!(timeline(&problem, &[PickUp(0)]), by_both);
    assert_eq!(timeline(&problem, &[PickUp(0), PickUp(0)]), by_both, "it is gone");
}

#[test]
fn an_object_that_the_partner_has_not_seen_takes_it_longer() {
    let mut problem = line(50.0, Some(5.0), &[(Target, 10.0), (Goal, 0.0)]);
    assert_eq!(timeline(&problem, &[]), [(336, false)]);
    problem.places[0].is_known_to_partner = false;
    // 1.8 times 50 frames on the way there.
    assert_eq!(timeline(&problem, &[]), [(376, false)]);
}

#[test]
fn a_partner_who_cannot_reach_an_object_gives_it_up_after_one_attempt() {
    let mut problem = line(50.0, Some(4.0), &[(Target, 5.0), (Target, 7.0), (Goal, 0.0)]);
    for chance in [1.0, 0.61] {
        problem.places[0].partner_chance = chance;
        // 10 + 78, 20 + 78, 70 + 108, 108.
        assert_eq!(timeline(&problem, &[]), [(364, false), (472, false)]);
    }
    problem.places[0].partner_chance = 0.59;
    assert_eq!(timeline(&problem, &[]), [(364, false)]);
    // The helper still gets it: 450 + 78 + 50 + 108.
    assert_eq!(timeline(&problem, &[PickUp(0)]), [(364, false), (686, true)]);
}

#[test]
fn deliveries_to_a_place_that_the_partner_hardly_reaches_count_in_part() {
    let mut problem = line(50.0, Some(4.0), &[(Target, 5.0), (Goal, 0.0)]);
    problem.places[1].partner_chance = 0.4;
    assert_near(deliveries(&problem, &[])[0].count, 0.4);
    assert_near(deliveries(&problem, &[PickUp(0)])[0].count, 0.4);
    let helper = line(4.0, None, &[(Target, 5.0), (Goal, 0.0)]);
    assert_near(deliveries(&helper, &[PickUp(0)])[0].count, 1.0);
}

#[test]
fn a_blocked_partner_delivers_only_if_the_helper_removes_the_obstacle() {
    let places = [(Target, 5.0), (Goal, 0.0), (Obstacle, 3.0)];
    let mut problem = line(2.0, Some(0.0), &places);
    assert_eq!(timeline(&problem, &[]), [(286, false)], "it steps over obstacles");
    if let Some(partner) = &mut problem.partner {
        partner.is_blocked = true;
    }
    assert!(timeline(&problem, &[]).is_empty());
    let opened = timeline(&problem, &[Remove(2)]);
    assert_eq!(opened.len(), 1);
    assert!(!opened[0].1 && opened[0].0 >= 286 + 20, "it waits: {opened:?}");
    assert!(simulate(&problem, &[Remove(2)]) > 1.0);
    // The same behind the obstacle, on the way back.
    if let Some(partner) = &mut problem.partner {
        partner.loose = vec![0];
    }
    problem.path_m[4] = vec![9.0, 8.0, 5.0];
    problem.obstacles_on_path[4] = vec![0, 4, 0];
    problem.places.iter_mut().for_each(|p| p.class_index = p.class_index.map(|_| 1));
    assert!(timeline(&problem, &[]).is_empty());
    assert_eq!(timeline(&problem, &[Remove(2)]).len(), 1);
}

#[test]
fn removal_takes_time_and_a_free_hand() {
    let places = [(Target, 5.0), (Goal, 0.0), (Obstacle, 3.0)];
    let mut problem = line(0.0, None, &places);
    // 30 + 160, then 20 + 78 and 50 + 108. A second removal of the same obstacle is nothing.
    assert_eq!(timeline(&problem, &[Remove(2), PickUp(0)]), [(446, true)]);
    assert_eq!(timeline(&problem, &[Remove(2), Remove(2), PickUp(0)]), [(446, true)]);
    // Full hands are emptied first: 0 + 108 + 108.
    problem.helper.loose = vec![0, 0];
    let expected = [(108, true), (216, true), (662, true)];
    assert_eq!(timeline(&problem, &[Remove(2), PickUp(0)]), expected);
}

#[test]
fn nothing_counts_after_the_deadline() {
    let mut problem = line(0.0, None, &[(Target, 5.0), (Target, 10.0), (Goal, 0.0)]);
    problem.frames_left = 286.0;
    assert_near(simulate(&problem, &[PickUp(0)]), 1.0 - 0.002);
    problem.frames_left = 285.0;
    assert_near(simulate(&problem, &[PickUp(0)]), -0.002);
    // The first hand is in time, the second is not.
    problem.frames_left = 500.0;
    assert_eq!(timeline(&problem, &[PickUp(0), PickUp(1)]), [(464, true)]);
    // A pick-up that ends too late is not begun.
    problem.frames_left = 290.0;
    problem.path_m[3][1] = 25.0;
    assert_eq!(timeline(&problem, &[PickUp(1), PickUp(0)]), [(286, true)]);
    let mut partner = line(50.0, Some(0.0), &[(Target, 5.0), (Goal, 0.0)]);
    assert_eq!(timeline(&partner, &[]), [(286, false)]);
    partner.frames_left = 285.0;
    assert!(timeline(&partner, &[]).is_empty());
}

#[test]
fn a_rider_docks_and_empties_its_basket_faster() {
    let mut problem = line(50.0, Some(0.0), &[(Target, 5.0), (Goal, 0.0)]);
    if let Some(partner) = &mut problem.partner {
        (partner.docking_frames, partner.n_loose) = (15.0, 3);
    }
    // 50 + 15 + 78, then 50 + 15 + 54.
    assert_eq!(timeline(&problem, &[]), [(262, false)]);
}

#[test]
fn an_empty_problem_has_no_value() {
    for partner in [None, Some(0.0)] {
        let mut problem = line(0.0, partner, &[]);
        assert_eq!(simulate(&problem, &[]), 0.0);
        assert_near(simulate(&problem, &[Deliver]), -0.002);
        // Objects in hand cannot be delivered without a goal place.
        problem.helper.loose = vec![0];
        assert_eq!(simulate(&problem, &[]), 0.0);
        problem.hypotheses.clear();
        assert_eq!(simulate(&problem, &[]), 0.0);
        assert!(deliveries(&problem, &[]).is_empty());
    }
    let mut unreachable = line(0.0, Some(0.0), &[(Target, 5.0), (Goal, 0.0)]);
    unreachable.path_m.iter_mut().flatten().for_each(|m| *m = NO_PATH_M);
    assert!(timeline(&unreachable, &[PickUp(0)]).is_empty());
    unreachable.frames_left = 0.0;
    assert!(timeline(&unreachable, &[PickUp(0)]).is_empty());
}
