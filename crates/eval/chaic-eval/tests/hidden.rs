//! What is hidden from a helper is hidden: goal and constraint of the partner reach it neither
//! through its briefing nor through anything it perceives, until it sees or feels them itself. An
//! agent that tries everything learns nothing; and each leak that was ever found, planted again,
//! is found again.

use std::sync::{Arc, Mutex};

use chaic_agents::PlannerRules;
use chaic_core::observation::{Granted, Grants, Senses};
use chaic_core::{Action, Agent, AgentError, Briefing, Observation, TaskId};
use chaic_env::minds::{BuiltIn, Helper, Helpers as _};
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EpisodeConfig};
use chaic_episodes::{Episode, find_episode};
use chaic_eval::audit::{Finding, Leak, Pair, Partner, Prober, Secret, compare};
use chaic_render::Appearance;

/// Long enough to explore, to pick up and to deliver.
const FRAMES: u32 = 900;

fn pair(episode: &Episode, secret: Secret, partner: Partner) -> Pair<'_> {
    let rules = RuleSet::PAPER;
    Pair { episode, secret, partner, rules, frames: FRAMES, image_size: 48 }
}

fn of_task(task: TaskId) -> Episode {
    let bundled = find_episode(&format!("{task}/test/01"));
    bundled.or_else(|_| find_episode(&format!("{task}/gen/501"))).unwrap()
}

fn built_in(name: &str) -> Helper {
    BuiltIn.make(name, PlannerRules::paper()).unwrap()
}

fn prober(episode: &Episode, sees: bool, grants: Grants) -> Helper {
    let n_things = episode.setup().things.len();
    Helper { mind: Box::new(Prober::new(sees, n_things)), grants }
}

/// Every task, with the goal or the constraint changed by turns.
fn tasks_and_secrets() -> impl Iterator<Item = (TaskId, Secret)> {
    TaskId::all().enumerate().map(|(k, task)| (task, Secret::ALL[k % 2]))
}

fn finds_nothing(pair: &Pair<'_>, who: &str, make: &dyn Fn() -> Helper) -> usize {
    let verdict = compare(pair, make, None).unwrap();
    let id = pair.episode.id();
    if let Some(finding) = verdict.finding {
        panic!("{id}, {who}, {:?}, partner {:?}: {finding}", pair.secret, pair.partner);
    }
    verdict.compared
}

#[test]
fn the_built_in_helpers_are_told_nothing() {
    for (k, (task, secret)) in tasks_and_secrets().enumerate() {
        let episode = of_task(task);
        let helper = ["rhp", "random", "follow"][k % 3];
        let acting = pair(&episode, secret, Partner::Acts);
        finds_nothing(&acting, helper, &|| built_in(helper));
        let waiting = pair(&episode, secret, Partner::Waits);
        let n = finds_nothing(&waiting, helper, &|| built_in(helper));
        assert!(n > 20, "{task}, {helper}: it did something, {n}");
    }
}

#[test]
fn whoever_tries_everything_learns_nothing() {
    for (k, (task, secret)) in tasks_and_secrets().enumerate() {
        let episode = of_task(task);
        for (sees, grants) in [(false, Grants::IDS), (true, [Grants::IDS, Grants::NONE][k % 2])] {
            let acting = pair(&episode, secret, Partner::Acts);
            finds_nothing(&acting, "prober", &|| prober(&episode, sees, grants));
        }
    }
}

/// The first pair that finds a planted leak, if any does.
fn found(leak: Leak) -> Option<Finding> {
    for (task, secret) in tasks_and_secrets() {
        let episode = of_task(task);
        let acting = Pair { frames: 2000, ..pair(&episode, secret, Partner::Acts) };
        let make = || prober(&episode, false, Grants::IDS);
        let verdict = compare(&acting, &make, Some(leak)).unwrap();
        if verdict.finding.is_some() {
            return verdict.finding;
        }
    }
    None
}

#[test]
fn every_leak_that_is_planted_is_found() {
    for leak in Leak::ALL {
        assert!(found(leak).is_some(), "{leak:?} goes unnoticed");
    }
}

#[test]
fn what_is_granted_differs() {
    // The same look finds what an oracle is told: the goal.
    let episode = of_task(TaskId::HighTarget);
    let verdict =
        compare(&pair(&episode, Secret::Goal, Partner::Waits), &|| built_in("oracle"), None);
    assert!(verdict.unwrap().finding.is_some_and(|f| f.what == "the briefing"));
    // Of the constraint it is told nothing.
    finds_nothing(&pair(&episode, Secret::Constraint, Partner::Waits), "oracle", &|| {
        built_in("oracle")
    });
}

/// Checks each observation by a function.
struct Checker {
    mind: Box<dyn Agent>,
    check: fn(&Observation, &Mutex<[u32; 3]>),
    counts: Arc<Mutex<[u32; 3]>>,
}

impl Agent for Checker {
    fn senses(&self) -> Senses {
        Senses { rgb: true, ..self.mind.senses() }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.mind.reset(briefing);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        (self.check)(observation, &self.counts);
        self.mind.act(observation)
    }
}

/// What the check counted while `helper` lived with these grants.
fn checked(
    task: TaskId,
    helper: &str,
    grants: Grants,
    check: fn(&Observation, &Mutex<[u32; 3]>),
) -> [u32; 3] {
    let counts = Arc::new(Mutex::new([0; 3]));
    let mind = built_in(helper).mind;
    let mind = Box::new(Checker { mind, check, counts: Arc::clone(&counts) });
    let config = EpisodeConfig {
        episode: &of_task(task),
        seed: 0,
        rules: RuleSet::PAPER,
        helper,
        partner: None,
        image_size: Some(48),
        appearance: Appearance::Canonical,
    };
    let mut env = Env::new(config, Some(Helper { mind, grants })).unwrap();
    env.advance(None).unwrap();
    *counts.lock().unwrap()
}

#[test]
fn without_grants_there_are_images_and_own_state_only() {
    let [n, ..] = checked(TaskId::NoConstraint, "random", Grants::NONE, |o, counts| {
        assert!(o.images.ids.is_none() && o.images.rgb.is_some() && o.images.depth_m.is_some());
        assert_eq!(o.granted, Granted::default());
        assert!(o.own.held().all(|held| held.identity.is_none()));
        counts.lock().unwrap()[0] += 1;
    });
    assert!(n > 20, "it was asked {n} times");
}

#[test]
fn the_grant_of_ids_is_about_the_own_image_alone() {
    let [n, delivered, elsewhere] =
        checked(TaskId::LowTarget, "rhp", Grants::PLANNER, |o, counts| {
            let ids = o.images.ids.as_ref().expect("rhp is granted ids");
            let named = |id: &u16| chaic_core::EntityId(*id).is_object();
            let mut seen: Vec<u16> = ids.iter().copied().filter(named).collect();
            seen.sort_unstable();
            seen.dedup();
            let told: Vec<u16> = o.granted.classes.iter().map(|(e, _)| e.0).filter(named).collect();
            assert_eq!(told, seen, "frame {}", o.frame);
            assert!(o.granted.delivered.iter().all(|(e, _)| seen.contains(&e.0)));
            let mut counts = counts.lock().unwrap();
            counts[0] += 1;
            counts[1] += u32::from(!o.granted.delivered.is_empty());
            counts[2] += u32::from(o.granted.delivered.is_empty());
        });
    assert!(n > 20 && delivered > 0 && elsewhere > 0, "{n}, {delivered}, {elsewhere}");
}
