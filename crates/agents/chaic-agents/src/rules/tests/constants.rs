//! Constants of the planners: each case changes one and expects another decision.

use super::*;
use crate::decision::valid_plans;
use chaic_core::briefing::{Companion, CompanionRole};
use chaic_core::geom::Pose;
use chaic_core::{AgentId, Vec3};

#[test]
fn a_plan_is_reconsidered_after_the_time_in_the_rules() {
    for replan_interval_frames in [PAPER.time.replan_interval_frames, 80] {
        let time = TimeRules { replan_interval_frames, ..PAPER.time };
        let mut s = Scenario::new(PlannerRules { time, ..PAPER });
        let mut partner = RulePolicy::new(RuleProfile::PARTNER);
        s.evaluate_with(&mut partner, |rules, context| rules.decide(context, &s.valid));
        let chosen = s.memory.frame;
        let reconsidered = [replan_interval_frames - 1, replan_interval_frames].map(|after| {
            s.memory.frame = chosen + after;
            s.evaluate_with(&mut partner, |rules, c| rules.reconsiders(c, &Plan::Explore, false))
        });
        assert_eq!(reconsidered, [false, true]);
    }
}

#[test]
fn a_plan_ends_at_its_time_limit_and_its_object_is_ignored_for_a_while() {
    for (interact_frames, ignore_frames) in [(1000, 500), (200, 50)] {
        let rules = PlannerRules {
            plan_timeouts: PlanTimeouts { interact_frames, ..PAPER.plan_timeouts },
            failures: FailureRules { ignore_frames, ..PAPER.failures },
            ..PAPER
        };
        let mut s = Scenario::new(rules);
        let (memory, briefing, apple) = memory_of("apple", rules);
        (s.memory, s.briefing) = (memory, briefing);
        let plan = Plan::PickUp(subject("apple", apple.0));
        let mut executor = Executor::new(&s.briefing, &rules);
        executor.start_plan(0, &rules);
        s.memory.frame = interact_frames;
        assert!(matches!(s.continue_plan(&mut executor, plan), Progress::Act(_)));
        s.memory.frame = interact_frames + 1;
        assert_eq!(s.continue_plan(&mut executor, plan), Progress::Failed);
        let object = s.memory.objects.get(apple).expect("seen");
        assert_eq!(object.ignore_until, interact_frames + 1 + ignore_frames);
    }
}

#[test]
fn a_plan_ends_at_the_eighth_bump_in_a_row() {
    let mut s = Scenario::new(PAPER);
    let (memory, briefing, apple) = memory_of("apple", PAPER);
    (s.memory, s.briefing) = (memory, briefing);
    s.memory.refresh();
    s.memory.last = Some((Action::MoveForward, Outcome::Failure(FailureReason::Blocked)));
    let plan = Plan::PickUp(subject("apple", apple.0));
    let mut executor = Executor::new(&s.briefing, &PAPER);
    executor.start_plan(s.memory.frame, &PAPER);
    let n_bumps = (1..20).find(|_| s.continue_plan(&mut executor, plan) == Progress::Failed);
    assert_eq!(n_bumps, Some(8));
    assert!(!s.memory.objects.get(apple).expect("seen").is_available(s.memory.frame));
}

#[test]
fn impossible_or_held_objects_are_ignored_for_the_time_in_the_rules() {
    let failures = PAPER.failures;
    let shorter = FailureRules { impossible_frames: 100, ..failures };
    let longer = FailureRules { held_refusal_ignore_frames: 400, ..failures };
    for (failures, reason, from) in [
        (failures, FailureReason::Impossible, 2000),
        (shorter, FailureReason::Impossible, 100),
        (failures, FailureReason::HeldByOther, 300),
        (longer, FailureReason::HeldByOther, 400),
    ] {
        let (mut memory, briefing, apple) = memory_of("apple", PlannerRules { failures, ..PAPER });
        let action = Action::PickUp { object: apple, hand: Hand::Left };
        apply_outcome(&mut memory, &briefing, (action, Outcome::Failure(reason)), &[], &[]);
        let object = memory.objects.get(apple).expect("seen");
        assert!(object.is_available(from) && !object.is_available(from - 1), "{reason}");
    }
}

/// Creates a memory of partner and child at these positions along z, observed from the origin.
fn memory_with_people(rules: PlannerRules, partner_z: f32, child_z: f32) -> (Memory, Briefing) {
    let mut toy = Toy::room(10.0, 10.0);
    toy.add(ToyObject::new("piano", [0.0, 0.0, -3.0], [0.6, 1.0, 0.6]));
    toy.stand([0.0, 0.0], 0.0);
    let mut briefing = toy.briefing();
    briefing.companions.push(Companion { agent: AgentId::CHILD, role: CompanionRole::Child });
    let mut memory = Memory::new(&briefing, rules);
    let mut observation = toy.observe();
    let pose = |z: f32| Pose { position: Vec3::new(0.0, 0.0, z), yaw_rad: 0.0 };
    observation.granted.poses =
        vec![(AgentId::PARTNER, pose(partner_z)), (AgentId::CHILD, pose(child_z))];
    memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
    (memory, briefing)
}

#[test]
fn the_partner_is_at_a_piece_within_the_distance_in_the_rules() {
    for (partner_at_furniture_m, expected) in
        [(PAPER.lifting.partner_at_furniture_m, true), (0.5, false)]
    {
        let lifting = LiftingRules { partner_at_furniture_m, ..PAPER.lifting };
        // One meter from the near side of the piano.
        let (memory, briefing) = memory_with_people(PlannerRules { lifting, ..PAPER }, -1.7, -1.7);
        let plans = valid_plans(&memory, &briefing);
        assert_eq!(plans.iter().any(|p| matches!(p, Plan::LiftWith(_))), expected, "{plans:?}");
    }
}

#[test]
fn the_child_is_away_beyond_the_distance_in_the_rules() {
    let people = PAPER.people;
    let farther = PeopleRules { child_apart_in_view_m: 4.5, ..people };
    for (people, apart_m, expected) in
        [(people, 3.4, false), (people, 4.0, true), (farther, 4.0, false), (farther, 4.6, true)]
    {
        let (memory, briefing) =
            memory_with_people(PlannerRules { people, ..PAPER }, -1.0, -1.0 - apart_m);
        assert_eq!(memory.child_is_away(&briefing), expected, "{apart_m}");
    }
}
