//! Promise: the world follows the rules of `docs/rules.md`. A slow interpreter of these rules
//! predicts every frame of random episodes. `docs/reliability.md` lists wrong rules that this test
//! has caught.

use std::sync::OnceLock;

use chaic_core::action::{FailureReason, Hand};
use chaic_core::capability::Persona;
use chaic_core::geom::{Pose, yaw_towards};
use chaic_core::{Action, AgentId, ClassId, TaskId, Vec3};
use chaic_episodes::{GeneratorSeeds, generate};
use chaic_reference::{Coverage, RuleSet, play_actions, play_many};
use chaic_world::{AgentSpec, ObjectSpec, Setup};

/// Number of joint actions. `docs/reliability.md` has the counts of a million.
const JOINT_ACTIONS: u64 = 80_000;
/// Smallest number of endings with each outcome.
const MIN_COUNT: u64 = 20;

/// Returns the counts of one run that all tests share.
fn coverage() -> &'static Coverage {
    static COVERAGE: OnceLock<Coverage> = OnceLock::new();
    COVERAGE.get_or_init(|| {
        play_many(0, JOINT_ACTIONS).unwrap_or_else(|difference| panic!("{difference}"))
    })
}

#[test]
fn the_world_follows_the_reference_in_every_frame() {
    assert!(coverage().n_joint_actions >= JOINT_ACTIONS);
}

#[test]
fn every_failure_reason_and_every_event_occurs() {
    let coverage = coverage();
    for reason in Coverage::REASONS {
        let n = coverage.n_failed(reason);
        assert!(n >= MIN_COUNT, "{reason:?} occurred {n} times\n{coverage}");
    }
    for event in Coverage::EVENTS {
        let n = coverage.events.get(event).copied().unwrap_or_default();
        assert!(n >= MIN_COUNT, "{event} occurred {n} times\n{coverage}");
    }
    for (action, reason) in [
        ("pick up", None),
        ("pick up", Some(FailureReason::Full)),
        ("put in", None),
        ("put in", Some(FailureReason::Full)),
        ("put on", None),
        ("put on", Some(FailureReason::BeyondLimits)),
        ("remove obstacle", None),
        ("remove obstacle", Some(FailureReason::BeyondLimits)),
        ("move forward", Some(FailureReason::Blocked)),
        ("turn left", Some(FailureReason::Blocked)),
        ("turn right", None),
        ("wait", None),
    ] {
        let n = coverage.ended.get(&(action, reason)).copied().unwrap_or_default();
        assert!(n > 0, "{action} never ended with {reason:?}\n{coverage}");
    }
}

#[test]
fn all_tasks_and_kinds_of_people_occur_under_both_rule_sets() {
    let coverage = coverage();
    for task in TaskId::paper() {
        for rules in ["paper", "compat"] {
            let name = format!("{task}, {rules}");
            assert!(coverage.tasks.contains_key(&name), "{name}\n{coverage}");
        }
    }
    let people = ["adult", "helper", "child", "wheelchair", "rider", "frail"];
    let impairments = ["one_handed", "low_vision", "tires", "tremor"];
    for name in people {
        assert!(coverage.people.contains_key(name), "{name}\n{coverage}");
    }
    for name in impairments {
        assert!(coverage.people.keys().any(|kind| kind.contains(name)), "{name}\n{coverage}");
    }
    let n_open = coverage.n_open as f64;
    assert!(n_open < 0.01 * coverage.n_frames as f64, "{n_open} conditions were not judged");
}

/// A chair between three adults; the third stands opposite the other two.
fn chair_with_three_people() -> Setup {
    let seeds = GeneratorSeeds { place: 0, episode: 0 };
    let mut setup = generate(TaskId::MovingHouse, seeds).expect("every seed has an episode");
    let at = Vec3::new(0.0, 0.0, 0.0);
    setup.things.retain(|t| t.fixed);
    let goal_place = setup.things.iter().position(|t| t.class.name() == "truck");
    setup.goal_places = vec![Setup::entity(goal_place.expect("a yard has a truck"))];
    setup.things.push(ObjectSpec::new(ClassId::named("navy_chair"), at, 0.0));
    let person = |x: f32, z: f32| {
        let position = Vec3::new(x, 0.0, z);
        let yaw_rad = yaw_towards(position, at);
        AgentSpec::new(Persona::Adult, Pose { position, yaw_rad }, 0)
    };
    setup.people = vec![person(-0.3, -0.9), person(0.3, -0.9), person(0.0, 0.9)];
    setup.horizon = 200;
    setup
}

/// Random actions reach this rarely.
#[test]
fn two_people_fail_to_lift_what_a_third_took_before() {
    let setup = chair_with_three_people();
    let object = Setup::entity(setup.things.len() - 1);
    let third = AgentId(2);
    let coverage = play_actions(&setup, RuleSet::Paper, |world, agent| {
        let is_first = world.state().agents[agent.index()].last.is_none();
        // The third has waited for the others by then, and closes its hands before them.
        let is_time = world.state().frame >= if agent == third { 0 } else { 10 };
        (is_first && is_time).then_some(Action::PickUp { object, hand: Hand::Right })
    });
    let coverage = coverage.unwrap_or_else(|difference| panic!("{difference}"));
    let n = |reason| coverage.ended.get(&("pick up", reason)).copied();
    assert_eq!(n(None), Some(1), "{coverage}");
    assert_eq!(n(Some(FailureReason::HeldByOther)), Some(2), "{coverage}");
}
