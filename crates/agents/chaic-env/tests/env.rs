//! Promise: what happens in an episode depends on episode, seed, rules and choices only. It is the
//! same whether a mind sits in the environment or its caller asks it, in one go or in pieces, in a
//! new environment or in one that was reset.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use chaic_agents::PlannerRules;
use chaic_core::observation::{Film, Grants, Senses};
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation, TaskId};
use chaic_env::minds::{BuiltIn, Helper, Helpers as _};
use chaic_env::rules::RuleSet;
use chaic_env::trace::Record;
use chaic_env::{
    Appearance, Env, EnvError, EpisodeConfig, Flow, Idle, Minds, RewardTerms, RewardWeights, Seat,
};
use chaic_episodes::{Episode, find_episode};

/// Frames that are played.
const UNTIL: u32 = 700;

fn of_task(task: TaskId) -> Episode {
    find_episode(&format!("{task}/test/02")).expect("a bundled episode")
}

fn config(episode: &Episode) -> EpisodeConfig<'_> {
    EpisodeConfig {
        episode,
        seed: 1,
        rules: RuleSet::PAPER,
        helper: "rhp",
        partner: None,
        image_size: Some(64),
        appearance: Appearance::Canonical,
    }
}

fn rhp() -> Helper {
    BuiltIn.make("rhp", PlannerRules::paper()).expect("it is built in")
}

/// Plays to a frame, noting all that happens.
fn run(env: &mut Env, until: u32, records: &mut Vec<Record>) -> Flow {
    let mut sink = |record: &Record| {
        records.push(record.clone());
        Ok::<(), AgentError>(())
    };
    env.run(&AtomicBool::new(false), Some(until), &mut sink).expect("the sink takes all")
}

fn played(env: &mut Env) -> Vec<Record> {
    let mut records = Vec::new();
    assert_eq!(run(env, UNTIL, &mut records), Flow::Stopped);
    assert!(records.len() > 30, "{} records", records.len());
    records
}

/// Without what the helper thinks: nobody asks a caller for its thoughts.
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
fn a_mind_that_the_caller_asks_does_as_one_that_sits_inside() {
    for task in [TaskId::LowTarget, TaskId::Shopping, TaskId::MovingHouse] {
        let episode = of_task(task);
        let inside = played(&mut Env::new(config(&episode), Some(rhp())).unwrap());
        let Helper { mut mind, grants } = rhp();
        // What it wants to perceive is known once it is briefed.
        let probe = Env::new(config(&episode), Some(rhp())).unwrap();
        mind.reset(&probe.briefing(AgentId::HELPER));
        let config = config(&episode);
        let image_size = config.image_size.unwrap();
        let seat = Seat::of_caller(grants, Senses { image_size, ..mind.senses() });
        let minds = Minds { helper: Some(seat), partner: None };
        let mut env = Env::new(config, minds).unwrap();
        let mut records = Vec::new();
        while run(&mut env, UNTIL, &mut records) == Flow::Waits {
            assert_eq!(env.waiting().collect::<Vec<_>>(), [AgentId::HELPER]);
            let seen = env.observe(AgentId::HELPER).expect("it waits");
            let action = mind.act(seen).expect("rules decide");
            assert!(!env.submit(AgentId::PARTNER, action), "a mind sits there");
            assert!(env.submit(AgentId::HELPER, action));
            assert!(!env.submit(AgentId::HELPER, action), "it has chosen already");
        }
        assert_eq!(without_thoughts(inside), without_thoughts(records), "{task}");
    }
}

#[test]
fn stops_change_nothing() {
    let episode = of_task(TaskId::Shopping);
    let whole = played(&mut Env::new(config(&episode), Some(rhp())).unwrap());
    assert!(whole.iter().any(|r| matches!(r, Record::Child(_))), "there is a child");
    let mut env = Env::new(config(&episode), Some(rhp())).unwrap();
    let mut records = Vec::new();
    for until in (0..=UNTIL).step_by(7) {
        run(&mut env, until, &mut records);
    }
    assert_eq!(records, whole);
}

#[test]
fn an_environment_that_is_reset_is_as_good_as_new() {
    let tasks = [TaskId::Obstacle, TaskId::Obstacle, TaskId::Shopping, TaskId::MovingHouse];
    let mut env = Env::new(config(&of_task(TaskId::NoConstraint)), Some(rhp())).unwrap();
    played(&mut env);
    for task in tasks {
        let episode = of_task(task);
        env.reset(config(&episode)).unwrap();
        let fresh = played(&mut Env::new(config(&episode), Some(rhp())).unwrap());
        assert_eq!(played(&mut env), fresh, "{task}");
    }
}

#[test]
fn seats_that_the_caller_filled_are_as_many_as_people() {
    let idle = || Seat::of_mind(Box::new(Idle), Grants::NONE);
    let [two, three] = [TaskId::Obstacle, TaskId::Shopping].map(of_task);
    let mut env = Env::with_seats(config(&two), vec![idle(), idle()]).unwrap();
    let refused = env.reset(config(&three));
    assert!(matches!(refused, Err(EnvError::Seats { people: 3, seats: 2, .. })), "a child more");
    assert_eq!(env.header().task, TaskId::Obstacle, "it is as it was");
    assert_eq!(env.advance(Some(300)), Ok(Flow::Stopped));
    assert!(Env::with_seats(config(&three), vec![idle()]).is_err());
}

#[test]
fn a_choice_of_nobody_who_waits_is_refused() {
    let episode = of_task(TaskId::HighTarget);
    let mut env = Env::new(config(&episode), None).unwrap();
    assert_eq!(env.waiting().count(), 0);
    for agent in [AgentId::PARTNER, AgentId::HELPER, AgentId(200)] {
        assert!(!env.submit(agent, Action::TurnLeft) && env.observe(agent).is_none());
    }
}

#[test]
fn what_follows_a_snapshot_follows_it_again() {
    for task in [TaskId::Obstacle, TaskId::Shopping, TaskId::MovingHouse] {
        let episode = of_task(task);
        let mut env = Env::new(config(&episode), Some(rhp())).unwrap();
        run(&mut env, 300, &mut Vec::new());
        let snapshot = env.snapshot().expect("rule-based minds can be copied");
        let begin = env.digest();
        let once = played(&mut env);
        assert_ne!(env.digest(), begin);
        for _ in 0..2 {
            env.restore(&snapshot).unwrap();
            assert_eq!(env.digest(), begin);
            assert_eq!(played(&mut env), once, "{task}");
        }
        let other = of_task(TaskId::NoConstraint);
        let mut other = Env::new(config(&other), Some(rhp())).unwrap();
        let before = other.digest();
        assert!(matches!(other.restore(&snapshot), Err(EnvError::OtherSnapshot { .. })));
        assert_eq!(other.digest(), before);
    }
}

/// A mind that can't be copied.
struct Single;

impl Agent for Single {
    fn senses(&self) -> Senses {
        Senses::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Result<Action, AgentError> {
        Ok(Action::TurnLeft)
    }
}

#[test]
fn a_mind_that_can_t_be_copied_allows_no_snapshot() {
    let episode = of_task(TaskId::Obstacle);
    let single = Helper { mind: Box::new(Single), grants: Grants::NONE };
    let env = Env::new(config(&episode), Some(single)).unwrap();
    let refused = env.snapshot().map(|_| ());
    assert!(matches!(refused, Err(EnvError::NoFork { agent: AgentId::HELPER })));
}

#[test]
fn deliveries_approaches_and_failures_are_rewarded_as_they_come() {
    let episode = of_task(TaskId::NoConstraint);
    let Helper { mut mind, grants } = BuiltIn.make("oracle", PlannerRules::paper()).unwrap();
    let seat = Seat::of_caller(grants, Senses { image_size: 128, ..Senses::DEPTH_AND_IDS });
    let minds = Minds { helper: Some(seat), partner: None };
    let whole = EpisodeConfig { image_size: Some(128), ..config(&episode) };
    let mut env = Env::new(whole, minds).unwrap();
    mind.reset(&env.briefing(AgentId::HELPER));
    assert_eq!(env.reward(AgentId::HELPER), None, "nothing has been chosen");
    let (mut delivered, mut towards_m, mut n_failed) = (0.0, 0.0, 0);
    let here = |env: &Env| env.world().state().people[AgentId::HELPER.index()].pose.position;
    let mut before = here(&env);
    while env.advance(None) == Ok(Flow::Waits) {
        if let Some(terms) = env.reward(AgentId::HELPER) {
            delivered += terms.delivered;
            towards_m += terms.approached_m.max(0.0);
            // Whatever the others took or dropped: one comes nearer by one's own way alone, and by
            // the length of an arm, to and fro, where one takes something.
            let walked_m = f64::from(here(&env).distance(before)) + 0.01;
            let action = env.world().last_action(AgentId::HELPER).map(|(action, _)| action);
            let arm_m = if action.is_some_and(|a| a.is_locomotion()) { 0.0 } else { 4.0 };
            assert!(terms.approached_m.abs() <= walked_m + arm_m, "{terms:?}: {walked_m} m");
            n_failed += u32::from(terms.is_invalid);
            // The environment tells the agent itself how its action ended.
            let last = env.observe(AgentId::HELPER).and_then(|seen| seen.own.last);
            assert_eq!(terms.is_invalid, last.is_some_and(|(_, outcome)| !outcome.is_success()));
        }
        let seen = env.observe(AgentId::HELPER).expect("it waits");
        // One that must fail, to see that it is told.
        let action = match seen.frame {
            0 => Action::PutIn,
            _ => mind.act(seen).expect("rules decide"),
        };
        before = here(&env);
        assert!(env.submit(AgentId::HELPER, action));
        let under_way = env.reward(AgentId::HELPER).expect("it has chosen");
        assert!(!under_way.is_invalid, "what has not ended has not failed");
    }
    let end = env.score();
    let missed = env.reward(AgentId::HELPER).expect("it acted").delivered;
    assert!(end.done > 0.0 && n_failed >= 1);
    assert!((delivered + missed - end.done / end.total).abs() < 1e-9, "{delivered} {missed}");
    assert!(towards_m > 10.0, "{towards_m} m towards targets and goal");
    let terms = RewardTerms { delivered: 0.2, approached_m: 2.0, is_invalid: true };
    let reward = terms.weigh(&RewardWeights::STANDARD);
    assert!((reward - 2.0).abs() < 1e-9, "0.2 * 10 + 2 * 0.05 - 0.1 is not {reward}");
}

#[test]
fn a_snapshot_of_a_caller_s_turn_is_gone_on_with() {
    let episode = of_task(TaskId::Obstacle);
    let seat = || Seat::of_caller(Grants::IDS, Senses { image_size: 64, ..Senses::DEPTH_AND_IDS });
    let minds = || Minds { helper: Some(seat()), partner: None };
    let mut env = Env::new(config(&episode), minds()).unwrap();
    let go_on = |env: &mut Env, action: Action| {
        assert!(env.submit(AgentId::HELPER, action));
        assert_eq!(env.advance(None), Ok(Flow::Waits));
        let seen = env.observe(AgentId::HELPER).expect("it waits").clone();
        (seen, env.reward(AgentId::HELPER), env.digest())
    };
    assert_eq!(env.advance(None), Ok(Flow::Waits));
    go_on(&mut env, Action::MoveForward);
    // In the middle of a turn, having looked.
    let snapshot = env.snapshot().unwrap();
    let one = go_on(&mut env, Action::TurnLeft);
    let other = go_on(&mut env, Action::PutIn);
    assert!(other.1.is_some_and(|terms| terms.is_invalid) && one.2 != other.2);
    env.restore(&snapshot).unwrap();
    assert_eq!(go_on(&mut env, Action::TurnLeft), one);
    assert_eq!(go_on(&mut env, Action::PutIn), other);
    // A mind in the caller's seat is another episode.
    let mut with_mind = Env::new(config(&episode), Some(rhp())).unwrap();
    assert!(matches!(with_mind.restore(&snapshot), Err(EnvError::OtherSnapshot { .. })));
}

/// A mind that breaks down, and counts how often it is asked.
struct Breaks(std::sync::Arc<std::sync::atomic::AtomicU32>);

impl Agent for Breaks {
    fn senses(&self) -> Senses {
        Senses::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Result<Action, AgentError> {
        self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        Err(AgentError::Broken("out of order".to_owned()))
    }
}

#[test]
fn who_broke_down_is_not_asked_again() {
    let asked = std::sync::Arc::default();
    let episode = of_task(TaskId::NoConstraint);
    let mind = Box::new(Breaks(std::sync::Arc::clone(&asked)));
    let mut env = Env::new(config(&episode), Some(Helper { mind, grants: Grants::NONE })).unwrap();
    for _ in 0..3 {
        assert_eq!(env.advance(None), Err(AgentError::Broken("out of order".to_owned())));
    }
    assert_eq!(asked.load(std::sync::atomic::Ordering::Relaxed), 1);
}

#[test]
fn who_sees_little_is_shown_nothing_that_is_far() {
    let near_sighted =
        of_task(TaskId::NoConstraint).with_partner("adult+low_vision".parse().unwrap());
    let episodes =
        [of_task(TaskId::NoConstraint), near_sighted.expect("such a person can play it")];
    let mut n_far = [0, 0];
    for (episode, n_far) in episodes.iter().zip(&mut n_far) {
        let seat = Seat::of_caller(Grants::PARTNER, Senses { rgb: true, ..Senses::DEPTH_AND_IDS });
        let minds = Minds { helper: None, partner: Some(seat) };
        let mut env = Env::new(config(episode), minds).unwrap();
        for _ in 0..30 {
            env.advance(None).expect("nobody breaks down");
            let pose = env.world().state().people[0].pose.position;
            let seen = env.observe(AgentId::PARTNER).expect("it is waiting");
            let (camera, images) = (&seen.camera, &seen.images);
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

/// A mind that waits, and writes down when the images of its films were taken.
struct Filming {
    film: Option<Film>,
    seen: Arc<Mutex<Vec<Filmed>>>,
}

/// When a mind was asked, and when the images of its film were taken.
type Filmed = (u32, Vec<u32>);

impl Agent for Filming {
    fn senses(&self) -> Senses {
        Senses { film: self.film, ..Senses::NONE }
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        for frame in &observation.film {
            let n = (frame.camera.width * frame.camera.height) as usize;
            assert_eq!(frame.images.rgb.as_ref().map(Vec::len), Some(3 * n));
            assert_eq!(frame.images.depth_m.as_ref().map(Vec::len), Some(n));
            assert_eq!(frame.images.ids, None, "ids are granted for the own image at most");
        }
        let frames = observation.film.iter().map(|frame| frame.frame).collect();
        self.seen.lock().unwrap().push((observation.frame, frames));
        Ok(Action::Wait { frames: 20 })
    }
}

#[test]
fn who_asks_for_a_film_gets_it_and_nobody_else() {
    let episode = of_task(TaskId::Shopping);
    let play = |film: Option<Film>| {
        let seen = Arc::<Mutex<Vec<Filmed>>>::default();
        let mind = Box::new(Filming { film, seen: Arc::clone(&seen) });
        let helper = Helper { mind, grants: Grants::PARTNER };
        let mut env = Env::new(config(&episode), Some(helper)).unwrap();
        env.advance(Some(200)).unwrap();
        let digest = env.digest();
        (seen.lock().unwrap().clone(), digest)
    };
    let film = Film { image_size: 16, every_frames: 3, most: 5 };
    let ((with, digest), (without, same)) = (play(Some(film)), play(None));
    assert_eq!(digest, same, "a film changes nothing");
    assert!(without.iter().all(|(_, frames)| frames.is_empty()) && without.len() > 5);
    assert!(with[0].1.is_empty(), "nothing has passed");
    for pair in with.windows(2) {
        let (then, now) = (pair[0].0, pair[1].0);
        let all: Vec<u32> = (then + 1..=now).filter(|frame| frame % 3 == 0).collect();
        assert_eq!(pair[1].1, all[all.len().saturating_sub(5)..], "from {then} to {now}");
    }
}

#[test]
fn a_film_larger_than_an_observation_may_be_is_refused_before_the_first_image() {
    let episode = of_task(TaskId::Shopping);
    let seen = Arc::<Mutex<Vec<Filmed>>>::default();
    let film = Some(Film { image_size: 2048, every_frames: 1, most: 256 });
    let mind = Box::new(Filming { film, seen: Arc::clone(&seen) });
    let mut env = Env::new(config(&episode), Some(Helper { mind, grants: Grants::NONE })).unwrap();
    for _ in 0..2 {
        let problem = env.advance(None).unwrap_err().to_string();
        assert!(problem.contains("7168 MiB") && problem.contains("at most 64 MiB"), "{problem}");
    }
    assert!(seen.lock().unwrap().is_empty(), "the mind is not asked");
    assert_eq!(env.world().state().frame, 0);
}
