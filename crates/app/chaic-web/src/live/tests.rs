//! Promises: a person's episode verifies; a plan or an action has an effect; a branch continues the
//! trace that it was taken from.

use chaic_episodes::find_episode;

use chaic_env::continue_with;
use chaic_env::helper_registry::built_in_partner;
use chaic_env::rules::RuleSet;

use super::*;
use crate::player::tests::verified;

fn episode() -> Vec<u8> {
    let mut setup = find_episode("low_target/test/00").unwrap().into_setup();
    setup.horizon = 900;
    Episode::new("low_target/test/00", "short", None, setup).unwrap().to_json().into_bytes()
}

fn config(seat: AgentId, level: InputLevel, helper: &str) -> LiveConfig {
    LiveConfig { seed: 0, seat, level, helper: helper.to_owned(), is_live: false }
}

/// Selects the first plan.
fn choose_first(session: &mut LiveSession) -> bool {
    let plans = session.state().plans;
    plans.first().is_some_and(|plan| session.choose_plan(plan))
}

/// Plays to the end; each decision selects the first plan.
fn play(session: &mut LiveSession) {
    for _ in 0..10_000 {
        match session.advance(7).unwrap() {
            LiveStatus::Running => {}
            LiveStatus::Waiting => assert!(choose_first(session)),
            LiveStatus::Ended => return,
        }
    }
    panic!("the episode does not end");
}

#[test]
fn an_episode_of_plans_verifies_in_each_seat() {
    let episode = episode();
    for (seat, helper) in
        [(AgentId::HELPER, "none"), (AgentId::PARTNER, "rhp"), (AgentId::PARTNER, "none")]
    {
        let config = config(seat, InputLevel::Plans, helper);
        let mut session = LiveSession::start(&episode, &config, &BuiltInHelpers).unwrap();
        let info = session.info();
        assert_eq!(
            info.goal.is_empty(),
            seat == AgentId::HELPER,
            "only the partner knows the goal"
        );
        if seat == AgentId::HELPER {
            assert_eq!((info.person.as_str(), session.state().progress), ("helper", None));
        }
        play(&mut session);
        assert!(session.state().progress.is_some(), "the end tells the result");
        let player = verified(session.trace(), &episode).unwrap();
        let replay = player.info();
        assert_eq!((replay.n_verified, &replay.problem), (replay.n_decisions, &None));
        assert!(replay.decisions.iter().filter(|line| line.agent == seat).count() > 20);
        let names = [replay.helper.as_str(), PERSON];
        assert_eq!(names[0] == names[1], seat == AgentId::HELPER);
    }
}

#[test]
fn an_episode_that_is_stopped_verifies_up_to_its_last_decision() {
    let episode = episode();
    let config = config(AgentId::HELPER, InputLevel::Plans, "none");
    let mut session = LiveSession::start(&episode, &config, &BuiltInHelpers).unwrap();
    for _ in 0..40 {
        if session.advance(7).unwrap() == LiveStatus::Waiting {
            choose_first(&mut session);
        }
    }
    let player = verified(session.trace(), &episode).unwrap();
    assert_eq!(player.info().n_verified, player.info().n_decisions);
}

#[test]
fn the_parts_of_a_trace_join_to_the_whole() {
    let config = config(AgentId::HELPER, InputLevel::Plans, "none");
    let mut session = LiveSession::start(&episode(), &config, &BuiltInHelpers).unwrap();
    let (mut joined, mut n_lines, mut n_parts) = (String::new(), 0, 0);
    for _ in 0..40 {
        if session.advance(7).unwrap() == LiveStatus::Waiting {
            choose_first(&mut session);
        }
        let added = session.trace_after(n_lines);
        n_parts += usize::from(!added.is_empty());
        joined += &added;
        n_lines = session.n_lines();
        assert_eq!(session.trace_after(n_lines), "");
    }
    assert_eq!(joined, session.trace());
    assert!(n_parts > 2, "{n_parts}");
}

#[test]
fn a_person_who_decides_nothing_stops_the_world() {
    let config = config(AgentId::HELPER, InputLevel::Plans, "none");
    let mut session = LiveSession::start(&episode(), &config, &BuiltInHelpers).unwrap();
    assert_eq!(session.advance(500).unwrap(), LiveStatus::Waiting);
    let state = session.state();
    assert_eq!((state.frame, state.plans.is_empty()), (0, false));
    assert_eq!(session.advance(500).unwrap(), LiveStatus::Waiting);
    assert_eq!(session.state().frame, 0);
    assert!(!session.choose_plan("fly") && session.state().is_refused);
    assert!(choose_first(&mut session) && !session.state().is_refused);
    assert!(!session.choose_plan(&state.plans[0]), "it acts already");
    session.advance(40).unwrap();
    assert!(session.state().frame > 0);
}

#[test]
fn a_live_world_goes_on_while_the_person_chooses() {
    let episode = episode();
    let helper = config(AgentId::HELPER, InputLevel::Plans, "none");
    let mut session = LiveSession::start(
        &episode,
        &LiveConfig { is_live: true, ..helper.clone() },
        &BuiltInHelpers,
    )
    .unwrap();
    assert_eq!(session.advance(60).unwrap(), LiveStatus::Waiting);
    let state = session.state();
    assert_eq!((state.frame, state.plans.is_empty()), (60, false));
    let pose = |session: &LiveSession| session.env.world().state().agents[1].pose;
    let before = pose(&session);
    assert!(session.choose_plan(&state.plans[0]));
    session.advance(60).unwrap();
    let after = pose(&session);
    assert!(before.position != after.position || before.yaw_rad != after.yaw_rad, "{state:?}");
    let mut steps = LiveSession::start(
        &episode,
        &LiveConfig { is_live: true, level: InputLevel::Steps, ..helper },
        &BuiltInHelpers,
    )
    .unwrap();
    assert_eq!(steps.advance(31).unwrap(), LiveStatus::Waiting);
    assert!(steps.act(Action::TurnLeft) && !steps.act(Action::TurnLeft));
    steps.advance(30).unwrap();
    for session in [&session, &steps] {
        let trace = session.trace();
        assert!(trace.contains("\"is_live\":true"));
        let player = verified(&trace, &episode).unwrap();
        assert_eq!(player.info().n_verified, player.info().n_decisions);
    }
    assert!(steps.trace().contains("\"turn_left\""));
}

#[test]
fn steps_move_the_person_and_name_objects_by_pixel() {
    let config = config(AgentId::PARTNER, InputLevel::Steps, "none");
    let mut session = LiveSession::start(&episode(), &config, &BuiltInHelpers).unwrap();
    let pose = |session: &LiveSession| session.env.world().state().agents[0].pose;
    let before = pose(&session);
    for action in [Action::TurnLeft, Action::MoveForward, Action::Wait { frames: 3 }] {
        assert!(!session.act(action), "nothing is asked yet");
        while session.advance(5).unwrap() == LiveStatus::Running {}
        assert!(session.act(action));
    }
    while session.advance(5).unwrap() == LiveStatus::Running {}
    let after = pose(&session);
    assert!(before.position != after.position && before.yaw_rad != after.yaw_rad);
    let object = Target::Pixel { column: 256, row: 300 };
    assert!(session.act(Action::PickUp { object, hand: Hand::Left }));
    while session.advance(5).unwrap() == LiveStatus::Running {}
    assert!(session.trace().contains("\"pick_up\""));
}

#[test]
fn a_branch_continues_a_trace() {
    let episode = episode();
    let whole = config(AgentId::PARTNER, InputLevel::Plans, "rhp");
    let mut session = LiveSession::start(&episode, &whole, &BuiltInHelpers).unwrap();
    play(&mut session);
    let parent = session.trace();
    for (seat, frame) in [(AgentId::PARTNER, 300), (AgentId::PARTNER, 0)] {
        let config = config(seat, InputLevel::Plans, "none");
        let mut branch =
            LiveSession::take_over(parent.as_bytes(), &episode, frame, &config).unwrap();
        assert_eq!(branch.state().frame, frame);
        let common = |trace: &str| -> Vec<String> {
            let before = |line: &&str| {
                let start = line.trim_start_matches('[').split(',').next().unwrap_or_default();
                line.starts_with('[') && start.parse::<u32>().is_ok_and(|at| at < frame)
            };
            trace.lines().filter(before).map(str::to_owned).collect()
        };
        assert_eq!(common(&branch.trace()), common(&parent));
        play(&mut branch);
        assert!(branch.trace().contains(&format!("\"frame\":{frame}}}")), "it names the frame");
        let player = verified(branch.trace(), &episode).unwrap();
        assert_eq!(player.info().problem, None);
    }
}

#[test]
fn a_trace_of_agents_that_act_otherwise_cannot_be_taken_over() {
    let episode = episode();
    let config = config(AgentId::PARTNER, InputLevel::Plans, "rhp");
    let mut session = LiveSession::start(&episode, &config, &BuiltInHelpers).unwrap();
    play(&mut session);
    let other = session.trace().replacen("\"helper\":\"rhp\"", "\"helper\":\"random\"", 1);
    let result = LiveSession::take_over(other.as_bytes(), &episode, 600, &config);
    assert!(matches!(result.err(), Some(LiveError::Diverged)));
}

#[test]
fn a_branch_has_the_image_size_and_the_partner_of_its_trace() {
    let bytes = episode();
    let episode = Episode::parse(&bytes, "episode").unwrap();
    let name = "habits:load=1";
    let start = |partner: Option<&str>| {
        let config_of_run = EpisodeConfig {
            seed: 1,
            rules: RuleSet::COMPAT,
            image_size: Some(128),
            partner,
            ..EpisodeConfig::new(&episode, "rhp")
        };
        let rules = config_of_run.rules.planner;
        let partner = partner.and_then(|name| built_in_partner(name, rules));
        let agents = EpisodeAgents::new(BuiltInHelpers.make("rhp", rules), partner);
        Env::new(config_of_run, agents).unwrap()
    };
    let mut env = start(Some(name));
    let mut trace = env.header().to_line() + "\n";
    let mut sink = |record: &Record| -> Result<(), AgentError> {
        trace += &(record.to_line() + "\n");
        Ok(())
    };
    env.run(&std::sync::atomic::AtomicBool::new(false), Some(400), &mut sink).unwrap();
    for seat in [AgentId::PARTNER, AgentId::HELPER] {
        let config = config(seat, InputLevel::Plans, "none");
        let mut branch = LiveSession::take_over(trace.as_bytes(), &bytes, 350, &config).unwrap();
        assert_eq!(branch.state().frame, 350);
        // The person is compared with simulated agents under the same rules, with the same seed.
        let mut simulated = start(Some(name).filter(|_| seat == AgentId::HELPER));
        simulated.advance(None).unwrap();
        let (delivered, wanted) = simulated.world().progress();
        assert_eq!(branch.reference(&bytes, "rhp").unwrap(), delivered / wanted, "{seat}");
        let unknown = trace.replacen(name, "policy:0", 1);
        let refused = LiveSession::take_over(unknown.as_bytes(), &bytes, 350, &config).err();
        let is_refused = matches!(refused, Some(LiveError::NoPartner(_)));
        assert_eq!(is_refused, seat == AgentId::HELPER, "{refused:?}");
    }
}

#[test]
fn a_person_goes_on_as_the_partner_where_another_helper_has_taken_over() {
    let bytes = episode();
    let whole = config(AgentId::HELPER, InputLevel::Plans, "none");
    let mut session = LiveSession::start(&bytes, &whole, &BuiltInHelpers).unwrap();
    play(&mut session);
    let episode = Episode::parse(&bytes, "episode").unwrap();
    let parent = session.trace();
    let branch = continue_with(parent.as_bytes(), &episode, 300, "rhp", &BuiltInHelpers).unwrap();
    let branch: String = branch.lines().map(|line| line + "\n").collect();
    let config = config(AgentId::PARTNER, InputLevel::Plans, "none");
    let again = LiveSession::take_over(branch.as_bytes(), &bytes, 500, &config);
    assert_eq!(again.unwrap().state().frame, 500);
}

#[test]
fn helpers_with_weights_and_other_seats_are_refused() {
    let start = |seat, helper| {
        LiveSession::start(&episode(), &config(seat, InputLevel::Plans, helper), &BuiltInHelpers)
            .err()
    };
    assert!(matches!(
        start(AgentId::PARTNER, "rl"),
        Some(LiveError::Env(EnvError::UnknownHelper { .. }))
    ));
    assert!(matches!(start(AgentId::CHILD, "none"), Some(LiveError::NoSeat(_))));
    let config = config(AgentId::HELPER, InputLevel::Plans, "none");
    let session = LiveSession::start(&episode(), &config, &BuiltInHelpers).unwrap();
    assert!(matches!(
        session.reference(&episode(), "rl"),
        Err(LiveError::Env(EnvError::UnknownHelper { .. }))
    ));
    assert!(session.reference(&episode(), "none").unwrap() > 0.0);
}
