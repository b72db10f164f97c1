//! Tests that an episode depends on setup, seed, rules and actions only. The caller that asks the
//! agent, interruptions, and a reset of the environment have no effect.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use chaic_agents::PlannerRules;
use chaic_core::observation::{FrameHistorySpec, Grants, SensorConfig};
use chaic_core::{
    Action, Agent, AgentError, AgentId, Briefing, EntityId, Hand, Observation, Target, TaskId,
};
use chaic_env::helper_registry::{BuiltInHelpers, Helper, HelperRegistry as _};
use chaic_env::trace::Record;
use chaic_env::{
    AdvanceOutcome, AgentSlot, Env, EnvError, EpisodeAgents, EpisodeConfig, NoopAgent, RewardTerms,
    RewardWeights,
};
use chaic_episodes::{Episode, find_episode};

/// Frames of each run.
const UNTIL: u32 = 700;

fn test_episode(task: TaskId) -> Episode {
    find_episode(&format!("{task}/test/02")).expect("a bundled episode")
}

fn config(episode: &Episode) -> EpisodeConfig<'_> {
    EpisodeConfig { seed: 1, image_size: Some(64), ..EpisodeConfig::new(episode, "rhp") }
}

fn rhp() -> Helper {
    BuiltInHelpers.make("rhp", PlannerRules::paper()).expect("it is built in")
}

/// Runs to a frame and collects all records.
fn run(env: &mut Env, until: u32, records: &mut Vec<Record>) -> AdvanceOutcome {
    let mut sink = |record: &Record| {
        records.push(record.clone());
        Ok::<(), AgentError>(())
    };
    env.run(&AtomicBool::new(false), Some(until), &mut sink).expect("the sink takes all")
}

fn run_all(env: &mut Env) -> Vec<Record> {
    let mut records = Vec::new();
    assert_eq!(run(env, UNTIL, &mut records), AdvanceOutcome::Stopped);
    assert!(records.len() > 30, "{} records", records.len());
    records
}

/// Removes the helper's thoughts: external agents report none.
fn without_thoughts(mut records: Vec<Record>) -> Vec<Record> {
    for record in &mut records {
        if let Record::Decision(decision) = record
            && decision.agent == AgentId::HELPER
        {
            decision.thought = None;
        }
    }
    records
}

#[test]
fn an_external_agent_acts_as_one_in_the_environment() {
    for task in [TaskId::LowTarget, TaskId::Shopping, TaskId::MovingHouse] {
        let episode = test_episode(task);
        let inside = run_all(&mut Env::new(config(&episode), Some(rhp())).unwrap());
        let Helper { mut agent, grants } = rhp();
        // The agent requests its sensors after its briefing.
        let probe = Env::new(config(&episode), Some(rhp())).unwrap();
        agent.reset(&probe.briefing(AgentId::HELPER));
        let config = config(&episode);
        let image_size = config.image_size.unwrap();
        let slot = AgentSlot::external(grants, SensorConfig { image_size, ..agent.sensors() });
        let agents = EpisodeAgents { helper: Some(slot), partner: None };
        let mut env = Env::new(config, agents).unwrap();
        let mut records = Vec::new();
        while run(&mut env, UNTIL, &mut records) == AdvanceOutcome::NeedsAction {
            assert_eq!(env.waiting().collect::<Vec<_>>(), [AgentId::HELPER]);
            let observation = env.observe(AgentId::HELPER).expect("the helper waits");
            let action = agent.act(observation).expect("a rule-based agent decides");
            assert!(!env.submit(AgentId::PARTNER, action), "the partner is not external");
            assert!(env.submit(AgentId::HELPER, action));
            assert!(!env.submit(AgentId::HELPER, action), "it has chosen already");
        }
        assert_eq!(without_thoughts(inside), without_thoughts(records), "{task}");
    }
}

#[test]
fn interruptions_change_nothing() {
    let episode = test_episode(TaskId::Shopping);
    let whole = run_all(&mut Env::new(config(&episode), Some(rhp())).unwrap());
    assert!(whole.iter().any(|r| matches!(r, Record::Child(_))), "there is a child");
    let mut env = Env::new(config(&episode), Some(rhp())).unwrap();
    let mut records = Vec::new();
    for until in (0..=UNTIL).step_by(7) {
        run(&mut env, until, &mut records);
    }
    assert_eq!(records, whole);
}

#[test]
fn single_frames_give_the_same_records() {
    let episode = test_episode(TaskId::Shopping);
    let whole = run_all(&mut Env::new(config(&episode), Some(rhp())).unwrap());
    let mut env = Env::new(config(&episode), Some(rhp())).unwrap();
    let mut records = Vec::new();
    for frame in 0..UNTIL {
        assert_eq!(env.world().state().frame, frame);
        let mut sink = |record: &Record| {
            records.push(record.clone());
            Ok::<(), AgentError>(())
        };
        assert_eq!(env.run_frame(&mut sink), Ok(AdvanceOutcome::Stopped));
    }
    assert!(records.len() > 30 && whole.starts_with(&records));
}

#[test]
fn the_end_is_recorded_once() {
    let mut setup = test_episode(TaskId::LowTarget).into_setup();
    setup.horizon = 60;
    let episode = Episode::new("short", "files", None, setup).unwrap();
    let mut env = Env::new(config(&episode), Some(rhp())).unwrap();
    let mut records = Vec::new();
    assert_eq!(run(&mut env, UNTIL, &mut records), AdvanceOutcome::Ended);
    assert!(matches!(records.last(), Some(Record::End(_))));
    let n = records.len();
    assert_eq!(run(&mut env, UNTIL, &mut records), AdvanceOutcome::Ended);
    let mut sink = |record: &Record| {
        records.push(record.clone());
        Ok::<(), AgentError>(())
    };
    assert_eq!(env.run_frame(&mut sink), Ok(AdvanceOutcome::Ended));
    assert_eq!(records.len(), n);
}

#[test]
fn a_reset_environment_equals_a_new_one() {
    let tasks = [TaskId::Obstacle, TaskId::Obstacle, TaskId::Shopping, TaskId::MovingHouse];
    let mut env = Env::new(config(&test_episode(TaskId::NoConstraint)), Some(rhp())).unwrap();
    run_all(&mut env);
    for task in tasks {
        let episode = test_episode(task);
        env.reset(config(&episode)).unwrap();
        let expected = run_all(&mut Env::new(config(&episode), Some(rhp())).unwrap());
        assert_eq!(run_all(&mut env), expected, "{task}");
    }
}

#[test]
fn the_caller_supplies_as_many_slots_as_people() {
    let idle = || AgentSlot::with_agent(Box::new(NoopAgent), Grants::NONE);
    let [two, three] = [TaskId::Obstacle, TaskId::Shopping].map(test_episode);
    let mut env = Env::with_slots(config(&two), vec![idle(), idle()]).unwrap();
    let refused = env.reset(config(&three));
    assert!(
        matches!(refused, Err(EnvError::SlotCount { people: 3, slots: 2, .. })),
        "there is a child"
    );
    assert_eq!(env.header().task, TaskId::Obstacle, "it is unchanged");
    assert_eq!(env.advance(Some(300)), Ok(AdvanceOutcome::Stopped));
    assert!(env.snapshot().is_ok(), "agents that stand still can be copied");
    assert!(Env::with_slots(config(&three), vec![idle()]).is_err());
}

#[test]
fn an_action_of_an_agent_that_does_not_wait_is_refused() {
    let episode = test_episode(TaskId::HighTarget);
    let mut env = Env::new(config(&episode), None).unwrap();
    assert_eq!(env.waiting().count(), 0);
    for agent in [AgentId::PARTNER, AgentId::HELPER, AgentId(200)] {
        assert!(!env.submit(agent, Action::TurnLeft) && env.observe(agent).is_none());
    }
}

#[test]
fn an_episode_repeats_from_a_snapshot() {
    for task in [TaskId::Obstacle, TaskId::Shopping, TaskId::MovingHouse] {
        let episode = test_episode(task);
        let mut env = Env::new(config(&episode), Some(rhp())).unwrap();
        run(&mut env, 300, &mut Vec::new());
        let snapshot = env.snapshot().expect("rule-based agents can be copied");
        let start = env.digest();
        let once = run_all(&mut env);
        assert_ne!(env.digest(), start);
        for _ in 0..2 {
            env.restore(&snapshot).unwrap();
            assert_eq!(env.digest(), start);
            assert_eq!(run_all(&mut env), once, "{task}");
        }
        let other = test_episode(TaskId::NoConstraint);
        let mut other = Env::new(config(&other), Some(rhp())).unwrap();
        let before = other.digest();
        assert!(matches!(other.restore(&snapshot), Err(EnvError::OtherSnapshot { .. })));
        assert_eq!(other.digest(), before);
    }
}

/// Agent that can't be copied.
struct Uncopyable;

impl Agent for Uncopyable {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Result<Action, AgentError> {
        Ok(Action::TurnLeft)
    }
}

#[test]
fn an_agent_that_can_not_be_copied_has_no_snapshot() {
    let episode = test_episode(TaskId::Obstacle);
    let single = Helper { agent: Box::new(Uncopyable), grants: Grants::NONE };
    let env = Env::new(config(&episode), Some(single)).unwrap();
    let refused = env.snapshot().map(|_| ());
    assert!(matches!(refused, Err(EnvError::NoFork { agent: AgentId::HELPER })));
}

#[test]
fn deliveries_progress_and_failures_are_rewarded_per_action() {
    let episode = test_episode(TaskId::NoConstraint);
    let Helper { mut agent, grants } =
        BuiltInHelpers.make("oracle", PlannerRules::paper()).unwrap();
    let slot = AgentSlot::external(
        grants,
        SensorConfig { image_size: 128, ..SensorConfig::DEPTH_AND_IDS },
    );
    let agents = EpisodeAgents { helper: Some(slot), partner: None };
    let whole = EpisodeConfig { image_size: Some(128), ..config(&episode) };
    let mut env = Env::new(whole, agents).unwrap();
    agent.reset(&env.briefing(AgentId::HELPER));
    assert_eq!(env.reward(AgentId::HELPER), None, "there was no action");
    let (mut delivered, mut progress_m_total, mut n_failed) = (0.0, 0.0, 0);
    let here = |env: &Env| env.world().state().agents[AgentId::HELPER.index()].pose.position;
    let mut before = here(&env);
    while env.advance(None) == Ok(AdvanceOutcome::NeedsAction) {
        if let Some(terms) = env.reward(AgentId::HELPER) {
            delivered += terms.delivered;
            progress_m_total += terms.progress_m.max(0.0);
            // Other agents' actions give no progress: it is at most the walked distance, plus the reach
            // of an arm for an action with an object.
            let walked_m = f64::from(here(&env).distance(before)) + 0.01;
            let action = env.world().last_action(AgentId::HELPER).map(|(action, _)| action);
            let arm_m = if action.is_some_and(|a| a.is_locomotion()) { 0.0 } else { 4.0 };
            assert!(terms.progress_m.abs() <= walked_m + arm_m, "{terms:?}: {walked_m} m");
            n_failed += u32::from(terms.is_invalid);
            // The observation has the outcome of the action too.
            let last = env.observe(AgentId::HELPER).and_then(|o| o.proprioception.last);
            assert_eq!(terms.is_invalid, last.is_some_and(|(_, outcome)| !outcome.is_success()));
        }
        let observation = env.observe(AgentId::HELPER).expect("the helper waits");
        // The first action must fail.
        let action = match observation.frame {
            0 => Action::PutIn,
            _ => agent.act(observation).expect("a rule-based agent decides"),
        };
        before = here(&env);
        assert!(env.submit(AgentId::HELPER, action));
        let under_way = env.reward(AgentId::HELPER).expect("it has chosen");
        assert!(!under_way.is_invalid, "an action under way has not failed");
    }
    let end = env.score();
    let last = env.reward(AgentId::HELPER).expect("it acted").delivered;
    assert!(end.done > 0.0 && n_failed >= 1);
    assert!((delivered + last - end.done / end.total).abs() < 1e-9, "{delivered} {last}");
    assert!(progress_m_total > 10.0, "{progress_m_total} m towards targets and goal");
    let terms = RewardTerms { delivered: 0.2, progress_m: 2.0, is_invalid: true };
    let reward = terms.weighted_sum(&RewardWeights::STANDARD);
    assert!((reward - 2.0).abs() < 1e-9, "0.2 * 10 + 2 * 0.05 - 0.1 is not {reward}");
}

#[test]
fn a_snapshot_within_a_turn_of_an_external_agent_is_restored() {
    let episode = test_episode(TaskId::Obstacle);
    let slot = || {
        AgentSlot::external(
            Grants::IDS,
            SensorConfig { image_size: 64, ..SensorConfig::DEPTH_AND_IDS },
        )
    };
    let agents = || EpisodeAgents { helper: Some(slot()), partner: None };
    let mut env = Env::new(config(&episode), agents()).unwrap();
    let step = |env: &mut Env, action: Action| {
        assert!(env.submit(AgentId::HELPER, action));
        assert_eq!(env.advance(None), Ok(AdvanceOutcome::NeedsAction));
        let observation = env.observe(AgentId::HELPER).expect("the helper waits").clone();
        (observation, env.reward(AgentId::HELPER), env.digest())
    };
    assert_eq!(env.advance(None), Ok(AdvanceOutcome::NeedsAction));
    step(&mut env, Action::MoveForward);
    // Within a turn, after its observation was rendered.
    let snapshot = env.snapshot().unwrap();
    let one = step(&mut env, Action::TurnLeft);
    let other = step(&mut env, Action::PutIn);
    assert!(other.1.is_some_and(|terms| terms.is_invalid) && one.2 != other.2);
    env.restore(&snapshot).unwrap();
    assert_eq!(step(&mut env, Action::TurnLeft), one);
    assert_eq!(step(&mut env, Action::PutIn), other);
    // An agent in place of the external one makes another episode.
    let mut with_agent = Env::new(config(&episode), Some(rhp())).unwrap();
    assert!(matches!(with_agent.restore(&snapshot), Err(EnvError::OtherSnapshot { .. })));
}

/// Agent that fails, and counts how often it is asked; copies count together.
struct Failing(std::sync::Arc<std::sync::atomic::AtomicU32>);

impl Agent for Failing {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Result<Action, AgentError> {
        self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        Err(AgentError::Broken("out of order".to_owned()))
    }

    fn fork(&self) -> Option<Box<dyn Agent>> {
        Some(Box::new(Failing(Arc::clone(&self.0))))
    }
}

#[test]
fn a_failed_agent_is_not_asked_again() {
    let asked = std::sync::Arc::default();
    let episode = test_episode(TaskId::NoConstraint);
    let agent = Box::new(Failing(std::sync::Arc::clone(&asked)));
    let mut env = Env::new(config(&episode), Some(Helper { agent, grants: Grants::NONE })).unwrap();
    let start = env.snapshot().unwrap();
    let failure = Err(AgentError::Broken("out of order".to_owned()));
    for _ in 0..3 {
        assert_eq!(env.advance(None), failure);
    }
    // A snapshot keeps the failure.
    let failed = env.snapshot().unwrap();
    env.restore(&failed).unwrap();
    assert_eq!(env.advance(None), failure);
    assert_eq!(asked.load(std::sync::atomic::Ordering::Relaxed), 1);
    env.restore(&start).unwrap();
    assert_eq!(env.advance(None), failure);
    assert_eq!(asked.load(std::sync::atomic::Ordering::Relaxed), 2, "no agent had failed there");
    env.restore(&failed).unwrap();
    assert_eq!(env.advance(None), failure);
    assert_eq!(asked.load(std::sync::atomic::Ordering::Relaxed), 2);
}

#[test]
fn an_agent_with_low_vision_sees_nothing_far_away() {
    let near_sighted =
        test_episode(TaskId::NoConstraint).with_partner("adult+low_vision".parse().unwrap());
    let episodes =
        [test_episode(TaskId::NoConstraint), near_sighted.expect("the partner fits the task")];
    let mut n_far = [0, 0];
    for (episode, n_far) in episodes.iter().zip(&mut n_far) {
        let slot = AgentSlot::external(
            Grants::PARTNER,
            SensorConfig { rgb: true, ..SensorConfig::DEPTH_AND_IDS },
        );
        let agents = EpisodeAgents { helper: None, partner: Some(slot) };
        let mut env = Env::new(config(episode), agents).unwrap();
        for _ in 0..30 {
            env.advance(None).expect("no agent fails");
            let pose = env.world().state().agents[0].pose.position;
            let observation = env.observe(AgentId::PARTNER).expect("the partner waits");
            let (camera, images) = (&observation.camera, &observation.images);
            let (depth_m, ids) = (images.depth_m.as_ref().unwrap(), images.ids.as_ref().unwrap());
            for (k, (d, id)) in depth_m.iter().zip(ids).enumerate() {
                let p = camera.unproject(k as u32 % camera.width, k as u32 / camera.width, *d);
                let is_far = chaic_core::geom::horizontal_distance(p, pose) > 2.001;
                *n_far += u32::from(is_far);
                assert!(*d != 0.0 || (!is_far && *id == 0), "{p} {d} {id}");
            }
            assert!(env.submit(AgentId::PARTNER, Action::TurnLeft));
        }
    }
    assert!(n_far[0] > 10_000 && n_far[1] == 0, "{n_far:?}");
}

/// Agent that waits, and logs the frames of its frame history.
struct HistoryLogger {
    spec: Option<FrameHistorySpec>,
    log: Arc<Mutex<Vec<LoggedFrames>>>,
}

/// Frame of an observation, and frames of its history.
type LoggedFrames = (u32, Vec<u32>);

impl Agent for HistoryLogger {
    fn sensors(&self) -> SensorConfig {
        SensorConfig { frame_history: self.spec, ..SensorConfig::NONE }
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        for frame in &observation.frame_history {
            let n = (frame.camera.width * frame.camera.height) as usize;
            assert_eq!(frame.images.rgb.as_ref().map(Vec::len), Some(3 * n));
            assert_eq!(frame.images.depth_m.as_ref().map(Vec::len), Some(n));
            assert_eq!(frame.images.ids, None, "a history has no ids");
        }
        let frames = observation.frame_history.iter().map(|frame| frame.frame).collect();
        self.log.lock().unwrap().push((observation.frame, frames));
        Ok(Action::Wait { frames: 20 })
    }
}

#[test]
fn only_an_agent_that_requests_a_frame_history_gets_one() {
    let episode = test_episode(TaskId::Shopping);
    let play = |spec: Option<FrameHistorySpec>| {
        let log = Arc::<Mutex<Vec<LoggedFrames>>>::default();
        let agent = Box::new(HistoryLogger { spec, log: Arc::clone(&log) });
        let helper = Helper { agent, grants: Grants::PARTNER };
        let mut env = Env::new(config(&episode), Some(helper)).unwrap();
        env.advance(Some(200)).unwrap();
        let digest = env.digest();
        (log.lock().unwrap().clone(), digest)
    };
    let spec = FrameHistorySpec { image_size: 16, every_frames: 3, max_len: 5 };
    let ((with, digest), (without, same)) = (play(Some(spec)), play(None));
    assert_eq!(digest, same, "a frame history changes nothing");
    assert!(without.iter().all(|(_, frames)| frames.is_empty()) && without.len() > 5);
    assert!(with[0].1.is_empty(), "no frame has passed");
    for pair in with.windows(2) {
        let (before, now) = (pair[0].0, pair[1].0);
        let all: Vec<u32> = (before + 1..=now).filter(|frame| frame % 3 == 0).collect();
        assert_eq!(pair[1].1, all[all.len().saturating_sub(5)..], "from {before} to {now}");
    }
}

#[test]
fn a_frame_history_beyond_the_observation_limit_is_refused_before_the_first_image() {
    let episode = test_episode(TaskId::Shopping);
    let log = Arc::<Mutex<Vec<LoggedFrames>>>::default();
    let spec = Some(FrameHistorySpec { image_size: 2048, every_frames: 1, max_len: 256 });
    let agent = Box::new(HistoryLogger { spec, log: Arc::clone(&log) });
    let mut env = Env::new(config(&episode), Some(Helper { agent, grants: Grants::NONE })).unwrap();
    for _ in 0..2 {
        let problem = env.advance(None).unwrap_err().to_string();
        assert!(problem.contains("7168 MiB") && problem.contains("at most 64 MiB"), "{problem}");
    }
    assert!(log.lock().unwrap().is_empty(), "the agent is not asked");
    assert_eq!(env.world().state().frame, 0);
}

#[test]
fn color_drawn_on_demand_equals_that_of_an_observation() {
    let episode = test_episode(TaskId::LowTarget);
    let image = |rgb: bool| {
        let sensors =
            SensorConfig { image_size: 64, rgb, depth: true, ids: false, frame_history: None };
        let helper = Some(AgentSlot::external(Grants::NONE, sensors));
        let agents = EpisodeAgents { helper, partner: None };
        let mut env = Env::new(config(&episode), agents).expect("the episode is valid");
        env.advance(None).expect("no agent fails");
        let drawn = env.render_color(AgentId::HELPER);
        let observation = env.observe(AgentId::HELPER).expect("the helper waits");
        (drawn, observation.images.rgb.clone())
    };
    let (drawn, none) = image(false);
    let (drawn_again, observed) = image(true);
    assert_eq!(none, None);
    assert!(drawn == drawn_again && Some(drawn) == observed);
}

#[test]
fn an_agent_without_images_points_at_what_its_camera_sees() {
    const SIZE: u32 = 64;
    let episode = test_episode(TaskId::LowTarget);
    let start = |grants: Grants, ids: bool| {
        let sensors = SensorConfig { image_size: SIZE, ids, ..SensorConfig::NONE };
        let helper = Some(AgentSlot::external(grants, sensors));
        let mut env = Env::new(config(&episode), EpisodeAgents { helper, partner: None }).unwrap();
        assert_eq!(env.advance(None), Ok(AdvanceOutcome::NeedsAction));
        env
    };
    let mut with_ids = start(Grants::IDS, true);
    let observation = with_ids.observe(AgentId::HELPER).expect("the helper waits");
    let ids = observation.images.ids.clone().expect("ids are granted");
    let (pixel, id) = (0..).zip(ids).max_by_key(|(_, id)| *id).expect("there are pixels");
    let (inside, shown) = (Target::Pixel { column: pixel % SIZE, row: pixel / SIZE }, EntityId(id));
    assert_ne!(shown, EntityId::NOTHING);
    let resolved = |grants: Grants, object: Target| {
        let mut env = start(grants, false);
        assert!(env.submit(AgentId::HELPER, Action::PickUp { object, hand: Hand::Left }));
        let mut records = Vec::new();
        run(&mut env, 1, &mut records);
        let of_helper = |record: &Record| match record {
            Record::Decision(decision) if decision.agent == AgentId::HELPER => {
                decision.action.subject()
            }
            _ => None,
        };
        records.iter().find_map(of_helper).expect("the helper has decided")
    };
    assert_eq!(resolved(Grants::NONE, inside), shown);
    for (column, row) in [(SIZE, 0), (0, SIZE)] {
        let outside = Target::Pixel { column, row };
        assert_eq!(resolved(Grants::NONE, outside), EntityId::NOTHING, "{column} {row}");
    }
    // Entities can only be named with ids.
    let entity = Target::Entity(shown);
    assert_eq!(resolved(Grants::NONE, entity), EntityId::NOTHING);
    assert_eq!(resolved(Grants::IDS, entity), shown);
}
