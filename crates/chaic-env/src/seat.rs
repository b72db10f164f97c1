//! Who takes part in an episode.

use chaic_agents::{PlannerRules, partners};
use chaic_protocol::observation::{Grants, Senses};
use chaic_protocol::rng::Stream;
use chaic_protocol::{Action, Agent, AgentId, Briefing, Observation, ResolvedAction};
use chaic_world::{Setup, World};

use crate::helpers::Helper;

/// A mind with what it is granted and what it wants to perceive.
pub struct Actor {
    /// The mind.
    pub mind: Box<dyn Agent>,
    /// What it is granted.
    pub grants: Grants,
    /// What it wants to perceive; known once the episode has begun.
    pub senses: Senses,
    /// Its last action, as it named it and as it was resolved.
    pub(super) submitted: Option<(Action, ResolvedAction)>,
}

/// Everybody, in the order of their ids.
pub struct Cast {
    /// By agent.
    pub actors: Vec<Actor>,
}

impl Actor {
    /// A mind before its first episode.
    pub fn new(mind: Box<dyn Agent>, grants: Grants) -> Actor {
        Actor { mind, grants, senses: Senses::NONE, submitted: None }
    }

    /// Briefs the mind and asks what it wants to perceive.
    pub(super) fn begin(&mut self, agent: AgentId, world: &World, image_size: Option<u32>) {
        self.mind.reset(&world.briefing(agent, self.grants));
        let senses = self.mind.senses();
        let image_size = image_size.unwrap_or(senses.image_size);
        self.senses = Senses { image_size, ..senses };
    }
}

/// The minds that a run chooses.
pub struct Minds {
    /// The helper's; `None` where the partner is alone.
    pub helper: Option<Helper>,
    /// The partner's; `None` for the rule-based one of its task.
    pub partner: Option<Helper>,
}

impl From<Option<Helper>> for Minds {
    fn from(helper: Option<Helper>) -> Minds {
        Minds { helper, partner: None }
    }
}

/// Partner, helper and child of a setup; nobody but the partner if there is no helper.
pub fn cast(setup: &Setup, minds: Minds, rules: PlannerRules) -> Cast {
    let info = setup.task.info();
    let persona = setup.people.first().map_or(info.partner, |p| p.persona);
    let partner = minds.partner.unwrap_or_else(|| Helper {
        mind: partners::partner(persona, info.scene, rules),
        grants: partners::partner_grants(rules),
    });
    let mut actors = vec![Actor::new(partner.mind, partner.grants)];
    if let Some(Helper { mind, grants }) = minds.helper {
        actors.push(Actor::new(mind, grants));
    }
    if setup.people.len() > AgentId::CHILD.index() {
        actors.push(Actor::new(partners::child(rules), Grants::CHILD));
    }
    // The world's rules allow more people than the tasks have; anybody further only stands there.
    while actors.len() < setup.people.len() {
        actors.push(Actor::new(Box::new(Bystander), Grants::NONE));
    }
    Cast { actors }
}

/// Somebody who stands there and looks at nothing.
#[derive(Clone, Copy, Debug)]
pub struct Bystander;

impl Agent for Bystander {
    fn senses(&self) -> Senses {
        Senses::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Action {
        Action::Wait { frames: 100 }
    }
}

/// The seed that the world is played with: the episode's own for seed 0, another one for each
/// further seed.
pub fn world_seed(episode_seed: u64, seed: u32) -> u64 {
    if seed == 0 {
        return episode_seed;
    }
    let mut stream = Stream::new(episode_seed, "eval seed", u64::from(seed));
    (0..4).fold(0, |s, _| s << 16 | stream.below(1 << 16) as u64)
}
