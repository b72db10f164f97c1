//! Promise: helpers are useful in real episodes. In each task the rule-based helper or the oracle
//! delivers something, and the following helper stays near the partner.

use std::sync::atomic::AtomicBool;

use chaic_agents::PlannerRules;
use chaic_core::geom::horizontal_distance;
use chaic_core::{AgentError, AgentId, TaskId};
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _};
use chaic_env::{AdvanceOutcome, Env, EpisodeConfig};
use chaic_episodes::{Episode, Split, episodes};
use chaic_eval::metrics::{ResultAccumulator, Summary};

/// Side of all agents' images, pixels: enough for navigation.
const SIDE_PX: u32 = 128;
/// Maximum number of tried episodes per task.
const EPISODES: usize = 6;

/// Returns an episode before its first frame.
fn start(episode: &Episode, helper: &str) -> Env {
    let config = EpisodeConfig { image_size: Some(SIDE_PX), ..EpisodeConfig::new(episode, helper) };
    let agent = BuiltInHelpers.make(helper, PlannerRules::paper());
    assert!(agent.is_some(), "{helper} is built in");
    Env::new(config, agent).expect("the bundled episodes can be played")
}

fn bundled(task: TaskId) -> impl Iterator<Item = Episode> {
    episodes(&Split::Train, task).map(|e| e.expect("the bundled episodes can be read"))
}

/// Returns the bundled episodes of a task, then generated ones.
fn episodes_of(task: TaskId) -> impl Iterator<Item = Episode> {
    let split = Split::Generated(700..700 + EPISODES as u64);
    let generated = episodes(&split, task).map(|e| e.expect("every seed has an episode"));
    bundled(task).chain(generated)
}

/// Returns whether the helper delivered a part of the goal, alone or together with the partner.
fn helper_delivers(episode: &Episode, helper: &str) -> bool {
    let mut env = start(episode, helper);
    let mut tally = ResultAccumulator::new(env.header());
    let mut summary: Option<Summary> = None;
    let mut sink = |record: &_| {
        summary = tally.add(record).and_then(|r| r.summary().cloned()).or(summary.take());
        Ok::<(), AgentError>(())
    };
    let outcome = env.run(&AtomicBool::new(false), None, &mut sink);
    assert_eq!(outcome.expect("the sink never fails"), AdvanceOutcome::Ended);
    let summary = summary.expect("the episode has ended");
    summary.deliveries.iter().any(|d| d.counted && (d.by == AgentId::HELPER || d.together))
}

#[test]
fn a_helper_delivers_part_of_the_goal_in_each_task() {
    std::thread::scope(|scope| {
        for task in TaskId::all() {
            scope.spawn(move || {
                // RHP guesses the goal, so the oracle plays every other episode.
                let mut tries =
                    episodes_of(task).take(EPISODES).zip(["rhp", "oracle"].iter().cycle());
                assert!(
                    tries.any(|(episode, helper)| helper_delivers(&episode, helper)),
                    "no helper has delivered anything in {EPISODES} episodes of {task}"
                );
            });
        }
    });
}

#[test]
fn the_following_helper_stays_near_the_partner() {
    /// Frames between two checks.
    const INTERVAL: u32 = 50;
    /// Frame until which it may search for the partner.
    const FOUND_BY: u32 = 600;
    let episode = bundled(TaskId::NoConstraint).next().expect("bundled");
    let mut env = start(&episode, "follow");
    let (mut near, mut checks, mut walked_m) = (0, 0, 0.0);
    for frame in (FOUND_BY..3000).step_by(INTERVAL as usize) {
        if env.advance(Some(frame)) == Ok(AdvanceOutcome::Ended) {
            break;
        }
        let people = &env.world().state().agents;
        let [partner, helper] = [AgentId::PARTNER, AgentId::HELPER].map(|a| &people[a.index()]);
        let apart_m = horizontal_distance(partner.pose.position, helper.pose.position);
        near += u32::from(apart_m < 3.5);
        checks += 1;
        walked_m = partner.walked_m;
        assert_eq!(helper.hands, [None; 2], "it holds nothing");
    }
    assert!(checks > 10 && walked_m > 10.0, "{checks} checks, the partner walked {walked_m} m");
    assert!(10 * near > 7 * checks, "near in {near} of {checks} checks");
}
