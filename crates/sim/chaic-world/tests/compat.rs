//! Promise: each rule in which the original's code differs from the paper does what its line in
//! `docs/rules.md` says, and only that: every test flips one rule of the paper's set.

mod common;

use chaic_core::action::{Action, FailureReason, Hand, Outcome};
use chaic_core::capability::{Capability, Persona};
use chaic_core::observation::Grants;
use chaic_core::{ClassId, EntityId, ResolvedAction, TaskId};
use chaic_world::{Blocking, Durations, EventKind, JointLift, ReachTo, Rules, Setup, World};
use common::*;

const PAPER: Rules = Rules::paper();

fn with(rules: Rules, setup: Setup) -> World {
    World::new(setup, rules).expect("the test's setup is valid")
}

fn pick(object: EntityId) -> ResolvedAction {
    Action::PickUp { object, hand: Hand::Right }
}

fn put(place: EntityId) -> ResolvedAction {
    Action::PutOn { place, hand: Hand::Right }
}

fn z(w: &World) -> f32 {
    w.state().people[0].pose.position.z
}

const BLOCKED: Outcome = Outcome::Failure(FailureReason::Blocked);

#[test]
fn who_creeps_goes_on_through_a_wall_at_half_speed() {
    let setup = || {
        let mut setup = hall(vec![], vec![person(Persona::Adult, 0.0, 0.6)]);
        setup.walls = vec![wall([-5.0, 0.0], [5.0, 0.0])];
        setup
    };
    let mut solid = with(PAPER, setup());
    run(&mut solid, A, Action::MoveForward);
    assert_eq!(run(&mut solid, A, Action::MoveForward).0, BLOCKED);
    let mut w = with(Rules { blocking: Blocking::Creeps, ..PAPER }, setup());
    // The probe, 0.5 m ahead and 0.175 m deep, overlaps the wall of 0.12 m for five frames more.
    assert_eq!(run(&mut w, A, Action::MoveForward), (Outcome::Success, 3), "from standing");
    for _ in 0..4 {
        let before = z(&w);
        assert_eq!(run(&mut w, A, Action::MoveForward), (Outcome::Success, 2));
        assert!((before - z(&w) - 0.047).abs() < 1e-3, "one frame of two is walked");
    }
    for _ in 0..30 {
        run(&mut w, A, Action::MoveForward);
    }
    assert!(z(&w) < -0.5, "through the wall at {}", z(&w));
}

#[test]
fn who_creeps_does_not_even_meet_the_stalls_of_the_street() {
    let frames = |task, class| {
        let mut setup =
            hall(vec![thing(class, at(0.0, 0.0, -0.8))], vec![person(Persona::Adult, 0.0, 0.0)]);
        setup.things[1].fixed = true;
        setup.task = task;
        let mut w = with(Rules { blocking: Blocking::Creeps, ..PAPER }, setup);
        run(&mut w, A, Action::MoveForward).1
    };
    assert_eq!(frames(TaskId::Shopping, "wood_shelving"), 11);
    assert!(frames(TaskId::Shopping, "bench") < 11);
    assert!(frames(TaskId::NoConstraint, "dining_table") < 11);
}

#[test]
fn reaching_to_the_middle_heeds_no_walls_and_puts_from_anywhere() {
    let setup = || {
        let apple = thing("apple", at(0.0, 0.0, -0.6));
        let far = thing("dining_table", at(0.0, 0.0, 3.4));
        let mut setup = hall(vec![apple, far], vec![person(Persona::Adult, 0.0, 0.4)]);
        setup.walls = vec![wall([-5.0, -0.2], [5.0, -0.2]), wall([-5.0, 1.2], [5.0, 1.2])];
        setup
    };
    let unseen = Outcome::Failure(FailureReason::OutOfReach);
    assert_eq!(run(&mut with(PAPER, setup()), A, pick(nth(0))).0, unseen);
    let mut w = with(Rules { reach_to: ReachTo::Middle, ..PAPER }, setup());
    assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
    assert_eq!(run(&mut w, A, put(nth(1))).0, Outcome::Success, "over the other wall");
}

#[test]
fn furniture_may_be_reached_from_farther() {
    let outcome = |furniture_reach_limit_m| {
        let backpack = thing("backpack", at(0.0, 0.0, -2.0));
        let mut setup = hall(vec![backpack], vec![person(Persona::Helper, 0.0, 0.5)]);
        // The approach ends 0.2 m before the wall's face, 2.4 m from the backpack's middle.
        setup.walls = vec![wall([-5.0, 0.14], [5.0, 0.14])];
        let rules = Rules { furniture_reach_limit_m, reach_to: ReachTo::Middle, ..PAPER };
        run(&mut with(rules, setup), A, pick(nth(0))).0
    };
    assert_eq!(outcome(2.0), BLOCKED);
    assert_eq!(outcome(3.0), Outcome::Success);
}

/// Somebody who can't put anything on the bed tries to, with an apple in hand.
fn after_a_vain_put(rules: Rules) -> World {
    let apple = thing("apple", at(-6.0, 0.0, -7.0));
    let mut someone = person(Persona::Adult, -6.2, -7.2);
    someone.capability =
        Some(Capability { put_range_m: [2.9, 3.0], ..Persona::Adult.capability() });
    let mut setup = hall(vec![apple], vec![someone]);
    setup.goal.targets[0].1 = 2;
    let mut put_penalty = rules.put_penalty;
    put_penalty.alpha = 0.01;
    let mut w = with(Rules { put_penalty, ..rules }, setup);
    assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
    let (outcome, _) = run(&mut w, A, put(EntityId::FIRST_OBJECT));
    assert_eq!(outcome, Outcome::Failure(FailureReason::BeyondLimits));
    w
}

#[test]
fn what_falls_near_the_goal_after_a_vain_put_may_count() {
    assert!(after_a_vain_put(PAPER).delivered().is_empty());
    let w = after_a_vain_put(Rules { dropped_counts: true, ..PAPER });
    assert_eq!(w.delivered(), vec![nth(0)]);
}

#[test]
fn a_put_on_anywhere_delivers_only_by_a_rule_that_no_set_has() {
    let delivered = |rules| {
        let things =
            vec![thing("apple", at(0.0, 0.0, -0.5)), thing("dining_table", at(1.5, 0.0, 0.0))];
        let mut w = with(rules, hall(things, vec![person(Persona::Adult, 0.0, 0.0)]));
        assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
        assert_eq!(run(&mut w, A, put(nth(1))).0, Outcome::Success);
        w.delivered()
    };
    assert!(delivered(PAPER).is_empty() && delivered(Rules::compat()).is_empty());
    assert_eq!(delivered(Rules { delivered_anywhere: true, ..PAPER }), vec![nth(0)]);
}

#[test]
fn vases_are_wanted_but_nobody_may_go_for_them() {
    let vase = ClassId::named("vase");
    let offered = |rules| {
        let w = with(rules, hall(vec![], vec![person(Persona::Child, 0.0, 0.0)]));
        w.briefing(A, Grants::PARTNER, 0).possible_targets.contains(&vase)
    };
    assert!(offered(PAPER) && !offered(Rules { fragile_targets: false, ..PAPER }));
}

#[test]
fn vases_break_by_one_chance_within_a_childs_reach_and_by_another_above_it() {
    let breaks = |break_chance_low, break_chance_high, is_high: bool| {
        let cabinet = thing("cabinet", at(0.0, 0.0, -0.6));
        let y = if is_high { chaic_world::top_surfaces(&cabinet)[0].center.y } else { 0.0 };
        let things = if is_high {
            vec![thing("vase", at(0.0, y, -0.6)), cabinet]
        } else {
            vec![thing("vase", at(0.0, y, -0.6))]
        };
        let setup = hall(things, vec![person(Persona::Child, 0.0, 0.3)]);
        let mut w = with(Rules { break_chance_low, break_chance_high, ..PAPER }, setup);
        run(&mut w, A, pick(nth(0)));
        happened(&mut w, |e| matches!(e.kind, EventKind::Broke { .. }))
    };
    for (low, high) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0)] {
        assert_eq!([breaks(low, high, false), breaks(low, high, true)], [low > 0.5, high > 0.5]);
    }
}

#[test]
fn containers_are_of_no_use_beside_a_wheelchair() {
    let offered = |containers_with_wheelchair, persona| {
        let people = vec![person(persona, 0.0, 0.0), person(Persona::Helper, 2.0, 0.0)];
        let w = with(Rules { containers_with_wheelchair, ..PAPER }, hall(vec![], people));
        [A, B].map(|agent| !w.briefing(agent, Grants::NONE, 0).containers.is_empty())
    };
    assert_eq!(offered(true, Persona::Wheelchair), [true, true]);
    assert_eq!(offered(false, Persona::Wheelchair), [false, false]);
    assert_eq!(offered(false, Persona::Child), [true, true]);
}

#[test]
fn who_chose_the_same_piece_last_is_called_to_lift_it() {
    let played = |joint_lift| {
        let rules = Rules { joint_lift, durations: Rules::compat().durations, ..PAPER };
        let piano = thing("piano", at(0.0, 0.0, 0.0));
        let people = vec![person(Persona::Frail, 0.0, 1.5), person(Persona::Helper, 2.2, 2.2)];
        let mut w = with(rules, hall(vec![piano], people));
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        assert_eq!(run(&mut w, A, pick(nth(0))).0, failed, "too heavy for one");
        w.submit(B, pick(nth(0))).expect("it is free");
        let called = w.state().people[0].activity.is_some();
        for _ in 0..400 {
            w.tick();
        }
        (
            called,
            happened(&mut w, |e| matches!(e.kind, EventKind::LiftedTogether { leader: A, .. })),
        )
    };
    assert_eq!(played(JointLift::LastChoice), (true, true));
    assert_eq!(played(JointLift::BothAtIt), (false, false));
}

#[test]
fn one_who_stands_at_furniture_waits_for_the_other_as_long_as_the_rules_say() {
    let lifted = |await_partner| {
        let durations = Durations { await_partner, ..PAPER.durations };
        let piano = thing("piano", at(0.0, 0.0, 0.0));
        // The helper crawls 2 m: 200 frames and more.
        let mut people = vec![person(Persona::Frail, 0.0, 1.5), person(Persona::Helper, 2.2, 2.2)];
        let crawls = Persona::Helper.capability();
        people[1].capability = Some(Capability { approach_speed_m_per_frame: 0.01, ..crawls });
        let mut w = with(Rules { durations, ..PAPER }, hall(vec![piano], people));
        for agent in [A, B] {
            w.submit(agent, pick(nth(0))).expect("it is free");
        }
        for _ in 0..600 {
            w.tick();
        }
        happened(&mut w, |e| matches!(e.kind, EventKind::LiftedTogether { .. }))
    };
    assert!(!lifted(PAPER.durations.await_partner));
    assert!(lifted(Rules::compat().durations.await_partner));
}

#[test]
fn single_parts_take_the_original_frames() {
    let frames = |durations, class: &str, off_m: f32| {
        let object = thing(class, at(0.0, 0.0, -off_m));
        let setup = hall(vec![object], vec![person(Persona::Helper, 0.0, 0.0)]);
        run(&mut with(Rules { durations, ..PAPER }, setup), A, pick(nth(0))).1
    };
    let (ours, theirs): (Durations, Durations) = (PAPER.durations, Rules::compat().durations);
    // From afar a pick-up is refused: at once, or after bringing both arms back.
    let refused = Durations { refused_pick: theirs.refused_pick, ..ours };
    assert_eq!([frames(ours, "apple", 6.0), frames(refused, "apple", 6.0)], [1, 37]);
    // 18 frames less of bringing back arms that are full.
    let raised = Durations { raise_furniture: theirs.raise_furniture, ..ours };
    assert_eq!(frames(ours, "backpack", 0.8) - frames(raised, "backpack", 0.8), 18);
}

#[test]
fn removed_obstacles_are_told_to_everybody() {
    let told = |tells_removed| {
        let bin = thing("trashbin", at(0.0, 0.0, -0.8));
        let setup = hall(vec![bin], vec![person(Persona::Helper, 0.0, 0.0)]);
        let mut w = with(Rules { tells_removed, ..PAPER }, setup);
        assert!(w.told_removed().is_empty());
        let remove = Action::RemoveObstacle { obstacle: nth(0), hand: Hand::Right };
        assert_eq!(run(&mut w, A, remove).0, Outcome::Success);
        w.told_removed()
    };
    assert!(told(false).is_empty());
    assert_eq!(told(true), vec![nth(0)]);
}

#[test]
fn furniture_is_brought_to_the_truck_not_into_it() {
    let things = vec![thing("backpack", at(0.0, 0.0, -1.5)), thing("truck", at(0.0, 0.0, -6.3))];
    let mut setup = hall(things, vec![person(Persona::Frail, 0.0, 0.0)]);
    setup.goal_places = vec![nth(1)];
    setup.task = TaskId::MovingHouse;
    setup.goal.targets = vec![(ClassId::named("backpack"), 1)];
    let mut w = with(Rules::compat(), setup);
    assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
    // The longer half of the truck is some 3 m; 3 m to walk are about 65 frames.
    assert_eq!(run(&mut w, A, put(nth(1))).0, Outcome::Success);
    assert!(w.is_over() && w.state().frame < 290, "{}", w.state().frame);
    assert!(z(&w) > -5.8, "before the truck, at {}", z(&w));
}
