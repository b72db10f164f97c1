//! Simulated runs of the episode that a person plays, for comparison.

use chaic_core::AgentId;
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _, find};
use chaic_env::{AgentSlot, Env, EpisodeAgents, EpisodeConfig};
use chaic_episodes::Episode;

use super::{LiveError, LiveSession, image_size_of_others};

impl LiveSession {
    /// Plays the episode (JSON) of the session from its start with simulated agents: a built-in helper and
    /// the partner of the session, or the rule-based one if the person is the partner. Rules and seed are
    /// those of the session. Returns the delivered fraction of the goal, to which a person compares
    /// theirs.
    ///
    /// # Errors
    /// If the episode is unreadable, or the helper does not exist.
    pub fn reference(&self, episode: &[u8], helper_name: &str) -> Result<f64, LiveError> {
        let episode = Episode::parse(episode, "episode")?;
        let header = self.env.header();
        let rules = header.rules;
        let name = header.partner.as_deref().filter(|_| self.seat != AgentId::PARTNER);
        let partner = name.and_then(|name| BuiltInHelpers.partner(name, None, rules.planner));
        let config = EpisodeConfig {
            seed: header.seed,
            rules,
            partner: name.filter(|_| partner.is_some()),
            image_size: image_size_of_others(header, self.seat),
            appearance: header.appearance,
            ..EpisodeConfig::new(&episode, helper_name)
        };
        let helper = find(&BuiltInHelpers, helper_name, rules.planner)?.map(AgentSlot::from);
        let agents = EpisodeAgents { helper, partner: partner.map(AgentSlot::from) };
        let mut env = Env::new(config, agents)?;
        env.advance(None)?;
        let (delivered, wanted) = env.world().progress();
        Ok(if wanted > 0.0 { delivered / wanted } else { 0.0 })
    }
}
