//! Promise: goal and constraint of the partner are hidden from a helper. They reach it neither in
//! its briefing nor in observations until it sees or touches their effects. A probe agent that
//! tries all actions learns nothing, and the audit finds each known leak.

use std::sync::{Arc, Mutex};

use chaic_agents::PlannerRules;
use chaic_core::observation::{GrantedInfo, Grants, SensorConfig};
use chaic_core::{Action, Agent, AgentError, Briefing, Observation, TaskId};
use chaic_env::helper_registry::{BuiltInHelpers, Helper, HelperRegistry as _};
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EpisodeConfig};
use chaic_episodes::{Episode, find_episode};
use chaic_eval::audit::{
    HiddenProperty, Leak, PartnerMode, ProbeAgent, RunPair, Violation, compare,
};

/// Number of frames: enough to explore, pick up and deliver.
const FRAMES: u32 = 900;

fn pair(episode: &Episode, secret: HiddenProperty, partner: PartnerMode) -> RunPair<'_> {
    let rules = RuleSet::PAPER;
    RunPair { episode, secret, partner, rules, frames: FRAMES, image_size: 48 }
}

fn episode_of_task(task: TaskId) -> Episode {
    let bundled = find_episode(&format!("{task}/test/01"));
    bundled.or_else(|_| find_episode(&format!("{task}/gen/501"))).unwrap()
}

fn built_in(name: &str) -> Helper {
    BuiltInHelpers.make(name, PlannerRules::paper()).unwrap()
}

fn probe_agent(episode: &Episode, has_camera: bool, grants: Grants) -> Helper {
    let n_objects = episode.setup().things.len();
    Helper { agent: Box::new(ProbeAgent::new(has_camera, n_objects)), grants }
}

/// Returns every task, with a change of the goal or the constraint alternately.
fn tasks_and_secrets() -> impl Iterator<Item = (TaskId, HiddenProperty)> {
    TaskId::all().enumerate().map(|(k, task)| (task, HiddenProperty::ALL[k % 2]))
}

fn check_no_violation(pair: &RunPair<'_>, observer: &str, make: &dyn Fn() -> Helper) -> usize {
    let result = compare(pair, make, None).unwrap();
    let id = pair.episode.id();
    if let Some(violation) = result.violation {
        panic!("{id}, {observer}, {:?}, partner {:?}: {violation}", pair.secret, pair.partner);
    }
    result.compared
}

#[test]
fn built_in_helpers_learn_no_secret() {
    for (k, (task, secret)) in tasks_and_secrets().enumerate() {
        let episode = episode_of_task(task);
        let name = ["rhp", "random", "follow", "infer"][k % 4];
        let acting = pair(&episode, secret, PartnerMode::Acts);
        check_no_violation(&acting, name, &|| built_in(name));
        let waiting = pair(&episode, secret, PartnerMode::Waits);
        let n = check_no_violation(&waiting, name, &|| built_in(name));
        assert!(n > 20, "{task}, {name}: it did something, {n}");
    }
}

#[test]
fn a_probe_agent_learns_no_secret() {
    for (k, (task, secret)) in tasks_and_secrets().enumerate() {
        let episode = episode_of_task(task);
        for (has_camera, grants) in
            [(false, Grants::IDS), (true, [Grants::IDS, Grants::NONE][k % 2])]
        {
            let acting = pair(&episode, secret, PartnerMode::Acts);
            check_no_violation(&acting, "probe agent", &|| {
                probe_agent(&episode, has_camera, grants)
            });
        }
    }
}

/// Returns the first violation that an artificial leak causes, if any.
fn violation_of(leak: Leak) -> Option<Violation> {
    for (task, secret) in tasks_and_secrets() {
        let episode = episode_of_task(task);
        let acting = RunPair { frames: 2000, ..pair(&episode, secret, PartnerMode::Acts) };
        let make = || probe_agent(&episode, false, Grants::IDS);
        let result = compare(&acting, &make, Some(leak)).unwrap();
        if result.violation.is_some() {
            return result.violation;
        }
    }
    None
}

#[test]
fn every_artificial_leak_is_found() {
    for leak in Leak::ALL {
        assert!(violation_of(leak).is_some(), "{leak:?} is not found");
    }
}

#[test]
fn granted_secrets_are_found() {
    // The audit finds information that is granted to the oracle: the goal.
    let episode = episode_of_task(TaskId::HighTarget);
    let result = compare(
        &pair(&episode, HiddenProperty::Goal, PartnerMode::Waits),
        &|| built_in("oracle"),
        None,
    );
    assert!(result.unwrap().violation.is_some_and(|v| v.part == "the briefing"));
    // The constraint is not granted.
    check_no_violation(
        &pair(&episode, HiddenProperty::Constraint, PartnerMode::Waits),
        "oracle",
        &|| built_in("oracle"),
    );
}

/// Agent that checks each observation with a function.
struct Checker {
    agent: Box<dyn Agent>,
    check: fn(&Observation, &Mutex<[u32; 3]>),
    counts: Arc<Mutex<[u32; 3]>>,
}

impl Agent for Checker {
    fn sensors(&self) -> SensorConfig {
        SensorConfig { rgb: true, ..self.agent.sensors() }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.agent.reset(briefing);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        (self.check)(observation, &self.counts);
        self.agent.act(observation)
    }
}

/// Returns the counts of the check for a helper with these grants.
fn checked(
    task: TaskId,
    helper: &str,
    grants: Grants,
    check: fn(&Observation, &Mutex<[u32; 3]>),
) -> [u32; 3] {
    let counts = Arc::new(Mutex::new([0; 3]));
    let agent = built_in(helper).agent;
    let agent = Box::new(Checker { agent, check, counts: Arc::clone(&counts) });
    let episode = episode_of_task(task);
    let config = EpisodeConfig { image_size: Some(48), ..EpisodeConfig::new(&episode, helper) };
    let mut env = Env::new(config, Some(Helper { agent, grants })).unwrap();
    env.advance(None).unwrap();
    *counts.lock().unwrap()
}

#[test]
fn without_grants_an_observation_has_images_and_proprioception_only() {
    let [n, ..] = checked(TaskId::NoConstraint, "random", Grants::NONE, |o, counts| {
        assert!(o.images.ids.is_none() && o.images.rgb.is_some() && o.images.depth_m.is_some());
        assert_eq!(o.granted, GrantedInfo::default());
        assert!(o.proprioception.held().all(|held| held.identity.is_none()));
        counts.lock().unwrap()[0] += 1;
    });
    assert!(n > 20, "it was asked {n} times");
}

#[test]
fn the_ids_grant_covers_only_objects_in_the_own_image() {
    let [n, delivered, elsewhere] =
        checked(TaskId::LowTarget, "rhp", Grants::PLANNER, |o, counts| {
            let ids = o.images.ids.as_ref().expect("rhp is granted ids");
            let named = |id: &u16| chaic_core::EntityId(*id).is_object();
            let mut visible: Vec<u16> = ids.iter().copied().filter(named).collect();
            visible.sort_unstable();
            visible.dedup();
            let granted: Vec<u16> =
                o.granted.classes.iter().map(|(e, _)| e.0).filter(named).collect();
            assert_eq!(granted, visible, "frame {}", o.frame);
            assert!(o.granted.delivered.iter().all(|(e, _)| visible.contains(&e.0)));
            let mut counts = counts.lock().unwrap();
            counts[0] += 1;
            counts[1] += u32::from(!o.granted.delivered.is_empty());
            counts[2] += u32::from(o.granted.delivered.is_empty());
        });
    assert!(n > 20 && delivered > 0 && elsewhere > 0, "{n}, {delivered}, {elsewhere}");
}
