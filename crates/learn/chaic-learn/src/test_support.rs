//! Inputs of unit tests.

use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{AgentId, Briefing, Observation, TaskId};
use chaic_env::{AgentSlot, Env, EpisodeAgents, EpisodeConfig};
use chaic_episodes::find_episode;

/// Returns the briefing and the first observation of a helper.
pub(crate) fn start(task: TaskId) -> (Briefing, Observation) {
    let episode = find_episode(&format!("{task}/gen/40000001")).unwrap();
    let sensors = SensorConfig { image_size: 32, ..SensorConfig::DEPTH_AND_IDS };
    let helper = Some(AgentSlot::external(Grants::PLANNER, sensors));
    let config = EpisodeConfig { image_size: Some(32), ..EpisodeConfig::new(&episode, "learner") };
    let mut env = Env::new(config, EpisodeAgents { helper, partner: None }).unwrap();
    env.advance(None).unwrap();
    let observation = env.observe(AgentId::HELPER).unwrap().clone();
    (env.briefing(AgentId::HELPER), observation)
}
