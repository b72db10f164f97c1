//! Promise: each rule in which the original's code differs from the paper has the effect that
//! `docs/rules.md` states, and no other. Every test flips one rule of the paper's set.

use crate::common::*;
use chaic_core::action::{Action, FailureReason, Hand, Outcome};
use chaic_core::capability::{Capability, Persona};
use chaic_core::observation::Grants;
use chaic_core::{ClassId, EntityId, ResolvedAction, TaskId};
use chaic_world::{
    CollisionResponse, Durations, EventKind, JointLift, ReachReference, Rules, Setup, World,
};

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
    w.state().agents[0].pose.position.z
}

const BLOCKED: Outcome = Outcome::Failure(FailureReason::Blocked);

#[test]
fn compat_has_the_rules_of_the_original_and_no_other_differences() {
    let (paper, mut rules) = (Rules::paper(), Rules::compat());
    let d = rules.durations;
    // Facts S9.4, S9.3, S2.2 and S1.4.
    assert_eq!(
        [d.await_partner, d.raise_furniture, d.refused_pick_up, d.failed_grasp],
        [3000, 17, 37, 0]
    );
    assert_eq!(
        (rules.blocking, rules.reach_to),
        (CollisionResponse::Creeps, ReachReference::Middle)
    );
    assert_eq!((rules.joint_lift, rules.furniture_reach_limit_m), (JointLift::LastChoice, 3.0));
    assert!(
        rules.announces_removed_obstacles
            && rules.failed_put_on_can_deliver
            && rules.put_on_delivers_all_released
    );
    assert!(!rules.containers_with_wheelchair && !rules.fragile_targets);
    assert_eq!([rules.break_chance_low, rules.break_chance_high], [0.0, 0.0]);
    rules.durations.await_partner = paper.durations.await_partner;
    rules.durations.raise_furniture = paper.durations.raise_furniture;
    rules.durations.refused_pick_up = paper.durations.refused_pick_up;
    rules.durations.failed_grasp = paper.durations.failed_grasp;
    let without = Rules {
        blocking: paper.blocking,
        reach_to: paper.reach_to,
        joint_lift: paper.joint_lift,
        furniture_reach_limit_m: paper.furniture_reach_limit_m,
        announces_removed_obstacles: paper.announces_removed_obstacles,
        failed_put_on_can_deliver: paper.failed_put_on_can_deliver,
        put_on_delivers_all_released: paper.put_on_delivers_all_released,
        containers_with_wheelchair: paper.containers_with_wheelchair,
        fragile_targets: paper.fragile_targets,
        break_chance_low: paper.break_chance_low,
        break_chance_high: paper.break_chance_high,
        ..rules
    };
    assert_eq!(without, paper);
}

#[test]
fn creeping_agents_pass_through_walls_at_half_speed() {
    let setup = || {
        let mut setup = hall(vec![], vec![person(Persona::Adult, 0.0, 0.6)]);
        setup.walls = vec![wall([-5.0, 0.0], [5.0, 0.0])];
        setup
    };
    let mut solid = with(PAPER, setup());
    run(&mut solid, A, Action::MoveForward);
    assert_eq!(run(&mut solid, A, Action::MoveForward).0, BLOCKED);
    let mut w = with(Rules { blocking: CollisionResponse::Creeps, ..PAPER }, setup());
    // The probe, 0.5 m ahead and 0.175 m deep, overlaps the wall of 0.12 m for five more frames.
    assert_eq!(run(&mut w, A, Action::MoveForward), (Outcome::Success, 3), "from standing");
    for _ in 0..4 {
        let before = z(&w);
        assert_eq!(run(&mut w, A, Action::MoveForward), (Outcome::Success, 2));
        assert!((before - z(&w) - 0.047).abs() < 1e-3, "the agent moves in one of two frames");
    }
    for _ in 0..30 {
        run(&mut w, A, Action::MoveForward);
    }
    assert!(z(&w) < -0.5, "through the wall at {}", z(&w));
}

#[test]
fn creeping_agents_ignore_street_stalls() {
    let frames = |task, class| {
        let mut setup =
            hall(vec![thing(class, at(0.0, 0.0, -0.8))], vec![person(Persona::Adult, 0.0, 0.0)]);
        setup.things[1].fixed = true;
        setup.task = task;
        let mut w = with(Rules { blocking: CollisionResponse::Creeps, ..PAPER }, setup);
        run(&mut w, A, Action::MoveForward).1
    };
    assert_eq!(frames(TaskId::Shopping, "wood_shelving"), 11);
    assert!(frames(TaskId::Shopping, "bench") < 11);
    assert!(frames(TaskId::NoConstraint, "dining_table") < 11);
}

#[test]
fn reach_to_the_middle_ignores_walls_and_put_distance() {
    let setup = || {
        let apple = thing("apple", at(0.0, 0.0, -0.6));
        let far = thing("dining_table", at(0.0, 0.0, 3.4));
        let mut setup = hall(vec![apple, far], vec![person(Persona::Adult, 0.0, 0.4)]);
        setup.walls = vec![wall([-5.0, -0.2], [5.0, -0.2]), wall([-5.0, 1.2], [5.0, 1.2])];
        setup
    };
    let out_of_reach = Outcome::Failure(FailureReason::OutOfReach);
    assert_eq!(run(&mut with(PAPER, setup()), A, pick(nth(0))).0, out_of_reach);
    let mut w = with(Rules { reach_to: ReachReference::Middle, ..PAPER }, setup());
    assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
    assert_eq!(run(&mut w, A, put(nth(1))).0, Outcome::Success, "over the other wall");
}

#[test]
fn furniture_has_its_own_reach_limit() {
    let outcome = |furniture_reach_limit_m| {
        let backpack = thing("backpack", at(0.0, 0.0, -2.0));
        let mut setup = hall(vec![backpack], vec![person(Persona::Helper, 0.0, 0.5)]);
        // The approach ends 0.2 m before the wall's face, 2.4 m from the center of the backpack.
        setup.walls = vec![wall([-5.0, 0.14], [5.0, 0.14])];
        let rules = Rules { furniture_reach_limit_m, reach_to: ReachReference::Middle, ..PAPER };
        run(&mut with(rules, setup), A, pick(nth(0))).0
    };
    assert_eq!(outcome(2.0), BLOCKED);
    assert_eq!(outcome(3.0), Outcome::Success);
}

/// Runs a put-on of an apple on the bed by a person who cannot reach the top of the bed.
fn after_a_failed_put(rules: Rules) -> World {
    let apple = thing("apple", at(-6.0, 0.0, -7.0));
    let mut adult = person(Persona::Adult, -6.2, -7.2);
    adult.capability = Some(Capability { put_range_m: [2.9, 3.0], ..Persona::Adult.capability() });
    let mut setup = hall(vec![apple], vec![adult]);
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
fn a_drop_near_the_goal_after_a_failed_put_on_can_deliver() {
    assert!(after_a_failed_put(PAPER).delivered().is_empty());
    let w = after_a_failed_put(Rules { failed_put_on_can_deliver: true, ..PAPER });
    assert_eq!(w.delivered(), vec![nth(0)]);
}

#[test]
fn a_put_on_anywhere_delivers_only_under_its_rule() {
    let delivered = |rules| {
        let things =
            vec![thing("apple", at(0.0, 0.0, -0.5)), thing("dining_table", at(1.5, 0.0, 0.0))];
        let mut w = with(rules, hall(things, vec![person(Persona::Adult, 0.0, 0.0)]));
        assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
        assert_eq!(run(&mut w, A, put(nth(1))).0, Outcome::Success);
        w.delivered()
    };
    assert!(delivered(PAPER).is_empty());
    assert_eq!(delivered(Rules { put_on_delivers_all_released: true, ..PAPER }), vec![nth(0)]);
    assert_eq!(delivered(Rules::compat()), vec![nth(0)]);
}

#[test]
fn a_put_on_delivers_what_still_falls_under_its_rule() {
    let things = vec![
        thing("bike", at(-0.45, 0.0, 0.0)),
        thing("dining_table", at(1.5, 0.0, 0.0)),
        thing("apple", at(0.0, 0.0, -0.6)),
    ];
    let mut setup = hall(things, vec![person(Persona::Rider, 0.0, 0.0)]);
    setup.goal.targets[0].1 = 2;
    let mut w = with(Rules { put_on_delivers_all_released: true, ..PAPER }, setup);
    assert_eq!(run(&mut w, A, pick(nth(2))).0, Outcome::Success);
    assert_eq!(run(&mut w, A, put(nth(1))).0, Outcome::Success);
    let is_resting = |w: &World| w.state().objects[3].is_resting();
    assert!(!is_resting(&w), "a rider does not watch the fall");
    assert_eq!(w.delivered(), vec![nth(2)]);
    for _ in 0..240 {
        w.tick();
    }
    assert!(is_resting(&w));
}

#[test]
fn a_failed_put_on_delivers_with_a_successful_one_under_its_rule() {
    // Attempts with the left and the right hand, each at a table within or above the reach.
    let delivered = |succeed: [bool; 2], put_on_delivers_all_released| {
        let tables = [(1.2, 0.0), (-1.2, 2.0)].map(|(x, bottom)| {
            let mut table = thing("dining_table", at(x, bottom, 0.0));
            table.fixed = true;
            table
        });
        let mut things =
            vec![thing("apple", at(0.0, 0.0, -0.5)), thing("apple", at(0.2, 0.0, -0.5))];
        things.extend(tables);
        let mut adult = person(Persona::Adult, 0.0, 0.0);
        adult.capability =
            Some(Capability { put_range_m: [0.0, 1.5], ..Persona::Adult.capability() });
        let mut setup = hall(things, vec![adult]);
        setup.goal.targets[0].1 = 3;
        let mut put_penalty = PAPER.put_penalty;
        put_penalty.alpha = 0.01;
        let mut w = with(Rules { put_penalty, put_on_delivers_all_released, ..PAPER }, setup);
        for (hand, object) in [(Hand::Left, nth(0)), (Hand::Right, nth(1))] {
            assert_eq!(run(&mut w, A, Action::PickUp { object, hand }).0, Outcome::Success);
        }
        for (hand, succeeds) in [Hand::Left, Hand::Right].into_iter().zip(succeed) {
            let place = if succeeds { nth(2) } else { nth(3) };
            let (outcome, _) = run(&mut w, A, Action::PutOn { place, hand });
            assert_eq!(outcome.is_success(), succeeds, "{outcome:?}");
        }
        w.delivered()
    };
    let both = vec![nth(0), nth(1)];
    assert_eq!(delivered([false, true], true), both, "what fell before");
    assert_eq!(delivered([true, false], true), both, "what falls next");
    assert_eq!(delivered([false, false], true), vec![]);
    assert_eq!(delivered([true, true], false), vec![]);
}

#[test]
fn fragile_objects_are_possible_targets_only_under_fragile_targets() {
    let vase = ClassId::named("vase");
    let is_listed = |rules| {
        let w = with(rules, hall(vec![], vec![person(Persona::Child, 0.0, 0.0)]));
        w.briefing(A, Grants::PARTNER, 0).possible_targets.contains(&vase)
    };
    assert!(is_listed(PAPER) && !is_listed(Rules { fragile_targets: false, ..PAPER }));
}

#[test]
fn break_chances_differ_within_and_above_a_childs_reach() {
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
        has_event(&mut w, |e| matches!(e.kind, EventKind::Broke { .. }))
    };
    for (low, high) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0)] {
        assert_eq!([breaks(low, high, false), breaks(low, high, true)], [low > 0.5, high > 0.5]);
    }
}

#[test]
fn containers_are_not_listed_with_a_wheelchair_user() {
    let is_listed = |containers_with_wheelchair, persona| {
        let people = vec![person(persona, 0.0, 0.0), person(Persona::Helper, 2.0, 0.0)];
        let w = with(Rules { containers_with_wheelchair, ..PAPER }, hall(vec![], people));
        [A, B].map(|agent| !w.briefing(agent, Grants::NONE, 0).containers.is_empty())
    };
    assert_eq!(is_listed(true, Persona::Wheelchair), [true, true]);
    assert_eq!(is_listed(false, Persona::Wheelchair), [false, false]);
    assert_eq!(is_listed(false, Persona::Child), [true, true]);
}

#[test]
fn under_last_choice_the_other_agent_is_called_to_lift() {
    let called_and_lifted = |joint_lift| {
        let rules = Rules { joint_lift, durations: Rules::compat().durations, ..PAPER };
        let piano = thing("piano", at(0.0, 0.0, 0.0));
        let people = vec![person(Persona::Frail, 0.0, 1.5), person(Persona::Helper, 2.2, 2.2)];
        let mut w = with(rules, hall(vec![piano], people));
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        assert_eq!(run(&mut w, A, pick(nth(0))).0, failed, "too heavy for one");
        w.submit(B, pick(nth(0))).expect("the agent waits");
        let called = w.state().agents[0].activity.is_some();
        for _ in 0..400 {
            w.tick();
        }
        (
            called,
            has_event(&mut w, |e| matches!(e.kind, EventKind::LiftedTogether { leader: A, .. })),
        )
    };
    assert_eq!(called_and_lifted(JointLift::LastChoice), (true, true));
    assert_eq!(called_and_lifted(JointLift::BothAtIt), (false, false));
}

#[test]
fn the_wait_for_a_lifting_partner_is_limited_by_await_partner() {
    let lifted = |await_partner| {
        let durations = Durations { await_partner, ..PAPER.durations };
        let piano = thing("piano", at(0.0, 0.0, 0.0));
        // The helper moves 2 m slowly: at least 200 frames.
        let mut people = vec![person(Persona::Frail, 0.0, 1.5), person(Persona::Helper, 2.2, 2.2)];
        let capability = Persona::Helper.capability();
        people[1].capability = Some(Capability { approach_speed_m_per_frame: 0.01, ..capability });
        let mut w = with(Rules { durations, ..PAPER }, hall(vec![piano], people));
        for agent in [A, B] {
            w.submit(agent, pick(nth(0))).expect("the agent waits");
        }
        for _ in 0..600 {
            w.tick();
        }
        has_event(&mut w, |e| matches!(e.kind, EventKind::LiftedTogether { .. }))
    };
    assert!(!lifted(PAPER.durations.await_partner));
    assert!(lifted(Rules::compat().durations.await_partner));
}

#[test]
fn refused_pick_and_raise_furniture_take_the_original_frames() {
    let frames = |durations, class: &str, off_m: f32| {
        let object = thing(class, at(0.0, 0.0, -off_m));
        let setup = hall(vec![object], vec![person(Persona::Helper, 0.0, 0.0)]);
        run(&mut with(Rules { durations, ..PAPER }, setup), A, pick(nth(0))).1
    };
    let (ours, theirs) = (PAPER.durations, Rules::compat().durations);
    // A distant pick-up is refused at once, or after the return of both arms.
    let refused = Durations { refused_pick_up: theirs.refused_pick_up, ..ours };
    assert_eq!([frames(ours, "apple", 6.0), frames(refused, "apple", 6.0)], [1, 37]);
    // Returning full arms takes 18 frames less.
    let raised = Durations { raise_furniture: theirs.raise_furniture, ..ours };
    assert_eq!(frames(ours, "backpack", 0.8) - frames(raised, "backpack", 0.8), 18);
}

#[test]
fn removed_obstacles_are_announced_under_their_rule() {
    let announced = |announces_removed_obstacles| {
        let bin = thing("trashbin", at(0.0, 0.0, -0.8));
        let setup = hall(vec![bin], vec![person(Persona::Helper, 0.0, 0.0)]);
        let mut w = with(Rules { announces_removed_obstacles, ..PAPER }, setup);
        assert!(w.announced_obstacles().is_empty());
        let remove = Action::RemoveObstacle { obstacle: nth(0), hand: Hand::Right };
        assert_eq!(run(&mut w, A, remove).0, Outcome::Success);
        w.announced_obstacles()
    };
    assert!(announced(false).is_empty());
    assert_eq!(announced(true), vec![nth(0)]);
}

#[test]
fn furniture_is_delivered_from_beside_the_truck() {
    let things = vec![thing("backpack", at(0.0, 0.0, -1.5)), thing("truck", at(0.0, 0.0, -6.3))];
    let mut setup = hall(things, vec![person(Persona::Frail, 0.0, 0.0)]);
    setup.goal_places = vec![nth(1)];
    setup.task = TaskId::MovingHouse;
    setup.goal.targets = vec![(ClassId::named("backpack"), 1)];
    let mut w = with(Rules::compat(), setup);
    assert_eq!(run(&mut w, A, pick(nth(0))).0, Outcome::Success);
    // Half of the truck's longer side is about 3 m; 3 m of walking take about 65 frames.
    assert_eq!(run(&mut w, A, put(nth(1))).0, Outcome::Success);
    assert!(w.is_over() && w.state().frame < 290, "{}", w.state().frame);
    assert!(z(&w) > -5.8, "in front of the truck, at {}", z(&w));
}
