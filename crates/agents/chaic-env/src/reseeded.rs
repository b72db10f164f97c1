//! Helpers whose random streams differ from episode to episode, for training and data collection.

use std::collections::BTreeMap;

use chaic_core::agent::{ChildState, Thought};
use chaic_core::observation::Senses;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation};
use chaic_world::episode_stream;

use crate::config::EpisodeConfig;
use crate::minds::Helper;
use crate::seat::world_seed;

/// An agent with another seed in its briefing.
struct Reseeded {
    agent: Box<dyn Agent>,
    seed: u64,
}

/// Returns the helper with a seed that differs between episodes, in place of the briefing's.
///
/// The seed in a helper's briefing is the same in all episodes of a run, so that a policy that samples
/// its actions would draw the same numbers in each. Trainings and collections of data use this
/// function. Scored runs must not: the seed identifies the episode.
pub fn seeded_by_episode(helper: Helper, config: &EpisodeConfig<'_>) -> Helper {
    let of_world = world_seed(config.episode.setup().seed, config.seed);
    let seed = episode_stream(of_world, AgentId::HELPER).seed();
    Helper { mind: Box::new(Reseeded { agent: helper.mind, seed }), grants: helper.grants }
}

impl Agent for Reseeded {
    fn senses(&self) -> Senses {
        self.agent.senses()
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.agent.reset(&Briefing { seed: self.seed, ..briefing.clone() });
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        self.agent.act(observation)
    }

    fn perception(&self) -> Option<String> {
        self.agent.perception()
    }

    fn thought(&self) -> Thought {
        self.agent.thought()
    }

    fn child_state(&self) -> Option<ChildState> {
        self.agent.child_state()
    }

    fn counts(&self) -> BTreeMap<String, u64> {
        self.agent.counts()
    }

    fn fork(&self) -> Option<Box<dyn Agent>> {
        let agent = self.agent.fork()?;
        Some(Box::new(Reseeded { agent, seed: self.seed }))
    }
}
