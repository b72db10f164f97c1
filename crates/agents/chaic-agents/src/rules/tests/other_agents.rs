//! Rules about other agents: the partner, the child, and the objects they hold.

use super::*;
use crate::helpers::HelperInfo;
use crate::partners::partner_grants;
use crate::test_support::identity;
use chaic_core::briefing::{Companion, CompanionRole};
use chaic_core::geom::Pose;
use chaic_core::observation::JointCarrier;
use chaic_core::{AgentId, Frame, Vec2, Vec3};

fn pose(x: f32, z: f32) -> Pose {
    Pose { position: Vec3::new(x, 0.0, z), yaw_rad: 0.0 }
}

#[test]
fn an_object_in_a_persons_hands_is_unavailable_or_available() {
    for sees_held_objects in [true, false] {
        let mut toy = Toy::room(8.0, 8.0);
        let apple = toy.add(ToyObject::new("apple", [0.0, 1.0, -2.5], [0.2, 0.2, 0.2]));
        toy.stand([0.0, 0.0], 0.0);
        let briefing = toy.briefing();
        let mut memory = Memory::new(&briefing, PlannerRules { sees_held_objects, ..PAPER });
        let mut observation = toy.observe();
        observation.granted.poses = vec![(AgentId::PARTNER, pose(0.0, -2.9))];
        memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
        let object = memory.objects.get(apple).expect("seen");
        assert_eq!(object.is_available(toy.frame), !sees_held_objects);
    }
}

#[test]
fn held_objects_are_granted_to_all_helpers_or_to_the_oracle_only() {
    for knows_partner_behavior in [false, true] {
        let rules = PlannerRules { knows_partner_behavior, ..PAPER };
        assert_eq!(partner_grants(rules).behavior, knows_partner_behavior);
        let grants =
            |name: &str| (HelperInfo::find_helper(name).expect("it is built in").grants)(rules);
        for helper in ["random", "rhp", "follow"] {
            assert_eq!(grants(helper).behavior, knows_partner_behavior, "{helper}");
        }
        assert!(grants("oracle").behavior);
    }
}

#[test]
fn objects_granted_as_held_are_avoided_for_the_time_in_the_rules() {
    for seen_held_ignore_frames in
        [PAPER.seen_held_ignore_frames, PlannerRules::compat().seen_held_ignore_frames]
    {
        let rules = PlannerRules { seen_held_ignore_frames, ..PAPER };
        let (mut memory, briefing, apple) = memory_of("apple", rules);
        let mut observation = Toy::room(8.0, 8.0).observe();
        observation.images = Default::default();
        observation.frame = 10;
        observation.granted.partner_hands =
            Some([Some(identity("apple", apple.0 as u16, &[])), None]);
        memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
        let object = memory.objects.get(apple).expect("seen");
        let until = 10 + seen_held_ignore_frames;
        assert!(!object.is_available(until - 1) && object.is_available(until));
    }
}

#[test]
fn lifting_together_is_planned_or_not() {
    let piano = Plan::LiftWith(subject("piano", 30));
    for (lifts_together, expected) in [(true, piano), (false, Plan::Explore)] {
        let mut s = Scenario::new(PlannerRules { lifts_together, ..PAPER });
        s.valid.push(piano);
        assert_eq!(s.choose_as(RuleProfile::RHP), expected);
    }
}

#[test]
fn an_obstacle_that_blocks_nobody_is_left_alone_or_removed() {
    for (wall_ends_m, is_passage) in [(0.6, true), (3.9, false)] {
        let mut toy = Toy::room(8.0, 8.0);
        toy.size = 256;
        toy.add_wall([-4.0, -2.1], [-wall_ends_m, -1.9]);
        toy.add_wall([wall_ends_m, -2.1], [4.0, -1.9]);
        let bin = toy.add(ToyObject::new("trashbin", [0.0, 0.0, -2.0], [0.4, 0.6, 0.4]));
        toy.stand([0.0, 1.0], 0.0);
        let remove = Plan::RemoveObstacle(subject("trashbin", bin.0));
        for (obstacle_choice, is_removed) in
            [(ObstacleChoice::All, true), (ObstacleChoice::InPassages, is_passage)]
        {
            let mut s = Scenario::new(PlannerRules { obstacle_choice, ..PAPER });
            s.briefing.bounds = toy.bounds();
            s.memory = Memory::new(&s.briefing, s.memory.rules);
            let observation = toy.observe();
            s.memory.update(&s.briefing, &observation, &GroundTruthIds.perceive(&observation));
            s.valid.push(remove);
            let chosen = s.choose_as(RuleProfile::RHP);
            assert_eq!(chosen == remove, is_removed, "{wall_ends_m} {obstacle_choice:?}");
        }
    }
}

/// Creates a situation of a helper that takes care of a child and its guardian.
fn child_scenario(rules: PlannerRules) -> Scenario {
    let mut s = Scenario::new(rules);
    s.briefing.companions.push(Companion { agent: AgentId::CHILD, role: CompanionRole::Child });
    s
}

/// Observes guardian and child far from each other; the child is beside the helper.
fn observe_both(s: &mut Scenario, frame: Frame) {
    observe_apart(s, frame, 9.5);
}

/// Observes guardian and child at this distance from each other; the child is beside the helper.
fn observe_apart(s: &mut Scenario, frame: Frame, apart_m: f32) {
    observe_poses(s, frame, pose(0.0, apart_m - 1.5), pose(0.0, -1.5));
}

/// Observes guardian and child in these poses; the helper is at the origin.
fn observe_poses(s: &mut Scenario, frame: Frame, guardian: Pose, child: Pose) {
    let mut observation = Toy::room(4.0, 4.0).observe();
    observation.images = Default::default();
    observation.frame = frame;
    observation.granted.poses = vec![(AgentId::PARTNER, guardian), (AgentId::CHILD, child)];
    s.memory.update(&s.briefing, &observation, &GroundTruthIds.perceive(&observation));
}

#[test]
fn a_child_unseen_for_long_is_searched_for() {
    for child_unseen_frames in
        [PAPER.child_unseen_frames, PlannerRules::compat().child_unseen_frames]
    {
        let mut s = child_scenario(PlannerRules { child_unseen_frames, ..PAPER });
        let chosen = [0, 1].map(|late| {
            s.memory.frame = child_unseen_frames + late;
            s.choose_as(RuleProfile::RHP)
        });
        assert_eq!(chosen, [Plan::Explore, Plan::TurnAround]);
    }
}

#[test]
fn a_child_beside_the_helper_is_trusted_to_come_back_or_not() {
    for (leaves_returning_child, expected) in [(true, Plan::Explore), (false, Plan::FollowChild)] {
        let mut s = child_scenario(PlannerRules {
            leaves_returning_child,
            initial_look_around: false,
            ..PAPER
        });
        let mut rhp = RulePolicy::new(RuleProfile::RHP);
        let chosen = [100, 140].map(|frame| {
            observe_both(&mut s, frame);
            s.evaluate_with(&mut rhp, |rules, context| rules.decide(context, &s.valid))
        });
        assert_eq!(chosen, [Plan::FollowChild, expected]);
    }
}

#[test]
fn the_helper_stays_with_the_child_briefly_or_as_long_as_it_is_there() {
    for leaves_returning_child in [true, false] {
        let mut s = child_scenario(PlannerRules { leaves_returning_child, ..PAPER });
        let mut executor = Executor::new(&s.briefing, &s.memory.rules);
        observe_both(&mut s, 100);
        let first = s.start_plan(&mut executor, Plan::FollowChild);
        assert!(matches!(first, Progress::Act(_)), "{first:?}");
        observe_both(&mut s, 140);
        let then = s.continue_plan(&mut executor, Plan::FollowChild);
        assert_eq!(then == Progress::Done, leaves_returning_child, "{then:?}");
        assert_eq!(matches!(then, Progress::Act(_)), !leaves_returning_child, "{then:?}");
    }
}

#[test]
fn the_helper_leaves_after_the_time_beside_the_child_counted_from_its_arrival() {
    let mut s = child_scenario(PlannerRules { initial_look_around: false, ..PAPER });
    let mut rhp = RulePolicy::new(RuleProfile::RHP);
    let decide = |rules: &mut RulePolicy, context: &Context<'_>| rules.decide(context, &[]);
    observe_poses(&mut s, 100, pose(0.0, 8.0), pose(0.0, -6.0));
    assert_eq!(s.evaluate_with(&mut rhp, decide), Plan::FollowChild);
    // It arrives while the plan is executed.
    observe_both(&mut s, 200);
    s.evaluate_with(&mut rhp, |rules, context| {
        assert!(!rules.reconsiders(context, &Plan::FollowChild, true));
    });
    observe_both(&mut s, 231);
    assert_eq!(s.evaluate_with(&mut rhp, decide), Plan::Explore);
}

#[test]
fn the_time_beside_the_child_starts_again_when_the_child_has_moved_away() {
    // It has just left the distance to keep at 2.1 m, and is away at 2.8 m.
    for (child_m, is_done) in [(2.1, true), (2.8, false)] {
        let mut s = child_scenario(PAPER);
        let mut executor = Executor::new(&s.briefing, &s.memory.rules);
        let guardian = pose(0.0, 8.0);
        observe_poses(&mut s, 100, guardian, pose(0.0, -1.5));
        let mut progress = s.start_plan(&mut executor, Plan::FollowChild);
        for (frame, z) in [(120, -child_m), (140, -1.5)] {
            assert!(matches!(progress, Progress::Act(_)), "{frame}: {progress:?}");
            observe_poses(&mut s, frame, guardian, pose(0.0, z));
            progress = s.continue_plan(&mut executor, Plan::FollowChild);
        }
        assert_eq!(progress == Progress::Done, is_done, "{child_m} m: {progress:?}");
        if !is_done {
            observe_poses(&mut s, 171, guardian, pose(0.0, -1.5));
            let end = s.continue_plan(&mut executor, Plan::FollowChild);
            assert_eq!(end, Progress::Done, "31 frames after 140");
        }
    }
}

#[test]
fn a_child_that_comes_into_view_restarts_the_time_limit_before_it_is_checked() {
    let mut s = child_scenario(PAPER);
    let mut executor = Executor::new(&s.briefing, &s.memory.rules);
    observe_apart(&mut s, 100, 9.5);
    executor.start_plan(100, &s.memory.rules);
    let late = 100 + s.memory.rules.plan_timeouts.follow_child_frames + 1;
    observe_apart(&mut s, late, 9.5);
    let progress = s.continue_plan(&mut executor, Plan::FollowChild);
    assert!(matches!(progress, Progress::Act(_)), "{progress:?}");
}

#[test]
fn without_trust_the_helper_leaves_the_child_some_time_after_it_was_last_away() {
    let mut s = child_scenario(PlannerRules { leaves_returning_child: false, ..PAPER });
    let mut executor = Executor::new(&s.briefing, &s.memory.rules);
    let mut at = |frame, apart_m| {
        observe_apart(&mut s, frame, apart_m);
        match frame {
            100 => s.start_plan(&mut executor, Plan::FollowChild),
            _ => s.continue_plan(&mut executor, Plan::FollowChild),
        }
    };
    for (frame, apart_m) in [(100, 9.5), (390, 9.5), (400, 1.0), (690, 1.0)] {
        let progress = at(frame, apart_m);
        assert!(matches!(progress, Progress::Act(_)), "{frame}: {progress:?}");
    }
    assert_eq!(at(691, 1.0), Progress::Failed, "300 frames after 390");
}

#[test]
fn looking_around_ends_when_both_are_found_or_continues() {
    for (look_around_stops_when_found, n) in [(false, PAPER.look_around_turns), (true, 0)] {
        let mut s = child_scenario(PlannerRules { look_around_stops_when_found, ..PAPER });
        observe_both(&mut s, 100);
        assert_eq!(s.n_turns_around(), n);
    }
}

#[test]
fn only_helpers_that_care_for_the_child_follow_it_when_it_is_away() {
    for (supervises_child, expected) in [(true, Plan::FollowChild), (false, Plan::Explore)] {
        let mut s =
            child_scenario(PlannerRules { supervises_child, initial_look_around: false, ..PAPER });
        observe_both(&mut s, 100);
        assert_eq!(s.choose_as(RuleProfile::RHP), expected);
        // The partner's rules ignore the child in any case.
        assert_eq!(s.choose_as(RuleProfile::PARTNER), Plan::Explore);
    }
}

#[test]
fn the_other_carrier_is_not_an_obstacle_for_the_leader() {
    for walking in [Walking::Careful, Walking::Lattice] {
        let cost_there = |leads: bool| {
            let mut s = Scenario::new(PlannerRules { walking, ..PAPER });
            let mut observation = Toy::room(4.0, 4.0).observe();
            observation.images = Default::default();
            observation.granted.poses = vec![(AgentId::PARTNER, pose(0.0, -1.2))];
            observation.proprioception.other_end = leads.then_some(JointCarrier {
                agent: AgentId::PARTNER,
                position_in_body: Vec3::new(0.0, 0.0, -1.2),
            });
            s.memory.update(&s.briefing, &observation, &GroundTruthIds.perceive(&observation));
            s.memory.refresh();
            let cell = s.memory.map.grid().cell_at(Vec2::new(0.0, -1.2)).expect("inside");
            s.memory.costs().cost(cell)
        };
        assert!(cost_there(false) > cost_there(true), "{walking:?}");
    }
}
