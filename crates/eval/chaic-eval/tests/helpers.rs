//! Promise: helpers are of use in real episodes, seen through their own eyes. In each task the rule-based
//! one or the oracle brings something to the goal, and who only follows stays with the partner.

use std::sync::atomic::AtomicBool;

use chaic_agents::PlannerRules;
use chaic_core::geom::horizontal_distance;
use chaic_core::{AgentError, AgentId, TaskId};
use chaic_env::minds::{BuiltIn, Helpers as _};
use chaic_env::rules::RuleSet;
use chaic_env::{Appearance, Env, EpisodeConfig, Flow};
use chaic_episodes::{Episode, Split, episodes};
use chaic_eval::metrics::{Summary, Tally};

/// Side of everybody's images, pixels: enough to find one's way.
const SIDE_PX: u32 = 128;
/// Most episodes of a task that are tried.
const EPISODES: usize = 6;

/// An episode before its first frame.
fn stage(episode: &Episode, helper: &str) -> Env {
    let config = EpisodeConfig {
        episode,
        seed: 0,
        rules: RuleSet::PAPER,
        helper,
        partner: None,
        image_size: Some(SIDE_PX),
        appearance: Appearance::Canonical,
    };
    let mind = BuiltIn.make(helper, PlannerRules::paper());
    assert!(mind.is_some(), "{helper} is built in");
    Env::new(config, mind).expect("the bundled episodes can be played")
}

fn bundled(task: TaskId) -> impl Iterator<Item = Episode> {
    episodes(&Split::Train, task).map(|e| e.expect("the bundled episodes can be read"))
}

/// The bundled episodes of a task, or generated ones where none are bundled.
fn any(task: TaskId) -> impl Iterator<Item = Episode> {
    let split = Split::Generated(700..700 + EPISODES as u64);
    let generated = episodes(&split, task).map(|e| e.expect("every seed has an episode"));
    bundled(task).chain(generated)
}

/// Whether the helper has delivered something wanted: by itself, or carried together with the partner.
fn helper_delivers(episode: &Episode, helper: &str) -> bool {
    let mut env = stage(episode, helper);
    let mut tally = Tally::new(env.header());
    let mut summary: Option<Summary> = None;
    let mut sink = |record: &_| {
        summary = tally.record(record).and_then(|r| r.summary().cloned()).or(summary.take());
        Ok::<(), AgentError>(())
    };
    let flow = env.run(&AtomicBool::new(false), None, &mut sink);
    assert_eq!(flow.expect("the sink takes all"), Flow::Ended);
    let summary = summary.expect("the episode has ended");
    summary.deliveries.iter().any(|d| d.counted && (d.by == AgentId::HELPER || d.together))
}

#[test]
fn in_each_task_a_helper_delivers_what_is_wanted() {
    std::thread::scope(|scope| {
        for task in TaskId::all() {
            scope.spawn(move || {
                // RHP guesses what is wanted; in half of the episodes it is the oracle's turn.
                let mut tries = any(task).take(EPISODES).zip(["rhp", "oracle"].iter().cycle());
                assert!(
                    tries.any(|(episode, helper)| helper_delivers(&episode, helper)),
                    "no helper has delivered anything in {EPISODES} episodes of {task}"
                );
            });
        }
    });
}

#[test]
fn who_follows_stays_with_the_partner() {
    /// Frames between two looks.
    const EVERY: u32 = 50;
    /// Until then it may look for the partner.
    const FOUND_BY: u32 = 600;
    let episode = bundled(TaskId::NoConstraint).next().expect("bundled");
    let mut env = stage(&episode, "follow");
    let (mut near, mut looks, mut walked_m) = (0, 0, 0.0);
    for frame in (FOUND_BY..3000).step_by(EVERY as usize) {
        if env.advance(Some(frame)) == Ok(Flow::Ended) {
            break;
        }
        let people = &env.world().state().people;
        let [partner, helper] = [AgentId::PARTNER, AgentId::HELPER].map(|a| &people[a.index()]);
        let apart_m = horizontal_distance(partner.pose.position, helper.pose.position);
        near += u32::from(apart_m < 3.5);
        looks += 1;
        walked_m = partner.walked_m;
        assert_eq!(helper.hands, [None; 2], "it takes nothing");
    }
    assert!(looks > 10 && walked_m > 10.0, "{looks} looks, the partner walked {walked_m} m");
    assert!(10 * near > 7 * looks, "near in {near} of {looks} looks");
}
