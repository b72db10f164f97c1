//! Promise: in real episodes, a helper with the granted state knows all objects and the whole map
//! before it moves.

use std::sync::atomic::AtomicBool;

use chaic_agents::PlannerRules;
use chaic_agents::execution::careful_navigation::CarefulNavigator;
use chaic_agents::execution::frontier_exploration::FrontierExplorer;
use chaic_agents::memory::Memory;
use chaic_agents::perception::{GroundTruthIds, Perception as _};
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{AgentError, AgentId, Briefing, Observation, TaskId};
use chaic_env::trace::Record;
use chaic_env::{AdvanceOutcome, AgentSlot, Env, EpisodeAgents, EpisodeConfig};
use chaic_episodes::{Episode, Split, episodes, find_episode};

const ME: AgentId = AgentId::HELPER;

/// Returns a bundled and a generated episode of each task.
fn all_episodes() -> impl Iterator<Item = Episode> {
    TaskId::all().flat_map(|task| {
        let bundled = TaskId::paper().any(|t| t == task);
        let bundled = bundled.then(|| format!("{task}/test/02"));
        let bundled = bundled.map(|id| find_episode(&id).expect("a bundled episode"));
        let generated = episodes(&Split::GeneratedStandard(800..801), task);
        bundled.into_iter().chain(generated.map(|e| e.expect("every seed has an episode")))
    })
}

/// Starts an episode; returns it with briefing and first observation of the helper.
fn start(episode: &Episode, grants: Grants) -> (Env, Briefing, Observation) {
    let config = EpisodeConfig { image_size: Some(128), ..EpisodeConfig::new(episode, "mine") };
    let helper = Some(AgentSlot::external(grants, SensorConfig::DEPTH_AND_IDS));
    let mut env = Env::new(config, EpisodeAgents { helper, partner: None }).expect("playable");
    let mut sink = |_: &Record| Ok::<(), AgentError>(());
    let outcome = env.run(&AtomicBool::new(false), None, &mut sink).expect("the sink takes all");
    assert_eq!(outcome, AdvanceOutcome::NeedsAction);
    let observation = env.observe(ME).expect("the helper waits").clone();
    let briefing = env.briefing(ME);
    (env, briefing, observation)
}

#[test]
fn nothing_is_left_to_explore_and_every_target_is_reachable() {
    for episode in all_episodes() {
        let id = episode.id();
        let (env, briefing, observation) = start(&episode, Grants::ALL);
        let mut memory = Memory::new(&briefing, PlannerRules::paper());
        memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
        memory.refresh();
        let goal = briefing.goal.as_ref().expect("granted");
        for (class, wanted) in &goal.targets {
            let available: Vec<_> = memory.objects.available(*class, memory.frame).collect();
            assert!(available.len() >= *wanted as usize, "{id}: {class}");
            for object in available {
                let path_m = memory.path_length_to(object);
                assert!(path_m.is_some_and(|m| m < 80.0), "{id}: {object:?}: {path_m:?}");
            }
        }
        let places: Vec<_> = memory.goal_places().iter().map(|(place, _)| place.track).collect();
        let mut expected: Vec<_> =
            env.world().setup().goal_places.iter().map(|e| (*e).into()).collect();
        expected.sort_unstable();
        let mut sorted = places.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, expected, "{id}");
        let mut explorer = FrontierExplorer::new(briefing.bounds);
        explorer.step(&mut memory, &mut CarefulNavigator::default());
        assert!(explorer.is_exhausted(), "{id}");
    }
}
