//! The constants of the planners: each case sets one otherwise and finds another decision.

use super::*;
use crate::decision::valid_plans;
use chaic_core::briefing::{Companion, Relation};
use chaic_core::geom::Pose;
use chaic_core::{AgentId, Vec3};

#[test]
fn a_plan_is_looked_at_again_after_as_long_as_the_rules_say() {
    for reconsider_frames in [PAPER.time.reconsider_frames, 80] {
        let time = TimeRules { reconsider_frames, ..PAPER.time };
        let mut s = Situated::new(PlannerRules { time, ..PAPER });
        let mut partner = RulePolicy::new(RuleProfile::PARTNER);
        s.ask_of(&mut partner, |rules, context| rules.decide(context, &s.valid));
        let chosen = s.memory.frame;
        let looks = [reconsider_frames - 1, reconsider_frames].map(|after| {
            s.memory.frame = chosen + after;
            s.ask_of(&mut partner, |rules, c| rules.reconsiders(c, &Plan::Explore, false))
        });
        assert_eq!(looks, [false, true]);
    }
}

#[test]
fn a_plan_ends_at_its_limit_and_its_object_is_left_alone_for_a_while() {
    for (interact_frames, ignore_frames) in [(1000, 500), (200, 50)] {
        let rules = PlannerRules {
            limits: PlanLimits { interact_frames, ..PAPER.limits },
            failures: FailureRules { ignore_frames, ..PAPER.failures },
            ..PAPER
        };
        let mut s = Situated::new(rules);
        let (memory, briefing, apple) = memory_of("apple", rules);
        (s.memory, s.briefing) = (memory, briefing);
        let plan = Plan::PickUp(subject("apple", apple.0));
        let mut executor = Executor::new(&s.briefing);
        executor.begin(0, &rules);
        s.memory.frame = interact_frames;
        assert!(matches!(s.go_on(&mut executor, plan), Progress::Act(_)));
        s.memory.frame = interact_frames + 1;
        assert_eq!(s.go_on(&mut executor, plan), Progress::Failed);
        let thing = s.memory.things.get(apple).expect("seen");
        assert_eq!(thing.ignore_until, interact_frames + 1 + ignore_frames);
    }
}

#[test]
fn one_leaves_alone_what_is_impossible_or_held_for_as_long_as_the_rules_say() {
    let failures = PAPER.failures;
    let shorter = FailureRules { impossible_frames: 100, ..failures };
    let surer = FailureRules { held_for_sure_frames: 400, ..failures };
    for (failures, reason, from) in [
        (failures, FailureReason::Impossible, 2000),
        (shorter, FailureReason::Impossible, 100),
        (failures, FailureReason::HeldByOther, 300),
        (surer, FailureReason::HeldByOther, 400),
    ] {
        let (mut memory, briefing, apple) = memory_of("apple", PlannerRules { failures, ..PAPER });
        let action = Action::PickUp { object: apple, hand: Hand::Left };
        learn(&mut memory, &briefing, (action, Outcome::Failure(reason)), &[], &[]);
        let thing = memory.things.get(apple).expect("seen");
        assert!(thing.is_available(from) && !thing.is_available(from - 1), "{reason}");
    }
}

/// Partner and child at these places along z, seen by somebody at the origin.
fn among(rules: PlannerRules, partner_z: f32, child_z: f32) -> (Memory, Briefing) {
    let mut toy = Toy::room(10.0, 10.0);
    toy.add(ToyObject::new("piano", [0.0, 0.0, -3.0], [0.6, 1.0, 0.6]));
    toy.stand([0.0, 0.0], 0.0);
    let mut briefing = toy.briefing();
    briefing.companions.push(Companion { agent: AgentId::CHILD, relation: Relation::Child });
    let mut memory = Memory::new(&briefing, rules);
    let mut observation = toy.observe();
    let pose = |z: f32| Pose { position: Vec3::new(0.0, 0.0, z), yaw_rad: 0.0 };
    observation.granted.poses =
        vec![(AgentId::PARTNER, pose(partner_z)), (AgentId::CHILD, pose(child_z))];
    memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
    (memory, briefing)
}

#[test]
fn the_partner_stands_at_a_piece_within_the_reach_of_the_rules() {
    for (at_piece_m, expected) in [(PAPER.lifting.at_piece_m, true), (0.5, false)] {
        let lifting = LiftingRules { at_piece_m, ..PAPER.lifting };
        // One meter from the near side of the piano.
        let (memory, briefing) = among(PlannerRules { lifting, ..PAPER }, -1.7, -1.7);
        let plans = valid_plans(&memory, &briefing);
        assert_eq!(plans.iter().any(|p| matches!(p, Plan::LiftWith(_))), expected, "{plans:?}");
    }
}

#[test]
fn the_child_is_away_beyond_the_distance_of_the_rules() {
    let people = PAPER.people;
    let farther = PeopleRules { child_apart_in_view_m: 4.5, ..people };
    for (people, apart_m, expected) in
        [(people, 3.4, false), (people, 4.0, true), (farther, 4.0, false), (farther, 4.6, true)]
    {
        let (memory, briefing) = among(PlannerRules { people, ..PAPER }, -1.0, -1.0 - apart_m);
        assert_eq!(memory.child_is_away(&briefing), expected, "{apart_m}");
    }
}
