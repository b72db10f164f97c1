//! Configuration of an episode, and the world and trace header that follow from it.

use std::sync::Arc;

use chaic_episodes::Episode;
use chaic_render::Appearance;
use chaic_world::{Rules, Setup, World};

use crate::CHAIC_VERSION;
use crate::agent_slot::{AgentSlot, EpisodeAgents, agent_slots, world_seed};
use crate::digest::Digest;
use crate::error::{EnvError, Result};
use crate::rules::RuleSet;
use crate::trace::{FORMAT, Header, Participant, VERSION};

/// Configuration of an episode without its agents.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeConfig<'a> {
    /// Episode.
    pub episode: &'a Episode,
    /// Index of the run's seed; 0 is the episode's own.
    pub seed: u32,
    /// Rules of the world and of the planners.
    pub rules: RuleSet,
    /// Name of the helper, for the trace.
    pub helper: &'a str,
    /// Name of the agent that replaces the rule-based partner, for the trace.
    pub partner: Option<&'a str>,
    /// Side of the images of all agents in the environment, pixels; `None` for what each requests.
    /// External agents have their own.
    pub image_size: Option<u32>,
    /// Lighting and colors.
    pub appearance: Appearance,
}

impl<'a> EpisodeConfig<'a> {
    /// Creates the default configuration: seed 0, the paper's rules, the rule-based partner, the images
    /// that each agent requests and the canonical appearance.
    pub fn new(episode: &'a Episode, helper: &'a str) -> EpisodeConfig<'a> {
        EpisodeConfig {
            episode,
            seed: 0,
            rules: RuleSet::PAPER,
            helper,
            partner: None,
            image_size: None,
            appearance: Appearance::Canonical,
        }
    }

    /// Returns the setup with the world's seed. Without a helper there is no child either, as in the
    /// original's runs without helper (facts A8).
    pub(crate) fn setup(&self, has_helper: bool) -> Arc<Setup> {
        let mut setup = self.episode.setup().clone();
        setup.seed = world_seed(setup.seed, self.seed);
        if !has_helper {
            setup.people.truncate(1);
        }
        Arc::new(setup)
    }

    /// Creates the world in its initial state.
    pub(crate) fn world(&self, setup: &Arc<Setup>) -> Result<World> {
        new_world(setup, self.rules.world, self.episode.id())
    }

    /// Briefs all agents.
    pub(crate) fn brief(&self, world: &World, slots: &mut [AgentSlot]) {
        for (agent, slot) in world.setup().agents().zip(slots) {
            slot.reset(agent, world, self.seed, self.image_size);
        }
    }

    /// Creates the header of the trace.
    pub(crate) fn header(&self, setup: &Setup, slots: &[AgentSlot]) -> Header {
        let people = setup.agents().zip(&setup.people).zip(slots);
        Header {
            format: FORMAT.to_owned(),
            version: VERSION,
            chaic: CHAIC_VERSION.to_owned(),
            task: setup.task,
            episode: self.episode.id().to_owned(),
            setup: Digest::of_setup(self.episode.setup()),
            seed: self.seed,
            world_seed: setup.seed,
            rules: self.rules,
            helper: self.helper.to_owned(),
            partner: self.partner.map(str::to_owned),
            people: people
                .map(|((agent, person), slot)| Participant {
                    agent,
                    persona: person.persona,
                    impairments: person.impairments,
                    grants: slot.grants,
                    sensors: slot.sensors,
                    perception: slot.agent().and_then(|agent| agent.perception()),
                    isolation: slot.agent().and_then(|agent| agent.isolation()),
                    weights: slot.agent().and_then(|agent| agent.weights()),
                    recording: slot.agent().and_then(|agent| agent.recording()),
                    input: None,
                    is_live: false,
                })
                .collect(),
            renderer: "cpu".to_owned(),
            appearance: self.appearance,
            branch_of: None,
        }
    }
}

/// Returns the trace header of an episode without running it.
///
/// # Errors
/// [`EnvError::Setup`] if the setup is invalid.
pub fn trace_header(config: EpisodeConfig<'_>, agents: impl Into<EpisodeAgents>) -> Result<Header> {
    let agents = agents.into();
    let setup = config.setup(agents.helper.is_some());
    let mut slots = agent_slots(&setup, agents, config.rules.planner);
    config.brief(&config.world(&setup)?, &mut slots);
    Ok(config.header(&setup, &slots))
}

fn new_world(setup: &Arc<Setup>, rules: Rules, id: &str) -> Result<World> {
    let invalid = |problem| EnvError::Setup { id: id.to_owned(), problem };
    World::new(Arc::clone(setup), rules).map_err(invalid)
}

/// Creates the initial world of a trace from its episode.
///
/// # Errors
/// [`EnvError::OtherEpisode`] if the trace is of another episode.
pub(crate) fn world_from_header(header: &Header, episode: &Episode) -> Result<World> {
    let digest = Digest::of_setup(episode.setup());
    if digest != header.setup {
        return Err(EnvError::OtherEpisode {
            id: header.episode.clone(),
            found: digest.to_string(),
            expected: header.setup.to_string(),
        });
    }
    let mut setup = episode.setup().clone();
    setup.seed = header.world_seed;
    setup.people.truncate(header.people.len().max(1));
    new_world(&Arc::new(setup), header.rules.world, episode.id())
}
