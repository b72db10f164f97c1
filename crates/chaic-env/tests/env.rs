//! Promise: what happens in an episode depends on episode, seed, rules and choices only. It is the
//! same whether a mind sits in the environment or its caller asks it, in one go or in pieces, in a
//! new environment or in one that was reset.

use std::sync::atomic::AtomicBool;

use chaic_agents::PlannerRules;
use chaic_env::minds::{BuiltIn, Helper, Helpers as _};
use chaic_env::rules::RuleSet;
use chaic_env::trace::Record;
use chaic_env::{Appearance, Env, EnvError, EpisodeConfig, Flow, Idle, Minds, Seat};
use chaic_episodes::{Episode, find_episode};
use chaic_protocol::observation::Grants;
use chaic_protocol::{Action, AgentError, AgentId, TaskId};

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
        let seat = Seat::of_caller(grants, mind.senses());
        let minds = Minds { helper: Some(seat), partner: None };
        let mut env = Env::new(config(&episode), minds).unwrap();
        let mut records = Vec::new();
        while run(&mut env, UNTIL, &mut records) == Flow::Waits {
            assert_eq!(env.waiting().collect::<Vec<_>>(), [AgentId::HELPER]);
            let seen = env.observation(AgentId::HELPER).expect("it waits");
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
        assert!(!env.submit(agent, Action::TurnLeft) && env.observation(agent).is_none());
    }
}
