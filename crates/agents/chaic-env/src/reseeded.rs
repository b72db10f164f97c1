//! Helpers with a different random stream in each episode, for training and data collection.

use std::collections::BTreeMap;

use chaic_core::agent::{ChildState, Thought};
use chaic_core::memory_view::MemoryView;
use chaic_core::observation::SensorConfig;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation};
use chaic_world::episode_stream;

use crate::agent_slot::world_seed;
use crate::config::EpisodeConfig;
use crate::helper_registry::Helper;

/// Agent whose briefing has another seed.
struct Reseeded {
    agent: Box<dyn Agent>,
    seed: u64,
}

/// Returns the helper with a seed per episode in place of the briefing's seed.
///
/// The seed in a helper's briefing is the same in all episodes of a run, so a policy that samples its
/// actions would draw the same numbers in each. Training and data collection use this function. Scored
/// runs must not: the seed identifies the episode.
pub fn seeded_by_episode(helper: Helper, config: &EpisodeConfig<'_>) -> Helper {
    let seed_of_world = world_seed(config.episode.setup().seed, config.seed);
    let seed = episode_stream(seed_of_world, AgentId::HELPER).seed();
    Helper { agent: Box::new(Reseeded { agent: helper.agent, seed }), grants: helper.grants }
}

impl Agent for Reseeded {
    fn sensors(&self) -> SensorConfig {
        self.agent.sensors()
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.agent.reset(&Briefing { seed: self.seed, ..briefing.clone() });
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        self.agent.act(observation)
    }

    fn observe(&mut self, observation: &Observation) {
        self.agent.observe(observation);
    }

    fn perception(&self) -> Option<String> {
        self.agent.perception()
    }

    fn isolation(&self) -> Option<String> {
        self.agent.isolation()
    }

    fn weights(&self) -> Option<String> {
        self.agent.weights()
    }

    fn recording(&self) -> Option<String> {
        self.agent.recording()
    }

    fn thought(&self) -> Thought {
        self.agent.thought()
    }

    fn memory_view(&self) -> Option<MemoryView> {
        self.agent.memory_view()
    }

    fn child_state(&self) -> Option<ChildState> {
        self.agent.child_state()
    }

    fn counters(&self) -> BTreeMap<String, u64> {
        self.agent.counters()
    }

    fn fork(&self) -> Option<Box<dyn Agent>> {
        let agent = self.agent.fork()?;
        Some(Box::new(Reseeded { agent, seed: self.seed }))
    }
}
